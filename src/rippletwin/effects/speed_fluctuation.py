"""The shaft does not turn evenly: sidebands a shaft order beside every piston order."""

from __future__ import annotations

import numpy as np

from rippletwin.effects.base import Effect, Parameter, normal, source_place


def swung(spectrum: np.ndarray, modulation: complex, count: int) -> np.ndarray:
    """Flow (count,) at even instants of a revolution of a shaft that is ahead of even turning by
    Re(b exp(j t)) rad at angle t, b = `modulation`: q(angle(t)) d angle/dt.

    spectrum (F,) is that of q at even speed: peak amplitudes of orders 0 to F - 1, the mean first.
    By Jacobi and Anger order k spreads to order n as j^(n-k) J_(n-k)(k |b|): small swings make
    sidebands, and larger ones leave little of a high order itself.
    """
    instant = 2.0 * np.pi * np.arange(count) / count
    swing = modulation * np.exp(1j * instant)
    orders = np.flatnonzero(spectrum)
    flow = (np.exp(1j * np.outer(instant + swing.real, orders)) @ spectrum[orders]).real
    return flow * (1.0 - swing.imag)


def peaks(flow: np.ndarray) -> np.ndarray:
    """Peak amplitudes (M // 2 + 1,) of shaft orders of a flow (M,) over one revolution."""
    spectrum = np.fft.rfft(flow) * (2.0 / len(flow))
    spectrum[0] /= 2.0
    return spectrum


def _apply(network, line, values, place):
    b = complex(values["cosine"], values["sine"])
    flow = np.array(np.broadcast_to(network.source_flow, np.shape(network.s)), dtype=complex)
    for r in np.unique(line.recording):
        own = line.recording == r
        orders = np.asarray(line.orders[own], int)
        spectrum = np.zeros(orders.max() + 1, complex)
        spectrum[0], spectrum[orders] = line.mean_flow[own][0], flow[own]
        flow[own] = peaks(swung(spectrum, b, 4 * len(spectrum)))[orders]
    network.source_flow = flow


def _in_time(line, state, values, place):
    spectrum = peaks(line.flow)
    line.flow = swung(spectrum, complex(values["cosine"], values["sine"]), len(line.flow))


EFFECT = Effect(
    name="speed_fluctuation",
    element="source",
    medium="any",
    equation="q(angle) d angle/dt, angle = t + Re(b e^(j t))",
    source="Randall 2011, Vibration-based Condition Monitoring, sec. 3.3 (phase modulation)",
    parameters=lambda rig, place: (
        Parameter("cosine", "rad", normal(0.0, 5e-3)),
        Parameter("sine", "rad", normal(0.0, 5e-3)),
    ),
    places=source_place,
    apply=_apply,
    in_time=_in_time,
)
