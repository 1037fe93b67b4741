"""What a recording should read under a hypothesis, and how far it may be off.

    reading = anchor at the recording's operating point + change by leaks, turned by the shaft angle

The change is that of the pump's flow through the twin's line. A hypothesis names the leaks, their
areas and pistons, the shaft angle between the recordings and how far the line's state has drifted.

Readings are divided into a part along the line's response to a flow at the pump and others across
it (`Division`). The pump's errors are along it alone, so that the others show how the line's state
has drifted, and whether it is still the same line.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from rippletwin.diagnosis.anchor import Anchor
from rippletwin.diagnosis.division import Division
from rippletwin.diagnosis.drifting_line import DriftingLine
from rippletwin.diagnosis.faults.base import Fault
from rippletwin.diagnosis.hypothesis import Errors, Hypothesis, Parts, coherence
from rippletwin.diagnosis.likelihood import Marginal, complex_columns, marginalise
from rippletwin.diagnosis.local_power import explained_power, local_power
from rippletwin.diagnosis.pump_flow import LeakFlow

TURN_SD = 0.02  # rad, of a shaft angle that has been found already
SOURCE_DRIFT, SOURCE_WAVES = 0.01, 4
"""The healthy pump's own flow drifts by 1 %, smoothly over the frequency, in four cosines."""
CHANGE_WAVES = 6  # cosines over the frequency in which the change's relative error is smooth
SMOOTH_SHARE = 0.5  # of the change's relative error, in each of these
AREA_SD = 0.1  # relative: discharge coefficients of leaks are between 0.6 and 0.8
SENSOR_SCATTER = 0.001  # relative, of each sensor from one recording to another
MIN_CHANGE_ERROR = 0.04  # relative, of the change by a leak behind the best of twins
MAX_SHARE = 2.0  # of a measured change over the predicted one, up to which errors grow with it
MAX_USUAL_ERROR = 0.3  # relative, of a leak's change behind the worst of twins
ALIKE = 8.0  # readings whose errors go together: those of a line are as wide as its resonances
PRIOR_NODES = 201  # of the integral over the prior of two areas
LEAST_WIDTH = 1e-6  # of a prior on the logarithm of an area
MOST_DRIFT = 10.0  # standard deviations, beyond which a line's response is not extrapolated
WHOLE = slice(None)
BETWEEN = 0.01  # share of a power whose errors show at orders that have none of it


