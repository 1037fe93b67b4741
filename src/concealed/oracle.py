"""A fit begun from the truth, after all verdicts are committed: an upper reference for a search.

It separates cases in which the search failed from cases in which the data do not hold the effect,
and says how well data that are left out can be predicted.
"""

from collections.abc import Mapping, Sequence
from itertools import product
from pathlib import Path

from rippletwin.calibration.fit import Fit, Hypothesis
from rippletwin.calibration.posterior import Posterior
from rippletwin.calibration.shaft_angles import align_shaft_angles
from rippletwin.case.load import load_case
from rippletwin.explanation.checks.cross_validation import score_held_out
from rippletwin.explanation.fit_jobs import Continuation, FitJob, FromTheta, Workers, make_base
from rippletwin.explanation.fit_starts import transfer_theta
from rippletwin.explanation.search.stepwise_search import SHAFT_ORDER_EFFECTS
from rippletwin.explanation.stages.preparation import observe_all, select_fitted_as
from rippletwin.explanation.stages.staged_search import prepare_stage, settle_ripple
from rippletwin.twin.effects.base import Effect, Place
from rippletwin.twin.effects.library import candidates, next_instance
from rippletwin.twin.parameters import coordinates


def fit_from_truth(case_folder: str | Path, truth: dict) -> dict:
    """What a fit begun from the truth reaches in a case. `truth` is the content of its seal.

    log_evidence  that the true effects add, see `log_evidence_of`
    held_out      misfit of data that were left out, as verdict.json states it of the explanation:
                  `held_out_misfit`

    Without an effect `log_evidence` is None; both are, where `fit_effects` is.
    """
    case = load_case(case_folder, states={"healthy"})
    whole, early, late = observe_all(case, processes=1)
    stage = prepare_stage(case.rig, whole)
    workers = Workers(stage.base, stage.observations)
    rig = truth["seal"]
    line = {"viscosity": rig["fluid"]["kinematic_viscosity"]}
    for k, segment in enumerate(rig["line"]["segments"], 1):
        line |= {f"{name}[{k}]": segment[name] for name in ("wave_speed", "diameter", "length")}
    fit = fit_effects(workers, truth["effects"], line)
    if fit is None:
        return {"log_evidence": None, "held_out": None}
    fit_all = add_nuisance(workers, fit, truth.get("nuisance", []))
    return {
        "log_evidence": log_evidence_of(workers, fit) if truth["effects"] else None,
        "held_out": held_out_misfit(workers, fit_all, early, late),
    }


def fit_effects(workers: Workers, effects: Sequence[dict], line: Mapping[str, float]) -> Fit | None:
    """The fit with the true `effects`; None where one is not in the library or acts at shaft orders
    alone.

    It starts from their true strengths and places, once on the nominal line and once on the true
    `line` (parameter name -> value, SI units). The greater evidence wins.
    """
    base = workers.base
    choices = [_forms(base.rig, true) for true in effects]
    if not all(choices):
        return None
    jobs = []
    for hypothesis in product(*choices):
        twin, values = base.with_(effects=hypothesis), _true_values(base.rig, hypothesis, effects)
        theta = coordinates(twin.parameters, {**line, **values})
        start = {name: theta[twin.index[name]] for name in values}
        aligned = align_shaft_angles(Posterior(twin, workers.observations), theta)[1]
        jobs.append(FitJob(hypothesis, Continuation((start,))))
        jobs.append(FitJob(hypothesis, FromTheta(aligned)))
    return _best(workers.fit(jobs))


def log_evidence_of(workers: Workers, with_effects: Fit) -> float:
    """Log evidence that the effects of a fit add to the line.

    The fit without them starts from nominal values and from the line of the fit with them. Below
    `MIN_LOG_BAYES_FACTOR` a search cannot distinguish the effects from chance; above it, a search
    that finds nothing has failed.
    """
    from_same_line = FitJob((), FromTheta(transfer_theta(with_effects, (), workers.base)))
    without = _best(workers.fit([FitJob(()), from_same_line]))
    return float(with_effects.evidence - without.evidence)


def add_nuisance(workers: Workers, fit: Fit, nuisance: Sequence[dict]) -> Fit:
    """The fit begun from another one with the nuisance physics that the library has beside its
    effects.

    The truth states no numbers of it but places: its parameters start from their prior medians.
    """
    rig, hypothesis, values = workers.base.rig, fit.hypothesis, {}
    for true in nuisance:
        forms = _forms(rig, true)
        added = next_instance(forms[0], hypothesis) if forms else None
        if added is not None:
            hypothesis = (*hypothesis, added)
            values |= _true_values(rig, [added], [true])
    twin = workers.base.with_(effects=hypothesis)
    theta = transfer_theta(fit, hypothesis, workers.base)
    stated = coordinates(twin.parameters, values)
    for name in values:
        theta[twin.index[name]] = stated[twin.index[name]]
    return workers.fit([FitJob(hypothesis, FromTheta(theta))])[0]


def held_out_misfit(workers: Workers, fit: Fit, early: Sequence, late: Sequence) -> float:
    """Misfit of data that were left out, relative, by the folds of `explain`.

    A simulated pump responds to the line first, as in `explain`. `early` and `late` are the
    observations of the halves of periodic recordings.
    """
    data, fit = settle_ripple(workers.base, workers.observations, fit)
    if data is not workers.observations:
        workers = Workers(make_base(workers.base.rig, data), data)
    early, late = (select_fitted_as(half, fit.twin.rig, data) for half in (early, late))
    halves = (early[0], late[0]) if len(data) == 1 and late else None
    return float(score_held_out(workers, fit, halves).misfit)


def _forms(rig, true: dict) -> list[tuple[Effect, Place]]:
    """The forms in which the library has a true effect, at its element; none at shaft orders."""
    return [
        (effect, place)
        for effect, place in candidates(rig)
        if effect.name not in SHAFT_ORDER_EFFECTS
        and (effect.name, place.element) == (true["name"], true["element"])
    ]


def _true_values(rig, hypothesis: Hypothesis, effects: Sequence[dict]) -> dict[str, float]:
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
