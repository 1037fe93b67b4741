"""What the truth is worth to one who knows it: the bound on what a search can find in the data."""

from collections.abc import Sequence
from itertools import product
from pathlib import Path

from rippletwin.case import load_case
from rippletwin.explain.fit import Fit, Hypothesis
from rippletwin.explain.run import begin, observed
from rippletwin.explain.search import library
from rippletwin.explain.workers import Workers, carry
from rippletwin.twin import Twin


def worth(case_folder: str | Path, effects: list[dict]) -> float | None:
    """Log evidence that the true `effects`, as a seal has them, add to the line of a case without
    any; see `worth_in`."""
    if not effects:
        return None
    case = load_case(case_folder, states={"healthy"})
    base, data = begin(case.rig, [observed(each, case.rig)[0] for each in case.healthy])
    return worth_in(base, data, effects)


def worth_in(base: Twin, data: Sequence, effects: list[dict]) -> float | None:
    """Log evidence that the true `effects` add to the twin `base` of the observations `data`.

    Both are fitted as `explain` fits, but the effects set out from their true strengths and places,
    and the line without them also from where they leave it. Less than `ACCEPT` no search can tell
    from chance; where it is more, one that finds nothing has failed. None where nothing can be
    added: an effect that the library has not, or one at shaft orders alone.
    """
    rig, pool = base.rig, Workers(base, data)
    choices = [
        [
            (effect, place)
            for effect, place in library(rig, data)
            if (effect.name, place.element) == (true["name"], true["element"])
        ]
        for true in effects
    ]
    if not all(choices):
        return None
    known = _best(
        pool.fit(
            [{"hypothesis": h, "starts": [_start(rig, h, effects)]} for h in product(*choices)]
        )
    )
    line = pool.fit([{"hypothesis": ()}, {"hypothesis": (), "theta": carry(known, (), base)}])
    return known.evidence - _best(line).evidence


def _start(rig, hypothesis: Hypothesis, effects: list[dict]) -> dict[str, float]:
    """Coordinates, by name, of the true parameters; a place is the one on the drawing."""
    start = {}
    for (effect, place), true in zip(hypothesis, effects, strict=True):
        values = true["parameters"]
        if true["position"] is not None:
            values = values | {"position": true["position_nominal"]}
        for p in effect.parameters(rig, place):
            if p.name in values:
                start[f"{effect.name}@{place}.{p.name}"] = float(p.prior.coordinate(values[p.name]))
    return start


def _best(fits: list[Fit]) -> Fit:
    return max(fits, key=lambda fit: fit.evidence)
