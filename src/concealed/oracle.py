"""What the truth is worth to one who knows it: the bound on what a search can find in the data."""

from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path

import numpy as np

from rippletwin.case import load_case
from rippletwin.explain.fit import Fit, Hypothesis
from rippletwin.explain.posterior import Posterior
from rippletwin.explain.run import begin, observed
from rippletwin.explain.search import library
from rippletwin.explain.starts import align
from rippletwin.explain.workers import Workers, carry
from rippletwin.twin import Twin


def worth(case_folder: str | Path, truth: dict) -> float | None:
    """Log evidence that the true effects add to the line of a case without any, `truth` being what
    a seal holds; see `worth_in`."""
    if not truth["effects"]:
        return None
    case = load_case(case_folder, states={"healthy"})
    base, data = begin(case.rig, [observed(each, case.rig)[0] for each in case.healthy])
    rig = truth["seal"]
    line = {"viscosity": rig["fluid"]["kinematic_viscosity"]}
    for k, segment in enumerate(rig["line"]["segments"], 1):
        line |= {f"{name}[{k}]": segment[name] for name in ("wave_speed", "diameter", "length")}
    return worth_in(base, data, truth["effects"], line)


def worth_in(
    base: Twin, data: Sequence, effects: list[dict], line: Mapping[str, float]
) -> float | None:
    """Log evidence that the true `effects` add to the twin `base` of the observations `data`.

    Both are fitted as `explain` fits, but the effects set out from their true strengths and places,
    also on the true `line` (its parameters by name), and the line without them also from where they
    leave it. Less than `ACCEPT` no search can tell
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
    jobs = []
    for hypothesis in product(*choices):
        start = _start(rig, hypothesis, effects)
        jobs.append({"hypothesis": hypothesis, "starts": [start]})
        twin = base.with_(effects=hypothesis)
        theta = np.zeros(len(twin.parameters))
        for k, p in enumerate(twin.parameters):
            theta[k] = p.prior.coordinate(line[p.name]) if p.name in line else start.get(p.name, 0)
        aligned = align(Posterior(twin, data), theta)[1]
        jobs.append({"hypothesis": hypothesis, "theta": aligned})
    known = _best(pool.fit(jobs))
    without = pool.fit([{"hypothesis": ()}, {"hypothesis": (), "theta": carry(known, (), base)}])
    return known.evidence - _best(without).evidence


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
