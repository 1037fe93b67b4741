"""Where on the circle a fault can be: a rough score of every piston and shaft angle at once.

A leak at another piston is the same change turned by a pitch, and a recording may begin at any
shaft angle. With errors that do not depend on either, the squared distance between a recording u
and a prediction h + d is

    |u|^2 + |h + d|^2 - 2 Re <h + d, u>

and the last term at all shaft angles is a Fourier transform, the sum of that of h and that of d,
which another piston only shifts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from rippletwin.diagnosis.anchor import correlate
from rippletwin.diagnosis.faults.base import Fault
from rippletwin.diagnosis.hypothesis import Hypothesis
from rippletwin.diagnosis.observation_model import ObservationModel

TOLERANCE = 0.1  # relative error of a prediction that the score forgives
SCATTER = 0.005  # relative scatter of the healthy ripple, in the score
AREAS = 19  # leak areas between a prior's ends
ANGLES = 1024  # shaft angles in a pitch of the pistons
KEPT = 8  # best candidates of single faults to which a second fault is added


@dataclass(frozen=True)
class Candidate:
    """A state with the areas and pistons of its faults, its shaft angle and score (log likelihood
    but for a constant)."""

    state: tuple[Fault, ...]
    areas: tuple[float, ...]
    pistons: tuple[int, ...]
    turn: float
    score: float


@dataclass(frozen=True)
class _Term:
    """A part (S, F) of a prediction, its correlation (angles,) with the recording, its square."""

    reading: np.ndarray
    gain: np.ndarray
    square: float


class Screen:
    """Scores of hypotheses about one recording."""

    def __init__(self, model: ObservationModel):
        self.model = model
        nothing = Hypothesis((), (), (), 0.0, np.zeros(len(model.line.drifts)))
        model.linearise_line(nothing)
        parts = model.predict(nothing)
        healthy, slopes = parts.healthy, parts.slopes
        self._response, self._values = model.response, model.values
        drifted = np.sum(np.abs(slopes) ** 2, axis=(0, 1))
        drifted = drifted / np.maximum(np.sum(np.abs(healthy) ** 2, axis=0), 1e-300)
        power = model.power_by_class(self._values)
        forgiven = np.minimum(TOLERANCE**2 + drifted, 1.0) * power
        scatter = SCATTER**2 * model.scatter_power(healthy)
        self._weight = 1.0 / (model.noise + forgiven + scatter)
        self._turns = np.exp(
            2j * np.pi / model.pistons * np.outer(np.arange(model.pistons), model.orders)
        )
        self._count = ANGLES * model.pistons
        self._healthy = self._term(healthy)
        # Pitches are counted from the shaft angle at which the pistons' orders are alike.
        even = self._weight * (model.orders % model.pistons == 0)
        score = correlate(healthy, self._values, model.orders, even, self._count)
        first = int(np.argmax(score[:ANGLES]))
        self._start = first - ANGLES // 2
        self._leaks: dict[str, list[tuple[float, _Term]]] = {}

    def screen_healthy(self) -> list[Candidate]:
        """The healthy state at each of the pistons' pitches, the best first."""
        return _sorted(self._at_pitches((), (), (), self._healthy.gain, self._healthy.square))

    def screen_one(self, fault: Fault) -> list[Candidate]:
        """One fault at every piston and pitch, each at its best leak area, the best first."""
        return _sorted(self._added(fault, None))

    def screen_two(self, first: list[Candidate], second: list[Candidate]) -> list[Candidate]:
        """Two faults together: the other one added to the best candidates of either."""
        found: dict[tuple[tuple[int, ...], int], Candidate] = {}
        for base, other in ((first, second), (second, first)):
            for candidate in base[:KEPT]:
                for new in self._added(other[0].state[0], candidate):
                    new = new if base is first else _swapped(new)
                    key = new.pistons, self._pitch(new.turn)
                    if key not in found or new.score > found[key].score:
                        found[key] = new
        return _sorted(found.values())

    def _added(self, fault: Fault, to: Candidate | None) -> list[Candidate]:
        """A fault at every piston and pitch, alone or beside the single fault of a candidate."""
        base = self._healthy
        state: tuple[Fault, ...] = () if to is None else to.state
        areas: tuple[float, ...] = () if to is None else to.areas
        pistons: tuple[int, ...] = () if to is None else to.pistons
        if to is not None:
            leak = self.model.leak_change(state[0], areas[0], pistons[0])
            base = self._term(base.reading + self._response * leak)
        found: dict[tuple[int, int], Candidate] = {}
        low, high = np.exp(self.model.area_ends(fault, areas))
        for area, term in self._leaks_of(fault):
            if not low <= area * (1.0 + 1e-9) <= high * (1.0 + 2e-9):  # rounding of the ends
                continue
            product = np.sum(self._weight * np.conj(base.reading) * term.reading, axis=0)
            cross = 2.0 * (self._turns @ product).real
            for piston in range(self.model.pistons if fault.one_piston else 1):
                gain = base.gain + np.roll(term.gain, -piston * ANGLES)
                square = base.square + term.square + cross[piston]
                named = (*state, fault), (*areas, area), (*pistons, piston)
                for pitch, new in enumerate(self._at_pitches(*named, gain, square)):
                    key = piston, pitch
                    if key not in found or new.score > found[key].score:
                        found[key] = new
        return list(found.values())

    def _term(self, reading: np.ndarray) -> _Term:
        model = self.model
        return _Term(
            reading,
            correlate(reading, self._values, model.orders, self._weight, self._count),
            float(np.sum(self._weight * np.abs(reading) ** 2)),
        )

    def _leaks_of(self, fault: Fault) -> list[tuple[float, _Term]]:
        """(leak area, what a leak at piston 0 adds to the reading)."""
        if fault.name not in self._leaks:
            areas = np.exp(np.linspace(*self.model.area_ends(fault), AREAS))
            self._leaks[fault.name] = [
                (float(a), self._term(self._response * self.model.leak_change(fault, float(a), 0)))
                for a in areas
            ]
        return self._leaks[fault.name]

    def _at_pitches(self, state, areas, pistons, gain, square: float) -> list[Candidate]:
        """The best shaft angle in each of the pistons' pitches."""
        turned = np.roll(gain, -self._start).reshape(self.model.pistons, ANGLES)
        best = np.argmax(turned, axis=1)
        return [
            Candidate(
                state,
                areas,
                pistons,
                2.0 * np.pi * (k * ANGLES + best[k] + self._start) / self._count,
                float(2.0 * turned[k, best[k]] - square),
            )
            for k in range(self.model.pistons)
        ]

    def _pitch(self, turn: float) -> int:
        return int((turn * self._count / (2.0 * np.pi) - self._start + 0.5) // ANGLES)


def _swapped(candidate: Candidate) -> Candidate:
    """The same with its faults in the other order."""
    c = candidate
    return replace(c, state=c.state[::-1], areas=c.areas[::-1], pistons=c.pistons[::-1])


def _sorted(candidates) -> list[Candidate]:
    return sorted(candidates, key=lambda c: -c.score)
