"""Flow ripples from pressure windows, by any inversion of the line."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rippletwin.harmonics import one_period, peak_amplitudes

RELATIVE_SPEED_STEP = 2e-4  # width of the bins of speed whose windows share one inversion


@dataclass(frozen=True)
class FlowEstimate:
    """Flow ripple of n windows, source flow or flow into the line, zero mean, nothing above the
    bandwidth.

    flow (n, M) m3/s; orders (F,); harmonics (n, F) complex peak amplitudes; standard_deviation
    (F,) of the complex harmonics' errors by the error model; prior (F,) the same without any
    sensor. Where the two are close, an order is not measured.
    """

    flow: np.ndarray
    orders: np.ndarray
    harmonics: np.ndarray
    standard_deviation: np.ndarray
    prior: np.ndarray


Inversion = Callable[
    [float, np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray, np.ndarray]
]
"""(speed_hz, orders (F,), noise power (S,), wave power (F,)) -> matrix (F, S) from the sensors'
harmonics to the flow's; the variance (F,) of its error; the prior variance (F,) of the flow.
Powers are variances of complex peak amplitudes, Pa2."""


def estimate(
    windows: np.ndarray,
    speed_hz: float | np.ndarray,
    inversion: Inversion,
    noise: float | np.ndarray,
    bandwidth_hz: float,
) -> FlowEstimate:
    """Invert windows (n, S, M), those of one speed together, as `spectral_inversion` describes."""
    windows = np.asarray(windows, dtype=float)
    count, sensors, samples = windows.shape
    speeds = np.broadcast_to(np.asarray(speed_hz, dtype=float), (count,))
    orders = orders_within(bandwidth_hz, speeds.mean(), samples)
    measured = peak_amplitudes(windows)[..., orders]  # (n, S, F)
    noise_power = 4 / samples * np.broadcast_to(np.asarray(noise, float) ** 2, (sensors,))
    # The largest reading is taken: a node at one sensor is rarely one at the others.
    power = np.max(np.mean(np.abs(measured) ** 2, axis=0), axis=0)  # (F,)

    harmonics = np.empty((count, len(orders)), complex)
    variance = np.zeros(len(orders))
    bins = np.rint((speeds / speeds.mean() - 1) / RELATIVE_SPEED_STEP)
    for step in np.unique(bins):
        members = np.flatnonzero(bins == step)
        matrix, error, prior = inversion(speeds[members].mean(), orders, noise_power, power)
        harmonics[members] = np.einsum("fs,nsf->nf", matrix, measured[members])
        variance += error * len(members) / count
    return FlowEstimate(
        flow=one_period(harmonics, samples, orders),
        orders=orders,
        harmonics=harmonics,
        standard_deviation=np.sqrt(variance),
        prior=np.sqrt(prior),
    )


def orders_within(bandwidth_hz: float, speed_hz: float, samples: int) -> np.ndarray:
    """Shaft orders 1, 2, ... up to `bandwidth_hz`, (F,) integers.

    Raises ValueError where the bandwidth is below the speed, or not below half of the sampling rate
    of `samples` a revolution.
    """
    highest = int(np.floor(bandwidth_hz / speed_hz * (1 + 1e-9)))
    if not 1 <= highest < samples / 2:
        raise ValueError(
            f"flow_sensor.bandwidth_hz, {bandwidth_hz:g} Hz, must lie between the speed, "
            f"{speed_hz:.4g} Hz, and half the sampling rate, {samples * speed_hz / 2:.4g} Hz"
        )
    return np.arange(1, highest + 1)


def keep_orders(
    bandwidth_hz: float, speed_hz: float, window_speed_hz: np.ndarray, samples: int
) -> float:
    """Bandwidth, Hz, in which windows of these speeds (n,), rev/s, have the orders that
    `bandwidth_hz` has at `speed_hz`: by a recording's own speed one at the edge comes and goes.

    Raises ValueError as `orders_within`.
    """
    highest = orders_within(bandwidth_hz, speed_hz, samples)[-1]
    return (highest + 0.5) * float(np.mean(window_speed_hz))


def band_limit(flow: np.ndarray, speed_hz: float, bandwidth_hz: float) -> np.ndarray:
    """`flow` (..., M) over one revolution with only the orders that a sensor estimates.

    Apply it to whatever is compared with an estimate, and to training data for such estimates.
    """
    samples = flow.shape[-1]
    orders = orders_within(bandwidth_hz, speed_hz, samples)
    return one_period(peak_amplitudes(flow)[..., orders], samples, orders)
