"""verdict.json: the explanation in the words of the contract, written whole or not at all."""

from __future__ import annotations

import json
import os
from dataclasses import asdict
from pathlib import Path

import numpy as np

from rippletwin.explain import detect, locate, next_recording
from rippletwin.explain.describe import is_passive, missing
from rippletwin.explain.intervals import intervals, pump_numbers
from rippletwin.explain.judge import (
    between,
    join,
    places,
    probabilities,
    rivals,
    span,
)
from rippletwin.explain.run import Explanation

WIDE = 0.15  # of the line: a position less well known asks for one more sensor

CHANCE = {
    "consistent": "The recordings are what the twin predicts within the data sheet's tolerances.",
    "calibration_only": "The line's nominal values are off by more than their stated tolerances, "
    "but no physics is missing: use the calibrated values and look at the data sheet.",
}


def verdict(explanation: Explanation) -> dict:
    """The verdict as plain data, with the keys of verdict.json."""
    e = explanation
    judgement, base = e.judgement, e.search.base
    accepted = judgement.accepted
    found = (
        intervals(accepted) if judgement.verdict in ("named", "ambiguous", "unexplained") else []
    )
    chances = probabilities(e.search, accepted)
    present = judgement.verdict not in ("consistent", "calibration_only")
    tried = len(e.search.singles) + 1
    gain = max([0.0, *(e.search.gain(f) for f in e.search.singles), e.search.gain(accepted)])
    named = [entry for entry in found if entry["effect"].named]
    effects = [
        {
            "name": entry["effect"].name,
            "element": entry["place"].element,
            "parameters": entry["parameters"],
            "probability": chances[entry["effect"].name],
        }
        for entry in named
        if judgement.verdict != "unexplained"
    ]
    shaft = e.shaft.name if e.shaft is not None else None
    kind = judgement.verdict
    if shaft is not None:
        unit = "rad" if shaft == "speed_fluctuation" else "1"
        # The sampling error of a mean over recordings is far below what the pump itself varies.
        amplitude = {"value": e.shaft.value, "ci95": [0.8 * e.shaft.value, 1.2 * e.shaft.value]}
        effects.append(
            {
                "name": shaft,
                "element": "source",
                "parameters": {"amplitude": {**amplitude, "unit": unit}},
                "probability": 1.0 - e.shaft.p_value,
            }
        )
        if kind in ("consistent", "calibration_only"):
            kind = "named"
        present = True
    alike = places(e.search) if kind in ("named", "ambiguous") else ()
    next_words = _next_recording(e, alike)
    result = {
        "verdict": kind,
        "mismatch": {
            "present": present,
            "p_value": detect.p_value(gain, tried) if e.chance is None else e.chance.p_value(gain),
            "where": _where(e, found) if present else None,
        },
        "effects": effects,
        "equivalents": [list(names) for names in (*judgement.equivalents, *alike)],
        "next_recording": next_words,
        "fit": _fit(e),
        "without": [asdict(each) for each in e.without],
        "pump": pump_numbers(accepted),
        "sentence": "",
    }
    if kind == "unexplained" and found and not found[-1]["effect"].named:
        result["stand_in"] = _stand_in(e, found[-1])
    if e.chance is not None:
        result["mismatch"]["by_chance"] = {
            "draws": len(e.chance.gains),
            "largest": max(e.chance.gains),
            "threshold": e.chance.threshold,
        }
    result["sentence"] = sentence(e, result, found, base)
    return result


def _where(e: Explanation, found: list[dict]) -> dict:
    base = e.search.base
    element, position = "line", [0.0, float(e.rig.length)]
    located = e.located
    if not found and e.shaft is not None and e.shaft.name is not None:
        element, position = "source", [0.0, 0.0]
    elif found:
        spans = [span(e.rig, f["effect"], f["place"], f["parameters"]) for f in found]
        element, position = spans[0]
    elif located is not None:
        element, position = located.element, list(located.position)
        if element == "position":
            element = between(e.rig, *position)
    where = {
        "element": element,
        "position_m": position,
        "bands_hz": detect.bands(base, e.observations),
        "crank_angle_deg": detect.crank_angles(base, e.observations),
        "conditions": detect.conditions(base, e.observations),
    }
    if located is not None:
        where["one_element_free"] = located.gains
        if len(e.rig.sensors) > 2:
            where["interior_misfit"] = {
                which: [
                    float(np.sqrt(np.mean(error**2)))
                    for error in detect.interior_test(e.observations, fit)
                ]
                for which, fit in (("before", base), ("after", e.judgement.accepted))
            }
    if e.blind:
        where["source_informed_and_free"] = locate.side_by_side(e.search, e.blind)
    return where


