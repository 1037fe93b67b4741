"""Search over local modes along the position of an accepted effect.

The posterior of a position has about one local mode per half wavelength along the line. The
stepwise search may end in a wrong one, because the effect was added to a line whose parameters were
biased by its absence. With few sensors several positions may fit equally well.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.explanation.fit_jobs import FitJob, FromTheta, Workers, job_from, rank_by_evidence
from rippletwin.explanation.fit_starts import transfer_theta
from rippletwin.explanation.search.stepwise_moves import MIN_IMPROVEMENT
from rippletwin.explanation.thresholds import EQUIVALENT_LOG_BAYES_FACTOR
from rippletwin.twin.effects.base import Effect, Place

STARTS_PER_WAVELENGTH = 2  # on the shortest wavelength, which has about as many local modes
ROUGH_MARGIN = 20.0
"""Log evidence below the best within which a start is followed to its mode after a few steps."""
MIN_DISTANCE_IN_WAVELENGTHS = 0.25  # of the shortest wavelength, between two distinct positions


def move_to_best_position(workers: Workers, best: Fit) -> tuple[Fit, list[Fit]]:
    """The fit with the best positions, and the equivalent fits at other positions, best first.

    Equivalent are those within EQUIVALENT_LOG_BAYES_FACTOR of it.
    """
    others = fit_other_positions(workers, best)
    if others and others[0].evidence > best.evidence + MIN_IMPROVEMENT:
        return move_to_best_position(workers, others[0])
    return best, [f for f in others if f.evidence > best.evidence - EQUIVALENT_LOG_BAYES_FACTOR]


def fit_other_positions(workers: Workers, best: Fit) -> list[Fit]:
    """Fits with one effect started at STARTS_PER_WAVELENGTH positions a wavelength along the line,
    best first.

    The list has neither `best` nor two fits at the same positions. It is empty for a line with
    nonlinear compliance, where each fit would take long.
    """
    if best.has_nonlinear_compliance:
        return []
    highest_hz = max(o.frequency_hz[-1] for o in workers.observations)
    wavelengths = best.twin.rig.delay * highest_hz  # on the line
    count = int(np.ceil(STARTS_PER_WAVELENGTH * wavelengths))
    min_distance = MIN_DISTANCE_IN_WAVELENGTHS * best.twin.rig.length / wavelengths
    jobs = []
    for k, (effect, place) in enumerate(best.hypothesis):
        if place.element != "position":
            continue
        hypothesis = (*best.without(k), (effect, place))
        name = f"{effect.name}@{place}.position"
        index = workers.base.with_(effects=hypothesis).index[name]
        start = transfer_theta(best, hypothesis, workers.base)
        prior = best.twin.parameters[best.twin.index[name]].prior
        for share in (np.arange(count) + 0.5) / count:
            theta = start.copy()
            theta[index] = prior.coordinate(prior.centre + prior.scale * share)
            jobs.append(FitJob(hypothesis, FromTheta(theta, exact=False, rough=True)))
    rough = [f for f in workers.fit(jobs) if f.evidence > best.evidence - ROUGH_MARGIN]
    distinct, known = [], [_sorted_positions(best)]
    for fit in rank_by_evidence(workers.fit([job_from(f, exact=False) for f in rough])):
        positions = _sorted_positions(fit)
        if all(np.max(np.abs(positions - others)) > min_distance for others in known):
            known.append(positions)
            distinct.append(fit)
    return distinct


def positions_of_effects(fit: Fit) -> dict[str, float]:
    """Fitted positions (m) of the effects that may be anywhere, by the effect's label."""
    values = fit.twin.values()
    return {
        _label(effect, place): values[f"{_label(effect, place)}.position"]
        for effect, place in fit.hypothesis
        if place.element == "position"
    }


def _label(effect: Effect, place: Place) -> str:
    return f"{effect.name}@{place}"


def _sorted_positions(fit: Fit) -> np.ndarray:
    """The same (n,), effect by effect; of several of one effect in their order along the line."""
    positions = positions_of_effects(fit)
    ordered = sorted((label.split("@")[0], x) for label, x in positions.items())
    return np.array([x for _, x in ordered])


def equivalent_positions(best: Fit, others: Sequence[Fit]) -> tuple[tuple[str, ...], ...]:
    """For each effect that `others` have elsewhere than `best`: its positions, "name at x m"."""
    classes = []
    for label, x in positions_of_effects(best).items() if others else ():
        moved = [f for f in others if _label(*f.hypothesis[-1]) == label]
        if moved:
            positions = sorted([x, *(positions_of_effects(f)[label] for f in moved)])
            name = label.split("@")[0]
            classes.append(tuple(f"{name} at {x:.2f} m" for x in positions))
    return tuple(classes)
