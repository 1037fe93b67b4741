"""Which effects a case's recordings could tell apart, before anything is fitted.

For each effect in turn a twin at the data sheet's values with that effect is taken for the truth.
The effect is as strong as changes the ripple by CHANGE, a small change, so that first order holds;
some cannot be so weak.
Another effect, its parameters and the line's free to move within their priors, misses its readings
by r in whitened units and loses

    1/2 r^T (I + J J^T)^-1 r

of log evidence against it, with J the Jacobian in coordinates in which every prior has the variance
1 (MacKay 1992, Neural Computation 4:590, to first order in J; as in `next_experiment`). Without any
effect the same loss says whether the effect would be noticed at all. Noise, operating points,
frequencies and sensors are those of the recordings.

What is told apart by little here may be told apart by nothing: a stronger effect is followed by the
line's parameters further than to first order.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from functools import cached_property

import numpy as np

from rippletwin.calibration.posterior import Posterior
from rippletwin.calibration.reading_errors import FIRST_SOURCE_SD
from rippletwin.case.model import Rig
from rippletwin.explanation.search.stepwise_search import applicable_candidates
from rippletwin.explanation.thresholds import (
    EQUIVALENT_LOG_BAYES_FACTOR,
    LITTLE_MODEL_ERROR,
    MIN_LOG_BAYES_FACTOR,
)
from rippletwin.explanation.verdict.next_experiment import FLAT_VARIANCE
from rippletwin.spectra.observation import Observation
from rippletwin.twin.effects.base import Effect, Place
from rippletwin.twin.twin import Twin

CHANGE = 0.05  # relative, of the ripple
CHANGE_TOLERANCE = 0.01  # relative, of CHANGE
STRENGTHS = (-8.0, 2.0)
"""Least and largest size of an effect, in prior standard deviations from its median. Beyond the
last an effect is out of all proportion."""
FIRST_STRENGTHS = (-4.0, -3.0)  # of the search; most effects change a ripple by some per cent there
MAX_TRIALS = 8


@dataclass(frozen=True)
class Discrimination:
    """What the recordings can tell of one effect.

    effect, place   the one that is taken for the truth
    change          relative change of the ripple that it makes
    evidence        log evidence that the line without an effect is expected to lose
    losses          name -> log evidence that this other effect is expected to lose
    """

    effect: str
    place: str
    change: float
    evidence: float
    losses: dict[str, float]

    @property
    def noticed(self) -> bool:
        """Whether the recordings are expected to show that something is missing."""
        return self.evidence >= MIN_LOG_BAYES_FACTOR

    def as_dict(self) -> dict:
        """Plain data, with what is concluded of it."""
        return {**asdict(self), "noticed": self.noticed, "alike": list(self.alike)}

    @property
    def alike(self) -> tuple[str, ...]:
        """Effects that are expected to explain the recordings as well."""
        return tuple(n for n, loss in self.losses.items() if loss < EQUIVALENT_LOG_BAYES_FACTOR)


def expect_discriminations(
    rig: Rig,
    observations: Sequence[Observation],
    progress: Callable[[str, int, int], None] | None = None,
) -> Iterator[Discrimination]:
    """What the `observations` (at the frequencies that are fitted) can tell of each effect."""
    base = _Rival(Twin(rig, observations), observations)
    rivals = []
    for pair in _one_place_each(rig, observations):
        rivals.append(_Rival(base.twin.with_(effects=(pair,)), observations, base.amplitudes))
        rivals[-1].set_strength(base.readings)
    for done, truth in enumerate(rivals, 1):
        losses = {r.name: r.loss(truth.readings) for r in rivals if r is not truth}
        change = _relative_change(truth.readings, base.readings)
        yield Discrimination(truth.name, truth.place, change, base.loss(truth.readings), losses)
        if progress is not None:
            progress("effects", done, len(rivals))


def _one_place_each(rig: Rig, observations) -> list[tuple[Effect, Place]]:
    """Each effect once, at its first place or at that in the middle."""
    places: dict[str, list] = {}
    for effect, place in applicable_candidates(rig, observations):
        places.setdefault(effect.name, []).append((effect, place))
    return [each[len(each) // 2] for each in places.values()]


class _Rival:
    """A twin with an effect, or with none, and the data sheet's values of all else.

    amplitudes   (F,) of free sources over those that are predicted; None for those that the
                 recordings have
    """

    def __init__(self, twin: Twin, observations, amplitudes: np.ndarray | None = None):
        self.twin, self.name, self.place = twin, "", ""
        for effect, place in twin.effects:
            self.name, self.place = effect.name, str(place)
        self._posterior = Posterior(twin, observations)
        self._posterior.model_error = LITTLE_MODEL_ERROR
        self._posterior.source_sd = FIRST_SOURCE_SD
        nominal = any(o.source == "nominal" for o in observations)
        self._posterior.smooth_sd = FIRST_SOURCE_SD if nominal else 0.0
        flat = [parameter.flat for parameter in twin.parameters]
        self._scale = np.where(flat, np.sqrt(FLAT_VARIANCE), 1.0)
        self._theta = np.zeros(len(twin.parameters))
        self._predicted = self._posterior.predict(self._theta)
        if amplitudes is None:
            amplitudes = self._posterior.free_amplitudes(self._predicted)
        self.amplitudes = amplitudes

    @property
    def readings(self) -> np.ndarray:
        """What the sensors should read (S, F), as large as in the recordings."""
        return self.amplitudes * self._predicted

    def set_strength(self, base: np.ndarray) -> None:
        """Make the effect as strong as changes the readings from those of `base` (S, F) by CHANGE,
        or as nearly as it can.

        The logarithm of the change is nearly linear in the strength: secants find it.
        """
        trials: list[tuple[float, float]] = []  # (how far off in factors, strength)

        def miss(strength: float) -> float:
            self._predict_at(strength)
            change = _relative_change(self.readings, base)
            missed = float(np.log(change / CHANGE)) if 0 < change < np.inf else np.inf
            trials.append((abs(missed), strength))
            return missed

        a, b = FIRST_STRENGTHS
        at_a, at_b = miss(a), miss(b)
        while len(trials) < MAX_TRIALS and min(trials)[0] > CHANGE_TOLERANCE:
            if at_a == at_b or not np.isfinite([at_a, at_b]).all():
                break
            wanted = float(np.clip(b - at_b * (b - a) / (at_b - at_a), *STRENGTHS))
            if wanted == b:
                break
            a, at_a, b, at_b = b, at_b, wanted, miss(wanted)
        best = min(trials)[1]
        if best != trials[-1][1]:
            self._predict_at(best)

    def _predict_at(self, strength: float) -> None:
        for k, parameter in enumerate(self.twin.parameters):
            if parameter.name.startswith(f"{self.name}@"):
                self._theta[k] = _coordinate(parameter.prior, strength)
        self._predicted = self._posterior.predict(self._theta)

    @cached_property
    def _slopes(self) -> np.ndarray:
        return self._posterior.slopes(self._theta, self._predicted)

    def loss(self, readings: np.ndarray) -> float:
        """Log evidence that this twin is expected to lose where these (S, F) are the readings."""
        posterior = self._posterior.with_values(readings)
        r, columns = posterior.whiten_slopes(self._predicted, self._slopes)
        columns = columns * self._scale[:, None]
        projection = columns @ r
        absorbed = np.linalg.solve(np.eye(len(projection)) + columns @ columns.T, projection)
        return 0.5 * float(max(r @ r - projection @ absorbed, 0.0))


def _relative_change(readings: np.ndarray, base: np.ndarray) -> float:
    return float(np.linalg.norm(readings - base) / np.linalg.norm(base))


def _coordinate(prior, strength: float) -> float:
    """Coordinate of an effect's parameter at a strength; a prior about zero has no median size."""
    if prior.kind == "lognormal":
        return strength
    centred = prior.kind in ("normal", "bounded") and prior.centre == 0.0
    return float(np.exp(min(strength, 1.0))) if centred else 0.0


def describe_discriminations(found: Sequence[Discrimination]) -> list[str]:
    """Lines of text: what would go unnoticed, and what could not be told from what."""

    def plain(names) -> str:
        return ", ".join(name.replace("_", " ") for name in names) or "none"

    unnoticed = [d.effect for d in found if not d.noticed]
    lines = [
        f"expected of effects that change the ripple by {100 * CHANGE:.0f} %:",
        f"  noticed: {plain(d.effect for d in found if d.noticed)}",
        f"  not noticed, absorbed by the calibration: {plain(unnoticed)}",
    ]
    for d in found:
        others = [name for name in d.alike if name not in unnoticed]
        if d.noticed and others:
            lines.append(f"  {plain([d.effect])} cannot be told from: {plain(others)}")
    return lines
