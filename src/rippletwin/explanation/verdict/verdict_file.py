"""verdict.json and twin.json: the explanation as plain data with fixed keys."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from rippletwin import store
from rippletwin.explanation.checks.profile_intervals import (
    effect_intervals,
    pump_intervals,
    sensor_intervals,
)
from rippletwin.explanation.checks.support import Support
from rippletwin.explanation.localise.missing_immittance import find_missing_immittance, is_passive
from rippletwin.explanation.localise.shaft_orders import ShaftEffect
from rippletwin.explanation.verdict.decision import (
    equivalent_places,
    posterior_probabilities,
    rival_fits,
)
from rippletwin.explanation.verdict.explanation import Explanation
from rippletwin.explanation.verdict.mismatch_entry import NOTHING_MISSING, describe_mismatch
from rippletwin.explanation.verdict.next_experiment import (
    propose_recording,
    propose_sensor_position,
)
from rippletwin.explanation.verdict.places import element_and_extent, element_in_words
from rippletwin.explanation.verdict.summary_text import describe_verdict
from rippletwin.twin import twin_file
from rippletwin.twin.effects.library import generalisations
from rippletwin.twin.unknown_load import load_curve

WIDE_INTERVAL = 0.15  # of the line's length; a wider one asks for one more sensor


def verdict_dict(explanation: Explanation) -> dict:
    """The verdict as plain data, with the keys of verdict.json."""
    e = explanation
    decision = e.decision
    verdict, shaft_effects = decision.verdict, _shaft_effects(e)
    if shaft_effects and verdict in NOTHING_MISSING:
        is_named = any(effect["support"] == "established" for effect in shaft_effects)
        verdict = "named" if is_named else "unexplained"
    entries = []
    if verdict in ("named", "ambiguous", "unexplained"):
        entries = effect_intervals(decision.accepted)
    effects = [*_line_effects(e, entries), *shaft_effects]
    # Not where shaft orders alone are named: the search accepted nothing then.
    places = equivalent_places(e.search) if decision.verdict in ("named", "ambiguous") else ()
    curve = load_curve(decision.accepted.twin, decision.accepted.covariance, e.observations)
    result = {
        "verdict": verdict,
        "mismatch": describe_mismatch(e, verdict, entries, shaft_effects),
        "effects": effects,
        "remainder": _remainder(e, entries),
        "equivalents": [list(names) for names in (*decision.equivalents, *places)],
        "next_recording": _next_recording(e, places),
        "fit": _fit_scores(e),
        "without": [asdict(sensitivity) for sensitivity in e.prior_sensitivity],
        "pump": pump_intervals(decision.accepted),
        "load": None if curve is None else curve.as_dict(),
        "sensors": sensor_intervals(decision.accepted),
        "warnings": list(e.warnings),
        "sentence": "",
    }
    result["sentence"] = describe_verdict(e, result, entries)
    return result


def _line_effects(e: Explanation, entries: list[dict]) -> list[dict]:
    """The effects of the explanation, each with its support."""
    supports = {(s.name, s.place): s for s in e.decision.supports}
    probabilities = posterior_probabilities(e.search, e.decision.accepted)
    effects = []
    for entry in entries:
        if not entry["effect"].named:
            continue
        support = supports.get((entry["effect"].name, str(entry["place"])))
        effects.append(
            {
                "name": entry["effect"].name,
                "element": entry["place"].element,
                "parameters": entry["parameters"],
                "probability": probabilities[entry["effect"].name],
                "support": "suggested" if support is None else support.level,
                "limit_of": generalisations(entry["effect"], entry["place"]),
                "disagreement": None if support is None else _disagreement(support),
            }
        )
    return effects


def _disagreement(support: Support) -> dict | None:
    """The largest difference of a parameter's value from a part of the data and from all data."""
    found = support.disagreement
    if found is None:
        return None
    return asdict(found) | {"parameter": found.parameter.rpartition(".")[2]}


def _shaft_effects(e: Explanation) -> list[dict]:
    """The effects at shaft orders.

    Data that contradict themselves show no effect. While something else is unexplained, shaft
    orders establish none: the twin that interprets them is incomplete. Nor does a fit of them that
    did not converge.
    """
    shaft_orders = e.shaft_orders
    if shaft_orders is None or e.decision.verdict == "bad_data":
        return []
    is_doubtful = e.decision.verdict == "unexplained" or not shaft_orders.converged
    support = "supported" if is_doubtful else "established"
    return [_shaft_effect(effect, support) for effect in shaft_orders.effects]


