"""`explain`: from the healthy recordings of a case to what its twin lacks.

The steps of the method, each with the module that takes it:

 1. Observe: harmonics of every recording and of its halves       spectra.observation
 2. Find contradictions in the data                               checks.data_contradictions
 3. Prepare: phase modulation of the shaft, base twin             localise.phase_modulation
 4. Search: stepwise selection of effects                         search.stepwise_search
 5. Search again with the modulation by the explained line        localise.phase_modulation
 6. Couple the pump to the line and resume the search             twin.pump_line_coupling
 7. Judge the support of each effect, drop what has none          checks.support
 8. Find the intervals of the effects' parameters                 checks.profile_intervals
 9. Fit passive networks, which need no name                      search.passive_networks
10. Find swapped sensors and inverted signs                       checks.sensor_wiring
11. Read the alarms: misfit, pull, disagreement, drift            checks.alarms
12. Repeat the best fits with an unknown source                   localise.source_free_fits
13. Cross-validate the base and the explanation                   checks.cross_validation
14. Draw the null distribution of the evidence, if asked for      checks.bootstrap
15. Test the data sheet: prior sensitivity of accepted effects    checks.prior_sensitivity
16. Decide                                                        verdict.decision
17. Locate the mismatch and what remains, by free corrections     localise.free_corrections,
                                                                  localise.remainder
18. Analyse the shaft orders by the explained line                localise.shaft_orders

`verdict.verdict_file` writes the result.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

from threadpoolctl import threadpool_limits

from rippletwin.calibration.error_sizes import MIN_MODEL_ERROR
from rippletwin.case.model import Case, Recording, Rig
from rippletwin.errors import InputError
from rippletwin.explanation.checks.alarms import fit_each_observation, read_alarms
from rippletwin.explanation.checks.bootstrap import bootstrap_null
from rippletwin.explanation.checks.cross_validation import cross_validate
from rippletwin.explanation.checks.data_contradictions import find_contradictions
from rippletwin.explanation.checks.prior_sensitivity import (
    PriorSensitivity,
    compare_without_each_effect,
)
from rippletwin.explanation.checks.profile_intervals import add_profile_intervals
from rippletwin.explanation.checks.sensor_tolerance import add_sensor_tolerance
from rippletwin.explanation.checks.sensor_wiring import find_swapped_sensors
from rippletwin.explanation.checks.support import (
    Judged,
    judge_beside_network,
    judge_effects,
    withhold_what_is_in_doubt,
)
from rippletwin.explanation.fit_jobs import FitJob, PlainCalibration, open_workers
from rippletwin.explanation.localise.free_corrections import locate_mismatch
from rippletwin.explanation.localise.phase_modulation import (
    estimate_phase_modulation,
    modulation_differs,
    with_phase_modulation,
)
from rippletwin.explanation.localise.remainder import find_remainder
from rippletwin.explanation.localise.shaft_order_intervals import add_amplitude_intervals
from rippletwin.explanation.localise.shaft_orders import ShaftOrders, analyse_shaft_orders
from rippletwin.explanation.localise.source_free_fits import refit_source_free
from rippletwin.explanation.search.passive_networks import accepted_network, fit_passive_networks
from rippletwin.explanation.search.sheet_tolerance import (
    fit_with_wider_tolerances,
    scale_tolerances,
    tolerance_scale,
    with_coordinates_of,
)
from rippletwin.explanation.search.stepwise_search import Search, resume_search, search_effects
from rippletwin.explanation.verdict.decision import decide
from rippletwin.explanation.verdict.explanation import Explanation
from rippletwin.spectra.frequency_selection import select_fitted_frequencies
from rippletwin.spectra.observation import Observation, observe, revolutions_of
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.pump_line_coupling import couple_pump_to_line
from rippletwin.twin.twin import Twin

HIGHEST_HZ = 4000.0  # of the harmonics that are fitted
MAX_MODEL_ERROR_FOR_COUPLING = 10.0 * MIN_MODEL_ERROR
"""Relative model error above which pressure and flow at the pump are too uncertain."""
MAX_RESUMED = 2  # times

Progress = Callable[[str, int, int], None]


def explain(
    case: Case, processes: int = 2, progress: Progress | None = None, draws: int = 0
) -> Explanation:
    """Explain the healthy recordings of a case.

    progress  gets what is being fitted, how many fits are done and how many there are
    draws     recordings without an effect to draw for the threshold (`checks.bootstrap`); 0 for
              the default threshold

    Raises InputError if no recording is healthy.
    """
    if not case.healthy:
        raise InputError(
            case.folder / "rig.yaml",
            "recordings",
            "none has state: healthy",
            "explaining needs at least one healthy recording",
        )
    observations, early, late = _observe_all(case, processes)
    contradiction = find_contradictions(case.rig, case.healthy, observations, early, late)
    explanation = explain_observations(
        case.rig, observations, early, late, processes, progress, contradiction, draws
    )
    return replace(explanation, warnings=case.warnings)


def explain_observations(
    rig: Rig,
    observations: Sequence[Observation],
    early: Sequence[Observation] = (),
    late: Sequence[Observation] = (),
    processes: int = 2,
    progress: Progress | None = None,
    contradiction: str = "",
    draws: int = 0,
) -> Explanation:
    """Explain observations: steps 3 to 18.

    early, late    observations of the two halves of periodic recordings
    contradiction  why the data contradict themselves, if they do; then nothing is searched for
    """
    # Steps 3 to 6: search
    modulation = estimate_phase_modulation(rig, observations, HIGHEST_HZ)
    base, data = prepare_base(rig, observations, modulation)
    state = _State(base, data, modulation)
    if contradiction:
        search = _fit_base_only(state)
    else:
        search = _search(state, processes, progress)
        state, search = _search_again(state, search, observations, processes, progress)
        state, search = _resume_search(state, search, processes, progress)
    base, data = state.base, state.observations
    early, late = _select_fitted(early, rig, data), _select_fitted(late, rig, data)
    halves = (early[0], late[0]) if len(data) == 1 and late else None
    judged = Judged(search.best, (), ())
    with open_workers(base, data, processes) as workers:
        if not contradiction:
            # Steps 7 to 10: the best explanation and its competitors
            judged = judge_effects(workers, search.base, search.best, halves)
            judged = replace(judged, best=add_profile_intervals(workers, judged.best))
            networks = fit_passive_networks(workers, judged.best)
            search = replace(search, best=judged.best, passive_networks=networks)
            network = accepted_network(search)
            if network is not None and set(judged.best.hypothesis) <= set(network.hypothesis):
                network, judged = judge_beside_network(workers, search.base, network, judged)
                search = replace(search, best=judged.best, passive_networks=[network, *networks])
            contradiction = find_swapped_sensors(base, data, search)
        # Steps 11 to 14: checks
        point_fits = fit_each_observation(workers, search.base)
        alarms = read_alarms(search.base, data, point_fits, early, late, rig.delay)
        source_free_fits = refit_source_free(workers, search.leading_fits)
        explanation = accepted_network(search) or search.best
        calibrated = None
        if explanation.hypothesis:
            calibrated = workers.fit([FitJob((), PlainCalibration())])[0]
        validation = cross_validate(workers, search.base, explanation, halves, calibrated)
        null_distribution = None
        if draws and search.best.hypothesis:
            null_distribution = bootstrap_null(search.base, data, draws, processes, progress)
        # Steps 15 and 16: the data sheet, and the decision
        sensitivity: tuple[PriorSensitivity, ...] = ()
        if judged.supports:
            sensitivity = compare_without_each_effect(workers, search.best, judged.without)
            has_rivals = [each.rivals for each in sensitivity]
            judged = withhold_what_is_in_doubt(
                judged, explanation, validation.model_error, has_rivals
            )
        decision = decide(search, alarms, judged.supports, contradiction, null_distribution)
    accepted = add_sensor_tolerance(decision.accepted, data)
    decision = replace(decision, accepted=accepted)
    # Steps 17 and 18: where the mismatch is
    location = locate_mismatch(search.base, data)
    remainder = None if contradiction else find_remainder(decision.accepted, data)
    shaft_orders = add_amplitude_intervals(
        analyse_shaft_orders(decision.accepted.twin, observations, HIGHEST_HZ),
        decision.accepted,
        observations,
        HIGHEST_HZ,
    )
    return Explanation(
        rig=rig,
        observations=tuple(data),
        search=search,
        alarms=alarms,
        validation=validation,
        calibrated=calibrated,
        decision=decision,
        point_fits=tuple(point_fits),
        source_free_fits=tuple(source_free_fits),
        prior_sensitivity=sensitivity if decision.supports else (),
        shaft_orders=shaft_orders,
        location=location,
        remainder=remainder,
        null_distribution=null_distribution,
    )


@dataclass(frozen=True)
class _State:
    """What is fitted: the base twin, the observations, and the modulation of their ripple."""

    base: Twin
    observations: list[Observation]
    modulation: ShaftOrders | None


def _observe_all(case: Case, processes: int) -> tuple[list, list, list]:
    """Step 1: observations of the healthy recordings, and of their early and late halves."""
    # Threads suffice: most of the time goes to linear algebra on large arrays, which releases the
    # interpreter. Each uses one thread of its own.
    with threadpool_limits(1), ThreadPoolExecutor(max(processes, 1)) as pool:
        parts = list(pool.map(partial(observe_whole_and_halves, rig=case.rig), case.healthy))
    whole = [part[0] for part in parts]
    early, late = ([part[k] for part in parts if len(part) > 1] for k in (1, 2))
    return whole, early, late


def observe_whole_and_halves(recording: Recording, rig: Rig) -> list[Observation]:
    """The observation of a recording; for a periodic one also those of both halves."""
    if recording.kind != "periodic":
        return [observe(recording, rig, HIGHEST_HZ)]
    revolutions = revolutions_of(recording, rig)
    half = len(revolutions.windows) // 2
    parts = [
        replace(revolutions, windows=revolutions.windows[part], speed_hz=revolutions.speed_hz[part])
        for part in (slice(None), slice(0, half), slice(half, None))
    ]
    return [observe(recording, rig, HIGHEST_HZ, revolutions=part) for part in parts]


def prepare_base(
    rig: Rig, observations: Sequence[Observation], modulation: ShaftOrders | None = None
) -> tuple[Twin, list[Observation]]:
    """Step 3: the twin without effects, not yet fitted, and the observations as they are fitted.

    `modulation` is that of the shaft (`localise.phase_modulation`).
    """
    highest_hz = HIGHEST_HZ if observations[0].orders is not None else None
    data = select_fitted_frequencies(
        with_phase_modulation(observations, modulation), rig, highest_hz
    )
    base = Twin(rig, data, uncertain_pump=True, changing_state=True)
    # Simulate the pump before the worker processes start: the twin keeps the result.
    ForwardModel(base, data)
    return base, data


def _fit_base_only(state: _State) -> Search:
    """The fitted base in place of a search."""
    with open_workers(state.base, state.observations, 1) as workers:
        (fit,) = workers.fit([FitJob(())])
    return Search(fit, [], fit)


def _search(state: _State, processes: int, progress: Progress | None) -> Search:
    """Step 4: stepwise selection of effects."""
    with open_workers(state.base, state.observations, processes) as workers:
        return search_effects(workers, progress)


def _search_again(
    state: _State,
    search: Search,
    observations: Sequence[Observation],
    processes: int,
    progress: Progress | None,
) -> tuple[_State, Search]:
    """Step 5: search again if the explained line gives another phase modulation.

    `observations` have all shaft orders.
    """
    modulation = analyse_shaft_orders(search.best.twin, observations, HIGHEST_HZ)
    if not modulation_differs(modulation, state.modulation, state.observations):
        return state, search
    base, data = prepare_base(state.base.rig, observations, modulation)
    state = _State(base, data, modulation)
    return state, _search(state, processes, progress)


def _resume_search(
    state: _State, search: Search, processes: int, progress: Progress | None
) -> tuple[_State, Search]:
    """Step 6: let a simulated pump respond to the line's pressure, widen the data sheet's
    tolerances by what the fit shows, and resume the search."""
    coupled = None
    if search.best.model_error < MAX_MODEL_ERROR_FOR_COUPLING:
        coupled = couple_pump_to_line(search.best.twin, state.observations)
    search, scale = _widen_tolerances(state, search, processes)
    if coupled is None and scale == 1.0:
        return state, search
    data = coupled or state.observations
    for _ in range(MAX_RESUMED):
        rig = scale_tolerances(state.base.rig, scale)
        base = Twin(rig, data, uncertain_pump=True, changing_state=True)
        with open_workers(base, data, processes) as workers:
            search = resume_search(workers, with_coordinates_of(search, base), progress)
        state = _State(base, data, state.modulation)
        scale = tolerance_scale(search.best)  # the response of the pump may have hidden it
        if scale == 1.0:
            break
    return state, search


def _widen_tolerances(state: _State, search: Search, processes: int) -> tuple[Search, float]:
    """The search with its best explanation under wider tolerances of the data sheet, if they gain,
    and the factor on them."""
    with open_workers(state.base, state.observations, processes) as workers:
        wider = fit_with_wider_tolerances(workers, search.best)
    if wider is None:
        return search, 1.0
    factor = wider.twin.rig.tolerance_scale / state.base.rig.tolerance_scale
    return replace(search, best=wider), factor * tolerance_scale(wider)


def _select_fitted(
    halves: Sequence[Observation], rig: Rig, data: Sequence[Observation]
) -> list[Observation]:
    """The halves of recordings as the whole ones, `data`, are fitted."""
    whole = {o.label: o for o in data}
    fitted = [
        replace(
            half,
            flow_ripple=whole[half.label].flow_ripple,
            modulation=whole[half.label].modulation,
        )
        for half in halves
    ]
    return select_fitted_frequencies(fitted, rig, HIGHEST_HZ)
