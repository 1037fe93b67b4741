"""Recordings of a rig by a data logger: wandering speed, sensors, noise, a constant rate."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d

from virtualrig.orbit import RECORDS, Bench, Orbit
from virtualrig.rig import Rig, Sensing, build

SAMPLING_RATE_HZ = 51200.0

MARGIN_S = 0.05  # that a march runs before the first and after the last sample


@dataclass(frozen=True)
class Point:
    """An operating point as the operator sets it; `faults` are keys of the rig's faults.

    `leak_area`, m2, takes the place of the sealed one where it is given.
    """

    label: str
    speed_rpm: float
    load_pressure: float
    seconds: float
    state: str = "healthy"
    leak_area: float | None = None

    @property
    def faults(self) -> tuple[str, ...]:
        return () if self.state == "healthy" else (self.state,)

    def rig_with_leak(self, rig: Rig) -> Rig:
        """The rig whose fault of this state has this point's leak area."""
        if self.leak_area is None or not self.faults:
            return rig
        fault = replace(rig.faults[self.state], leak_area=self.leak_area)
        return replace(rig, faults=rig.faults | {self.state: fault})


@dataclass(frozen=True)
class Take:
    """A recording: `pressure` (sensors, samples) Pa, true crank `turns` (samples,), `orbit`."""

    pressure: np.ndarray
    turns: np.ndarray
    orbit: Orbit


