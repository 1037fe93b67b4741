"""What the truth is worth to one who knows it: the bound on what a search can find in the data."""

from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path

from rippletwin.calibration.fit import Fit, Hypothesis
from rippletwin.calibration.multistart import align_shaft_angles
from rippletwin.calibration.posterior import Posterior
from rippletwin.case.load import load_case
from rippletwin.explanation.explain import observe_whole_and_halves, prepare_base
from rippletwin.explanation.fit_jobs import Workers, transfer_theta
from rippletwin.explanation.search.stepwise_search import applicable_candidates
from rippletwin.twin.parameters import coordinates
from rippletwin.twin.twin import Twin


def worth(case_folder: str | Path, truth: dict) -> float | None:
    """Log evidence that the true effects add to the line of a case without any, `truth` being what
    a seal holds; see `worth_in`."""
    if not truth["effects"]:
        return None
    case = load_case(case_folder, states={"healthy"})
    base, data = prepare_base(
        case.rig, [observe_whole_and_halves(each, case.rig)[0] for each in case.healthy]
    )
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
    leave it. Less than `ACCEPT` no search can tell from chance; where it is more, one that finds
    nothing has failed. None where nothing can be added: an effect that the library has not, or one
    at shaft orders alone.
    """
    pool, found = Workers(base, data), applicable_candidates(base.rig, data)
    choices = [
        [c for c in found if (c[0].name, c[1].element) == (true["name"], true["element"])]
        for true in effects
    ]
    if not all(choices):
        return None
    jobs = []
    for hypothesis in product(*choices):
        twin, values = base.with_(effects=hypothesis), _values(base.rig, hypothesis, effects)
        theta = coordinates(twin.parameters, {**line, **values})
        start = {name: theta[twin.index[name]] for name in values}
        jobs.append({"hypothesis": hypothesis, "starts": [start]})
        jobs.append(
            {"hypothesis": hypothesis, "theta": align_shaft_angles(Posterior(twin, data), theta)[1]}
        )
    known = _best(pool.fit(jobs))
    without = pool.fit(
        [{"hypothesis": ()}, {"hypothesis": (), "theta": transfer_theta(known, (), base)}]
    )
    return known.evidence - _best(without).evidence


def _values(rig, hypothesis: Hypothesis, effects: list[dict]) -> dict[str, float]:
    """The true parameters by name; a place is the one on the drawing."""
    values = {}
    for (effect, place), true in zip(hypothesis, effects, strict=True):
        own = true["parameters"]
        if true["position"] is not None:
            own = own | {"position": true["position_nominal"]}
        for p in effect.parameters(rig, place):
            if p.name in own:
                values[f"{effect.name}@{place}.{p.name}"] = own[p.name]
    return values


def _best(fits: list[Fit]) -> Fit:
    return max(fits, key=lambda fit: fit.evidence)
