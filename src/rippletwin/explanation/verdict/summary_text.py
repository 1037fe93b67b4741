"""The verdict as a paragraph for an engineer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rippletwin.calibration.laplace import UNCONVERGED_GAIN
from rippletwin.case.quantities import plain, unit_of, write_value
from rippletwin.explanation.checks.alarms import largest_pull
from rippletwin.explanation.localise.shaft_orders import ShaftOrders
from rippletwin.explanation.localise.source_free_fits import compare_evidence
from rippletwin.explanation.thresholds import PULL_ALARM
from rippletwin.explanation.verdict.decision import equivalent_places
from rippletwin.explanation.verdict.explanation import Explanation
from rippletwin.explanation.verdict.number_text import (
    load_sentences,
    parameters_sentence,
    pump_sentences,
    sensor_sentences,
    spaced,
)
from rippletwin.explanation.verdict.places import element_and_extent, join_words

SAME_PRESSURE = 0.05  # relative; mean pressures closer than this count as one
SOURCE_FREE_SHARE = 0.2  # of the evidence that must remain if the source is unknown
RIPPLE_ERROR_RATIO = 3.0
"""Misfit with the nominal ripple over model error from which nearly all of it is an error of the
ripple: the rest, a tenth in power, is the model error."""
OPENINGS = {
    "consistent": "The recordings agree with the twin within the tolerances of the data sheet.",
    "calibration_only": "No physics is missing, but nominal values of the line are outside their "
    "stated tolerances: use the calibrated values and check the data sheet.",
}
LESSER = {
    "supported": "an unlisted error of another element, or a free law at the same place, would do "
    "as well",
    "suggested": "a free data sheet would do as well, or data that were left out speak against it",
}
"""What it means that an effect is not established, by its support."""


def summary_text(e: Explanation, result: dict, entries: Sequence[dict]) -> str:
    """One paragraph that an engineer can act on.

    result   the verdict's other keys (`verdict_file.verdict_dict`)
    entries  the effects of the accepted fit (`profile_intervals.effect_intervals`)
    """
    verdict = result["verdict"]
    if verdict == "bad_data":
        return " ".join(
            [f"The data contradict themselves: {e.decision.contradiction}.", *_drift(e), *_pulls(e)]
        )
    sentences = []
    if verdict in OPENINGS:
        sentences.append(OPENINGS[verdict])
    elif verdict == "unexplained":
        sentences += _unexplained(e, result, entries)
    elif e.decision.established:
        sentences += _named(e, result, entries)
    else:  # what is named acts at shaft orders alone
        sentences.append("At the piston orders nothing is missing.")
    if result["next_recording"]:
        sentences.append(f"Next recording: {result['next_recording']}.")
    if verdict in ("named", "ambiguous") and entries:
        if equivalent_places(e.search):
            sentences.append("Its place or form is not determined: see equivalents.")
        sentences += _source_free(e)
    sentences += _remainder(result["remainder"])
    if entries:
        sentences += _ripple_error(e, result["fit"])
    sentences += _unfinished_fit(result["fit"])
    sentences += pump_sentences(result["pump"])
    sentences += load_sentences(result["load"])
    sentences += sensor_sentences(result["sensors"])
    sentences += _shaft_orders(e.shaft_orders)
    sentences += _drift(e)
    sentences += _pulls(e, is_off_data_sheet=verdict == "calibration_only" and not e.alarms.raised)
    return " ".join(sentences)


def _named(e: Explanation, result: dict, entries: Sequence[dict]) -> list[str]:
    """Which effects are established, their parameters, and what else would fit."""
    before, after = (result["fit"][which]["held_out"] for which in ("before", "after"))
    levels = {(s.name, s.place): s.level for s in e.decision.supports}
    named = [x for x in entries if x["effect"].named]
    certain = [x for x in named if _level(levels, x) == "established"]
    names = [_effect_and_place(e, entry) for entry in certain]
    sentences = [
        f"The twin lacks {join_words(names)}. This is established. With the effects listed and the "
        f"pump's flow ripple corrected, the misfit on held-out data goes from {before:.1%} to "
        f"{after:.1%} of the measured ripple."
    ]
    for name, entry in zip(names, certain):
        if entry["parameters"]:
            sentences.append(parameters_sentence(name, entry["parameters"]))
        if entry["effect"].certain:
            sentences.append(
                f"{spaced(entry['effect'].name).capitalize()} is always present, so it is included "
                "unless the data contradict it."
            )
    sentences += _lesser(e, [x for x in named if x not in certain], levels)
    sentences += _data_sheet_rivals(e, result["fit"])
    sentences += liquid_like_air(
        [entry["effect"].name for entry in certain], [o.load_pressure for o in e.observations]
    )
    if result["verdict"] == "ambiguous":
        classes = "; ".join(join_words(names) for names in result["equivalents"])
        sentences.append(f"These recordings cannot discriminate between {classes}.")
    return sentences


def _level(levels: Mapping[tuple[str, str], str], entry: dict) -> str:
    """Support of an entry; one without is suggested."""
    return levels.get((entry["effect"].name, str(entry["place"])), "suggested")


def _lesser(e: Explanation, entries: Sequence[dict], levels: Mapping) -> list[str]:
    """The effects that are supported or suggested, and what that means."""
    sentences = []
    for level, why in LESSER.items():
        names = [_effect_and_place(e, x) for x in entries if _level(levels, x) == level]
        if names:
            verb = "is" if len(names) == 1 else "are"
            sentences.append(f"{_capital(join_words(names))} {verb} {level} only: {why}.")
    return sentences


def _unexplained(e: Explanation, result: dict, entries: Sequence[dict]) -> list[str]:
    """Where something is missing, and what describes it best."""
    before, after = (result["fit"][which]["held_out"] for which in ("before", "after"))
    where = f" (location: {_place(e, entries[0])})" if entries else ""
    sentences = [f"Something is missing, and nothing is established{where}."]
    named = [entry for entry in entries if entry["effect"].named]
    if entries:
        sentences.append(
            f"With the best description the misfit on held-out data goes from {before:.1%} to "
            f"{after:.1%}."
        )
    if named:
        levels = {(s.name, s.place): s.level for s in e.decision.supports}
        names = join_words([_effect_and_place(e, entry) for entry in named])
        sentences.append(f"In the library {names} comes nearest.")
        sentences += _lesser(e, named, levels)
        sentences += _data_sheet_rivals(e, result["fit"])
    return sentences


def _remainder(remainder: dict | None) -> list[str]:
    """What remains, where and by which law, and what stands in for it."""
    if remainder is None:
        return []
    rest = (
        f"What then remains is {remainder['model_error']:.1%} of the reading beside errors of the "
        "pump's ripple"
    )
    if remainder["element"] is None:
        return [f"{rest}; no single element accounts for it."]
    low, high = remainder["position_m"]
    where = f"{low:.2f} to {high:.2f} m from the pump" if high > low else f"{low:.2f} m"
    sentence = f"{rest}. It belongs to {remainder['element']} ({where})"
    if remainder["law"] is not None:
        sentence += f" and is {remainder['law']}"
    sentences = [sentence + "."]
    network = remainder["stand_in"]
    if network is not None:
        passive = "passive" if network["passive"] else "not passive"
        sentences.append(f"A {network['form']} ({passive}) stands in for it in the twin.")
        sentences += [
            f"Beside it acts a {more['form']} at {more['parameters']['position']['value']:.2f} m"
            + (f", {more['follows']}." if more["follows"] else ".")
            for more in network.get("beside", ())
        ]
    return sentences


def _ripple_error(e: Explanation, fit: dict) -> list[str]:
    """How wrong the pump's nominal ripple is, where there is one and it is more wrong than the
    line."""
    if not any(o.source == "nominal" for o in e.observations):
        return []
    misfit, model_error = fit["nominal_ripple"]["in_sample"], fit["model_error"]["after"]
    if misfit < RIPPLE_ERROR_RATIO * model_error:
        return []
    return [
        f"With the pump's nominal flow ripple the corrected line misses {misfit:.0%} of the "
        f"reading, with the corrected ripple {fit['after']['in_sample']:.1%}."
    ]


def _unfinished_fit(fit: dict) -> list[str]:
    """That the fit has not come to a stationary point, where that could change the verdict."""
    gain = fit["expected_gain"]["after"]
    if gain <= UNCONVERGED_GAIN:
        return []
    return [
        f"The fit did not converge: one more step promises {gain:.1f} of log posterior. Its "
        "numbers and the verdict are uncertain."
    ]


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _data_sheet_rivals(e: Explanation, fit: dict) -> list[str]:
    """Fits without an effect that only the data sheet rejects.

    Their misfits have the nominal ripple: where it is wrong they compare nothing.
    """
    if _ripple_error(e, fit):
        return []
    return [
        f"Without {spaced(s.effect)} ({s.place}) the line would fit to {s.misfit:.1%} with "
        f"{s.parameter} at {plain(write_value(s.value, unit_of(s.unit, s.parameter)))}. That is "
        f"{s.pull:.0f} standard deviations from the data sheet, and only the data sheet rejects it."
        for s in e.prior_sensitivity
        if s.rivals and s.pull > PULL_ALARM
    ]


def liquid_like_air(names: Sequence[str], pressures: Sequence[float | None]) -> list[str]:
    """A warning where accepted effects `names` include entrained air at one pressure (Pa).

    Only the change with pressure discriminates air from any liquid that stiffens.
    """
    known = [p for p in pressures if p is not None]
    if "entrained_air" not in names or not known or max(known) > (1 + SAME_PRESSURE) * min(known):
        return []
    return [
        "At a single mean pressure any liquid that stiffens under compression fits as well as "
        "entrained air: record at another pressure."
    ]


def _source_free(e: Explanation) -> list[str]:
    """Whether the accepted effects are also seen if the source is unknown."""
    for row in compare_evidence(e.search.leading_fits, e.source_free_fits):
        if row["effects"] == e.decision.accepted.label:
            if row["source_free"] > SOURCE_FREE_SHARE * row["informed"]:
                return ["The evidence remains if the source is assumed unknown."]
            return [
                "The evidence rests on the stated source: it vanishes if the source is assumed "
                "unknown."
            ]
    return []


def _shaft_orders(shaft_orders: ShaftOrders | None) -> list[str]:
    """What the shaft orders indicate."""
    if shaft_orders is None or shaft_orders.name is None:
        return []
    if shaft_orders.name == "speed_fluctuation":
        effect = f"a speed fluctuation with a phase modulation of {shaft_orders.value:.2g} rad"
    else:
        effect = f"a spread of the pistons of {shaft_orders.value:.2g} of the mean flow"
    if shaft_orders.interval is not None:
        low, high = shaft_orders.interval
        effect += f" (95 % interval {low:.2g} to {high:.2g})"
    return [
        f"Shaft orders between the piston orders have {shaft_orders.level:.1%} of the ripple and "
        f"indicate {effect}. They resemble a fault of a single piston."
    ]


def _drift(e: Explanation) -> list[str]:
    """The recording whose state changed, if any."""
    if "drift" not in e.alarms.raised:
        return []
    return [f"The two halves of {e.alarms.drift[1]} differ: the state drifted."]


def _pulls(e: Explanation, is_off_data_sheet: bool = False) -> list[str]:
    """Parameters that are far from the data sheet.

    `is_off_data_sheet` says that the verdict rests on the data sheet alone; otherwise a parameter
    of the base must raise the alarm.
    """
    accepted = e.decision.accepted
    if not accepted.hypothesis:
        pull, name = e.alarms.pull
        if "pull" in e.alarms.raised or is_off_data_sheet:
            return [f"{name} is {pull:.1f} standard deviations from the data sheet."]
        return []
    pull, name = largest_pull(accepted)
    if pull > PULL_ALARM:
        return [f"Check {name}: it is {pull:.1f} standard deviations from the data sheet."]
    return []


def _effect_and_place(e: Explanation, entry: dict) -> str:
    return f"{spaced(entry['effect'].name)} ({_place(e, entry)})"


def _place(e: Explanation, entry: dict) -> str:
    """Element at which an effect acts, with its position in metres if it has one."""
    element, (low, high) = element_and_extent(
        e.rig, entry["effect"], entry["place"], entry["parameters"]
    )
    if "position" in entry["parameters"]:
        return f"{element}, {low:.2f} to {high:.2f} m from the pump"
    return element
