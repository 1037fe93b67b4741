"""The verdict in plain words: what is the matter, what remains and what to record."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rippletwin.case.quantities import write_probability, write_share
from rippletwin.case.words import join_words, name_effects, name_equivalents, name_place

TITLES = {
    "consistent": "The twin accounts for the recordings",
    "calibration_only": "The data sheet is off, no physics is missing",
    "named": "Missing physics found and named",
    "ambiguous": "Physics is missing, and more than one effect would explain it",
    "unexplained": "Physics is missing that the library does not contain",
    "bad_data": "The recordings contradict themselves",
}
POINT = 5e-3  # m: a shorter interval is a point
LESSER = ("supported", "suggested")


def verdict_title(verdict: Mapping) -> str:
    """The verdict as a headline."""
    return TITLES.get(verdict["verdict"], verdict["verdict"])


def verdict_sentence(verdict: Mapping) -> str:
    """The verdict in one plain sentence, and others on what is uncertain and what remains."""
    kind, effects = verdict["verdict"], verdict.get("effects") or []
    if kind == "consistent":
        return (
            "With numbers within the tolerances of the data sheet the twin predicts the healthy "
            f"recordings{_error_after(verdict)}."
        )
    if kind == "calibration_only":
        return (
            "With numbers outside the stated tolerances of the data sheet the twin predicts the "
            f"healthy recordings{_error_after(verdict)}: use the calibrated values below, and "
            "check the data sheet."
        )
    if kind == "bad_data":
        return verdict.get("sentence", "").strip() or "Repeat the recordings."
    if kind == "unexplained" or not effects:
        suggested = f"; what the recordings suggest is {_effects(effects)}" if effects else ""
        return (
            f"Something is missing {_where(verdict)}, and no effect of the library explains it"
            f"{suggested}."
        )
    certain = [e for e in effects if e.get("support", "established") == "established"]
    said = _effects(certain) or "an effect"
    sentences = [f"The rig has what its data sheet does not say: {said}{_change(verdict)}."]
    if kind == "ambiguous":
        rivals = name_equivalents(verdict.get("equivalents", ()))
        sentences.append(f"These recordings cannot tell apart: {rivals}.")
    for level in LESSER:
        lesser = [e for e in effects if e.get("support") == level]
        if lesser:
            sentences.append(f"{level.capitalize()} only: {_effects(lesser)}.")
    if kind == "named" and verdict.get("remainder"):
        sentences.append(_left(verdict["remainder"]))
    return " ".join(sentences)


def _left(remainder: Mapping) -> str:
    """What remains, and where, as a sentence."""
    words = [f"What remains is {write_share(remainder['misfit'])} of the ripple"]
    if remainder.get("element"):
        words.append(name_place(remainder["element"]))
    position = remainder.get("position_m")
    if position and position[1] - position[0] > POINT:
        words.append(f"({position[0]:.2f} to {position[1]:.2f} m from the pump)")
    return " ".join(words) + "."


def _effects(effects: Sequence[Mapping]) -> str:
    return name_effects((effect["name"], effect.get("element")) for effect in effects)


def _where(verdict: Mapping) -> str:
    where = (verdict.get("mismatch") or {}).get("where") or {}
    words = name_place(where.get("element", "line"))
    position = where.get("position_m")
    if position and position[1] - position[0] > POINT:
        words += f", {position[0]:.2f} to {position[1]:.2f} m from the pump"
    return words


def held_out(verdict: Mapping) -> tuple[float, float] | None:
    """Misfit of data left out before and after the correction; None where it is not known."""
    fit = verdict.get("fit") or {}
    pair = [(fit.get(which) or {}).get("held_out") for which in ("before", "after")]
    return None if None in pair else tuple(pair)


def _error_after(verdict: Mapping) -> str:
    errors = held_out(verdict)
    return "" if errors is None else f" with an error of {write_share(errors[1])}"


def _change(verdict: Mapping) -> str:
    errors = held_out(verdict)
    if errors is None:
        return ""
    before, after = map(write_share, errors)
    return f". With it the error on data that the twin has not seen falls from {before} to {after}"


def remaining_sentences(verdict: Mapping) -> list[str]:
    """What the corrected twin still misses."""
    sentences, remainder = [], verdict.get("remainder")
    errors = held_out(verdict)
    if errors is not None:
        after = write_share(errors[1])
        sentences.append(f"Data that the twin has not seen are predicted with an error of {after}.")
    nominal = ((verdict.get("fit") or {}).get("nominal_ripple") or {}).get("held_out")
    if errors is not None and nominal is not None and write_share(nominal) != after:
        sentences.append(
            "For that the pump's flow ripple is corrected too; with the ripple of its data sheet "
            f"the error is {write_share(nominal)}."
        )
    if remainder:
        sentences.append(_left(remainder))
        if remainder.get("bands_hz"):
            sentences.append(f"It stands out at {_bands(remainder['bands_hz'])}.")
        if remainder.get("law"):
            sentences.append(f"It behaves like {remainder['law']}.")
        if remainder.get("stand_in"):
            sentences.append("A passive network stands in for it in the corrected twin.")
    elif "remainder" in verdict:
        sentences.append("Nothing that stands out remains.")
    else:
        error = ((verdict.get("fit") or {}).get("model_error") or {}).get("after")
        if error is not None:
            sentences.append(f"The error of the model itself is estimated at {write_share(error)}.")
    return sentences


def mismatch_sentences(verdict: Mapping) -> list[str]:
    """How sure it is that something was missing, and where it showed."""
    mismatch = verdict.get("mismatch") or {}
    if not mismatch.get("present"):
        return []
    chance = write_probability(mismatch["p_value"])
    sentences = [f"If nothing were missing, so much evidence would have a probability of {chance}."]
    where = mismatch.get("where") or {}
    if where.get("bands_hz"):
        bands = _bands(where["bands_hz"])
        sentences.append(f"Without the correction the twin misses most at {bands}.")
    return sentences


def next_sentences(verdict: Mapping) -> list[str]:
    """What to record next."""
    if verdict.get("next_recording"):
        text = str(verdict["next_recording"])
        return [text[:1].upper() + text[1:].rstrip(".") + "."]
    if verdict["verdict"] == "bad_data":
        return ["Repeat the recording that contradicts the others."]
    if verdict["verdict"] == "unexplained" or verdict.get("remainder"):
        return ["No recording is proposed. One more sensor and one more pressure tell most."]
    return ["Nothing more is needed for this verdict."]


def _bands(bands: Sequence[Sequence[float]]) -> str:
    return join_words([f"{low:.0f} to {high:.0f} Hz" for low, high in bands])
