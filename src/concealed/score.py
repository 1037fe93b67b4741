"""Scoring of one case: the tool's verdict against the truth."""

import numpy as np

from concealed.names import (
    SUPPORTED_TOO,
    is_place_right,
    judge_names,
    rank_effects,
    same_or_equivalent,
)

SILENT_VERDICTS = ("consistent", "calibration_only", "crashed")
PLAIN_CHANGE = 0.05
"""Relative change of the ripple from which an effect counts as plain: above the 1 to 4 % by which
the nominal flow ripple is wrong."""

ACCEPTABLE_MISFIT = 0.05
"""Relative misfit above which calibration alone raises the alarm."""

REMAINDER_TOLERANCE = 0.05  # of the line's length, between what remains and what is concealed

NO_ORACLE = {"log_evidence": None, "held_out": None}


def score_case(truth: dict, verdict: dict, baselines: dict, oracle: dict = NO_ORACLE) -> dict:
    """A flat row of one case.

    Arguments: `truth` is the content of the seal, `verdict` that of verdict.json, `baselines` the
    result of `concealed.tool`, `oracle` that of `concealed.oracle`.

    Keys of the row:
        kind, effects, change, noise, points, sensors, floor   from the truth; `effects` as text
        plain            change >= PLAIN_CHANGE
        mesh             frequency, Hz, estimated and allowed error, Pa, of the mesh of a nonlinear
                         line of the bench `clean`; None elsewhere
        oracle_log_evidence, oracle_held_out   of the fit begun from the truth, None without one
        verdict, named, sentence   from the verdict; `named` are its effects as text
        alarm            the verdict is not one of SILENT_VERDICTS
        effects_found    number of true effects that are named
        right            every true effect is named, and there is one
        named_first      whether the first of `rank_effects` counts for a true effect
        wrong            named effects that count for no true effect, nor for nuisance physics that
                         is there, as text
        places_right     for each found effect, whether its place is right
        remainder_right  for each true effect outside the library that has a place, whether what
                         remains is there (`is_remainder_at`)
        intervals_hold   for each interval of a right effect, whether it holds the true value
        probabilities    pairs (stated probability, right) of the named effects that state one
        established      of each named effect, whether it is there
        supported_too    `there` (of each effect), `right`, `effects_found` and `wrong`, where an
                         effect that is only supported counts as named too
        misfit_nominal   relative, of the whole data, with nominal values
        misfit_calibrated, misfit_corrected   the same before and after, as the verdict states it
        absorbed         1 - misfit_calibrated/misfit_nominal, the share that calibration absorbs
        held_out_calibrated, held_out_corrected   the verdict's, of data that were left out
        line_errors      {"calibrated", "corrected"}: see `line_errors`
        baselines        {"bic", "sparse", "recalibrate"}: see `score_baseline`
        seconds          processor time of the tool, s
    """
    names, supported = judge_names(truth, verdict), judge_names(truth, verdict, SUPPORTED_TOO)
    true, named, found = names.true, names.named, names.found
    ranked = rank_effects(verdict, names.nuisance)
    fit = verdict["fit"]
    nominal, calibrated = baselines["nominal"], fit["before"]["in_sample"]
    return {
        "kind": truth["kind"],
        "effects": " + ".join(effect["name"] for effect in true),
        "change": truth["change"],
        "noise": truth["noise"],
        "points": truth["points"],
        "sensors": truth["sensors"],
        "floor": truth["floor"],
        "plain": truth["change"] >= PLAIN_CHANGE,
        "mesh": truth["mesh"],
        "oracle_log_evidence": oracle["log_evidence"],
        "oracle_held_out": oracle["held_out"],
        "verdict": verdict["verdict"],
        "named": " + ".join(f"{claim['name']} ({claim['element']})" for claim in named),
        "sentence": verdict["sentence"],
        "alarm": verdict["verdict"] not in SILENT_VERDICTS,
        "effects_found": len(found),
        "right": names.is_right,
        "named_first": bool(ranked) and any(ranked[0] is claim for _, claim in found),
        "wrong": names.wrong,
        "places_right": [is_place_right(*pair, truth["length"]) for pair in found],
        "remainder_right": [
            is_remainder_at(effect, verdict.get("remainder"), truth["length"])
            for effect in true
            if truth["kind"] == "outside" and effect["position"] is not None
        ],
        "intervals_hold": [inside for pair in found for inside in intervals_hold(*pair)],
        "probabilities": [
            (claim["probability"], ok)
            for claim, ok in zip(named, names.there)
            if claim.get("probability") is not None
        ],
        "established": names.there,
        "supported_too": {
            "there": supported.there,
            "right": supported.is_right,
            "effects_found": len(supported.found),
            "wrong": supported.wrong,
        },
        "misfit_nominal": nominal,
        "misfit_calibrated": calibrated,
        "misfit_corrected": fit["after"]["in_sample"],
        "absorbed": float(np.maximum(0.0, 1.0 - calibrated / nominal)),  # keeps a crash's NaN
        "held_out_calibrated": fit["before"]["held_out"],
        "held_out_corrected": fit["after"]["held_out"],
        "line_errors": {
            which: line_errors(truth["segments"], rows)
            for which, rows in baselines["segments"].items()
        },
        "baselines": {
            "bic": score_baseline(truth, baselines["bic"]),
            "sparse": score_baseline(truth, baselines["sparse"]),
            "recalibrate": score_baseline(truth, None) | {"alarm": calibrated > ACCEPTABLE_MISFIT},
        },
        "seconds": baselines["seconds"],
    }


