"""Log evidence of the true effects, fitted from their true values: an upper reference for a search.

It separates cases in which the search failed from cases in which the data do not hold the effect.
"""

from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path

from rippletwin.calibration.fit import Fit, Hypothesis
from rippletwin.calibration.posterior import Posterior
from rippletwin.calibration.shaft_angles import align_shaft_angles
from rippletwin.case.load import load_case
from rippletwin.explanation.fit_jobs import Continuation, FitJob, FromTheta, Workers
from rippletwin.explanation.fit_starts import transfer_theta
from rippletwin.explanation.search.stepwise_search import SHAFT_ORDER_EFFECTS
from rippletwin.explanation.stages.preparation import observe_whole_and_halves, prepare_base
from rippletwin.twin.effects.library import candidates
from rippletwin.twin.parameters import coordinates
from rippletwin.twin.twin import Twin


def oracle_log_evidence(case_folder: str | Path, truth: dict) -> float | None:
    """Log evidence that the true effects add in a case; None without an effect, and as stated by
    `log_evidence_of_effects`. `truth` is the content of the case's seal.
    """
    if not truth["effects"]:
        return None
    case = load_case(case_folder, states={"healthy"})
    base, observations = prepare_base(
        case.rig, [observe_whole_and_halves(each, case.rig)[0] for each in case.healthy]
    )
    rig = truth["seal"]
    line = {"viscosity": rig["fluid"]["kinematic_viscosity"]}
    for k, segment in enumerate(rig["line"]["segments"], 1):
        line |= {f"{name}[{k}]": segment[name] for name in ("wave_speed", "diameter", "length")}
    return log_evidence_of_effects(base, observations, truth["effects"], line)


def log_evidence_of_effects(
    base: Twin, observations: Sequence, effects: list[dict], line: Mapping[str, float]
) -> float | None:
    """Log evidence that the true `effects` add to the twin `base` of the observations.

    Both twins are fitted as `explain` fits them. The fit with the effects starts from their true
    strengths and places, once on the nominal line and once on the true `line` (parameter name ->
    value, SI units). The fit without effects also starts from the line of the better of these.
    Below `MIN_LOG_BAYES_FACTOR` a search cannot distinguish the effects from chance; above it, a
    search that finds nothing has failed. None where an effect is not in the library or acts at
    shaft orders alone.
    """
    pool = Workers(base, observations)
    library = [c for c in candidates(base.rig) if c[0].name not in SHAFT_ORDER_EFFECTS]
    choices = [
        [c for c in library if (c[0].name, c[1].element) == (true["name"], true["element"])]
        for true in effects
    ]
    if not all(choices):
        return None
    jobs = []
    for hypothesis in product(*choices):
        twin, values = base.with_(effects=hypothesis), _true_values(base.rig, hypothesis, effects)
        theta = coordinates(twin.parameters, {**line, **values})
        start = {name: theta[twin.index[name]] for name in values}
        aligned = align_shaft_angles(Posterior(twin, observations), theta)[1]
        jobs.append(FitJob(hypothesis, Continuation((start,))))
        jobs.append(FitJob(hypothesis, FromTheta(aligned)))
    with_effects = _best(pool.fit(jobs))
    from_same_line = FitJob((), FromTheta(transfer_theta(with_effects, (), base)))
    without = _best(pool.fit([FitJob(()), from_same_line]))
    return with_effects.evidence - without.evidence


def _true_values(rig, hypothesis: Hypothesis, effects: list[dict]) -> dict[str, float]:
    """True parameters of the effects by name; positions are those on the drawing, m."""
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
