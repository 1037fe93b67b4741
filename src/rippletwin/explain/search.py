"""Search over hypotheses: every effect at every place, then pairs and triples, by evidence."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from rippletwin.effects import Effect, Place, candidates
from rippletwin.explain.fit import Fit, Hypothesis
from rippletwin.explain.posterior import FLOOR
from rippletwin.explain.workers import Workers, carry, dropping, in_common, scan

ACCEPT = 8.0
"""Log evidence that an effect must add. The largest that chance gave any effect of the library in
parametric bootstraps of no-effect cases with refitting is below it (docs/explain.md)."""

SURE = 2.0 * ACCEPT
"""Log evidence from which something is missing even where the line fits without and no explanation
holds on data left out."""

CERTAIN = -3.0  # the same for an effect that no real line is without: twenty to one against it
MOST = 4  # effects at a time
STAND_INS = 10  # single effects tried in the place of another
DRAWS = 800  # about each fit below a limit
CLOSE = 4.0 * ACCEPT  # log evidence within which a rival is worth another look
LENT = 5  # single effects from whose lines the base is fitted again
LIMITS = {"line_volume": "load_volume"}  # effects at any place that are another at the line's end
GOOD = 2.0 * FLOOR  # relative model error at which a fit is as good as it can be believed


def library(rig, observations: Sequence, named: bool = True) -> list[tuple[Effect, Place]]:
    """The candidates that these data can say anything about."""
    kinds = {o.kind for o in observations}
    found = []
    for effect, place in candidates(rig, named):
        if kinds == {"input_impedance"} and effect.element in ("source", "sensor"):
            continue
        if effect.name == "entrained_air" and "periodic" not in kinds:
            continue
        if effect.name in ("piston_spread", "speed_fluctuation"):
            continue  # act at shaft orders that are not fitted, see `rippletwin.explain.shaft`
        found.append((effect, place))
    return found


@dataclass
class Search:
    """What the search found.

    base     the paper's line, fitted
    singles  every effect at every place alone, best first
    best     the accepted hypothesis (may be the base)
    rivals   fits of every step that took effects in or could have: alternatives to `best`
    others   passive networks that compete, best first
    """

    base: Fit
    singles: list[Fit]
    best: Fit
    rivals: list[Fit] = field(default_factory=list)
    others: list[Fit] = field(default_factory=list)

    def gain(self, fit: Fit) -> float:
        """Log evidence over the base."""
        return fit.evidence - self.base.evidence


def search(pool: Workers, progress: Callable[[str, int, int], None] | None = None) -> Search:
    """Forward and backward steps over the library, from the base; see `Search`."""
    found = library(pool.base.rig, pool.observations)
    base, singles = alone(pool, found, progress)
    return _stepwise(pool, Search(base, singles, base, singles), found, progress)


def again(pool: Workers, past: Search, progress=None) -> Search:
    """The search on data that differ little from those of `past`: its fits from where they ended,
    and steps from its best, of which what has become needless is dropped first."""
    close = [f for f in past.rivals if past.best.evidence - f.evidence < CLOSE]
    fits = [past.base, *past.singles, past.best, *close]
    jobs = [{"hypothesis": f.hypothesis, "theta": f.twin.theta} for f in fits]
    tell = _counter(progress, "again", len(jobs))
    base, *rest = pool.fit(jobs, tell)
    count = len(past.singles)
    singles, best, rivals = _ranked(rest[:count]), rest[count], _ranked(rest[count + 1 :])
    found = library(pool.base.rig, pool.observations)
    best = settled(pool, simplify(pool, exchange(pool, backward(pool, best), singles), found))
    return _stepwise(pool, Search(base, singles, best, rivals), found, progress)


def _stepwise(pool: Workers, begun: Search, found: Sequence, progress) -> Search:
    """Steps forward and back from `begun.best`, with the candidates `found`."""
    base, singles = begun.base, begun.singles
    best, rivals, step = begun.best, begun.rivals, singles
    if best.hypothesis:
        step = _extensions(pool, best, found, progress)
    while True:
        new = step[0] if step else None
        if new is None or new.evidence - best.evidence < needed(new):
            certain = [f for f in step if f.hypothesis[-1][0].certain]
            # What no line is without is taken in with something else, never alone.
            if not (best.hypothesis and certain):
                break
            new = certain[0]
            if new.evidence - best.evidence < CERTAIN:
                break
        best, rivals = new, rivals if step is singles else [*rivals, *step]
        best = simplify(pool, exchange(pool, backward(pool, best), singles), found)
        best = settled(pool, best)
        step = _extensions(pool, best, found, progress)
    return Search(base, singles, best, rivals)


def _extensions(pool: Workers, best: Fit, found: Sequence, progress) -> list[Fit]:
    """`best` with each of the candidates besides that it has not, best first; none beyond MOST."""
    if len(best.hypothesis) >= MOST:
        return []
    rig = pool.base.rig
    jobs = [
        extended(best, candidate, rig) for candidate in found if candidate not in best.hypothesis
    ]
    tell = _counter(progress, f"{len(best.hypothesis) + 1} effects", len(jobs))
    return _ranked(pool.fit(jobs, tell))


def alone(pool: Workers, found: Sequence, progress=None) -> tuple[Fit, list[Fit]]:
    """The base, and each of the candidates `found` alone, best first."""
    tell = _counter(progress, "single effects", len(found) + 1)
    fits = pool.fit([{"hypothesis": h} for h in [(), *((c,) for c in found)]], tell)
    base, singles = _lowest(pool, fits[0], fits[1:]), fits[1:]
    if base.floor <= GOOD:
        # A line that fits without the effect has no other valley for it than a weak one nearby.
        tell = _counter(progress, "weak effects", len(found))
        near = pool.fit([{"hypothesis": f.hypothesis, "fit": base} for f in singles], tell)
        singles = [max(pair, key=lambda f: f.evidence) for pair in zip(singles, near)]
    return base, polish(pool, _ranked(singles))


def _lowest(pool: Workers, base: Fit, singles: Sequence[Fit]) -> Fit:
    """The base, or what it becomes from where the best effects have brought the line, or from
    draws about what lower harmonics leave possible.

    A base that stopped in a wrong valley, as from a sheet that is far off, would give all of the
    way out of it to whichever effect first finds out.
    """
    starts = _ranked(singles)[:LENT]
    jobs = [{"hypothesis": (), "theta": carry(fit, (), pool.base)} for fit in starts]
    if base.floor > GOOD and len(pool.observations) == 1:
        # Of one operating point the lowest harmonics say least.
        jobs = [{"hypothesis": (), "draws": DRAWS}, *jobs]
    return max([base, *pool.fit(jobs)], key=lambda fit: fit.evidence)


def settled(pool: Workers, best: Fit) -> Fit:
    """The fit at its exact mode, where that takes derivatives of what the line stores: what is
    added to a fit that stopped short of it would be taken for what is missing."""
    if not best.stores:
        return best
    return pool.fit([{"hypothesis": best.hypothesis, "theta": best.twin.theta}])[0]


def exchange(pool: Workers, best: Fit, singles: Sequence[Fit], rounds: int = 2) -> Fit:
    """Put another effect in the place of each while that is better and the fit still poor.

    The first effect taken in does the work of all that are missing; once others are there it may
    be the wrong one. What stands in is the best few single effects.
    """
    for _ in range(rounds):
        if len(best.hypothesis) < 2 or best.floor <= GOOD:
            break
        stand_ins = [f.hypothesis[0] for f in singles[:STAND_INS]]
        jobs = []
        for k in range(len(best.hypothesis)):
            jobs += [
                restarted(best, (*best.without(k), c), pool.base.rig)
                for c in stand_ins
                if c not in best.hypothesis
            ]
        better = _ranked(pool.fit(jobs))
        if not better or better[0].evidence < best.evidence + 1.0:
            break
        best = better[0]
    return best


def simplify(pool: Workers, best: Fit, found: Sequence) -> Fit:
    """Put in the place of each effect one that it contains, unless that costs ACCEPT.

    What the larger has besides is physics of its own, which has to be worth as much as any other.
    """
    for k, member in enumerate(best.hypothesis):
        rest = best.without(k)
        jobs = [
            {"hypothesis": (*rest, c), "fit": best}
            for c in found
            if c not in rest and _contains(member, c, pool.base.rig)
        ]
        for fit in _ranked(pool.fit(jobs))[:1]:
            if fit.evidence > best.evidence - ACCEPT:
                return simplify(pool, fit, found)
    return best


def _contains(member, other, rig) -> bool:
    """Whether an effect is a special case of another: of its equations, or where it may be."""
    (effect, place), (less, where) = member, other
    if effect is not less:
        return LIMITS.get(effect.name) == less.name
    names = [{p.name for p in e.parameters(rig, at)} for e, at in (member, other)]
    return place.element == where.element and names[1] < names[0]


def restarted(best: Fit, hypothesis: Hypothesis, rig) -> dict:
    """The job that fits from nominal again, effects in common starting where they were."""
    kept = in_common(best, hypothesis)
    return {
        "hypothesis": hypothesis,
        "starts": [{**kept, **start} for start in scan(rig, hypothesis)],
    }


def extended(best: Fit, candidate, rig) -> dict:
    """The job that adds a candidate to a fit.

    Where the fit is still poor its parameters are bent, and the fit starts from nominal again with
    its effects where they were; where it is good the candidate starts from it.
    """
    hypothesis = (*best.hypothesis, candidate)
    if best.floor > GOOD:
        return restarted(best, hypothesis, rig)
    return {"hypothesis": hypothesis, "fit": best}


def polish(pool: Workers, fits: list[Fit], count: int = 3) -> list[Fit]:
    """Fits again, from more starts, those of the best that may have stopped in a wrong valley; of
    one operating point, what acts along the whole line from draws too, as the base.
    """
    again = [f for f in fits[:count] if f.floor > GOOD and f.hypothesis]
    jobs = [{"hypothesis": f.hypothesis, "starts": finer(pool.base.rig, f)} for f in again]
    if len(pool.observations) == 1:
        for job in jobs:
            # Along the whole line an effect is as free as the line itself.
            if job["hypothesis"][-1][0].element == "line":
                job["draws"] = DRAWS
    better = {id(f): new for f, new in zip(again, pool.fit(jobs))}
    return _ranked([max(f, better.get(id(f), f), key=lambda x: x.evidence) for f in fits])


def finer(rig, fit: Fit) -> list[dict[str, float]]:
    """Starts about where a fit ended, and a finer grid over what its effect scans."""
    effect, place = fit.hypothesis[-1]
    label = f"{effect.name}@{place}"
    own = {
        p.name: float(fit.twin.theta[fit.twin.index[f"{label}.{p.name}"]])
        for p in effect.parameters(rig, place)
    }
    starts = []
    for p in effect.parameters(rig, place):
        if len(p.scan) > 1:
            low, high = min(p.scan), max(p.scan)
            for u in np.linspace(1.3 * low, 1.3 * high, 2 * len(p.scan)):
                starts.append({f"{label}.{n}": v for n, v in {**own, p.name: float(u)}.items()})
    return starts or [{f"{label}.{n}": v for n, v in own.items()}, {}]


def backward(pool: Workers, best: Fit) -> Fit:
    """Drop every effect that the others have made needless."""
    while len(best.hypothesis) > 1:
        fits = pool.fit([dropping(best, k, pool.base) for k in range(len(best.hypothesis))])
        losses = [
            best.evidence - fit.evidence - needed_of(effect)
            for fit, (effect, _) in zip(fits, best.hypothesis)
        ]
        weakest = int(np.argmin(losses))
        if losses[weakest] >= 0:
            break
        best = fits[weakest]
    return best


def needed(fit: Fit) -> float:
    """Log evidence that the newest effect of a fit must have added."""
    return needed_of(fit.hypothesis[-1][0])


def needed_of(effect: Effect) -> float:
    """Log evidence that an effect must add."""
    return CERTAIN if effect.certain else ACCEPT


def _ranked(fits: Sequence[Fit]) -> list[Fit]:
    return sorted((f for f in fits if np.isfinite(f.evidence)), key=lambda f: -f.evidence)


def _counter(progress, what: str, total: int):
    if progress is None:
        return None
    done = 0

    def tell():
        nonlocal done
        done += 1
        progress(what, done, total)

    return tell