def is_remainder_at(effect: dict, remainder: dict | None, length: float) -> bool:
    """Whether what remains is within REMAINDER_TOLERANCE of an effect's actual or nominal position.

    What remains is at the position of the network that stands in for it, or in the middle of its
    interval. `length` is the line's, m.
    """
    if remainder is None or remainder["position_m"] is None:
        return False
    network = remainder["stand_in"]
    if network is None:
        place = float(np.mean(remainder["position_m"]))
    else:
        place = network["parameters"]["position"]["value"]
    distances = [abs(place - effect[key]) for key in ("position", "position_nominal")]
    return min(distances) <= REMAINDER_TOLERANCE * length


def intervals_hold(effect: dict, claim: dict) -> list[bool]:
    """Whether each stated 95 % interval of a claim by the effect's own name, at its own element,
    holds the true value.

    Positions are left to `is_place_right`: they are known to the lengths' tolerance only.
    """
    if (claim["name"], claim["element"]) != (effect["name"], effect["element"]):
        return []
    return [
        claim["parameters"][name]["ci95"][0] <= value <= claim["parameters"][name]["ci95"][1]
        for name, value in effect["parameters"].items()
        if name != "position" and "ci95" in claim["parameters"].get(name, ())
    ]


def line_errors(true: list[dict], rows: list[dict]) -> list[dict]:
    """Errors of each segment's delay and impedance: `relative`, and `z` in stated standard
    deviations. Empty where `rows` is: the tool gave no twin.
    """
    if not rows:
        return []
    return [
        {
            "quantity": quantity,
            "relative": row[quantity] / segment[quantity] - 1.0,
            "z": (row[quantity] - segment[quantity]) / row[f"{quantity}_sd"],
        }
        for segment, row in zip(true, rows, strict=True)
        for quantity in ("delay", "impedance")
    ]


def score_baseline(truth: dict, picked: dict | None) -> dict:
    """Score of a method that picks one effect or none, against the seal's content.

    `right` whether the pick is a concealed one; `alarm` and `named`, the pick as text, where it is
    not there at all: like the tool, a method may name nuisance physics. A pick has no position, so
    that nuisance physics counts by its name.
    """
    if picked is None:
        return {"alarm": False, "right": False, "named": ""}
    sets, name = [set(names) for names in truth["classes"]], picked["name"]
    right = any(same_or_equivalent(name, effect["name"], sets) for effect in truth["effects"])
    there = right or any(name == effect["name"] for effect in truth.get("nuisance", ()))
    return {
        "alarm": not there,
        "right": right,
        "named": "" if there else f"{name} ({picked['element']})",
    }
