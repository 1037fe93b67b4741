"""`explain`: from the healthy recordings of a case to what its twin lacks.

The steps of the method, each with the module that takes it:

 1. Observe: harmonics of every recording and of its halves       stages.preparation
 2. Find contradictions in the data                               checks.data_contradictions
 3. Prepare: phase modulation of the shaft, base twin             stages.preparation
 4. Search: stepwise selection of effects                         search.stepwise_search
 5. Search again with the modulation by the explained line        stages.staged_search
 6. Couple the pump to the line and resume the search             stages.staged_search
 7. Take volumes side by side for one stretch of pipe             search.neighbouring_lumps
 8. Judge the support of each effect, drop what has none          checks.support
 9. Fit passive networks, which need no name                      search.passive_networks
10. Judge the effects beside a network that stands in             checks.support
11. Find the intervals of the effects' parameters, with those of
    a network that stands in                                      checks.profile_intervals
12. Fit gas in place of volumes of liquid                         search.gas_rivals
13. Find swapped sensors and inverted signs                       checks.sensor_wiring
14. Read the alarms: misfit, pull, disagreement, drift            checks.alarms
15. Repeat the best fits with an unknown source                   localise.source_free_fits
16. Cross-validate the base and the explanation                   checks.cross_validation
17. Draw the null distribution of the evidence, if asked for      checks.bootstrap
18. Test the data sheet: prior sensitivity of accepted effects    checks.prior_sensitivity
19. Withhold a name from what is in doubt                         checks.support
20. Decide; cross-validate the line alone if that is accepted     verdict.decision,
                                                                  checks.cross_validation
21. Add the tolerances of the sensors to the intervals            checks.sensor_tolerance
22. Locate the mismatch and what remains, by free corrections     localise.free_corrections,
                                                                  localise.remainder
23. Analyse the shaft orders by the explained line                localise.shaft_orders,
                                                                  localise.shaft_order_intervals

`verdict.verdict_file` writes the result.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from threadpoolctl import threadpool_limits

from rippletwin.calibration.fit import Fit
from rippletwin.case.model import Case, Rig
from rippletwin.errors import InputError
from rippletwin.explanation.checks.alarms import fit_each_observation, read_alarms
from rippletwin.explanation.checks.bootstrap import bootstrap_null, check_draws
from rippletwin.explanation.checks.cross_validation import Halves, cross_validate
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
    judge_beside_piece,
    judge_effects,
    withhold_what_is_in_doubt,
)
from rippletwin.explanation.fit_jobs import FitJob, PlainCalibration, Workers, open_workers
from rippletwin.explanation.localise.free_corrections import locate_mismatch
from rippletwin.explanation.localise.remainder import find_remainder
from rippletwin.explanation.localise.shaft_order_intervals import add_amplitude_intervals
from rippletwin.explanation.localise.shaft_orders import analyse_shaft_orders
from rippletwin.explanation.localise.source_free_fits import refit_source_free
from rippletwin.explanation.search.gas_rivals import fit_gas_rivals
from rippletwin.explanation.search.neighbouring_lumps import merge_neighbours
from rippletwin.explanation.search.passive_networks import accepted_network, fit_passive_networks
from rippletwin.explanation.search.stepwise_search import Search
from rippletwin.explanation.stages.preparation import (
    HIGHEST_HZ,
    observe_all,
    quantity_error,
    select_fitted_as,
)
from rippletwin.explanation.stages.staged_search import (
    Progress,
    fit_base_only,
    prepare_stage,
    search_in_stages,
)
from rippletwin.explanation.verdict.decision import decide
from rippletwin.explanation.verdict.explanation import Explanation
from rippletwin.spectra.observation import Observation


def explain(
    case: Case, processes: int = 2, progress: Progress | None = None, draws: int = 0
) -> Explanation:
    """Explain the healthy recordings of a case.

    processes  that fit side by side
    progress   gets what is being fitted, how many fits are done and how many there are
    draws      recordings without an effect to draw for the threshold (`checks.bootstrap`); 0 for
               the default threshold

    Raises InputError if no recording is healthy, and where the healthy ones are pressures and input
    impedances; ValueError for too few draws.
    """
    check_draws(draws)
    if error := quantity_error(case):
        raise error
    if not case.healthy:
        raise InputError(
            case.folder / "rig.yaml",
            "recordings",
            "none has state: healthy",
            "explaining needs at least one healthy recording",
        )
    # Two threads round products of matrices otherwise than one, and so the verdict's last digits.
    with threadpool_limits(1):
        observations, early, late = observe_all(case, processes)
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
    """Explain observations: steps 3 to 23.

    early, late    observations of the two halves of periodic recordings
    contradiction  why the data contradict themselves, if they do; then nothing is searched for

    `processes`, `progress` and `draws` are those of `explain`. Raises ValueError for too few draws.
    """
    check_draws(draws)
    # Steps 3 to 6: search
    stage = prepare_stage(rig, observations)
    if contradiction:
        search = fit_base_only(stage)
    else:
        stage, search = search_in_stages(stage, observations, processes, progress)
    base, data = stage.base, stage.observations
    early, late = select_fitted_as(early, rig, data), select_fitted_as(late, rig, data)
    halves = (early[0], late[0]) if len(data) == 1 and late else None
    judged = Judged(search.best, (), ())
    with open_workers(base, data, processes) as workers:
        if not contradiction:
            search, judged, contradiction = _judge_explanation(workers, search, halves)
        # Steps 14 to 17: checks
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
        # Steps 18 to 20: the data sheet, and the decision
        sensitivity: tuple[PriorSensitivity, ...] = ()
        if judged.supports:
            sensitivity = compare_without_each_effect(workers, search.best, judged.without)
            has_rivals = [each.rivals for each in sensitivity]
            judged = withhold_what_is_in_doubt(
                judged, explanation, validation.model_error, has_rivals
            )
        decision = decide(search, alarms, judged.supports, contradiction, null_distribution)
        if explanation.hypothesis and not decision.accepted.hypothesis:
            # The explanation is rejected: the scores are those of the line alone.
            validation = cross_validate(workers, search.base, search.base, halves, calibrated)
    # Steps 21 to 23: the sensors' tolerances, and where the mismatch is
    accepted = add_sensor_tolerance(decision.accepted, data)
    decision = replace(decision, accepted=accepted)
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
        source_free_fits=tuple(source_free_fits),
        prior_sensitivity=sensitivity if decision.supports else (),
        shaft_orders=shaft_orders,
        location=location,
        remainder=remainder,
        null_distribution=null_distribution,
    )


def _judge_explanation(
    workers: Workers, search: Search, halves: Halves | None
) -> tuple[Search, Judged, str]:
    """Steps 7 to 13: the search with the explanation that the checks leave and its competitors,
    the support of its effects, and the contradiction in words where the sensors are wired wrongly.
    """
    search, piece = merge_neighbours(workers, search)
    if piece is None:
        judged = judge_effects(workers, search.base, search.best, halves)
    else:
        judged = judge_beside_piece(workers, search.base, piece, halves)
    networks = fit_passive_networks(workers, judged.best, piece)
    search = replace(search, best=judged.best, passive_networks=networks)
    network = accepted_network(search)
    if network is not None and set(judged.best.hypothesis) <= set(network.hypothesis):
        network, judged = judge_beside_network(workers, search.base, network, judged)
        search = replace(search, best=judged.best, passive_networks=_led_by(network, networks))
    search = _with_intervals(workers, search)
    judged = replace(judged, best=search.best)
    search = replace(search, rivals=[*search.rivals, *fit_gas_rivals(workers, search.best)])
    explanation = accepted_network(search) or search.best
    wrong = find_swapped_sensors(workers.base, workers.observations, explanation)
    return search, judged, wrong


def _with_intervals(workers: Workers, search: Search) -> Search:
    """The search with intervals of the one fit whose effects are stated: that with the network that
    is accepted, or the best without one."""
    network = accepted_network(search)
    if network is None:
        return replace(search, best=add_profile_intervals(workers, search.best))
    network = add_profile_intervals(workers, network)
    return replace(search, passive_networks=_led_by(network, search.passive_networks))


def _led_by(first: Fit, fits: Sequence[Fit]) -> list[Fit]:
    """A fit, and those of `fits` that have another hypothesis."""
    return [first, *(fit for fit in fits if set(fit.hypothesis) != set(first.hypothesis))]
