"""`explain`: from a case to what its twin lacks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from threadpoolctl import threadpool_limits

from rippletwin.case import Case
from rippletwin.effects import candidates
from rippletwin.errors import InputError
from rippletwin.explain import contradiction, detect, locate
from rippletwin.explain.answer import answered
from rippletwin.explain.bootstrap import Chance, chance
from rippletwin.explain.fit import Fit, fit_hypothesis, prepare
from rippletwin.explain.intervals import profiled
from rippletwin.explain.judge import Judgement, examined, judge
from rippletwin.explain.posterior import FLOOR
from rippletwin.explain.search import Search, again, search
from rippletwin.explain.shaft import (
    RELATIVE,
    ROUGH_SHARE,
    SHARE,
    ShaftLines,
    apart,
    as_turned,
    shaft_lines,
    standing_out,
)
from rippletwin.explain.sheet import WithoutEffect, without_each
from rippletwin.explain.steps import extended
from rippletwin.explain.thresholds import ACCEPT, GOOD
from rippletwin.explain.validate import Validation, that_transfers, validate
from rippletwin.explain.workers import Workers, workers
from rippletwin.forward import Forward
from rippletwin.spectra import observe, revolutions_of
from rippletwin.twin import Twin

HIGHEST_HZ = 4000.0
ROUGH = 10.0 * FLOOR  # relative model error above which pressure and flow at the pump are unknown


@dataclass(frozen=True)
class Explanation:
    """All that was found; `rippletwin.explain.verdict` writes it down.

    observations are as fitted; single holds the base fitted to each of them alone, shaft what the
    shaft orders say that are no multiples of the pistons' number, blind the fits that know nothing
    of the source (`rippletwin.explain.locate.compared`), located where the base lacks something,
    without what a free data sheet would make of the data without each accepted effect, chance the
    draws without an effect where they were asked for.
    """

    rig: object
    observations: tuple
    alarms: detect.Alarms
    search: Search
    judgement: Judgement
    validation: Validation
    single: tuple[Fit, ...]
    shaft: ShaftLines | None = None
    blind: tuple[Fit, ...] = ()
    located: locate.Located | None = None
    without: tuple[WithoutEffect, ...] = ()
    chance: Chance | None = None

    @property
    def threshold(self) -> float:
        """Log evidence that an effect must add to be named."""
        return ACCEPT if self.chance is None else max(ACCEPT, self.chance.threshold)

    @property
    def twin(self) -> Twin:
        """The corrected twin, which later stages use."""
        return self.judgement.accepted.twin


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
        read = list(pool.map(partial(observed, rig=case.rig), case.healthy))
    observations = [parts[0] for parts in read]
    early, late = ([parts[k] for parts in read if len(parts) > 1] for k in (1, 2))
    reason = contradiction.find(case.rig, case.healthy, observations, early, late)
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
    turning = _turning(rig, observations)
    base, data, found = *begin(rig, observations, turning), None
    if not reason:
        found = _search(base, data, processes, progress)
        shaft = _shaft(found.best, observations)
        if apart(shaft, turning, data):
            turning = shaft
            base, data = begin(rig, observations, turning)
            found = _search(base, data, processes, progress)
        base, data, found = _answered(base, data, found, processes, progress)
    early, late = (prepare(as_turned(part, turning), rig, HIGHEST_HZ) for part in (early, late))
    held = late if len(data) == 1 and late else None
    with workers(base, data, processes) as pool:
        if found is None:
            fit = pool.fit([{"hypothesis": ()}])[0]
            found = Search(fit, [], fit)
        else:
            found.best = profiled(pool, that_transfers(pool, found.best, held))
            found.others = _others(pool, found)
            reason = contradiction.wiring(base, data, found)
        single = _alone(pool, found.base)
        alarms = detect.Alarms(
            found.base.floor,
            detect.pull(found.base),
            detect.disagreement(single),
            detect.drift(early, late, rig.delay),
        )
        explanation = found.others[0] if _prefers_other(found) else found.best
        blind = locate.blind(pool, found)
        validation = validate(pool, found.base, explanation, held)
        checked = validation if explanation.hypothesis else None
        by_chance = None
        if draws and found.best.hypothesis:
            by_chance = chance(found.base, data, draws, processes, progress)
        judgement = judge(found, alarms, checked, reason, by_chance)
        without = without_each(pool, found.base, judgement.accepted)
        judgement = examined(judgement, without)
    return Explanation(
        rig=rig,
        observations=tuple(data),
        alarms=alarms,
        search=found,
        judgement=judgement,
        validation=validation,
        single=tuple(single),
        shaft=_shaft(judgement.accepted, observations),
        blind=tuple(blind),
        located=locate.locate(found.base, data),
        without=without,
        chance=by_chance,
    )


def begin(rig, observations: Sequence, turning: ShaftLines | None = None) -> tuple[Twin, list]:
    """The paper's line, not yet fitted, and the observations as fits take them, of a shaft that
    turns as `turning` says."""
    highest = HIGHEST_HZ if observations[0].orders is not None else None
    data = prepare(as_turned(observations, turning), rig, highest)
    base = Twin(rig, data, uncertain_pump=True)
    Forward(base, data)  # what the twin keeps of the pump is worked out before the processes part
    return base, data


def _search(base: Twin, data: Sequence, processes: int, progress) -> Search:
    with workers(base, data, processes) as pool:
        return search(pool, progress)


def _answered(base: Twin, data: Sequence, found: Search, processes: int, progress) -> tuple:
    """Base, observations and what the search found: where the source is the lumped pump, that has
    been made to answer the line, and the search has gone on."""
    known = answered(found.best.twin, data) if found.best.floor < ROUGH else None
    if known is None:
        return base, data, found
    base = Twin(base.rig, known, uncertain_pump=True)
    with workers(base, known, processes) as pool:
        return base, known, again(pool, found, progress)


def _turning(rig, observations: Sequence) -> ShaftLines | None:
    """How unevenly the shaft turns, by a line that is calibrated and no more; None where evenly.
    The line as it is explained will tell better."""
    found = None
    if "pistons" in rig.pump:
        found = standing_out(observations, rig.pump["pistons"], HIGHEST_HZ)
    if found is None or found[0] < RELATIVE:
        return None
    shaft = None
    for uncertain_pump in (False, True):
        # What a swing takes from the ripple must not be put down to the pump, so that comes second.
        data = prepare(as_turned(observations, shaft), rig, HIGHEST_HZ)
        twin = fit_hypothesis(Twin(rig, data, uncertain_pump=uncertain_pump), (), data).twin
        shaft = shaft_lines(twin, observations, HIGHEST_HZ, ROUGH_SHARE)
    return shaft


def _shaft(fit: Fit, observations: Sequence) -> ShaftLines | None:
    """How the shaft turns by the line as it is explained, as far as it is."""
    share = SHARE if fit.floor < ROUGH else ROUGH_SHARE
    return shaft_lines(fit.twin, observations, HIGHEST_HZ, share)


def _others(pool: Workers, found: Search) -> list[Fit]:
    """Passive networks without a name, alone and beside the best, where there is room for them."""
    best = found.best
    if best.floor <= GOOD:
        return []
    networks = [c for c in candidates(pool.base.rig, named=False)]
    jobs = [{"hypothesis": (network,)} for network in networks]
    if best.hypothesis:
        jobs += [extended(best, network, pool.base.rig) for network in networks]
    fits = [f for f in pool.fit(jobs) if np.isfinite(f.evidence)]
    return sorted(fits, key=lambda f: -f.evidence)


def _prefers_other(found: Search) -> bool:
    best = found.best
    if not found.others:
        return False
    return found.others[0].evidence > best.evidence and best.floor > GOOD


def _alone(pool: Workers, base: Fit) -> list[Fit]:
    """The base fitted to each observation alone; none where there is only one."""
    count = len(pool.observations)
    if count < 2:
        return []
    return pool.fit(
        [{"hypothesis": (), "theta": base.twin.theta, "use": [k]} for k in range(count)]
    )


def observed(recording, rig) -> list:
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


__all__ = ["Explanation", "begin", "explain", "explain_observations", "observed"]
