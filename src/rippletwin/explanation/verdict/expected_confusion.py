"""Which effects a case's recordings could tell apart, before anything is fitted.

For each effect in turn a twin at the data sheet's values with that effect is taken for the truth.
The effect is as strong as changes the ripple by CHANGE, a small change, so that first order holds.
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
from dataclasses import asdict, dataclass, replace

import numpy as np

from rippletwin.calibration.posterior import FIRST_SOURCE_SD, MIN_MODEL_ERROR, Posterior
from rippletwin.case.model import Rig
from rippletwin.explanation.search.stepwise_search import applicable_candidates
from rippletwin.explanation.thresholds import EQUIVALENT_LOG_BAYES_FACTOR, MIN_LOG_BAYES_FACTOR
from rippletwin.explanation.verdict.next_experiment import FLAT_VARIANCE
from rippletwin.spectra.observation import Observation
from rippletwin.twin.effects.base import Effect, Place
from rippletwin.twin.twin import Twin

CHANGE = 0.05  # relative, of the ripple
STRENGTHS = np.arange(-8.0, 2.5, 0.5)
"""Prior standard deviations from the median of an effect's size, of which that one is taken whose
change of the ripple is nearest to CHANGE. Beyond the last an effect is out of all proportion."""


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
    base = _Rival(rig, observations)
    rivals = [_Rival(rig, observations, e, base) for e in _one_place_each(rig, observations)]
    for done, truth in enumerate(rivals, 1):
        losses = {r.name: r.loss(truth.readings) for r in rivals if r is not truth}
        yield Discrimination(
            truth.name, truth.place, truth.change(base), base.loss(truth.readings), losses
        )
        if progress is not None:
            progress("effects", done, len(rivals))


def _one_place_each(rig: Rig, observations) -> list[tuple[Effect, Place]]:
    """Each effect once, at its first place or at that in the middle."""
    places: dict[str, list] = {}
    for effect, place in applicable_candidates(rig, observations):
        places.setdefault(effect.name, []).append((effect, place))
    return [each[len(each) // 2] for each in places.values()]


class _Rival:
    """A twin with an effect, or with none, and the data sheet's values of all else."""

    def __init__(self, rig: Rig, observations, effect=None, base=None):
        effects = () if effect is None else (effect,)
        self.name: str = "" if effect is None else effect[0].name
        self.place: str = "" if effect is None else str(effect[1])
        self.observations = list(observations)
        self.twin = Twin(rig, observations, effects=effects)
        flat = [parameter.flat for parameter in self.twin.parameters]
        self._scale = np.where(flat, np.sqrt(FLAT_VARIANCE), 1.0)
        self._set_strength(0.0)
        if base is not None:
            self._set_strength(min(STRENGTHS, key=lambda u: self._distance(u, base)))

    def _distance(self, strength: float, base: _Rival) -> float:
        """How far from CHANGE the effect is at a strength, in factors."""
        self._set_strength(strength)
        change = self.change(base)
        return abs(np.log(change / CHANGE)) if 0 < change < np.inf else np.inf

    def _set_strength(self, strength: float) -> None:
        theta = np.zeros(len(self.twin.parameters))
        for k, parameter in enumerate(self.twin.parameters):
            if self.name and parameter.name.startswith(f"{self.name}@"):
                theta[k] = _coordinate(parameter.prior, strength)
        self.twin = self.twin.with_(theta=theta)
        self.readings = self.twin.predict(self.observations)

    def change(self, base: _Rival) -> float:
        """Relative difference of the readings from those of `base`."""
        own, other = (np.concatenate(r.readings, axis=1) for r in (self, base))
        return float(np.linalg.norm(own - other) / np.linalg.norm(other))

    def loss(self, readings) -> float:
        """Log evidence that this twin is expected to lose where these are the readings."""
        seen = [replace(o, values=values) for o, values in zip(self.observations, readings)]
        posterior = Posterior(self.twin, seen)
        posterior.model_error = MIN_MODEL_ERROR
        nominal = any(o.source == "nominal" for o in seen)
        posterior.source_sd = FIRST_SOURCE_SD
        posterior.smooth_sd = FIRST_SOURCE_SD if nominal else 0.0
        theta = self.twin.theta
        r, jacobian = posterior.linearise(theta, posterior.predict(theta))
        count = 2 * posterior.values.size  # the rest are the residuals of the priors
        r, columns = r[:count], jacobian[:count] * self._scale
        projection = columns.T @ r
        absorbed = np.linalg.solve(np.eye(len(projection)) + columns.T @ columns, projection)
        return 0.5 * float(max(r @ r - projection @ absorbed, 0.0))


def _coordinate(prior, strength: float) -> float:
    """Coordinate of an effect's parameter at a strength; a prior about zero has no median size."""
    if prior.kind == "lognormal":
        return strength
    centred = prior.kind == "normal" and prior.centre == 0.0
    return float(np.exp(min(strength, 1.0))) if centred else 0.0


def in_words(found: Sequence[Discrimination]) -> list[str]:
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
