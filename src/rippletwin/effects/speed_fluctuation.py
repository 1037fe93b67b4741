"""The shaft does not turn evenly: sidebands a shaft order beside every piston order."""

from __future__ import annotations

import numpy as np

from rippletwin.effects.base import Effect, Parameter, normal, source_place


def sidebands(orders: np.ndarray, flow: np.ndarray, modulation: complex) -> np.ndarray:
    """First-order sidebands (F,) of `flow` (F,) at shaft `orders` (F,).

    q(theta + Re(b exp(j theta))) with b = `modulation` in rad puts j k b X_k/2 at order k + 1 and
    j k conj(b) X_k/2 at order k - 1. Orders that are not in `orders` are lost.
    """
    at = {int(n): i for i, n in enumerate(orders)}
    out = np.zeros_like(flow)
    for i, k in enumerate(orders):
        for step, factor in ((1, modulation), (-1, np.conj(modulation))):
            j = at.get(int(k) + step)
            if j is not None:
                out[j] += 0.5j * k * factor * flow[i]
    return out


def _apply(network, line, values, place):
    b = complex(values["cosine"], values["sine"])
    flow = np.array(np.broadcast_to(network.source_flow, np.shape(network.s)), dtype=complex)
    for r in np.unique(line.recording):
        own = line.recording == r
        flow[own] = flow[own] + sidebands(line.orders[own], flow[own], b)
    network.source_flow = flow


def _in_time(line, state, values, place):
    # q(angle + d) = q + d dq/dangle, to first order in both domains.
    spectrum = np.fft.rfft(line.flow)
    slope = np.fft.irfft(1j * np.arange(len(spectrum)) * spectrum, len(line.flow))
    angle = 2.0 * np.pi * np.arange(len(line.flow)) / len(line.flow)
    b = complex(values["cosine"], values["sine"])
    line.flow = line.flow + (b * np.exp(1j * angle)).real * slope


EFFECT = Effect(
    name="speed_fluctuation",
    element="source",
    medium="any",
    equation="Q_(k+1) += j k b X_k/2, Q_(k-1) += j k b* X_k/2, angle + Re(b e^(j angle))",
    source="Randall 2011, Vibration-based Condition Monitoring, sec. 3.3 (phase modulation)",
    parameters=lambda rig, place: (
        Parameter("cosine", "rad", normal(0.0, 5e-3)),
        Parameter("sine", "rad", normal(0.0, 5e-3)),
    ),
    places=source_place,
    apply=_apply,
    in_time=_in_time,
)
