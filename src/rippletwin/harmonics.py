"""Harmonics of one period: peak amplitudes of its orders, resampling, phase modulation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.fft import ifft, irfft, rfft
from scipy.special import jv

from rippletwin.case.model import FlowRipple

ROUNDING = 1e-13  # of the largest amplitude: below it are errors of rounding


def phase_modulate(spectrum: np.ndarray, modulation: complex, count: int) -> np.ndarray:
    """Flow (count,) at even instants t of a revolution of a shaft that leads uniform rotation by
    Re(b exp(j t)) rad, b = `modulation`: q(angle(t)) d angle/dt.

    spectrum (F,) is that of q at uniform speed: peak amplitudes of orders 0 to F - 1. By Jacobi and
    Anger order k spreads to order n as j^(n-k) J_(n-k)(k |b|): a small modulation makes sidebands,
    and a larger one leaves little of a high order itself.
    """
    orders = np.flatnonzero(np.abs(spectrum) > ROUNDING * np.max(np.abs(spectrum)))
    swing = orders * abs(modulation)
    most = np.max(swing, initial=0.0)
    reach = int(most + 10.0 * np.cbrt(most) + 20.0)  # J_m falls off beyond the argument
    side = np.arange(-reach, reach + 1)
    turn = (1j * np.exp(1j * np.angle(modulation))) ** side
    spread = spectrum[orders, None] * jv(side, swing[:, None]) * turn
    at = ((orders[:, None] + side) % count).ravel()
    modulated = np.bincount(at, spread.real.ravel(), count) + 1j * np.bincount(
        at, spread.imag.ravel(), count
    )
    instant = 2.0 * np.pi * np.arange(count) / count
    lead = modulation * np.exp(1j * instant)
    return count * ifft(modulated).real * (1.0 - lead.imag)


def modulate_ripple(ripple: FlowRipple, modulation: complex) -> FlowRipple:
    """The flow ripple of a shaft that leads an even rotation by Re(b exp(j t)) rad at angle t.

    b is `modulation`.
    """
    count = max(len(ripple.flow) // 2, 8)
    spectrum = flow_harmonics(ripple, np.arange(count))
    flow = phase_modulate(spectrum, modulation, 4 * count)
    angle = 360.0 * np.arange(len(flow)) / len(flow)
    return replace(ripple, angle_deg=angle, flow=flow, modulation=modulation)


def peak_amplitudes(period: np.ndarray) -> np.ndarray:
    """Peak amplitudes (..., M // 2 + 1) of the orders 0, 1 ... of one period (..., M); that of
    order 0 is the mean.

    Of an even M the last order, of which the sine is not sampled, comes out twice as large.
    """
    amplitudes = rfft(period) * (2.0 / np.shape(period)[-1])
    amplitudes[..., 0] *= 0.5
    return amplitudes


def one_period(
    amplitudes: np.ndarray, count: int, orders: np.ndarray | slice = slice(None)
) -> np.ndarray:
    """One period (..., `count`) of a wave with peak `amplitudes` (..., F) at whole `orders` (F,),
    by default 0, 1 ... `count` // 2: the inverse of `peak_amplitudes`."""
    spectrum = np.zeros((*np.shape(amplitudes)[:-1], count // 2 + 1), complex)
    spectrum[..., orders] = 0.5 * count * np.asarray(amplitudes)
    spectrum[..., 0] *= 2.0
    return irfft(spectrum, count)


def resample_period(period: np.ndarray, count: int) -> np.ndarray:
    """One period (..., M) at `count` even instants, with the orders that both can have.

    The order count/2 of an even count, of which the sine is not sampled, is left out.
    """
    size = np.shape(period)[-1]
    spectrum = rfft(period)[..., : count // 2 + 1]
    if count < size and count % 2 == 0:
        spectrum[..., -1] = 0.0
    if count > size and size % 2 == 0:
        spectrum[..., -1] *= 0.5  # the last order becomes one like the others
    return irfft(spectrum, count) * (count / size)


def flow_harmonics(ripple: FlowRipple, orders: np.ndarray) -> np.ndarray:
    """Peak complex amplitudes (F,), m3/s, at shaft `orders` (F,); that of order 0 is the mean.

    Orders that the angles do not resolve have no amplitude. Angles need not be evenly spaced: the
    ripple is interpolated by a periodic cubic spline over the revolution. The result is cached with
    the ripple and read-only, since fits need the same orders very often.
    """
    key = np.asarray(orders, dtype=float).tobytes()
    known = ripple.known_harmonics
    if key not in known:
        known[key] = _calculate_harmonics(ripple, orders)
        known[key].flags.writeable = False
    return known[key]


def _calculate_harmonics(ripple: FlowRipple, orders: np.ndarray) -> np.ndarray:
    even, flow = ripple.on_even_angles()
    orders, count = np.asarray(orders, float), len(flow)
    is_resolved = np.abs(orders) <= ripple.highest_order
    if np.all(orders == np.abs(np.round(orders))):
        known = peak_amplitudes(flow)[np.where(is_resolved, orders, 0).astype(int)]
        known *= np.exp(-1j * orders * np.deg2rad(even[0]))
    else:
        known = np.exp(-1j * np.outer(orders, np.deg2rad(even))) @ flow / count
        known = np.where(orders == 0, known, 2 * known)
    return np.where(is_resolved, known, 0.0)
