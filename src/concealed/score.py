"""Scoring of one case: the tool's verdict against the truth."""

from collections.abc import Sequence

import numpy as np
from scipy.optimize import linear_sum_assignment

SILENT_VERDICTS = ("consistent", "calibration_only")
PLAIN_CHANGE = 0.05
"""Relative change of the ripple from which an effect counts as plain: above the 1 to 4 % by which
the nominal flow ripple is wrong."""

POSITION_TOLERANCE = 0.01
"""Of the line's length, added to both ends of a position's interval: lengths are known to that."""

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
        mesh             estimated error of the recording's numerics, None for a linear line
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
        misfit_nominal   relative, of the whole data, with nominal values
        misfit_calibrated, misfit_corrected   the same before and after, as the verdict states it
        absorbed         1 - misfit_calibrated/misfit_nominal, the share that calibration absorbs
        held_out_calibrated, held_out_corrected   the verdict's, of data that were left out
        line_errors      {"calibrated", "corrected"}: see `line_errors`
        baselines        {"bic", "sparse", "recalibrate"}: see `score_baseline`
        seconds          processor time of the tool, s
    """
    true, named = truth["effects"], named_effects(verdict)
    nuisance = truth.get("nuisance", [])
    classes = [set(names) for names in [*verdict["equivalents"], *truth["classes"]]]
    claims = assign_claims(true, named, classes, truth["length"])
    found = [(effect, claim) for effect, claim in zip(true, claims) if claim is not None]
    rest = [claim for claim in named if not any(claim is each for each in claims)]
    there = [
        claim
        for effect, claim in zip(nuisance, assign_claims(nuisance, rest, [], truth["length"]))
        if claim is not None and is_place_right(effect, claim, truth["length"])
    ]
    right = [any(claim is each for each in [*claims, *there]) for claim in named]
    ranked = rank_effects(verdict, there)
    wrong = [claim["name"] for claim, ok in zip(named, right) if not ok]
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
        "right": bool(true) and len(found) == len(true),
        "named_first": bool(ranked) and any(ranked[0] is claim for claim in claims),
        "wrong": " + ".join(wrong),
        "places_right": [is_place_right(*pair, truth["length"]) for pair in found],
        "remainder_right": [
            is_remainder_at(effect, verdict.get("remainder"), truth["length"])
            for effect in true
            if truth["kind"] == "outside" and effect["position"] is not None
        ],
        "intervals_hold": [inside for pair in found for inside in intervals_hold(*pair)],
        "probabilities": [
            (claim["probability"], ok)
            for claim, ok in zip(named, right)
            if claim.get("probability") is not None
        ],
        "established": right,
        "misfit_nominal": nominal,
        "misfit_calibrated": calibrated,
        "misfit_corrected": fit["after"]["in_sample"],
        "absorbed": max(0.0, 1.0 - calibrated / nominal),
        "held_out_calibrated": fit["before"]["held_out"],
        "held_out_corrected": fit["after"]["held_out"],
        "line_errors": {
            which: line_errors(truth["segments"], rows)
            for which, rows in baselines["segments"].items()
        },
        "baselines": {
            "bic": score_baseline(true, baselines["bic"], truth["classes"]),
            "sparse": score_baseline(true, baselines["sparse"], truth["classes"]),
            "recalibrate": score_baseline(true, None, truth["classes"])
            | {"alarm": calibrated > ACCEPTABLE_MISFIT},
        },
        "seconds": baselines["seconds"],
    }


def named_effects(verdict: dict) -> list[dict]:
    """The effects that a verdict establishes; none unless it is `named` or `ambiguous`."""
    if verdict["verdict"] not in ("named", "ambiguous"):
        return []
    return [e for e in verdict["effects"] if e.get("support", "established") == "established"]


def rank_effects(verdict: dict, nuisance: Sequence[dict] = ()) -> list[dict]:
    """The established effects of a verdict, most log evidence first, without those of `nuisance`:
    physics that is there besides what is concealed.

    The evidence is what is lost without the effect (`without[].evidence`), infinite where nothing
    fits without it. Effects at shaft orders have none and come last.
    """
    rows, ranked = list(verdict["without"]), []
    established = named_effects(verdict)
    for effect in verdict["effects"]:
        own = [r for r in rows if r["effect"] == effect["name"]]
        row = next((r for r in own if _is_at(r["place"], effect["element"])), None)
        evidence = -np.inf
        if row is not None:
            rows.remove(row)  # several of one name are in the same order in both lists
            evidence = np.inf if row["evidence"] is None else row["evidence"]
        counts = any(effect is each for each in established)
        if counts and not any(effect is each for each in nuisance):
            ranked.append((evidence, effect))
    return [effect for _, effect in sorted(ranked, key=lambda pair: -pair[0])]


def _is_at(place: str, element: str) -> bool:
    """Whether a place, as "source (volume)" or "position 2", is at an element."""
    return f"{place} ".startswith(f"{element} ")


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


def same_or_equivalent(name: str, other: str, classes: Sequence[set]) -> bool:
    """Whether two names are equal or in one class of effects that cannot be told apart."""
    return name == other or any({name, other} <= names for names in classes)


def assign_claims(
    true: Sequence[dict], named: Sequence[dict], classes: Sequence[set], length: float
) -> list[dict | None]:
    """For each true effect the named effect that counts for it, or None.

    A named effect counts for one true effect at most, also where its class holds two. The
    assignment finds as many true effects as possible; among those the most by their own names, and
    then the most at their own places. `length` is the line's, m.
    """
    gain = np.zeros((len(true), len(named)))
    for k, effect in enumerate(true):
        for n, claim in enumerate(named):
            if same_or_equivalent(claim["name"], effect["name"], classes):
                same_name = claim["name"] == effect["name"]
                gain[k, n] = 1e4 + 1e2 * same_name + is_place_right(effect, claim, length)
    assigned = [None] * len(true)
    for k, n in zip(*linear_sum_assignment(gain, maximize=True)):
        if gain[k, n] > 0:
            assigned[k] = named[n]
    return assigned


def is_place_right(effect: dict, claim: dict, length: float) -> bool:
    """Whether a claim's element is the true one, or its position's interval holds the true one."""
    position = claim["parameters"].get("position")
    if effect["position"] is not None and position is not None:
        return _holds_position(effect, position["ci95"], length)
    return claim["element"] == effect["element"]


def _holds_position(effect: dict, interval: Sequence[float], length: float) -> bool:
    """Whether the widened interval holds the actual or the nominal position.

    The calibrated line's metres are between the two.
    """
    low = interval[0] - POSITION_TOLERANCE * length
    high = interval[1] + POSITION_TOLERANCE * length
    return low <= effect["position"] <= high or low <= effect["position_nominal"] <= high


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


def score_baseline(true: list[dict], picked: dict | None, classes: list[list[str]]) -> dict:
    """Score of a method that picks one effect or none.

    `alarm` whether it picks one, `right` whether that is a true one, `named` the pick as text.
    """
    if picked is None:
        return {"alarm": False, "right": False, "named": ""}
    sets = [set(names) for names in classes]
    return {
        "alarm": True,
        "right": any(same_or_equivalent(picked["name"], effect["name"], sets) for effect in true),
        "named": f"{picked['name']} ({picked['element']})",
    }
