"""The healthy recording that a recording of unknown state is compared with.

What the twin gets wrong about the healthy pump is known from the healthy recording and need not be
paid for again: the flow that the recording asks for at the pump, and what no flow at the pump
explains, are taken from it and brought to the operating point of the unknown recording.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from rippletwin.diagnosis.drifting_line import DriftingLine
from rippletwin.diagnosis.pump_flow import healthy_flow
from rippletwin.harmonics import flow_harmonics
from rippletwin.twin.twin import Twin

SAME_SPEED, SAME_PRESSURE = 0.01, 0.03  # relative: the same operating point, set twice
FAR = 0.3  # relative change of the operating point over which the anchor's own part is lost
ABOUT = 5  # orders of the pistons over which a misfit is averaged
ANGLES = 8192  # of a revolution, over which two spectra are aligned


@dataclass(frozen=True)
class Anchor:
    """A healthy recording at the operating point of the unknown one, its shaft angle as recorded.

    flow (F,) at the pump, m3/s, and rest (S, F), Pa, that no flow explains, at shaft orders (F,).
    variance (S, F) is that of the readings: noise, and what another operating point makes unsure.
    angle, rad, is how far the recording's shaft is ahead of the simulated pump's, but for whole
    pitches of the pistons. misfit (F,) is the twin's own of the healthy ripple, relative, as it is
    about each order. distance is that of the operating points, 0 where they are the same.
    """

    label: str
    orders: np.ndarray
    flow: np.ndarray
    rest: np.ndarray
    variance: np.ndarray
    angle: float
    misfit: np.ndarray
    distance: float


def distance(
    speed: float, other_speed: float, pressure: float | None, other_pressure: float | None
) -> float:
    """Sum of the relative differences of speed and load pressure of two operating points; 0 where
    they are one, set twice. A pressure that is not known is no difference."""
    by_speed = abs(np.log(speed / other_speed))
    both = (pressure or 0.0) > 0.0 and (other_pressure or 0.0) > 0.0
    by_pressure = abs(np.log(pressure / other_pressure)) if both else 0.0
    same = by_speed < SAME_SPEED and by_pressure < SAME_PRESSURE
    return 0.0 if same else float(by_speed + by_pressure)


def make_anchor(
    twin: Twin, healthy, observation, line: DriftingLine, speed_rpm: float, pressure: float
) -> Anchor:
    """The anchor that `healthy` is for `observation`, whose line is `line` and whose pump runs at
    `speed_rpm` into `pressure`, Pa. The twin's pump is as fitted (`with_fitted_pump`)."""
    count = min(len(healthy.orders), len(observation.orders))
    healthy, orders = at_orders(healthy, count), np.asarray(healthy.orders[:count])
    apart = distance(
        healthy.speed_hz, observation.speed_hz, healthy.load_pressure, observation.load_pressure
    )
    pump, fluid = twin.rig.pump, twin.rig.fluid
    here = healthy_flow(pump, fluid, speed_rpm, pressure)
    there = here
    if apart:
        pressure = healthy.load_pressure or pressure
        there = healthy_flow(pump, fluid, 60.0 * healthy.speed_hz, pressure)
    response = DriftingLine(twin, healthy, there).response()
    simulated = _even(flow_harmonics(there, orders), orders, pump["pistons"])
    flow = np.sum(np.conj(response) * healthy.values, 0) / np.sum(np.abs(response) ** 2, 0)
    rest = healthy.values - response * flow
    pitch = 2 * np.pi / pump["pistons"]
    angle = alignment(response * simulated, healthy.values, orders, pitch)
    turned = simulated * np.exp(1j * orders * angle)
    left = healthy.values - response * turned
    misfit = relative_misfit(left, healthy.values, orders, pump["pistons"])
    variance = _noise(healthy)
    if apart:
        now = _even(flow_harmonics(here, orders), orders, pump["pistons"])
        flow = flow + (now - simulated) * np.exp(1j * orders * angle)
        share = min(apart / FAR, 1.0)
        rest = (1.0 - share) * rest
        unsure = np.mean(np.abs(line.response()[:, :count] * flow) ** 2, axis=0)
        variance = variance + (misfit * share) ** 2 * unsure
    return Anchor(healthy.label, orders, flow, rest, variance, angle, misfit, apart)


def alignment(here: np.ndarray, there: np.ndarray, orders: np.ndarray, pitch: float) -> float:
    """The angle, rad in [0, pitch), by which turning `here` (S, F) comes nearest to `there`."""
    score = correlation(here, there, orders)
    score = score[: int(np.ceil(ANGLES * pitch / (2 * np.pi)))]
    return float(2 * np.pi * np.argmax(score) / ANGLES)


def correlation(here, there, orders, weight=1.0, count: int = ANGLES) -> np.ndarray:
    """Re sum w conj(h exp(j n x)) t at `count` even angles x of a revolution, (..., count)."""
    product = np.sum(weight * np.conj(here) * there, axis=-2)
    spectrum = np.zeros((*product.shape[:-1], count), complex)
    spectrum[..., orders] = product
    return np.fft.fft(spectrum, axis=-1).real


def at_orders(observation, count: int):
    """The observation at its first `count` shaft orders."""
    return replace(
        observation,
        frequency_hz=observation.frequency_hz[:count],
        orders=observation.orders[:count],
        values=observation.values[:, :count],
        covariance=observation.covariance[:count],
    )


def _even(flow: np.ndarray, orders: np.ndarray, pistons: int) -> np.ndarray:
    """A simulated flow at the orders that equal pistons make: there is nothing at the others."""
    return np.where(orders % pistons == 0, flow, 0.0)


def relative_misfit(left, readings, orders: np.ndarray, pistons: int) -> np.ndarray:
    """What a twin leaves (S, F) of `readings`, relative (F,), about each order. The pistons' orders
    tell. Below the first of them errors fall with the order: at rest a line has none. Orders of
    next to no power count with their neighbours."""
    own = np.flatnonzero(orders % pistons == 0)
    powers = [np.mean(np.abs(x[:, own]) ** 2, axis=0) for x in (left, readings)]
    about = [uniform_filter1d(power, min(ABOUT, len(own)), mode="nearest") for power in powers]
    relative = np.minimum(np.sqrt(about[0] / np.maximum(about[1], 1e-300)), 1.0)
    return np.interp(orders, [0, *orders[own]], [0.0, *relative])


def _noise(observation) -> np.ndarray:
    """Variance (S, F) of the readings, Pa2."""
    return np.einsum("fss->sf", observation.covariance).real