def _next_recording(e: Explanation, alike: tuple) -> str | None:
    """What to record to tell rivals apart, or to narrow where a nameless network sits."""
    kind, accepted = e.judgement.verdict, e.judgement.accepted
    if kind == "ambiguous" or alike:
        proposal = next_recording.propose(accepted, rivals(e.search), e.observations)
        return None if proposal is None else str(proposal)
    if kind == "unexplained" and accepted.hypothesis:
        effect, place = accepted.hypothesis[-1]
        if effect.named:
            return None
        low, high = intervals(accepted)[-1]["parameters"]["position"]["ci95"]
        if high - low > WIDE * e.rig.length:
            proposal = next_recording.place_sensor(accepted, e.observations, place.form, low, high)
            return None if proposal is None else str(proposal)
    return None


def _stand_in(e: Explanation, entry: dict) -> dict:
    """The nameless network that the corrected twin has."""
    found = missing(e.judgement.accepted, e.observations)
    return {
        "form": f"{entry['place'].form} one-port",
        "passive": is_passive(e.judgement.accepted),
        "parameters": entry["parameters"],
        "follows": None if found is None else found.words,
    }


def _fit(e: Explanation) -> dict:
    def scores(which):
        return {k: float(v.misfit) for k, v in which.items()} | {
            f"theil_{k}": float(v.theil) for k, v in which.items()
        }

    return {
        "before": scores(e.validation.before),
        "after": scores(e.validation.after),
        "left_out": list(e.validation.left_out),
        "parameters_agree_within_sd": float(e.validation.disagreement),
    }


def sentence(e: Explanation, result: dict, found: list[dict], base) -> str:
    """One paragraph an engineer can act on."""
    kind, fit = result["verdict"], result["fit"]
    before, after = fit["before"]["held_out"], fit["after"]["held_out"]
    words = [CHANCE.get(kind, "")]
    if kind == "named" and not found:  # what was named acts at shaft orders alone
        words = ["At the pistons' harmonics the twin lacks nothing."]
    elif kind in ("named", "ambiguous"):
        names = [f"{f['effect'].name.replace('_', ' ')} at the {_place(e, f)}" for f in found]
        words = [
            f"The twin lacks {join(names)}: with it the misfit on data it has not seen goes from "
            f"{before:.1%} to {after:.1%} of the measured ripple."
        ]
        numbers = {}
        for f in found:
            for name, p in f["parameters"].items():
                low, high = p["ci95"]
                unit = "" if p["unit"] == "1" else f" {p['unit']}"
                numbers[
                    f"{name.replace('_', ' ').capitalize()} {p['value']:.3g}{unit} "
                    f"({low:.3g} to {high:.3g})."
                ] = None
            if f["effect"].certain:
                numbers[
                    f"{f['effect'].name.replace('_', ' ').capitalize()} is taken in because no "
                    "such line is without it, unless data speak against it."
                ] = None
        words += numbers
        words += _against_the_sheet(e)
        if kind == "ambiguous":
            classes = "; ".join(join(names) for names in result["equivalents"])
            words.append(f"These recordings cannot tell apart {classes}.")
    elif kind == "unexplained":
        words = [
            "Something is missing that no effect of the library explains"
            + (f"; it is seen at the {_place(e, found[0])}" if found else "")
            + "."
        ]
        if "stand_in" in result:
            words.append(
                f"A {result['stand_in']['form']}, {_passive(result)}, stands in for it: misfit on "
                f"unseen data {before:.1%} to {after:.1%}. What is missing goes "
                f"{result['stand_in']['follows']}."
            )
    if kind in ("named", "ambiguous", "unexplained") and result["next_recording"]:
        words.append(f"Next: {result['next_recording']}.")
    if kind in ("named", "ambiguous") and found:
        if places(e.search):
            words.append("Its place or form cannot be told: see equivalents.")
        words.append(_without_source(e))
    words.append(_pump(result["pump"]))
    if kind == "bad_data":
        words = [f"The data contradict themselves: {e.judgement.reason}."]
    if e.shaft is not None and e.shaft.name is not None:
        words.append(
            f"Shaft-order lines of {e.shaft.relative:.1%} of the ripple show "
            f"{e.shaft.name.replace('_', ' ')}: they resemble a single-piston fault."
        )
    if "drift" in e.alarms.ringing:
        words.append(f"Early and late windows of {e.alarms.drift[1]} differ: the state drifted.")
    # Without an alarm `calibration_only` rests on the sheet; disagreeing points are another cause.
    off_the_sheet = kind == "calibration_only" and not e.alarms.ringing
    told = "pull" in e.alarms.ringing or off_the_sheet
    if told and not e.judgement.accepted.hypothesis:
        size, name = e.alarms.pull
        words.append(f"{name} is {size:.1f} standard deviations from the data sheet.")
    pulled = detect.pull(e.judgement.accepted)
    if e.judgement.accepted.hypothesis and pulled[0] > detect.PULL:
        words.append(f"Check {pulled[1]}: {pulled[0]:.1f} standard deviations from the data sheet.")
    return " ".join(word for word in words if word)


