"""`explain`: from a case to what its twin lacks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np
from threadpoolctl import threadpool_limits

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.frequency_continuation import fit_hypothesis
from rippletwin.calibration.posterior import MIN_MODEL_ERROR
from rippletwin.case.model import Case
from rippletwin.errors import InputError
from rippletwin.explanation.checks import alarms, data_contradictions, sensor_wiring
from rippletwin.explanation.checks.bootstrap import bootstrap_null
from rippletwin.explanation.checks.cross_validation import (
    cross_validate,
    prune_by_cross_validation,
)
from rippletwin.explanation.checks.prior_sensitivity import (
    compare_without_each_effect,
)
from rippletwin.explanation.checks.profile_intervals import add_profile_intervals
from rippletwin.explanation.fit_jobs import Workers, open_workers
from rippletwin.explanation.localise import free_corrections, source_free_fits
from rippletwin.explanation.localise.shaft_orders import (
    MIN_RELATIVE_LEVEL,
    MODULATION_SHARE,
    ROUGH_MODULATION_SHARE,
    ShaftOrders,
    analyse_shaft_orders,
    modulation_differs,
    shaft_order_level,
    with_phase_modulation,
)
from rippletwin.explanation.search.stepwise_moves import extension_job
from rippletwin.explanation.search.stepwise_search import Search, resume_search, search_effects
from rippletwin.explanation.thresholds import GOOD
from rippletwin.explanation.verdict.decision import decide, withdraw_refuted_name
from rippletwin.explanation.verdict.explanation import Explanation
from rippletwin.spectra.frequency_selection import select_fitted_frequencies
from rippletwin.spectra.observation import observe, revolutions_of
from rippletwin.twin.effects.library import candidates
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.pump_line_coupling import couple_pump_to_line
from rippletwin.twin.twin import Twin

HIGHEST_HZ = 4000.0
MAX_MODEL_ERROR_FOR_COUPLING = (
    10.0 * MIN_MODEL_ERROR
)  # relative model error above which pressure and flow at the pump are unknown


def explain(
    case: Case,
    processes: int = 2,
    progress: Callable[[str, int, int], None] | None = None,
    draws: int = 0,
) -> Explanation:
    """Explain a case's healthy recordings.

    `progress` is told what is being fitted, how many fits are done, and of how many. With `draws`
    the threshold is that of as many recordings drawn without an effect (`explain.bootstrap`).
    Raises InputError where no recording is healthy.
    """
    if not case.healthy:
        raise InputError(
            case.folder / "rig.yaml",
            "recordings",
            "none has state: healthy",
            "explaining needs at least one healthy recording",
        )
    # Linear algebra on large arrays: threads suffice, each with one of its own.
    with threadpool_limits(1), ThreadPoolExecutor(max(processes, 1)) as pool:
        read = list(pool.map(partial(observe_whole_and_halves, rig=case.rig), case.healthy))
    observations = [parts[0] for parts in read]
    early, late = ([parts[k] for parts in read if len(parts) > 1] for k in (1, 2))
    reason = data_contradictions.find_contradictions(
        case.rig, case.healthy, observations, early, late
    )
    return explain_observations(
        case.rig, observations, early, late, processes, progress, reason, draws
    )


def explain_observations(
    rig,
    observations: Sequence,
    early: Sequence = (),
    late: Sequence = (),
    processes: int = 2,
    progress: Callable[[str, int, int], None] | None = None,
    reason: str = "",
    draws: int = 0,
) -> Explanation:
    """Explain observations; `early` and `late` are those of the two halves of periodic ones.

    `reason` says why the data contradict themselves, where they do; then nothing is searched for.
    With `draws` the threshold is that of so many recordings drawn without an effect.
    """
    turning = _estimate_phase_modulation(rig, observations)
    base, data, found = *prepare_base(rig, observations, turning), None
    if not reason:
        found = _search(base, data, processes, progress)
        shaft = _shaft(found.best, observations)
        if modulation_differs(shaft, turning, data):
            turning = shaft
            base, data = prepare_base(rig, observations, turning)
            found = _search(base, data, processes, progress)
        base, data, found = _search_with_coupled_pump(base, data, found, processes, progress)
    early, late = (
        select_fitted_frequencies(with_phase_modulation(part, turning), rig, HIGHEST_HZ)
        for part in (early, late)
    )
    held = late if len(data) == 1 and late else None
    with open_workers(base, data, processes) as pool:
        if found is None:
            fit = pool.fit([{"hypothesis": ()}])[0]
            found = Search(fit, [], fit)
        else:
            found.best = add_profile_intervals(
                pool, prune_by_cross_validation(pool, found.best, held)
            )
            found.passive_networks = _fit_passive_networks(pool, found)
            reason = sensor_wiring.find_swapped_sensors(base, data, found)
        single = _fit_each_observation(pool, found.base)
        rung = alarms.Alarms(
            found.base.model_error,
            alarms.largest_pull(found.base),
            alarms.largest_disagreement(single),
            alarms.drift_p_value(early, late, rig.delay),
        )
        explanation = found.passive_networks[0] if _prefers_other(found) else found.best
        blind = source_free_fits.refit_source_free(pool, found)
        validation = cross_validate(pool, found.base, explanation, held)
        checked = validation if explanation.hypothesis else None
        by_chance = None
        if draws and found.best.hypothesis:
            by_chance = bootstrap_null(found.base, data, draws, processes, progress)
        judgement = decide(found, rung, checked, reason, by_chance)
        without = compare_without_each_effect(pool, found.base, judgement.accepted)
        judgement = withdraw_refuted_name(judgement, without)
    return Explanation(
        rig=rig,
        observations=tuple(data),
        alarms=rung,
        search=found,
        judgement=judgement,
        validation=validation,
        single=tuple(single),
        shaft=_shaft(judgement.accepted, observations),
        blind=tuple(blind),
        located=free_corrections.locate(found.base, data),
        without=without,
        chance=by_chance,
    )


def prepare_base(
    rig, observations: Sequence, turning: ShaftOrders | None = None
) -> tuple[Twin, list]:
    """The paper's line, not yet fitted, and the observations as fits take them, of a shaft that
    turns as `turning` says."""
    highest = HIGHEST_HZ if observations[0].orders is not None else None
    data = select_fitted_frequencies(with_phase_modulation(observations, turning), rig, highest)
    base = Twin(rig, data, uncertain_pump=True)
    ForwardModel(
        base, data
    )  # what the twin keeps of the pump is worked out before the processes part
    return base, data


def _search(base: Twin, data: Sequence, processes: int, progress) -> Search:
    with open_workers(base, data, processes) as pool:
        return search_effects(pool, progress)


def _search_with_coupled_pump(
    base: Twin, data: Sequence, found: Search, processes: int, progress
) -> tuple:
    """Base, observations and what the search found: where the source is the lumped pump, that has
    been made to answer the line, and the search has gone on."""
    known = (
        couple_pump_to_line(found.best.twin, data)
        if found.best.model_error < MAX_MODEL_ERROR_FOR_COUPLING
        else None
    )
    if known is None:
        return base, data, found
    base = Twin(base.rig, known, uncertain_pump=True)
    with open_workers(base, known, processes) as pool:
        return base, known, resume_search(pool, found, progress)


def _estimate_phase_modulation(rig, observations: Sequence) -> ShaftOrders | None:
    """How unevenly the shaft turns, by a line that is calibrated and no more; None where evenly.
    The line as it is explained will tell better."""
    found = None
    if "pistons" in rig.pump:
        found = shaft_order_level(observations, rig.pump["pistons"], HIGHEST_HZ)
    if found is None or found[0] < MIN_RELATIVE_LEVEL:
        return None
    shaft = None
    for uncertain_pump in (False, True):
        # What a swing takes from the ripple must not be put down to the pump, so that comes second.
        data = select_fitted_frequencies(
            with_phase_modulation(observations, shaft), rig, HIGHEST_HZ
        )
        twin = fit_hypothesis(Twin(rig, data, uncertain_pump=uncertain_pump), (), data).twin
        shaft = analyse_shaft_orders(twin, observations, HIGHEST_HZ, ROUGH_MODULATION_SHARE)
    return shaft


def _shaft(fit: Fit, observations: Sequence) -> ShaftOrders | None:
    """How the shaft turns by the line as it is explained, as far as it is."""
    share = (
        MODULATION_SHARE
        if fit.model_error < MAX_MODEL_ERROR_FOR_COUPLING
        else ROUGH_MODULATION_SHARE
    )
    return analyse_shaft_orders(fit.twin, observations, HIGHEST_HZ, share)


def _fit_passive_networks(pool: Workers, found: Search) -> list[Fit]:
    """Passive networks without a name, alone and beside the best, where there is room for them."""
    best = found.best
    if best.model_error <= GOOD:
        return []
    networks = [c for c in candidates(pool.base.rig, named=False)]
    jobs = [{"hypothesis": (network,)} for network in networks]
    if best.hypothesis:
        jobs += [extension_job(best, network, pool.base.rig) for network in networks]
    fits = [f for f in pool.fit(jobs) if np.isfinite(f.evidence)]
    return sorted(fits, key=lambda f: -f.evidence)


def _prefers_other(found: Search) -> bool:
    best = found.best
    if not found.passive_networks:
        return False
    return found.passive_networks[0].evidence > best.evidence and best.model_error > GOOD


def _fit_each_observation(pool: Workers, base: Fit) -> list[Fit]:
    """The base fitted to each observation alone; none where there is only one."""
    count = len(pool.observations)
    if count < 2:
        return []
    return pool.fit(
        [{"hypothesis": (), "theta": base.twin.theta, "use": [k]} for k in range(count)]
    )


def observe_whole_and_halves(recording, rig) -> list:
    """The observation of a recording; of a periodic one then those of both halves of its
    revolutions."""
    if recording.kind != "periodic":
        return [observe(recording, rig, HIGHEST_HZ)]
    revolutions = revolutions_of(recording, rig)
    count = len(revolutions.windows)
    cuts = [slice(None), slice(0, count // 2), slice(count // 2, None)]
    parts = [
        replace(revolutions, windows=revolutions.windows[cut], speed_hz=revolutions.speed_hz[cut])
        for cut in cuts
    ]
    return [observe(recording, rig, HIGHEST_HZ, revolutions=part) for part in parts]
