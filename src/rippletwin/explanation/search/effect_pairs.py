"""Extensions by two effects at once, where neither adds enough evidence without the other.

Which two are missing follows from the residual before anything is fitted: to first order, all pairs
of effects are compared by what they leave of it together.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.posterior import Posterior
from rippletwin.calibration.score_test import ScoreTest
from rippletwin.explanation.fit_jobs import FitJob, FromTheta, NearFit, Workers, rank_by_evidence
from rippletwin.explanation.fit_starts import transfer_theta
from rippletwin.explanation.search.stepwise_moves import additions, extension_job
from rippletwin.explanation.thresholds import MIN_LOG_BAYES_FACTOR
from rippletwin.twin.effects.base import Effect, Place
from rippletwin.twin.twin import Twin

PAIRS_FITTED, PAIRS_OF_ONE = 6, 2  # at most: in all, and with the same effect
MIN_PAIR_PROMISE = MIN_LOG_BAYES_FACTOR  # of a pair that is fitted: half of what it must add
TINY = 1e-300  # size of a change that is none
LEAST_SHARE = 1e-3  # of a direction that is none of the others'


@dataclass(frozen=True, eq=False)
class Start:
    """A start of one more effect beside a fit, and what the effect can do from there.

    member      the effect and its place
    own         (K,) coordinates of the effect's parameters
    directions  (N, D) orthonormal: changes of the whitened readings, the rest refitted
    score       (D,) what of the residual is along each
    """

    member: tuple[Effect, Place]
    own: np.ndarray
    directions: np.ndarray
    score: np.ndarray


def fit_best_pairs(workers: Workers, best: Fit, candidates: Sequence) -> list[Fit]:
    """Fits of `best` with two more of `candidates`, those pairs that promise most, best first."""
    rig = workers.base.rig
    jobs = [extension_job(best, c) for c in additions(rig, best.hypothesis, candidates)]
    # A candidate that takes the place of a form of itself has another fit beside it.
    jobs = [job for job in jobs if job.hypothesis[:-1] == best.hypothesis]
    starts = [start for found in workers.map(score_starts, jobs) for start in found]
    pairs: list[FitJob] = []
    for one, other in _most_promising(starts):
        effect, place = other.member
        hypothesis = (*best.hypothesis, one.member)
        joined = additions(rig, hypothesis, [(effect, replace(place, number=1))])
        if not joined:
            continue
        hypothesis = (*hypothesis, *joined)
        theta = transfer_theta(best, hypothesis, workers.base)
        theta[len(theta) - len(one.own) - len(other.own) :] = [*one.own, *other.own]
        pairs.append(FitJob(hypothesis, FromTheta(theta, exact=False)))
    return rank_by_evidence(workers.fit(pairs))


def score_starts(base: Twin, observations: Sequence, job: FitJob) -> list[Start]:
    """The starts of the newest effect of a job that starts near a fit; for `Workers.map`."""
    posterior = Posterior(base.with_(effects=job.hypothesis), observations, None, job.source_free)
    assert isinstance(job.start, NearFit)
    test = ScoreTest(base, posterior, job.start.all_thetas(base, job.hypothesis, observations))
    starts = []
    for k, theta in enumerate(test.starts):
        columns = test.directions(k)
        columns = columns / np.maximum(np.linalg.norm(columns, axis=0), TINY)
        left, sizes, _ = np.linalg.svd(columns, full_matrices=False)
        directions = left[:, sizes > LEAST_SHARE]
        own = theta[test.count_without :]
        starts.append(Start(job.hypothesis[-1], own, directions, directions.T @ test.residual))
    return starts


def _most_promising(starts: Sequence[Start]) -> list[tuple[Start, Start]]:
    """The pairs of `starts` to fit: those first whose directions together hold most
    of the residual.

    Each pair of effects is fitted once, from its best starts, and each effect in PAIRS_OF_ONE at
    most: where one effect promises much, all pairs with it do.
    """
    promises = [(_promise(*pair), pair) for pair in combinations(starts, 2)]
    chosen: dict[frozenset, tuple[Start, Start]] = {}
    for promise, pair in sorted(promises, key=lambda each: -each[0]):
        members = frozenset(start.member for start in pair)
        uses = max(sum(member in other for other in chosen) for member in members)
        if promise < MIN_PAIR_PROMISE or len(chosen) == PAIRS_FITTED:
            break
        if members not in chosen and uses < PAIRS_OF_ONE:
            chosen[members] = pair
    return list(chosen.values())


def _promise(one: Start, other: Start) -> float:
    """Log evidence that two effects add together at most, to first order: half the square of the
    residual along the directions of both."""
    shared = one.directions.T @ other.directions
    rest = other.score - shared.T @ one.score
    sizes, axes = np.linalg.eigh(np.eye(len(rest)) - shared.T @ shared)
    new = sizes > LEAST_SHARE
    return 0.5 * float(one.score @ one.score + np.sum((axes[:, new].T @ rest) ** 2 / sizes[new]))
