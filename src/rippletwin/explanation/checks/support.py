"""How well each accepted effect is supported: established, supported or suggested.

suggested     The search accepted it.
supported     It also keeps its evidence with a free data sheet, and predicts held-out data better.
established   It also keeps its evidence beside a free correction of any other element, with a free
              correction at its own place its law is not needless, its parameters are plausible, and
              they are the same without any part of the data.

Effects are judged one by one: the others stay in both models.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.laplace import UNCONVERGED_GAIN
from rippletwin.explanation.checks.alarms import largest_pull
from rippletwin.explanation.checks.cross_validation import (
    Disagreement,
    Fold,
    Halves,
    find_disagreement,
    make_folds,
    predict_held_out,
)
from rippletwin.explanation.checks.prior_sensitivity import WithoutEffect, fit_without_each_effect
from rippletwin.explanation.checks.robustness import Robustness, compare_beside_corrections
from rippletwin.explanation.fit_jobs import FitJob, FromTheta, Workers, job_without_effect
from rippletwin.explanation.fit_starts import transfer_theta
from rippletwin.explanation.localise.elements import (
    NONE,
    elements_of,
    own_element,
    position_spacing,
)
from rippletwin.explanation.localise.smooth_corrections import SmoothCorrections
from rippletwin.explanation.search.stepwise_moves import extension_job
from rippletwin.explanation.thresholds import (
    MAX_DISAGREEMENT,
    MIN_LOG_BAYES_FACTOR,
    MUCH_MODEL_ERROR,
    PULL_ALARM,
)


@dataclass(frozen=True)
class Support:
    """What supports one accepted effect.

    name, place   of the effect
    level         "suggested", "supported" or "established"
    robustness    its log Bayes factors beside free corrections
    held_out      log predictive probability of held-out data that it adds, over all folds
    pull          prior standard deviations between its parameters and their medians, at most
    disagreement  the largest of its parameters between a part of the data and all data; None where
                  nothing can be compared
    """

    name: str
    place: str
    level: str
    robustness: Robustness
    held_out: float
    pull: float
    disagreement: Disagreement | None = None

    @property
    def contradicts_its_law(self) -> bool:
        """Whether parts of the data give it different values, which its law says are the same."""
        return _deviations(self.disagreement) > MAX_DISAGREEMENT


@dataclass(frozen=True)
class Judged:
    """A fit, the support of each of its effects, and the fits without each, in the same order."""

    best: Fit
    supports: tuple[Support, ...]
    without: tuple[WithoutEffect, ...]


def judge_effects(workers: Workers, base: Fit, best: Fit, halves: Halves | None = None) -> Judged:
    """`best` without the effects that only the search suggests, and what supports the others.

    A suggested effect is dropped only if another is left: the last one says what comes nearest.
    An always-present effect stays.
    """
    while True:
        without = fit_without_each_effect(workers, base, best)
        supports = _judge_each(workers, best, without, halves)
        weak = [
            k
            for k, support in enumerate(supports)
            if support.level == "suggested" and not _is_certain(best, k)
        ]
        if not weak or len(best.hypothesis) == 1:
            return Judged(best, supports, without)
        weakest = min(weak, key=lambda k: supports[k].robustness.plain)
        best = without[weakest].stated


def judge_beside_piece(
    workers: Workers, base: Fit, pieced: Fit, halves: Halves | None = None
) -> Judged:
    """`judge_effects` of the named effects of `pieced`, whose newest effect is a passive network,
    with that in all models: without it they would answer for what it explains."""
    judged, piece = judge_effects(workers, base, pieced, halves), pieced.hypothesis[-1]
    if piece not in judged.best.hypothesis:
        return judged
    k = judged.best.hypothesis.index(piece)
    named = judged.without[k].stated
    supports = judged.supports[:k] + judged.supports[k + 1 :]
    return Judged(named, supports, fit_without_each_effect(workers, base, named))


def judge_beside_network(
    workers: Workers, base: Fit, network: Fit, judged: Judged
) -> tuple[Fit, Judged]:
    """The fit with a passive network that stands in for what remains, and the effects beside it.

    What is not there may fit a part of what the network stands for. Each effect is therefore left
    out beside the network, and beside one that is begun anew without it. An effect that the network
    makes needless is dropped, but an always-present one; it is established only if it keeps its
    evidence.
    """
    while True:
        fits = _fit_without_beside(workers, network, judged)
        gains = [
            np.inf if _is_certain(judged.best, k) else network.evidence - fit.evidence
            for k, fit in enumerate(fits)
        ]
        if min(gains, default=0.0) >= 0.0:
            break
        k = int(np.argmin(gains))
        network, best = fits[k], judged.without[k].stated
        supports = judged.supports[:k] + judged.supports[k + 1 :]
        judged = Judged(best, supports, fit_without_each_effect(workers, base, best))
    supports = tuple(
        replace(support, level="supported")
        if support.level == "established" and gain < MIN_LOG_BAYES_FACTOR
        else support
        for support, gain in zip(judged.supports, gains)
    )
    return network, replace(judged, supports=supports)


def withhold_what_is_in_doubt(
    judged: Judged, explanation: Fit, held_out_error: float, has_rivals: Sequence[bool]
) -> Judged:
    """Supports that are no more than `supported` where the `explanation` gives reason to doubt.

    The explanation has a network if one stands in. An effect is in doubt

    * whose own parameters are not plausible in the explanation: a network moves them,
    * where the explanation leaves much or did not converge, but a usual effect,
    * that has a rival in the data sheet, where the line's parameters are biased by physics that is
      left out: one contradicts the sheet, or held-out data leave much; but a usual effect.

    held_out_error   model error, relative, of the explanation on data that were left out
    has_rivals       of each effect, whether other values of the data sheet do nearly as well
    """
    leaves_much = explanation.model_error > MUCH_MODEL_ERROR
    converged = explanation.expected_gain <= UNCONVERGED_GAIN  # else its evidence is not known
    biased = largest_pull(explanation)[0] > PULL_ALARM or held_out_error > MUCH_MODEL_ERROR
    rig = judged.best.twin.rig
    supports = []
    for support, (effect, place), has_rival in zip(
        judged.supports, judged.best.hypothesis, has_rivals, strict=True
    ):
        is_doubtful_line = leaves_much or not converged or (biased and has_rival)
        in_doubt = is_doubtful_line and not effect.usual(rig, place)
        if _pull_of_effect(explanation, f"{effect.name}@{place}.") > PULL_ALARM:
            in_doubt = True
        if in_doubt and support.level == "established":
            support = replace(support, level="supported")
        supports.append(support)
    return replace(judged, supports=tuple(supports))


def _is_certain(fit: Fit, k: int) -> bool:
    """Whether effect k of a fit is always present in its rig."""
    effect, place = fit.hypothesis[k]
    return effect.certain(fit.twin.rig, place)


def _fit_without_beside(workers: Workers, network: Fit, judged: Judged) -> list[Fit]:
    """The fits with the network and without each effect of `judged.best`, in its order."""
    places = [member for member in network.hypothesis if not member[0].named]
    jobs = [
        job_without_effect(network, network.hypothesis.index(effect), workers.base)
        for effect in judged.best.hypothesis
    ]
    if len(places) == 1:
        jobs += [extension_job(each.stated, places[0]) for each in judged.without]
    fits, count = workers.fit(jobs), len(judged.best.hypothesis)
    return [max(fits[k::count], key=lambda fit: fit.evidence) for k in range(count)]


def _judge_each(
    workers: Workers, best: Fit, without: Sequence[WithoutEffect], halves: Halves | None
) -> tuple[Support, ...]:
    """`Support` of every effect of `best`."""
    folds = make_folds(workers, halves)
    held_out, disagreements = _check_on_folds(best, without, folds)
    rig, values = best.twin.rig, best.twin.effect_values(best.twin.theta)
    owns = [own_element(effect, place, value, rig) for effect, place, value in values]
    elements = elements_of(rig, workers.observations, owns)
    jobs = []
    for each in without:
        start = transfer_theta(best, each.stated.hypothesis, workers.base)
        jobs.append((((each.stated, None), (each.stated, start)), each.wide, elements))
    absent = workers.map(evaluate_without, jobs)
    tried = list(dict.fromkeys(e for tables in absent for table in tables for e in table))
    one, other = workers.map(evaluate_corrections, [(best, tried[k::2]) for k in range(2)])
    present = one | other
    frequency_hz = np.concatenate([o.frequency_hz for o in workers.observations])
    spacing = position_spacing(rig, frequency_hz)
    supports = []
    for k, (effect, place) in enumerate(best.hypothesis):
        robustness = compare_beside_corrections(present, absent[k], owns[k], spacing)
        pull = _pull_of_effect(best, f"{effect.name}@{place}.")
        differs = disagreements[k]
        level = support_level(robustness, held_out[k], pull, _deviations(differs))
        support = Support(effect.name, str(place), level, robustness, held_out[k], pull, differs)
        supports.append(support)
    return tuple(supports)


def _pull_of_effect(fit: Fit, label: str) -> float:
    """Largest |coordinate| of the parameters of one effect; a position has no pull."""
    pulls = [
        abs(float(u))
        for p, u in zip(fit.twin.parameters, fit.twin.theta)
        if p.name.startswith(label) and p.prior.kind != "uniform"
    ]
    return max(pulls, default=0.0)


def evaluate_corrections(base, observations: Sequence, job: tuple) -> dict[tuple, float]:
    """Log evidence of a model with a correction of each element; `job` is (fit, elements), for
    `Workers.map`."""
    fit, elements = job
    return SmoothCorrections(fit, observations).by_element(elements)


def evaluate_without(base, observations: Sequence, job: tuple) -> list[dict[tuple, float]]:
    """Log evidence of the models without an effect, with a correction of each element; for
    `Workers.map`.

    `job` is (models, wide, elements): pairs (fit, theta or None), which also get corrections at the
    positions that promise most in any of them, and the fit with wide priors, without a correction.
    """
    models, wide, elements = job
    corrections = [SmoothCorrections(fit, observations, theta) for fit, theta in models]
    positions = [e for each in corrections for e in each.promising_positions()]
    tried = list(dict.fromkeys([*elements, *positions]))
    tables = [each.by_element(tried) for each in corrections]
    return [*tables, SmoothCorrections(wide, observations).by_element([(NONE, None)])]


def support_level(
    robustness: Robustness, held_out: float, pull: float, deviations: float = 0.0
) -> str:
    """Level of an effect with these results of the checks.

    robustness   its log Bayes factors beside free corrections
    held_out     log predictive probability of held-out data that it adds
    pull         of its parameters, prior standard deviations
    deviations   standard deviations between its parameters from parts of the data and from all
    """
    if robustness.plain < MIN_LOG_BAYES_FACTOR or held_out <= 0.0:
        return "suggested"
    survives = robustness.least >= MIN_LOG_BAYES_FACTOR and robustness.own >= 0.0
    plausible = pull <= PULL_ALARM and deviations <= MAX_DISAGREEMENT
    return "established" if survives and plausible else "supported"


def _deviations(disagreement: Disagreement | None) -> float:
    return 0.0 if disagreement is None else disagreement.deviations


def _check_on_folds(
    best: Fit, without: Sequence[WithoutEffect], folds: Sequence[Fold]
) -> tuple[list[float], list[Disagreement | None]]:
    """Of each effect of `best`: the log predictive probability of the held-out data that it adds,
    over all folds, and the largest disagreement of its parameters between a fold and all data."""
    gains, parts = np.zeros(len(without)), []
    for fold in folds:
        jobs = [
            FitJob(f.hypothesis, FromTheta(f.twin.theta, exact=False), observations=fold.indices)
            for f in (best, *(each.stated for each in without))
        ]
        fits = fold.workers.fit(jobs)
        present, *absent = (_log_predictive(fit, fold.held_out) for fit in fits)
        gains += present - np.array(absent)
        parts.append((fits[0], fold.left_out))
    labels = [f"{effect.name}@{place}." for effect, place in best.hypothesis]
    return list(map(float, gains)), [find_disagreement(best, parts, label) for label in labels]


def _log_predictive(fit: Fit, observations: Sequence) -> float:
    """Log probability of observations under a fit to others."""
    posterior, theta = predict_held_out(fit, observations)
    r, log_determinant = posterior.whitened(posterior.predict(theta))
    return -float(np.sum(np.abs(r) ** 2)) - log_determinant