class ObservationModel:
    """The recording `observation`, its anchor and line, and the leaks' flows by fault name.

    `repeats` (R, orders from 0) are changes of the pump's flow, m3/s, by which healthy recordings
    differ from the anchor. `start`, in revolutions, is how far the shaft turns from the
    recording's first sample to where the observation's shaft angle counts from.
    """

    def __init__(
        self,
        observation,
        anchor: Anchor,
        line: DriftingLine,
        flows: Mapping[str, LeakFlow],
        repeats: np.ndarray,
        start: float = 0.0,
    ):
        self.start = start
        self.observation = observation
        self.sensors = len(observation.values)
        self.anchor, self.line, self.flows = anchor, line, flows
        self.orders = anchor.orders
        self._repeats = repeats[:, self.orders]
        self.pistons = int(line.twin.rig.pump["pistons"])
        self._waves = _cosines(self.observation.frequency_hz, CHANGE_WAVES)
        self._expected = np.hypot(MIN_CHANGE_ERROR, [anchor.misfit, anchor.line_misfit])
        self.usual_error = min(float(np.median(self._expected[0])), MAX_USUAL_ERROR)
        self._undrifted = line.response()
        self._divide(np.zeros(len(line.drifts)))

    # predictions

    def change(self, hypothesis: Hypothesis) -> np.ndarray:
        """Change (K, F) of the flow by each of the hypothesis's leaks, m3/s, as the anchor's shaft
        stands."""
        found = [
            self.leak_change(fault, area, piston)
            for fault, area, piston in zip(
                hypothesis.state, hypothesis.areas, hypothesis.pistons, strict=True
            )
        ]
        return np.array(found).reshape(len(found), len(self.orders))

    def leak_change(self, fault: Fault, area: float, piston: int) -> np.ndarray:
        """The same (F,) of one leak of `area`, m2, at `piston`, counted from 0."""
        return self._turned(self.flows[fault.name].harmonics(area), piston)

    def _turned(self, harmonics: np.ndarray, piston: int) -> np.ndarray:
        """Harmonics (..., K) of a leak at piston 0 as one at `piston` makes them at the orders."""
        angle = self.anchor.angle + 2.0 * np.pi * piston / self.pistons
        return harmonics[..., self.orders] * np.exp(1j * self.orders * angle)

    def _pump_slopes(self, hypothesis: Hypothesis) -> np.ndarray:
        """What uncertain numbers of the pump make of the leaks' flow (P, F), or (0, F)."""
        each = [
            self._turned(self.flows[fault.name].pump_slopes(area), piston)
            for fault, area, piston in zip(hypothesis.state, hypothesis.areas, hypothesis.pistons)
        ]
        return np.sum(each, axis=0) if each else np.zeros((0, len(self.orders)), complex)

    def area_ends(self, fault: Fault, beside: Sequence[float] = ()) -> tuple[float, float]:
        """Ends of the prior on the logarithm of a fault's leak area, m2, with leaks of areas
        `beside` it. A leak below what the twin errs by in the other's change is part of that error.
        """
        areas = self.flows[fault.name].areas
        low = max([areas[0], *(self.usual_error * other for other in beside)])
        high = min([areas[-1], *(other / self.usual_error for other in beside)])
        low, high = float(np.log(low)), float(np.log(high))
        # beside a leak that leaves a single area, rounding may leave none
        return low, low + LEAST_WIDTH if abs(high - low) < LEAST_WIDTH else high

    def log_prior_size(self, state: Sequence[Fault]) -> float:
        """Log of the interval, of two faults of the area, that the logarithms of their leak areas
        can be in: a prior's density is one over it."""
        first, *rest = state
        low, high = self.area_ends(first)
        if not rest:
            return float(np.log(high - low))
        nodes = np.linspace(low, high, PRIOR_NODES)
        ends = np.array([self.area_ends(rest[0], (x,)) for x in np.exp(nodes)])
        widths = np.maximum(ends[:, 1] - ends[:, 0], 0.0)
        return float(np.log(np.trapezoid(widths, nodes)))

    def state_of_line(self, hypothesis: Hypothesis) -> np.ndarray:
        """Drift (D,), standard deviations, with what the leaks' change of mean flow makes of an
        orifice set anew."""
        gained = sum(
            self.flows[fault.name].gained(area)
            for fault, area in zip(hypothesis.state, hypothesis.areas)
        )
        return self.line.reset_orifice(np.array(hypothesis.drift, float), gained)

    def change_of_flow(self, hypothesis: Hypothesis) -> np.ndarray:
        """Change (F,) of the pump's flow from that of the hypothesis to the recording's, m3/s, as
        the anchor's shaft stands; the line is that of the last linearisation."""
        parts = self.predict(hypothesis)
        left = (self.values - parts.healthy - parts.change)[0] / self.response[0]
        return left * np.exp(-1j * self.orders * hypothesis.turn)

    def linearise_line(self, hypothesis: Hypothesis) -> None:
        """From here on the line is linear in the drift about that of the hypothesis, and readings
        are divided as its response has them."""
        self._divide(self.state_of_line(hypothesis))

    def _divide(self, drift: np.ndarray) -> None:
        response, slopes = self.line.response(drift), self.line.slopes(drift)
        self._at, self.division = drift, Division(response)
        divide = self.division.divide
        self.response, self._slopes = divide(response), divide(slopes)
        self._before, self._rest = divide(self._undrifted), divide(self.anchor.rest)
        self.values = divide(self.observation.values)
        noise = self.anchor.variance + self.observation.variance
        self.noise = self.division.divide_variance(noise)

    def predict(self, hypothesis: Hypothesis) -> Parts:
        """The prediction of a hypothesis, divided, Pa."""
        slopes = self._slopes
        moved = self.response + np.tensordot(self.state_of_line(hypothesis) - self._at, slopes, 1)
        leaks = self.change(hypothesis)
        flow = self.anchor.flow + np.sum(leaks, axis=0)
        turn = np.exp(1j * self.orders * hypothesis.turn)
        healthy = (moved * self.anchor.flow + self._rest) * turn
        added = moved * leaks[:, None] * turn
        return Parts(
            healthy=healthy,
            drifted=(moved - self._before) * self.anchor.flow * turn,
            leaks=added,
            slopes=slopes * flow * turn,
            repeats=moved * self._repeats[:, None] * turn,
            pump=moved * self._pump_slopes(hypothesis)[:, None] * turn,
            spread=local_power(moved) * np.mean(np.abs(leaks.sum(axis=0)) ** 2),
            measured=self._measured_share(healthy, added.sum(axis=0)),
            explained=explained_power(self.values - healthy, added.sum(axis=0)),
        )

    # likelihood

    def evaluate(
        self,
        hypothesis: Hypothesis,
        errors: Errors,
        highest_hz: float = np.inf,
        part: slice = WHOLE,
    ) -> Marginal:
        """Marginal likelihood of the recording below a frequency, or of a part of the divided
        readings. The first amplitudes are those of the shaft angle, in `TURN_SD`, and of the
        drift."""
        return self._evaluate(self.predict(hypothesis), hypothesis.drift, errors, highest_hz, part)

    def log_likelihoods(self, hypothesis: Hypothesis, errors: Sequence[Errors]) -> np.ndarray:
        """Log likelihoods (E,) of the recording under E `errors` of different sizes."""
        parts = self.predict(hypothesis)
        found = [self._evaluate(parts, hypothesis.drift, each) for each in errors]
        return np.array([each.log_likelihood for each in found])

    def _evaluate(
        self,
        parts: Parts,
        drift: np.ndarray,
        errors: Errors,
        highest_hz: float = np.inf,
        part=WHOLE,
    ) -> Marginal:
        below = self.observation.frequency_hz <= highest_hz
        sure, expected = self._sure(errors), self.expected_reading(parts, errors)
        columns = self._columns(parts, expected, sure)
        # The drift is about zero: where it has been followed, back to there in a straight line.
        residual = self.values - expected + sure * np.tensordot(drift, parts.slopes, 1)
        variance = self.variance(parts, errors)
        columns = columns[:, part, below]
        return marginalise(residual[part, below], variance[part, below], columns, ALIKE)

    def variance(self, parts: Parts, errors: Errors) -> np.ndarray:
        """Variance (S, F), Pa2, of the divided readings' independent errors. What the twin says of
        a change is relatively wrong, whether a leak makes it or a drift of the line. A pulse of
        wrong shape errs at all orders, also at those where the twin's own pulse has next to
        nothing. The errors that a flow makes at all sensors add up in the first part."""
        healthy, drifted = self.scatter_power(parts.healthy), self.power_by_class(parts.drifted)
        leaks = local_power(parts.change) + BETWEEN * parts.spread
        # Across the response a leak makes nothing, whatever its size: what it explains of the
        # measured change counts.
        changes = parts.measured**2 * leaks, parts.explained
        scatters = errors.scatter, SENSOR_SCATTER
        flow, across = (
            scatter**2 * healthy + unsure + (1.0 - sure) * (change + drifted)
            for scatter, unsure, sure, change in zip(
                scatters, self.anchor.unsure, self._both_sure(errors), changes
            )
        )
        return self.noise + self._in_rows(self.sensors * flow, across)

    def expected_reading(self, parts: Parts, errors: Errors) -> np.ndarray:
        """The divided reading (S, F), Pa, to expect: changes count by as much as they are sure."""
        changed = parts.drifted + parts.change
        return parts.healthy - parts.drifted + self._sure(errors) * changed

    def _sure(self, errors: Errors) -> np.ndarray:
        """Share (S, F) of a predicted change that is to be expected."""
        return self._in_rows(*self._both_sure(errors))

    def _in_rows(self, along: np.ndarray, across: np.ndarray) -> np.ndarray:
        """The rows (S, F) of divided readings: one along the response, alike ones across it."""
        return np.array([along, *[across] * (self.sensors - 1)])

    def _both_sure(self, errors: Errors) -> tuple[np.ndarray, np.ndarray]:
        """The same (F,) along the response and across it."""
        along, across = self._expected
        return coherence(errors.change * along), coherence(errors.across * across)

    def _measured_share(self, healthy: np.ndarray, change: np.ndarray) -> float:
        """The measured change over the predicted one. Errors of a leak's change are relative to
        what was measured: a leak that is too large must not be forgiven more for its size. One that
        predicts next to nothing must not be forgiven everything."""
        predicted = np.linalg.norm(change)
        if predicted == 0.0:
            return 1.0
        return min(float(np.linalg.norm(self.values - healthy) / predicted), MAX_SHARE)

    def scatter_power(self, healthy: np.ndarray) -> np.ndarray:
        """Power (F,), Pa2, to which the scatter of repeated healthy recordings is in proportion, of
        readings `healthy` (S, F), Pa."""
        own, all_orders = self.power_by_class(healthy), local_power(healthy)
        return own + BETWEEN * all_orders

    def power_by_class(self, readings: np.ndarray) -> np.ndarray:
        """Local power (F,), Pa2, of readings (S, F), Pa, of pistons' orders and of all others
        apart."""
        out = np.empty(len(self.orders))
        even = self.orders % self.pistons == 0
        for which in (even, ~even):
            if np.any(which):
                out[which] = local_power(readings[:, which])
        return out

    def fit_turn_and_drift(
        self, hypothesis: Hypothesis, errors: Errors, limits_hz: Sequence[float]
    ) -> Hypothesis:
        """The hypothesis with its shaft angle, rad, and drift, standard deviations, at their most
        likely values, found below one of `limits_hz` after the other: at high frequencies the phase
        may be off by more than half a turn at first."""
        for limit in limits_hz:
            self.linearise_line(hypothesis)
            amplitudes = self.evaluate(hypothesis, errors, limit).amplitudes
            hypothesis = replace(
                hypothesis,
                turn=hypothesis.turn + TURN_SD * amplitudes[0],
                drift=np.clip(amplitudes[1 : 1 + len(self.line.drifts)], -MOST_DRIFT, MOST_DRIFT),
            )
        self.linearise_line(hypothesis)
        return hypothesis

    def _columns(self, parts: Parts, expected: np.ndarray, sure: np.ndarray) -> np.ndarray:
        turning = TURN_SD * 1j * self.orders * expected
        source = SOURCE_DRIFT * parts.healthy * self._waves[:SOURCE_WAVES, None]
        # The first wave is constant: it would be a leak of another size, which AREA_SD has.
        size = SMOOTH_SHARE * np.sqrt(1.0 - sure[0]) * parts.measured
        waves = size * self._waves[1:, None]
        smooth = map(complex_columns, (source, *(waves * leak for leak in parts.leaks)))
        # Relative to the predicted change these would favour large leaks, relative to the measured
        # one small ones: their geometric mean favours neither.
        leak = sure * np.sqrt(parts.measured)
        known = (
            turning[None],
            sure * parts.slopes,
            parts.repeats,
            leak * AREA_SD * parts.leaks,
            leak * parts.pump,
        )
        return np.concatenate([*known, *smooth])


def _cosines(frequency_hz: np.ndarray, count: int) -> np.ndarray:
    """Cosines (count, F) over the frequency, the first of them constant."""
    share = frequency_hz / frequency_hz[-1]
    return np.cos(np.pi * np.outer(np.arange(count), share))