def _pump(numbers: dict) -> str:
    """What the ripple says of the pump, where that is not what the data sheet says."""
    off = [n for n in numbers.values() if not n["ci95"][0] <= n["sheet"] <= n["ci95"][1]]
    if not off:
        return ""
    modulus, timing = numbers["bulk_modulus"], numbers["port_timing"]
    turned = timing["value"] - timing["sheet"]
    return (
        f"The ripple is that of a pump with a bulk modulus of {modulus['value']:.3g} Pa (sheet "
        f"{modulus['sheet']:.3g}) and its port plate {abs(turned):.2f} deg "
        f"{'late' if turned > 0 else 'early'}."
    )


def _against_the_sheet(e: Explanation) -> list[str]:
    """Where the data alone would do without an effect, and only the data sheet says no."""
    return [
        f"Without {w.effect.replace('_', ' ')} a fit at {w.misfit:.1%} would be had with "
        f"{w.parameter} at {w.value:.3g} {w.unit}, {w.pull:.0f} standard deviations from the "
        "data sheet, which is what rejects it."
        for w in e.without
        if w.rivals and w.pull > detect.PULL
    ]


def _passive(result: dict) -> str:
    return "passive" if result["stand_in"]["passive"] else "not passive"


def _without_source(e: Explanation) -> str:
    """What a fit that knows nothing of the source says of the accepted effects."""
    for row in locate.side_by_side(e.search, e.blind):
        if row["effects"] == e.judgement.accepted.label:
            if row["source_free"] > 0.2 * row["informed"]:
                return "It stands in a fit that is blind to the source too."
            return "Blind to the source it is not seen: it acts at the pump or only there is known."
    return ""


def _place(e: Explanation, entry: dict) -> str:
    element, (low, high) = span(e.rig, entry["effect"], entry["place"], entry["parameters"])
    if "position" in entry["parameters"]:
        return f"line, {low:.2f} to {high:.2f} m from the pump ({element})"
    return element


def write(explanation: Explanation, folder: str | Path) -> dict:
    """Write verdict.json and twin.json into `folder` (made if needed); returns the verdict.

    Each file appears whole or not at all.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    result = verdict(explanation)
    _write(folder / "twin.json", explanation.twin.to_dict())
    _write(folder / "verdict.json", result)
    return result


def _write(path: Path, data: dict) -> None:
    text = json.dumps(data, indent=1, default=_plain, allow_nan=False)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_text(text + "\n")
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)


def _plain(value):
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise TypeError(f"{type(value)} is no plain data")
