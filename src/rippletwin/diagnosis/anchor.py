"""The healthy recording that a recording of unknown state is compared with.

The healthy recording shows what the twin gets wrong about the healthy pump. So the flow at the pump
that the recording needs, and what no flow at the pump explains, are taken from it and brought to
the operating point of the unknown recording.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from rippletwin.case.model import FlowRipple
from rippletwin.diagnosis.drifting_line import DriftingLine
from rippletwin.diagnosis.pump_flow import load_pressure_of, simulate_healthy_pump
from rippletwin.harmonics import flow_harmonics
from rippletwin.twin.twin import Twin

SAME_SPEED, SAME_PRESSURE = 0.01, 0.03  # relative: the same operating point, set twice
FAR = 0.3  # relative change of the operating point over which the anchor's own part is lost
ABOUT = 5  # orders of a kind, the pistons' or others, over which a misfit is averaged
ANGLES = 8192  # of a revolution, over which two spectra are aligned


@dataclass(frozen=True)
class Anchor:
    """A healthy recording at the operating point of the unknown one, its shaft angle as recorded.

    flow (F,) at the pump, m3/s, and rest (S, F), Pa, that no flow explains, at shaft orders (F,).
    variance (S, F) is that of the readings' noise. unsure (2, F) are mean squares, Pa2, by which
    another operating point makes them unsure: as a flow at the pump would, and as none does.
    angle, rad, is how far the recording's shaft is ahead of the simulated pump's, but for whole
    pitches of the pistons. misfit (F,) is the twin's own of the healthy ripple, relative, as it is
    about each order, and line_misfit (F,) the part of it that is the line's: with one sensor all.
    distance is that of the operating points, 0 where they are the same.
    """

    label: str
    orders: np.ndarray
    flow: np.ndarray
    rest: np.ndarray
    variance: np.ndarray
    unsure: np.ndarray
    angle: float
    misfit: np.ndarray
    line_misfit: np.ndarray
    distance: float


def distance(
    speed: float, other_speed: float, pressure: float | None, other_pressure: float | None
) -> float:
    """Sum of the relative differences of speed and load pressure of two operating points; 0 where
    they are one, set twice. A pressure that is not known is no difference."""
    by_speed, by_pressure = differences(speed, other_speed, pressure, other_pressure)
    same = by_speed < SAME_SPEED and by_pressure < SAME_PRESSURE
    return 0.0 if same else by_speed + by_pressure


def differences(
    speed: float, other_speed: float, pressure: float | None, other_pressure: float | None
) -> tuple[float, float]:
    """Relative differences of speed and load pressure of two operating points, as `distance`."""
    both = (pressure or 0.0) > 0.0 and (other_pressure or 0.0) > 0.0
    by_pressure = abs(np.log(pressure / other_pressure)) if both else 0.0
    return float(abs(np.log(speed / other_speed))), float(by_pressure)


def distance_between(one, other) -> float:
    """`distance` of the operating points of two observations."""
    return distance(one.speed_hz, other.speed_hz, one.load_pressure, other.load_pressure)


def make_anchor(
    twin: Twin, healthy, observation, line: DriftingLine, speed_rpm: float, pressure: float
) -> Anchor:
    """The anchor that `healthy` is for `observation`, whose line is `line` and whose pump runs at
    `speed_rpm` into `pressure`, Pa. Both are at the same shaft orders; the twin's pump is as fitted
    (`with_fitted_pump`)."""
    orders = np.asarray(healthy.orders)
    apart = distance_between(healthy, observation)
    pump, fluid = twin.rig.pump, twin.rig.fluid
    here = simulate_healthy_pump(pump, fluid, speed_rpm, pressure)
    there = here
    if apart:
        other = load_pressure_of(twin, healthy)
        there = simulate_healthy_pump(pump, fluid, 60.0 * healthy.speed_hz, other)
    response = DriftingLine(twin, healthy, there).response()
    simulated = even_flow(there, orders, pump["pistons"])
    flow, rest = estimate_flow_at_pump(response, healthy.values)
    pitch = 2 * np.pi / pump["pistons"]
    angle = find_alignment(response * simulated, healthy.values, orders, pitch)
    turned = simulated * np.exp(1j * orders * angle)
    left = healthy.values - response * turned
    misfit = relative_misfit(left, healthy.values, orders, pump["pistons"])
    line_misfit = misfit
    if len(rest) > 1:
        whole = np.sqrt(scale_of_rest(len(rest))) * rest
        line_misfit = relative_misfit(whole, healthy.values, orders, pump["pistons"])
    unsure = np.zeros((2, len(orders)))
    if apart:
        now = even_flow(here, orders, pump["pistons"])
        flow = flow + (now - simulated) * np.exp(1j * orders * angle)
        share = min(apart / FAR, 1.0)
        rest = (1.0 - share) * rest
        power = np.mean(np.abs(line.response() * flow) ** 2, axis=0)
        unsure = (share * np.array([misfit, line_misfit])) ** 2 * power
    return Anchor(
        label=healthy.label,
        orders=orders,
        flow=flow,
        rest=rest,
        variance=healthy.variance,
        unsure=unsure,
        angle=angle,
        misfit=misfit,
        line_misfit=line_misfit,
        distance=apart,
    )


def scale_of_rest(sensors: int) -> float:
    """The power of an error at all sensors over what of it no flow explains, a ratio."""
    return sensors / max(sensors - 1, 1)  # a flow takes one in `sensors`


def without_recording(
    anchor: Anchor, simulated: np.ndarray, response: np.ndarray, pistons: int
) -> Anchor:
    """The anchor that the twin alone is: its own flow, simulated (F,), m3/s, through its line, a
    response (S, F), Pa s/m3, as wrong about each order as the recording of `anchor` shows it to
    be."""
    turned = simulated * np.exp(1j * anchor.orders * anchor.angle)
    own, sensors = anchor.orders % pistons == 0, len(anchor.rest)
    along, across = response * (anchor.flow - turned), np.sqrt(scale_of_rest(sensors)) * anchor.rest
    powers = np.mean(np.abs([along, across]) ** 2, axis=1)
    wrong = np.empty_like(powers)
    for which in (own, ~own):
        if np.any(which):
            count = min(ABOUT, int(np.sum(which)))
            wrong[:, which] = uniform_filter1d(powers[:, which], count, mode="nearest")
    return replace(
        anchor,
        label="the twin alone",
        flow=simulated,
        rest=np.zeros_like(anchor.rest),
        variance=np.zeros_like(anchor.variance),
        unsure=wrong,
        angle=0.0,
    )


def find_alignment(here: np.ndarray, there: np.ndarray, orders: np.ndarray, pitch: float) -> float:
    """The angle, rad in [0, pitch), by which turning `here` (S, F) comes nearest to `there`."""
    score = correlate(here, there, orders)
    score = score[: int(np.ceil(ANGLES * pitch / (2 * np.pi)))]
    return float(2 * np.pi * np.argmax(score) / ANGLES)


def correlate(here, there, orders, weight=1.0, count: int = ANGLES) -> np.ndarray:
    """Re sum w conj(h exp(j n x)) t at `count` even angles x of a revolution, (..., count), of
    spectra h = `here` and t = `there` (..., S, F) at shaft orders n (F,)."""
    product = np.sum(weight * np.conj(here) * there, axis=-2)
    spectrum = np.zeros((*product.shape[:-1], count), complex)
    spectrum[..., orders] = product
    return np.fft.fft(spectrum, axis=-1).real


def estimate_flow_at_pump(
    response: np.ndarray, readings: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The flow (F,) at the pump, m3/s, that comes nearest to readings (S, F) through a response
    (S, F), and what it leaves of them (S, F)."""
    flow = np.sum(np.conj(response) * readings, 0) / np.sum(np.abs(response) ** 2, 0)
    return flow, readings - response * flow


def even_flow(ripple: FlowRipple, orders: np.ndarray, pistons: int) -> np.ndarray:
    """Harmonics (F,) of a simulated ripple, m3/s: equal pistons make nothing at other orders."""
    return np.where(orders % pistons == 0, flow_harmonics(ripple, orders), 0.0)


def relative_misfit(left, readings, orders: np.ndarray, pistons: int) -> np.ndarray:
    """What a twin leaves (S, F) of `readings`, relative (F,), about each order. The pistons' orders
    tell. Below the first of them errors fall with the order: at rest a line has none. Orders of
    next to no power count with their neighbours."""
    own = np.flatnonzero(orders % pistons == 0)
    powers = [np.mean(np.abs(x[:, own]) ** 2, axis=0) for x in (left, readings)]
    # Sums that move along can end a little below zero.
    left, whole = (
        np.maximum(uniform_filter1d(power, min(ABOUT, len(own)), mode="nearest"), 0.0)
        for power in powers
    )
    relative = np.minimum(np.sqrt(left / np.maximum(whole, 1e-300)), 1.0)
    return np.interp(orders, [0, *orders[own]], [0.0, *relative])
