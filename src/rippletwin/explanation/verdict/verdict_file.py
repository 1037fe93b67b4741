"""verdict.json: the explanation in the words of the contract, written whole or not at all."""

from __future__ import annotations

import json
import os
from dataclasses import asdict
from pathlib import Path

import numpy as np

from rippletwin.explanation.checks import alarms
from rippletwin.explanation.checks.profile_intervals import effect_intervals, pump_numbers
from rippletwin.explanation.localise import residual_bands, source_free_fits
from rippletwin.explanation.localise.missing_immittance import is_passive, missing_immittance
from rippletwin.explanation.verdict import next_experiment
from rippletwin.explanation.verdict.decision import equivalent_places, probabilities, rival_fits
from rippletwin.explanation.verdict.explanation import Explanation
from rippletwin.explanation.verdict.places import element_and_extent, stretch_between_sensors
from rippletwin.explanation.verdict.summary_text import summary_text
from rippletwin.twin import twin_file

WIDE_INTERVAL = 0.15  # of the line: a position less well known asks for one more sensor


def verdict_dict(explanation: Explanation) -> dict:
    """The verdict as plain data, with the keys of verdict.json."""
    e = explanation
    judgement, base = e.judgement, e.search.base
    accepted = judgement.accepted
    found = (
        effect_intervals(accepted)
        if judgement.verdict in ("named", "ambiguous", "unexplained")
        else []
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
    alike = equivalent_places(e.search) if kind in ("named", "ambiguous") else ()
    next_words = _next_recording(e, alike)
    result = {
        "verdict": kind,
        "mismatch": {
            "present": present,
            "p_value": alarms.evidence_p_value(gain, tried)
            if e.chance is None
            else e.chance.p_value(gain),
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
    result["sentence"] = summary_text(e, result, found, base)
    return result


def _where(e: Explanation, found: list[dict]) -> dict:
    base = e.search.base
    element, position = "line", [0.0, float(e.rig.length)]
    located = e.located
    if not found and e.shaft is not None and e.shaft.name is not None:
        element, position = "source", [0.0, 0.0]
    elif found:
        spans = [element_and_extent(e.rig, f["effect"], f["place"], f["parameters"]) for f in found]
        element, position = spans[0]
    elif located is not None:
        element, position = located.element, list(located.position)
        if element == "position":
            element = stretch_between_sensors(e.rig, *position)
    where = {
        "element": element,
        "position_m": position,
        "bands_hz": residual_bands.residual_frequency_bands(base, e.observations),
        "crank_angle_deg": residual_bands.residual_crank_angles(base, e.observations),
        "conditions": residual_bands.residual_conditions(base, e.observations),
    }
    if located is not None:
        where["one_element_free"] = located.gains
        if len(e.rig.sensors) > 2:
            where["interior_misfit"] = {
                which: [
                    float(np.sqrt(np.mean(error**2)))
                    for error in residual_bands.interior_test(e.observations, fit)
                ]
                for which, fit in (("before", base), ("after", e.judgement.accepted))
            }
    if e.blind:
        where["source_informed_and_free"] = source_free_fits.compare_evidence(e.search, e.blind)
    return where


def _next_recording(e: Explanation, alike: tuple) -> str | None:
    """What to record to tell rivals apart, or to narrow where a nameless network sits."""
    kind, accepted = e.judgement.verdict, e.judgement.accepted
    if kind == "ambiguous" or alike:
        proposal = next_experiment.propose_recording(accepted, rival_fits(e.search), e.observations)
        return None if proposal is None else str(proposal)
    if kind == "unexplained" and accepted.hypothesis:
        effect, place = accepted.hypothesis[-1]
        if effect.named:
            return None
        low, high = effect_intervals(accepted)[-1]["parameters"]["position"]["ci95"]
        if high - low > WIDE_INTERVAL * e.rig.length:
            proposal = next_experiment.propose_sensor_position(
                accepted, e.observations, place.form, low, high
            )
            return None if proposal is None else str(proposal)
    return None


def _stand_in(e: Explanation, entry: dict) -> dict:
    """The nameless network that the corrected twin has."""
    found = missing_immittance(e.judgement.accepted, e.observations)
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
        "model_error": {
            "before": float(e.search.base.model_error),
            "after": float(e.judgement.accepted.model_error),
        },
        "left_out": list(e.validation.left_out),
        "parameters_agree_within_sd": float(e.validation.disagreement),
    }


def write_verdict(explanation: Explanation, folder: str | Path) -> dict:
    """Write verdict.json and twin.json into `folder` (made if needed); returns the verdict.

    Each file appears whole or not at all.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    result = verdict_dict(explanation)
    _write(folder / "twin.json", twin_file.to_dict(explanation.twin))
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
