"""The verdict as a paragraph for an engineer."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rippletwin.calibration.laplace import UNCONVERGED_GAIN
from rippletwin.case.quantities import (
    plain,
    unit_of,
    write_share,
    write_stated,
    write_value,
)
from rippletwin.case.words import (
    name_effect,
    name_effects,
    name_equivalents,
    name_parameter,
    name_place,
)
from rippletwin.explanation.checks.alarms import largest_pull
from rippletwin.explanation.localise.source_free_fits import compare_evidence
from rippletwin.explanation.thresholds import MUCH_MODEL_ERROR, PULL_ALARM
from rippletwin.explanation.verdict.explanation import Explanation
from rippletwin.explanation.verdict.number_text import (
    disagreement_sentences,
    load_sentences,
    parameters_sentence,
    pump_sentences,
    sensor_sentences,
)
from rippletwin.explanation.verdict.places import element_and_extent, extent_in_words
from rippletwin.explanation.verdict.pressure_text import pressure_sentences
from rippletwin.explanation.verdict.remainder_text import (
    remainder_sentences,
    ripple_sentences,
    shaft_order_sentences,
)

SOURCE_FREE_SHARE = 0.2  # of the evidence that must remain if the source is unknown
OPENINGS = {
    "consistent": "The recordings agree with the twin within the tolerances of the data sheet.",
    "calibration_only": "No physics is missing, but nominal values of the line are outside their "
    "stated tolerances: use the calibrated values and check the data sheet.",
}
LESSER = {
    "supported": "An error of another element, or another law at the same place, would explain "
    "the recordings as well.",
    "suggested": "Other values of the data sheet would explain the recordings as well, or data "
    "that were left out speak against it.",
}
"""What it means that an effect is not established, by its support."""


def describe_verdict(e: Explanation, result: dict, entries: Sequence[dict]) -> str:
    """What an engineer can act on, as paragraphs of short sentences, the most important first.

    result   the verdict's other keys (`verdict_file.verdict_dict`)
    entries  the effects of the accepted fit (`profile_intervals.effect_intervals`)
    """
    verdict = result["verdict"]
    if verdict == "bad_data":
        said = [f"The data contradict themselves: {e.decision.contradiction}.", *_drift(e)]
        return plain(" ".join([*said, *_pulls(e)]))
    named = [entry for entry in entries if entry["effect"].named]
    levels = {(s.name, s.place): s.level for s in e.decision.supports}
    certain = [entry for entry in named if _level(levels, entry) == "established"]
    is_named = verdict in ("named", "ambiguous") and bool(entries)
    found = _found(e, result, entries, certain)
    if named:
        found += _lesser(e, [entry for entry in named if entry not in certain], levels)
        found += _contradictions(e, named)
    paragraphs = [
        [*found, *_unfinished_fit(result["fit"])],
        [*_undecided(result), *_next_recording(result)],
        _values(e, certain),
        [
            *(_data_sheet_rivals(e, result["fit"]) if named else []),
            *_alike(e, certain),
            *(_source_free(e) if is_named else []),
        ],
        [
            *remainder_sentences(result["remainder"]),
            *(ripple_sentences(e.observations, result["fit"]) if entries else []),
        ],
        [
            *pump_sentences(result["pump"]),
            *load_sentences(result["load"]),
            *sensor_sentences(result["sensors"]),
            *shaft_order_sentences(e.shaft_orders),
            *_drift(e),
            *_pulls(e, verdict == "calibration_only" and not e.alarms.raised),
        ],
    ]
    return plain("\n".join(" ".join(sentences) for sentences in paragraphs if sentences))


def _found(
    e: Explanation, result: dict, entries: Sequence[dict], certain: Sequence[dict]
) -> list[str]:
    """The verdict: what is established, or what the recordings say instead."""
    if result["verdict"] in OPENINGS:
        return [OPENINGS[result["verdict"]]]
    errors = [write_share(result["fit"][which]["held_out"]) for which in ("before", "after")]
    falls = (
        f"the error on data that were left out falls from {errors[0]} to {errors[1]} of the ripple"
    )
    if result["verdict"] == "unexplained":
        where = f" {name_place(_element(e, entries[0]))}" if entries else ""
        sentences = [f"Something is missing{where}, and nothing is established."]
        if entries:
            sentences.append(f"With the best description {falls}.")
        named = [entry for entry in entries if entry["effect"].named]
        if named:
            sentences.append(f"Nearest in the library comes {_effects(e, named)}.")
        return sentences
    if not e.decision.established:  # what is named acts at shaft orders alone
        return ["At the piston orders nothing is missing."]
    return [
        f"The twin lacks {_effects(e, certain)}. This is established.",
        f"With this, and with the pump's flow ripple corrected, {falls}.",
        *_carries_over(result["fit"]["model_error"]),
    ]


def _carries_over(model_error: Mapping[str, float]) -> list[str]:
    """That the explanation does not carry over to data that were left out, where it does not."""
    if model_error["held_out"] <= MUCH_MODEL_ERROR:
        return []
    held_out, fitted = (write_share(model_error[which]) for which in ("held_out", "after"))
    return [
        f"It does not carry over well: the line errs by {held_out} on data that were left out, by "
        f"{fitted} on those that were fitted."
    ]


def _is_always_present(e: Explanation, entry: dict) -> bool:
    return entry["effect"].certain(e.rig, entry["place"])


def _level(levels: Mapping[tuple[str, str], str], entry: dict) -> str:
    """Support of an entry; one without is suggested."""
    return levels.get((entry["effect"].name, str(entry["place"])), "suggested")


def _lesser(e: Explanation, entries: Sequence[dict], levels: Mapping) -> list[str]:
    """The effects that are supported or suggested, and what that means.

    What is always present is not doubted, whatever these recordings say of it.
    """
    always = [entry for entry in entries if _is_always_present(e, entry)]
    doubted = [entry for entry in entries if not _is_always_present(e, entry)]
    sentences = []
    for level, why in LESSER.items():
        own = [entry for entry in doubted if _level(levels, entry) == level]
        if own:
            sentences.append(f"{_capital(level)} only: {_effects(e, own)}. {why}")
    if always:
        sentences.append(
            f"{_capital(_effects(e, always))}: always present, so included; these recordings "
            "alone do not establish it."
        )
    return sentences


def _contradictions(e: Explanation, entries: Sequence[dict]) -> list[str]:
    """Effects to which parts of the recordings give different values."""
    supports = {(s.name, s.place): s for s in e.decision.supports if s.contradicts_its_law}
    keys = [(entry["effect"].name, str(entry["place"])) for entry in entries]
    return disagreement_sentences(
        [
            (_effect(e, entry), entry["parameters"], supports[key].disagreement)
            for entry, key in zip(entries, keys)
            if key in supports
        ]
    )


def _undecided(result: dict) -> list[str]:
    """What these recordings cannot tell apart."""
    if result["verdict"] not in ("named", "ambiguous") or not result["equivalents"]:
        return []
    return [f"These recordings cannot tell apart: {name_equivalents(result['equivalents'])}."]


def _next_recording(result: dict) -> list[str]:
    return [f"Next recording: {result['next_recording']}."] if result["next_recording"] else []


def _values(e: Explanation, entries: Sequence[dict]) -> list[str]:
    """The parameters of effects."""
    told = [
        parameters_sentence(_effect(e, entry), entry["parameters"])
        for entry in entries
        if entry["parameters"]
    ]
    return ["Values, with 95 % intervals in brackets.", *told] if told else []


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
    if ripple_sentences(e.observations, fit):
        return []
    sentences = []
    for s in e.prior_sensitivity:
        if s.rivals and s.pull > PULL_ALARM:
            unit = unit_of(s.unit, s.parameter)
            sentences.append(
                f"Only the data sheet speaks for {name_effect(s.effect, s.place)}: without it the "
                f"line would fit to {write_share(s.misfit)} if the {name_parameter(s.parameter)} "
                f"were {write_value(s.value, unit)} instead of {write_stated(s.nominal, unit)}. "
                f"That is {s.pull:.0f} standard deviations from the data sheet."
            )
    return sentences


def _alike(e: Explanation, entries: Sequence[dict]) -> list[str]:
    """What the mean pressures of these recordings cannot tell from the effects of `entries`."""
    names = [entry["effect"].name for entry in entries]
    return pressure_sentences(names, e.observations, e.rig.fluid.is_gas) if names else []


def _source_free(e: Explanation) -> list[str]:
    """Whether the accepted effects are also seen if the source is unknown."""
    for row in compare_evidence(e.search.leading_fits, e.source_free_fits):
        if row["effects"] == e.decision.accepted.label:
            if row["source_free"] > SOURCE_FREE_SHARE * row["informed"]:
                return ["The evidence remains if the pump's flow ripple is taken as unknown."]
            return [
                "The evidence rests on the stated flow ripple of the pump: it vanishes if that is "
                "taken as unknown."
            ]
    return []


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
        is_told = "pull" in e.alarms.raised or is_off_data_sheet
    else:
        pull, name = largest_pull(accepted)
        is_told = pull > PULL_ALARM
    if not is_told:
        return []
    whose = "that of the other recordings" if name.startswith("state[") else "the data sheet"
    return [f"Check the {name_parameter(name)}: it is {pull:.1f} standard deviations from {whose}."]


def _effects(e: Explanation, entries: Sequence[dict]) -> str:
    """Effects in words, those of one name together, each at its place."""
    return name_effects((entry["effect"].name, _place(e, entry)) for entry in entries)


def _effect(e: Explanation, entry: dict) -> str:
    """An effect at its element, in words."""
    return name_effect(entry["effect"].name, _place(e, entry, extent=False))


def _place(e: Explanation, entry: dict, extent: bool = True) -> str:
    """Place of an effect for `name_effect`; that of one with a position says where that is."""
    if "position" not in entry["parameters"]:
        return str(entry["place"])
    place = name_place(_element(e, entry))
    return (
        f"{place}, {extent_in_words(entry['parameters']['position']['ci95'])}" if extent else place
    )


def _element(e: Explanation, entry: dict) -> str:
    element, _ = element_and_extent(e.rig, entry["place"], entry["parameters"])
    return element