def _shaft_effect(effect: ShaftEffect, support: str) -> dict:
    """It has no `probability`: no evidence was calculated for it."""
    amplitude: dict[str, Any] = {"value": effect.value}
    if effect.interval is not None:
        amplitude["ci95"] = list(effect.interval)
    amplitude["unit"] = "rad" if effect.name == "speed_fluctuation" else "1"
    return {
        "name": effect.name,
        "element": "source",
        "parameters": {} if effect.value is None else {"amplitude": amplitude},
        "support": support,
    }


def _next_recording(e: Explanation, places: tuple) -> str | None:
    """The recording that discriminates between rivals, or narrows a passive network's position."""
    verdict, accepted = e.decision.verdict, e.decision.accepted
    proposal = None
    if verdict == "ambiguous" or places:
        # rivals are of the best explanation, without a network that stands in
        proposal = propose_recording(e.search.best, rival_fits(e.search), e.observations)
    elif verdict == "unexplained" and accepted.hypothesis:
        effect, _ = accepted.hypothesis[-1]
        if effect.named:
            return None
        low, high = effect_intervals(accepted)[-1]["parameters"]["position"]["ci95"]
        if high - low > WIDE_INTERVAL * e.rig.length:
            proposal = propose_sensor_position(accepted, e.observations, low, high)
    return None if proposal is None else str(proposal)


def _remainder(e: Explanation, entries: list[dict]) -> dict | None:
    """What remains beside the explanation, and the network that stands in for it in the twin."""
    networks = [k for k, entry in enumerate(entries) if not entry["effect"].named]
    stand_in = _stand_in(e, entries, networks[0]) if networks else None
    r = e.remainder
    if r is None and stand_in is None:
        return None
    if stand_in is not None:
        stand_in["beside"] = [_stand_in(e, entries, k) for k in networks[1:]]
        element, position = stand_in.pop("element"), stand_in["parameters"]["position"]["ci95"]
        law = stand_in.pop("follows")
    elif r.element is None:
        element = position = law = None
    else:
        element, position = element_in_words(e.rig, r.element, r.interval)
        law = r.law
    return {
        "misfit": float(e.validation.after["in_sample"].misfit) if r is None else r.misfit,
        "model_error": float(e.decision.accepted.model_error),
        "element": element,
        "position_m": position,
        "bands_hz": [] if r is None else r.bands_hz,
        "conditions": [] if r is None else r.conditions,
        "law": law,
        "stand_in": stand_in,
    }


def _stand_in(e: Explanation, entries: list[dict], index: int) -> dict:
    """A passive network of the corrected twin, the effect `index` of the explanation."""
    entry = entries[index]
    accepted, form = e.decision.accepted, entry["place"].form
    effect, _, values = accepted.twin.effect_values(accepted.twin.theta)[index]
    if effect.describe is not None:
        follows = effect.describe(values)
    else:
        missing = find_missing_immittance(accepted, e.observations, index)
        follows = None if missing is None else missing.law_in_words
    element, _ = element_and_extent(e.rig, entry["place"], entry["parameters"])
    return {
        "form": "short two-port" if form is None else f"{form} one-port",
        "element": element,
        "passive": is_passive(accepted, index),
        "parameters": entry["parameters"],
        "follows": follows,
    }


def _fit_scores(e: Explanation) -> dict:
    """Misfits and model errors without effects ("before") and with them ("after").

    The misfits before are the best that a calibration without effects reaches. Those after are of
    the corrected line with the corrected flow ripple of the pump, and beside them those with the
    nominal ripple. The model error before is that of the base.
    """

    def scores(which):
        return {k: float(v.misfit) for k, v in which.items()} | {
            f"theil_{k}": float(v.theil) for k, v in which.items()
        }

    return {
        "before": scores(e.validation.without_effects),
        "after": scores(e.validation.after),
        "nominal_ripple": scores(e.validation.nominal_ripple),
        "model_error": {
            "before": float(e.search.base.model_error),
            "after": float(e.decision.accepted.model_error),
            "held_out": float(e.validation.model_error),
        },
        "expected_gain": {
            "before": float(e.search.base.expected_gain),
            "after": float(e.decision.accepted.expected_gain),
        },
        "left_out": list(e.validation.left_out),
        "parameters_agree_within_sd": float(e.validation.disagreement),
    }


def write_verdict(explanation: Explanation, folder: str | Path) -> dict:
    """Write verdict.json and twin.json into `folder`, made if needed; returns the verdict.

    Both files appear whole or not at all.
    """
    result = verdict_dict(explanation)
    covariance = {"covariance": explanation.decision.accepted.covariance}
    twin = twin_file.to_dict(explanation.twin) | covariance
    store.write_texts(folder, {"twin.json": _as_json(twin), "verdict.json": _as_json(result)})
    return result


def _as_json(data: dict) -> str:
    return json.dumps(data, indent=1, default=_plain, allow_nan=False) + "\n"


def _plain(value):
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    raise TypeError(f"{type(value)} cannot be written as JSON")
