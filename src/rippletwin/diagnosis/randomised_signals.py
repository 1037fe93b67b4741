"""Training signals that allow for what is not known: severity, twin, piston and shaft angle.

A signal is one revolution at the sensors, an inverse Fourier transform of

    response of the line x (flow of the healthy pump + change by a leak)

whose line and pump are drawn from the twin's posterior, whose line drifts as between two
recordings, whose leak is of a log-uniform area at a random piston, and whose error is a smooth
random function of frequency, about each order as large as the twin's own misfit of the healthy
ripple. The twin's pistons are alike, those of a pump are not: between the pistons' orders the
healthy flow is as large as the recording shows, and falls to the pistons at random. An anchored
signal has the measured healthy ripple in place of the twin's, so that pump and misfit concern the
change alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rippletwin.diagnosis.anchor import estimate_flow_at_pump, make_anchor
from rippletwin.diagnosis.drifting_line import DriftingLine
from rippletwin.diagnosis.faults.library import FAULT_OF, FAULTS
from rippletwin.diagnosis.observation_model import SOURCE_DRIFT, TURN_SD
from rippletwin.diagnosis.pump_flow import (
    NUMBERS,
    ORDERS,
    simulate_healthy_pump,
    simulate_leak_flow,
    with_fitted_pump,
)
from rippletwin.diagnosis.uncertain_pump import UncertainPump, number_slopes
from rippletwin.harmonics import one_period, peak_amplitudes
from rippletwin.spectra.observation import Observation
from rippletwin.twin.twin import Twin

WAVES, WAVES_HZ = 6, 4000.0  # cosines of the smooth error, and over which frequency


@dataclass(frozen=True)
class RandomisedSignals:
    """pressure (C, N, S, M), Pa, and source flow (C, N, 1, M), m3/s, of C classes; leak areas
    (C, N), m2, 0 for a healthy pump."""

    pressure: np.ndarray
    flow: np.ndarray
    leak_area: np.ndarray


def severity_bins(
    severity: Mapping[str, Sequence[float]], limit: float
) -> dict[str, tuple[float, float]]:
    """Range of leak areas, m2, of each faulty class, from those of S and C; `limit` divides the
    cylinder's. Raises ValueError where a range is empty or the limit is not inside."""
    (low, high), (least, most) = severity["C"], severity["S"]
    if not 0.0 < low < limit < high:
        raise ValueError(f"severity_limit {limit} must be between {low} and {high}")
    if not 0.0 < least < most:
        raise ValueError(f"severity.S {(least, most)} must ascend from a positive area")
    return {"S": (least, most), "C1": (low, limit), "C2": (limit, high)}


