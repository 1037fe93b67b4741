"""Search of `explain` in stages: search, and search again with what the first search has shown.

The explained line gives a better modulation of the shaft, the ripple that is there, with which
nonlinear flows are calculated, the pressure at the pump, to which a simulated pump responds, and
the tolerances that the data sheet should have stated.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.ripple_correction import with_corrected_ripple
from rippletwin.case.model import Rig
from rippletwin.explanation.fit_jobs import FitJob, job_from, make_base, open_workers
from rippletwin.explanation.localise.phase_modulation import (
    estimate_phase_modulation,
    modulation_differs,
)
from rippletwin.explanation.localise.shaft_orders import ShaftOrders, analyse_shaft_orders
from rippletwin.explanation.search.sheet_tolerance import (
    estimate_tolerance_scale,
    fit_with_wider_tolerances,
    scale_tolerances,
    with_coordinates_of,
)
from rippletwin.explanation.search.stepwise_search import Search, resume_search, search_effects
from rippletwin.explanation.stages.preparation import HIGHEST_HZ, prepare_base
from rippletwin.explanation.thresholds import LITTLE_MODEL_ERROR
from rippletwin.spectra.observation import Observation
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.pump_line_coupling import couple_pump_to_line
from rippletwin.twin.twin import Twin

MAX_MODEL_ERROR_FOR_COUPLING = 10.0 * LITTLE_MODEL_ERROR
"""Relative model error above which pressure and flow at the pump are too uncertain."""
LIKELIER = 1.0  # log evidence that a step of the pump's response adds
NOTICED_CHANGE = 0.25  # of LITTLE_MODEL_ERROR: a change of the prediction that is fitted again
MAX_RESUMED = 2  # times
MAX_SETTLED = 4  # fits of one hypothesis, each with the ripple that the last one found

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Stage:
    """What is fitted: the base twin, the observations, and the modulation of their ripple."""

    base: Twin
    observations: list[Observation]
    modulation: ShaftOrders | None


def prepare_stage(rig: Rig, observations: Sequence[Observation]) -> Stage:
    """The first stage, with the modulation of the shaft by a line that is only calibrated."""
    modulation = estimate_phase_modulation(rig, observations, HIGHEST_HZ)
    return Stage(*prepare_base(rig, observations, modulation), modulation)


def fit_base_only(stage: Stage) -> Search:
    """The fitted base in place of a search."""
    with open_workers(stage.base, stage.observations, 1) as workers:
        (fit,) = workers.fit([FitJob(())])
    return Search(fit, [], fit)


def search_in_stages(
    stage: Stage,
    observations: Sequence[Observation],
    processes: int = 2,
    progress: Progress | None = None,
) -> tuple[Stage, Search]:
    """Search for effects in all stages: the last stage and its search.

    observations  with all shaft orders
    progress      gets what is being fitted, how many fits are done and how many there are
    """
    search = _search(stage, processes, progress)
    stage, search = _search_again(stage, search, observations, processes, progress)
    return _resume_search(stage, search, processes, progress)


def _search(stage: Stage, processes: int, progress: Progress | None) -> Search:
    """Stepwise selection of effects."""
    with open_workers(stage.base, stage.observations, processes) as workers:
        return search_effects(workers, progress)


def _search_again(
    stage: Stage,
    search: Search,
    observations: Sequence[Observation],
    processes: int,
    progress: Progress | None,
) -> tuple[Stage, Search]:
    """Search again if the explained line gives another phase modulation.

    `observations` have all shaft orders.
    """
    modulation = analyse_shaft_orders(search.best.twin, observations, HIGHEST_HZ)
    if not modulation_differs(modulation, stage.modulation, stage.observations):
        return stage, search
    base, data = prepare_base(stage.base.rig, observations, modulation)
    stage = Stage(base, data, modulation)
    return stage, _search(stage, processes, progress)


def _resume_search(
    stage: Stage, search: Search, processes: int, progress: Progress | None
) -> tuple[Stage, Search]:
    """Widen the data sheet's tolerances by what the fit shows, calculate what is nonlinear with the
    ripple that it shows, let a simulated pump respond to the line's pressure, and resume the
    search."""
    search, scale = _widen_tolerances(stage, search, processes)
    data = stage.observations
    for _ in range(MAX_RESUMED):
        base = make_base(scale_tolerances(stage.base.rig, scale), data)
        search = with_coordinates_of(search, base)
        settled, best = settle_ripple(base, data, search.best)
        if settled is data and scale == 1.0:
            break
        data = settled
        with open_workers(base, data, processes) as workers:
            search = resume_search(workers, replace(search, best=best), progress)
        stage = Stage(base, data, stage.modulation)
        scale = estimate_tolerance_scale(search.best)  # the response of the pump may have hidden it
        if scale == 1.0:
            break
    return stage, search


def settle_ripple(base: Twin, data: list[Observation], best: Fit) -> tuple[list, Fit]:
    """The data with the ripple that `best` finds in them, and `best` refitted: the pump's response
    and products of harmonics follow from the fit, and the fit from them.

    A step of the pump's response is kept where it makes the data likelier, by more than a fit that
    has not converged leaves open. The data are the same list where nothing changes.
    """
    best = _refit(base, data, best)
    if best.model_error >= MAX_MODEL_ERROR_FOR_COUPLING:
        return data, best
    for _ in range(MAX_SETTLED):
        coupled = couple_pump_to_line(best.twin, data)
        if coupled is None:
            break
        coupled = with_corrected_ripple(best, data, coupled)
        fit = _refit(base, coupled, best)
        undecided = max(fit.expected_gain, best.expected_gain)
        if fit.evidence < best.evidence + undecided + LIKELIER:
            break
        data, best = coupled, fit
    for _ in range(MAX_SETTLED):
        corrected = with_corrected_ripple(best, data, data)
        if not changes_prediction(best, data, corrected):
            break
        data, best = corrected, _refit(base, corrected, best)
    return data, best


def _refit(base: Twin, data: list[Observation], fit: Fit) -> Fit:
    with open_workers(base, data, 1) as workers:
        return workers.fit([job_from(fit)])[0]


def changes_prediction(fit: Fit, before: Sequence[Observation], after: Sequence) -> bool:
    """Whether a fit predicts other readings for the observations `after` than for those `before`,
    by more than a part of LITTLE_MODEL_ERROR."""
    old, new = (
        np.concatenate(ForwardModel(fit.twin, data)(fit.twin.theta), axis=1)
        for data in (before, after)
    )
    change = np.mean(np.abs(new - old) ** 2, axis=0) / np.mean(np.abs(old) ** 2, axis=0)
    return bool(np.sqrt(np.mean(change)) > NOTICED_CHANGE * LITTLE_MODEL_ERROR)


def _widen_tolerances(stage: Stage, search: Search, processes: int) -> tuple[Search, float]:
    """The search with the better fit that wider tolerances of the data sheet find, if any, and the
    factor on them."""
    with open_workers(stage.base, stage.observations, processes) as workers:
        better = fit_with_wider_tolerances(workers, search.best)
    if better is None:
        return search, 1.0
    factor = better.twin.rig.tolerance_scale / stage.base.rig.tolerance_scale
    return replace(search, best=better), factor * estimate_tolerance_scale(better)
