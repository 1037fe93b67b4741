"""How often `rippletwin explain` is right on cases made with the twin's own equations.

    python benchmarks/explain_selfcheck.py run FILE --kind none|single|pair [--first 0] [--cases 20]
        [--geometry]
    python benchmarks/explain_selfcheck.py summary FILE...

`run` appends one JSON line for each case to FILE; `summary` prints rates. A case is drawn from its
number alone. It has a line of two to four segments, two or three sensors, one to three operating
points, 0.5 to 4 kPa of sensor noise, nominal values off by their stated uncertainty, and effects at
random places with parameters from their priors. The backflow of the nominal flow ripple is wrong by
a few per cent in depth, width and timing. With `--geometry` the ripple is the lumped pump's, its
geometry is known, and the true pump has another bulk modulus (4 %), port timing (0.3 deg) and dead
volume (2 %, which is no parameter of the twin).

The benchmark measures the statistics of the method (false alarms, confusion, coverage). It cannot
say whether the equations are right, since recordings and twin share them.
"""

from __future__ import annotations

import argparse
import json
import time
from pathlib import Path

import numpy as np

from concealed.names import assign_claims
from rippletwin.calibration.frequency_continuation import refine
from rippletwin.calibration.misfit import relative_misfit
from rippletwin.explanation.checks.profile_intervals import effect_intervals, own_parameter_indices
from rippletwin.explanation.explain import explain_observations
from rippletwin.explanation.verdict.places import element_and_extent
from rippletwin.explanation.verdict.verdict_file import verdict_dict
from rippletwin.twin.twin import Twin
from selfcheck_cases import EFFECT_COUNTS, draw_case

DETECTABLE = 15.0  # log evidence that the true effects, fitted from their true values, add


def run_case(number: int, kind: str, geometry: bool = False) -> dict:
    """Draw, explain and score one case."""
    rng = np.random.default_rng([number, EFFECT_COUNTS[kind]])
    rig, observations, truth = draw_case(rng, kind, geometry)
    base = Twin(rig, observations, uncertain_pump=True)
    start = time.process_time()
    e = explain_observations(rig, observations, processes=1)
    seconds = time.process_time() - start
    v = verdict_dict(e)
    at = dict(zip((p.name for p in truth.parameters), truth.theta))
    parameters = base.with_(effects=truth.effects).parameters
    theta = np.array([at.get(p.name, 0.0) for p in parameters])
    known = refine(base, truth.effects, observations, [theta])
    measured = np.concatenate([o.values for o in observations], axis=1)
    truth_misfit = relative_misfit(measured, np.concatenate(truth.predict(observations), axis=1))
    accepted = e.decision.accepted
    right, wrong = compare_names(rig, truth, v)
    return {
        "number": number,
        "kind": kind,
        "points": len(observations),
        "sensors": len(rig.sensors),
        "truth": [(effect.name, place.element) for effect, place in truth.effects],
        "oracle_log_evidence": known.evidence - e.search.base.evidence,
        "verdict": v["verdict"],
        "named": [(x["name"], x["element"]) for x in v["effects"]],
        "best": [(a.name, str(b)) for a, b in e.search.best.hypothesis],
        "right": right,
        "wrong": wrong,
        "place_right": is_place_right(rig, truth, e),
        "gain": e.search.log_bayes_factor(e.search.best),
        "behind_oracle": known.evidence - e.search.best.evidence,
        "top_single": e.search.log_bayes_factor(e.search.single_effect_fits[0]),
        "alarms": list(e.alarms.raised),
        "pull": e.alarms.pull[0],
        "disagreement": e.alarms.disagreement[0],
        "model_error_base": e.search.base.model_error,
        "model_error": e.search.best.model_error,
        "folds": e.validation.disagreement,
        "intervals_hold": intervals_hold(truth, accepted),
        "z": z_scores(truth, accepted),
        "z_line": z_scores(truth, accepted, line=True),
        "held_out": [v["fit"][k]["held_out"] for k in ("before", "after")],
        "misfit_of_truth": truth_misfit,
        "seconds": seconds,
    }


def compare_names(rig, truth, verdict: dict) -> tuple[list[str], list[str]]:
    """Names of the true effects that a verdict names, and of those that it names and are not there.

    truth : the twin with the true values
    """
    actual = [
        {"name": effect.name, "element": place.element}
        | dict.fromkeys(("position", "position_nominal"), values.get("position"))
        for effect, place, values in truth.effect_values(truth.theta)
    ]
    named, classes = verdict["effects"], [set(names) for names in verdict["equivalents"]]
    claims = assign_claims(actual, named, classes, rig.length)
    right = [true["name"] for true, claim in zip(actual, claims) if claim is not None]
    return right, [x["name"] for x in named if not any(x is claim for claim in claims)]


def is_place_right(rig, truth, e) -> bool | None:
    """Whether all named true effects are at their places; None where none is named."""
    own = {}
    for effect, place, values in truth.effect_values(truth.theta):
        own[effect.name] = (place, values)
    results = []
    for entry in effect_intervals(e.decision.accepted):
        name = entry["effect"].name
        if name not in own:
            continue
        place, values = own[name]
        if "position" in values:
            low, high = element_and_extent(rig, entry["place"], entry["parameters"])[1]
            results.append(low - 0.25 <= float(values["position"]) <= high + 0.25)
        else:
            results.append(place.element == entry["place"].element)
    return all(results) if results else None


