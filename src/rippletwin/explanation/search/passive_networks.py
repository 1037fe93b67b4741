"""Passive networks without a name, which stand in for physics that the library does not have.

A network is a shunt, a series element or a short piece of another pipe, at a free place. It is
added to the best explanation. Where that leaves the line badly fitted, the named effects may have
biased its parameters: the network is then fitted anew as well, along the whole line and beside the
usual effects only. Where no network fits the line, it may be in a wrong local mode: the best are
fitted again from starts about their places. Several networks may stand in together.
"""

from __future__ import annotations

from rippletwin.calibration.fit import Fit
from rippletwin.explanation.fit_jobs import (
    Continuation,
    FitJob,
    FromTheta,
    Workers,
    rank_by_evidence,
    score_extension,
)
from rippletwin.explanation.fit_starts import transfer_theta
from rippletwin.explanation.search.single_effects import refined_starts
from rippletwin.explanation.search.stepwise_moves import (
    MIN_PROMISE,
    WRONG_MODE_MODEL_ERROR,
    extension_job,
)
from rippletwin.explanation.search.stepwise_search import Search
from rippletwin.explanation.thresholds import (
    EQUIVALENT_LOG_BAYES_FACTOR,
    GOOD_MODEL_ERROR,
    MIN_LOG_BAYES_FACTOR,
    leaves_nothing,
)
from rippletwin.twin.effects import library

WRONG_MODE_FITS = 3  # of the best fits: those in wrong local modes are fitted again
MAX_NETWORKS = 3  # in one line


def fit_passive_networks(workers: Workers, best: Fit, known: Fit | None = None) -> list[Fit]:
    """Fits of passive networks alone and added to `best`, best first; none where `best` leaves
    nothing that a network could explain, or no network promises anything.

    known   a fit whose newest effect is a network that explains the data beside others: one more
            start
    """
    if leaves_nothing(best):
        return []
    networks = library.candidates(workers.base.rig, named=False)
    jobs = [extension_job(best, network) for network in networks]
    if best.model_error <= GOOD_MODEL_ERROR:  # only the ripple errs, and the pump may make that
        scored = workers.map(score_extension, jobs)
        jobs = [job for promise, job in scored if promise >= MIN_PROMISE]
        if not jobs:
            return []
    if known is not None:
        hypothesis = (*best.hypothesis, known.hypothesis[-1])
        theta = transfer_theta(known, hypothesis, workers.base)
        jobs.append(FitJob(hypothesis, FromTheta(theta)))
    fits = workers.fit(jobs)
    if not best.hypothesis or min(f.model_error for f in fits) > GOOD_MODEL_ERROR:
        # Named effects may have biased the parameters of the line.
        usual = tuple(
            member for member in best.hypothesis if member[0].usual(best.twin.rig, member[1])
        )
        fits += workers.fit([FitJob((*usual, network)) for network in networks])
    fits = rank_by_evidence(fits)
    fits = _refit_from_wrong_mode(workers, best, fits)
    if not fits or fits[0].evidence <= best.evidence + MIN_LOG_BAYES_FACTOR:
        return fits
    return [*_with_further_networks(workers, fits[0], networks), *fits]


def _refit_from_wrong_mode(workers: Workers, best: Fit, fits: list[Fit]) -> list[Fit]:
    """`fits` and, where the first may be in a wrong local mode, refits about their places.

    A line in a wrong local mode leaves to the pump what it cannot fit: its model error is large, or
    the error of the ripple is larger than without networks.
    """

    def is_in_wrong_mode(fit: Fit) -> bool:
        ripple = fit.source_sd if fit.source_sd > best.source_sd else 0.0
        return max(fit.model_error, ripple) > WRONG_MODE_MODEL_ERROR

    wrong = [fit for fit in fits[:WRONG_MODE_FITS] if is_in_wrong_mode(fit)]
    if not wrong or wrong[0] is not fits[0]:
        return fits
    rig = workers.base.rig
    jobs = [FitJob(f.hypothesis, Continuation(tuple(refined_starts(rig, f)))) for f in wrong]
    return rank_by_evidence([*fits, *workers.fit(jobs)])


def _with_further_networks(workers: Workers, leading: Fit, networks: list) -> list[Fit]:
    """Fits with more networks than `leading`, best first, while each adds enough evidence."""
    found: list[Fit] = []
    while leading.model_error > GOOD_MODEL_ERROR and _count(leading) < MAX_NETWORKS:
        jobs = [
            extension_job(leading, another)
            for network in networks
            if (another := library.next_instance(network, leading.hypothesis)) is not None
        ]
        more = rank_by_evidence(workers.fit(jobs))[0]
        if more.evidence <= leading.evidence + MIN_LOG_BAYES_FACTOR:
            break
        found, leading = [more, *found], more
    return found


def _count(fit: Fit) -> int:
    return sum(not effect.named for effect, _ in fit.hypothesis)


def accepted_network(search: Search) -> Fit | None:
    """The best passive network, if it has so much more evidence than the best hypothesis of named
    effects that it stands in for what remains."""
    best, network = search.best, next(iter(search.passive_networks), None)
    needed = EQUIVALENT_LOG_BAYES_FACTOR if best.hypothesis else MIN_LOG_BAYES_FACTOR
    if network is None or network.evidence <= best.evidence + needed:
        return None
    return network
