"""Passive networks without a name, which stand in for physics that the library does not have."""

from __future__ import annotations

from rippletwin.calibration.fit import Fit
from rippletwin.explanation.fit_jobs import FitJob, Workers, rank_by_evidence
from rippletwin.explanation.search.stepwise_moves import extension_job
from rippletwin.explanation.search.stepwise_search import Search
from rippletwin.explanation.thresholds import GOOD_MODEL_ERROR
from rippletwin.twin.effects import library


def fit_passive_networks(workers: Workers, best: Fit) -> list[Fit]:
    """Fits of a passive network alone and added to `best`, best first; none where `best` is good.

    A good fit leaves nothing that a network could explain.
    """
    if best.model_error <= GOOD_MODEL_ERROR:
        return []
    rig = workers.base.rig
    networks = library.candidates(rig, named=False)
    jobs = [extension_job(best, network) for network in networks]
    if not best.hypothesis:
        jobs += [FitJob((network,)) for network in networks]
    return rank_by_evidence(workers.fit(jobs))


def best_explanation(search: Search) -> Fit:
    """The best hypothesis of named effects, or a passive network where that has more evidence."""
    networks, best = search.passive_networks, search.best
    if networks and networks[0].evidence > best.evidence and best.model_error > GOOD_MODEL_ERROR:
        return networks[0]
    return best