def intervals_hold(truth, accepted) -> list[bool]:
    """Whether the 95 % intervals of the effects' parameters hold the truth."""
    inside = []
    for _, _, own in own_parameter_indices(accepted.twin):
        for k in own:
            name = accepted.twin.parameters[k].name
            if name in truth.index:
                low, high = accepted.interval(k)
                inside.append(low <= truth.theta[truth.index[name]] <= high)
    return inside


def z_scores(truth, accepted, line=False) -> dict:
    """(fitted - true)/sd of the parameters of effects, or of the line, in prior coordinates."""
    twin, sd, scores = accepted.twin, accepted.sd, {}
    for k, p in enumerate(twin.parameters):
        if p.flat or ("@" in p.name) == line or p.name not in truth.index:
            continue
        scores[p.name] = float((twin.theta[k] - truth.theta[truth.index[p.name]]) / sd[k])
    return scores


def summarise(rows: list[dict]) -> str:
    """Rates as text."""
    lines = []
    for kind in EFFECT_COUNTS:
        cases = [r for r in rows if r["kind"] == kind]
        if not cases:
            continue
        lines.append(f"{kind}: {len(cases)} cases, {np.mean([r['seconds'] for r in cases]):.0f} s")
        if kind == "none":
            alarms = [r for r in cases if r["verdict"] not in ("consistent", "calibration_only")]
            lines.append(f"  false alarms {len(alarms)}: {[r['number'] for r in alarms]}")
            lines.append(f"  largest model error: {max(r['model_error'] for r in cases):.4f}")
            top = sorted((r["top_single"] for r in cases), reverse=True)
            lines.append("  largest evidence of any single effect: " + _row(top[:8]))
            pulls = sorted((r["pull"] for r in cases), reverse=True)
            lines.append("  pull: " + _row(pulls[:8]))
            apart = sorted((r["disagreement"] for r in cases), reverse=True)
            lines.append("  disagreement: " + _row(apart[:8]))
            continue
        seen = [r for r in cases if r["oracle_log_evidence"] > DETECTABLE]
        lines.append(f"  detectable (oracle log evidence > {DETECTABLE:g}): {len(seen)}")
        verdicts = {}
        for r in seen:
            verdicts[r["verdict"]] = verdicts.get(r["verdict"], 0) + 1
        lines.append(f"  verdicts: {verdicts}")
        some = sum(bool(r["right"]) and not r["wrong"] for r in seen)
        every = sum(len(r["right"]) == len(r["truth"]) and not r["wrong"] for r in seen)
        lines.append(f"  at least one right and none wrong: {some}; all right: {every}")
        lines.append(f"  wrong names: {sum(bool(r['wrong']) for r in seen)}")
        where = [r["place_right"] for r in seen if r["place_right"] is not None]
        lines.append(f"  right place: {sum(where)} of {len(where)}")
        missed = [r["number"] for r in seen if r["behind_oracle"] > 3.0]
        lines.append(f"  search behind the oracle by more than 3 of log evidence: {missed}")
        folds = sorted((r["folds"] for r in seen if r["right"]), reverse=True)
        lines.append("  folds' disagreement where right: " + _row(folds[:8]))
        good = [r for r in seen if len(r["right"]) == len(r["truth"]) and not r["wrong"]]
        inside = [x for r in good for x in r["intervals_hold"]]
        holding = f"{sum(inside):.0f} of {len(inside)}"
        lines.append(f"  intervals of effects that hold the truth: {holding}")
        for key in ("z", "z_line"):
            z = np.array([x for r in good for x in r[key].values()])
            if len(z):
                lines.append(
                    f"  {key}: {np.mean(np.abs(z) < 1.96):.1%} of {len(z)} within 1.96 deviations, "
                    f"rms {np.sqrt(np.mean(np.clip(z, -9, 9) ** 2)):.2f}"
                )
        if good:
            largest = max(r["model_error"] for r in good)
            lines.append(f"  largest model error of these: {largest:.4f}")
        ratio = [r["held_out"][1] / r["misfit_of_truth"] for r in good]
        if ratio:
            lines.append(f"  held-out misfit over the truth's: median {np.median(ratio):.2f}")
        for r in seen:
            if not r["right"] or r["wrong"]:
                lines.append(
                    f"    {r['number']}: {r['truth']} verdict {r['verdict']} {r['named']} "
                    f"best {r['best']} oracle log evidence {r['oracle_log_evidence']:.0f} "
                    f"behind {r['behind_oracle']:.0f} "
                    f"model error {r['model_error']:.3f} folds {r['folds']:.1f}"
                )
    return "\n".join(lines)


def _row(values) -> str:
    return " ".join(f"{x:.1f}" for x in values)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    running = commands.add_parser("run")
    running.add_argument("file", type=Path)
    running.add_argument("--kind", choices=EFFECT_COUNTS, required=True)
    running.add_argument("--first", type=int, default=0)
    running.add_argument("--cases", type=int, default=20)
    running.add_argument("--geometry", action="store_true")
    commands.add_parser("summary").add_argument("files", type=Path, nargs="+")
    arguments = parser.parse_args()
    if arguments.command == "summary":
        lines = [x for f in arguments.files for x in f.read_text().splitlines()]
        print(summarise([json.loads(x) for x in lines]))
        return
    for number in range(arguments.first, arguments.first + arguments.cases):
        row = run_case(number, arguments.kind, arguments.geometry)
        with open(arguments.file, "a") as file:
            file.write(json.dumps(row, default=float) + "\n")
        print(number, row["truth"], row["verdict"], row["named"], f"{row['seconds']:.0f} s")


if __name__ == "__main__":
    main()