class SignalSource:
    """A twin and a healthy recording at one operating point, from which signals are drawn.

    twin, covariance : the twin and the posterior covariance of its theta, None where it is not
        known; then of line and pump only the drift is drawn. Where the pump's numbers are no
        parameters of the twin, they are drawn about the data sheet's (`pump_flow.UNCERTAIN`).
    healthy : (R, S, M) consecutive revolutions of one healthy recording, Pa, M even shaft angles.
    speed_hz, load_pressure : rev/s, Pa.

    Raises ArithmeticError where the pump cannot be simulated.
    """

    def __init__(
        self,
        twin: Twin,
        covariance: np.ndarray | None,
        healthy: np.ndarray,
        speed_hz: float,
        load_pressure: float,
    ):
        fitted = with_fitted_pump(twin)
        self._samples = healthy.shape[-1]
        self.orders = np.arange(1, min(ORDERS, (self._samples - 1) // 2) + 1)
        self._pistons = fitted.rig.pump["pistons"]
        self._point = 60.0 * speed_hz, load_pressure
        self._pump, self._fluid = fitted.rig.pump, fitted.rig.fluid
        observed = _observation(healthy, self.orders, speed_hz, load_pressure)
        ripple = simulate_healthy_pump(self._pump, self._fluid, *self._point)
        self._line = DriftingLine(fitted, observed, ripple)
        self._healthy = observed.values
        anchor = make_anchor(fitted, observed, observed, self._line, *self._point)
        self._angle, self.misfit = anchor.angle, anchor.misfit
        flow, _ = estimate_flow_at_pump(self._line.response(), self._healthy)
        self._uneven = np.where(self.orders % self._pistons == 0, 0.0, flow)
        self._flows = UncertainPump(self._pump, self._fluid, *self._point, self.orders)
        self._waves = np.cos(
            np.pi * np.outer(np.arange(WAVES), observed.frequency_hz / WAVES_HZ)
        ) / np.sqrt(WAVES)
        self._kept = [twin.index[p.name] for p in fitted.parameters]
        self._numbers = number_slopes(twin)
        self._root = None
        if covariance is not None:
            values, vectors = np.linalg.eigh(covariance)
            self._root = vectors * np.sqrt(np.clip(values, 0.0, None))
            # what the data sheet calls exact has a coordinate all the same; its drift is drawn
            self._root[[p.prior.scale == 0.0 for p in twin.parameters]] = 0.0

    @property
    def overall_misfit(self) -> float:
        """What the twin leaves of the whole healthy ripple, relative."""
        ripple = np.abs(self._healthy)
        return float(np.linalg.norm(self.misfit * ripple) / np.linalg.norm(ripple))

    def draw(
        self,
        bins: Mapping[str, tuple[float, float]],
        classes: Sequence[str],
        count: int,
        rng: np.random.Generator,
        anchored: bool = False,
    ) -> RandomisedSignals:
        """`count` signals of each class, each class with the same twins. Leak areas are log-uniform
        in `bins`; a class without a bin is healthy. Raises ArithmeticError where the pump cannot be
        simulated."""
        leaks = {
            name: simulate_leak_flow(self._pump, self._fluid, *self._point, FAULTS[FAULT_OF[name]])
            for name in classes
            if name in bins
        }
        areas = np.array(
            [
                _log_uniform(*bins[name], count, rng) if name in bins else np.zeros(count)
                for name in classes
            ]
        )
        sensors = len(self._healthy)
        pressure = np.empty((len(classes), count, sensors, len(self.orders)), complex)
        flow = np.empty((len(classes), count, 1, len(self.orders)), complex)
        for k in range(count):
            theta, numbers = self._draw_twin(rng)
            healthy = self._flows.healthy(numbers) + self._draw_uneven(rng)
            known = None
            if anchored:
                known = estimate_flow_at_pump(self._line.response(theta=theta), self._healthy)
            for c, name in enumerate(classes):
                change, gained = self._leak(leaks.get(name), areas[c, k], numbers, rng)
                moved = self._line.response(self._draw_drift(gained, rng), theta)
                whole = healthy + change
                pressure[c, k] = (
                    self._smooth(self.misfit, sensors, rng) * moved * whole
                    if known is None
                    else self._anchored(*known, moved, change, rng)
                )
                flow[c, k] = self._smooth(self.misfit, 1, rng) * whole
        return RandomisedSignals(
            pressure=one_period(pressure, self._samples, self.orders),
            flow=one_period(flow, self._samples, self.orders),
            leak_area=areas,
        )

    def _anchored(self, flow, rest, moved, change, rng) -> np.ndarray:
        """Readings (S, F): the measured healthy ripple, a flow (F,) at the pump and what it leaves
        (S, F), through the drifted line, as the shaft stood when it was recorded, and the twin's
        change."""
        angle = self._angle + TURN_SD * rng.standard_normal()
        changed = moved * change * np.exp(1j * self.orders * angle)
        own = self._smooth(SOURCE_DRIFT, 1, rng) * moved * flow + rest
        return own + self._smooth(self.misfit, len(moved), rng) * changed

    def _leak(self, leak, area: float, numbers, rng) -> tuple[np.ndarray | float, float]:
        """Change (F,) of the flow at a random piston of the pump of these numbers, and that of the
        mean flow, relative."""
        piston = rng.integers(self._pistons)
        if leak is None:
            return 0.0, 0.0
        turn = np.exp(2j * np.pi * self.orders * piston / self._pistons)
        return self._flows.change(leak, area, numbers) * turn, leak.gained(area)

    def _draw_twin(self, rng) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates (P,) of the line and numbers (U,) of the pump, see `UncertainPump`."""
        theta = self._line.twin.theta
        if self._root is None:
            return theta, np.zeros(len(NUMBERS))
        moved = self._root @ rng.standard_normal(len(self._root))
        numbers = self._numbers @ moved
        if not self._numbers.any():
            numbers = rng.standard_normal(len(NUMBERS))
        return theta + moved[self._kept], numbers

    def _draw_uneven(self, rng) -> np.ndarray:
        """Flow (F,) of unequal pistons between the pistons' orders: of the measured spectrum, each
        piston's share of it a normal number."""
        shares = np.fft.fft(rng.standard_normal(self._pistons)) / np.sqrt(self._pistons)
        return shares[self.orders % self._pistons] * self._uneven

    def _draw_drift(self, gained: float, rng) -> np.ndarray:
        """Drift (D,) of the line; an orifice is set anew, so that the load pressure is held."""
        return self._line.reset_orifice(rng.standard_normal(len(self._line.drifts)), gained)

    def _smooth(self, size: float | np.ndarray, rows: int, rng) -> np.ndarray:
        """Random factors (rows, F) about 1, smooth in frequency, of relative deviation `size`, a
        number or one for each order (F,)."""
        weights = rng.standard_normal((2, rows, WAVES))
        weights[..., 0] /= np.sqrt(2.0)  # the constant cosine has twice the power of the others
        return 1.0 + size * ((weights[0] + 1j * weights[1]) @ self._waves)


def _observation(healthy, orders, speed_hz, load_pressure) -> Observation:
    """The mean revolution of a healthy recording as an observation at all shaft orders."""
    spectra = peak_amplitudes(healthy)[..., orders]
    sensors = spectra.shape[1]
    scatter = np.var(spectra, axis=0).T[:, :, None] * np.eye(sensors) / len(spectra)
    return Observation(
        kind="periodic",
        label="healthy",
        frequency_hz=orders * speed_hz,
        orders=orders,
        values=spectra.mean(axis=0),
        covariance=scatter.astype(complex),
        mean=None,
        speed_hz=speed_hz,
        load_pressure=load_pressure,
        source="nominal",
        flow_ripple=None,
        sensors=None,
    )


def _log_uniform(low: float, high: float, count: int, rng: np.random.Generator) -> np.ndarray:
    """`count` numbers whose logarithms are evenly distributed."""
    return np.exp(rng.uniform(np.log(low), np.log(high), count))