def record(
    rig: Rig,
    point: Point,
    rng: np.random.Generator,
    flow: Callable[[float], np.ndarray] | None = None,
    tolerance: float = 20.0,
    step_divisor: int = 1,
    marched: bool = False,
) -> Take:
    """One recording of `rig` at `point`; its first sample is at a random crank angle.

    `flow`, `step_divisor` and `tolerance` are those of `Bench` and `Bench.settle`. If the speed
    wanders and `marched` is true, the rig is run at the speed of every instant over the whole
    recording. Otherwise the recording is composed of three orbits.
    """
    set_speed = point.speed_rpm * (1 + rig.speed_error * rng.standard_normal())
    set_pressure = point.load_pressure * (1 + rig.load_pressure_error * rng.standard_normal())
    count = round(point.seconds * SAMPLING_RATE_HZ)
    speed = set_speed * (1 + draw_speed_wander(count, rig.wander, rig.correlation_s, rng))
    turns = rng.uniform() + np.concatenate([[0.0], np.cumsum(speed[:-1])]) / 60 / SAMPLING_RATE_HZ
    bench = Bench(point.rig_with_leak(rig), point.faults, flow, step_divisor)
    if marched and rig.wander > 0:
        pressure, orbit = march_recording(bench, speed, turns, set_pressure, tolerance)
    else:
        orbits = settle_orbits(bench, speed, set_pressure, tolerance)
        pressure, orbit = (
            compose_from_orbits(orbits, rig.sensing, speed, turns),
            orbits[len(orbits) // 2],
        )
    pressure += rig.noise * rng.standard_normal(pressure.shape)
    return Take(pressure, turns, orbit)


def nominal_ripple(known: dict, point: Point) -> tuple[np.ndarray, np.ndarray]:
    """Outlet flow of the data sheet's pump on the data sheet's line: crank angle, deg, and m3/s.

    Without effects, with steady friction, at the operating point as set; one revolution in steps
    of 360/RECORDS degrees.
    """
    orbit = Bench(build(known, {})).settle(point.speed_rpm, point.load_pressure)
    return 360 * np.arange(len(orbit.outlet_flow)) / len(orbit.outlet_flow), orbit.outlet_flow


def draw_speed_wander(
    count: int, deviation: float, correlation_s: float, rng: np.random.Generator
) -> np.ndarray:
    """Slow relative deviation of the speed (count,): Gaussian, with the correlation
    exp(-(t/correlation_s)^2) and the standard deviation `deviation` before its mean is taken off.
    """
    step = 0.02
    grid = np.arange(int(np.ceil(count / SAMPLING_RATE_HZ / step)) + 2)
    width = correlation_s / 2 / step
    pad = int(np.ceil(4 * width))
    rough = rng.standard_normal(len(grid) + 2 * pad)
    smooth = gaussian_filter1d(rough, width)[pad : pad + len(grid)]
    smooth *= deviation * np.sqrt(2 * np.sqrt(np.pi) * width)  # std of white noise so filtered
    values = CubicSpline(grid * step, smooth)(np.arange(count) / SAMPLING_RATE_HZ)
    return values - values.mean()


def settle_orbits(
    bench: Bench, speed: np.ndarray, load_pressure: float, tolerance: float
) -> list[Orbit]:
    """Orbits at the mean of `speed` (r/min) and, if it varies, at its extremes.

    The valve is set once, at the mean speed.
    """
    middle = bench.settle(speed.mean(), load_pressure, tolerance=tolerance)
    reach = np.abs(speed - speed.mean()).max()
    if reach < 1e-6 * speed.mean():
        return [middle]
    low, high = (
        bench.settle(speed.mean() + side * reach, load_pressure, middle.valve, tolerance)
        for side in (-1, 1)
    )
    return [low, middle, high]


def compose_from_orbits(
    orbits: list[Orbit], sensing: tuple[Sensing, ...], speed: np.ndarray, turns: np.ndarray
) -> np.ndarray:
    """Sensed pressure (sensors, samples) along the orbits at `speed` (r/min) and crank `turns`.

    Quadratic interpolation in speed between three orbits, splines in crank angle.
    """
    phase = turns % 1.0
    total = np.zeros((len(sensing), len(turns)))
    knots = np.array([orbit.speed_rpm for orbit in orbits])
    for k, orbit in enumerate(orbits):
        others = np.delete(knots, k)
        share = np.prod([(speed - other) / (knots[k] - other) for other in others], axis=0)
        sensed = sensed_pressure(orbit, sensing)
        grid = np.linspace(0, 1, sensed.shape[1] + 1)
        closed = np.concatenate([sensed, sensed[:, :1]], axis=1)
        total += share * CubicSpline(grid, closed, axis=1, bc_type="periodic")(phase)
    return total


def march_recording(
    bench: Bench, speed: np.ndarray, turns: np.ndarray, load_pressure: float, tolerance: float
) -> tuple[np.ndarray, Orbit]:
    """Sensed pressure (sensors, samples), Pa, of a run at the speed of every instant.

    `speed` (samples,) in r/min and crank `turns` (samples,) are those of the samples. The valve is
    set once, at the mean speed. Before the first sample the speed is that of the first sample.
    Also returns the orbit from which the run starts.
    """
    valve = bench.valve_for(speed.mean(), load_pressure, tolerance)
    first = bench.settle(speed[0], load_pressure, valve, tolerance)
    before = (turns[0] % 1.0) + np.ceil(MARGIN_S * speed[0] / 60)  # revolutions, from crank angle 0
    seconds = np.arange(len(speed)) / SAMPLING_RATE_HZ + before * 60 / speed[0]
    step = 60 / speed[0] / RECORDS
    at = step * np.arange(1, int(np.ceil((seconds[-1] + MARGIN_S) / step)) + 1)
    pressure = bench.march(speed[0], np.interp(at - step / 2, seconds, speed / speed[0] - 1))
    # the filter is periodic: the errors at both ends lie within the margins
    sensed = _filtered(pressure, 1 / (step * pressure.shape[1]), bench.rig.sensing)
    return CubicSpline(at, sensed, axis=1)(seconds), first


def sensed_pressure(orbit: Orbit, sensing: tuple[Sensing, ...]) -> np.ndarray:
    """An orbit's pressures (sensors, RECORDS) as sensed: gain, delay and resonance of each."""
    return _filtered(orbit.pressure, orbit.speed_rpm / 60, sensing)


def _filtered(pressure: np.ndarray, base_hz: float, sensing: tuple[Sensing, ...]) -> np.ndarray:
    """Sensed (sensors, M) of a pressure (sensors, M) that repeats with `base_hz`."""
    spectrum = np.fft.rfft(pressure, axis=1)
    s = 2j * np.pi * np.arange(spectrum.shape[1]) * base_hz
    for row, chain in zip(spectrum, sensing, strict=True):
        row *= chain.gain * np.exp(-s * chain.delay)
        if chain.resonance is not None:
            frequency, damping = chain.resonance
            omega = 2 * np.pi * frequency
            row *= omega**2 / (s**2 + 2 * damping * omega * s + omega**2)
    return np.fft.irfft(spectrum, n=pressure.shape[1], axis=1)
