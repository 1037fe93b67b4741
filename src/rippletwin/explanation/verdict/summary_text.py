"""The verdict in a paragraph for an engineer."""

from __future__ import annotations

from collections.abc import Sequence

from rippletwin.explanation.checks import alarms
from rippletwin.explanation.localise import source_free_fits
from rippletwin.explanation.verdict.decision import MAX_MODEL_ERROR_TO_NAME, equivalent_places
from rippletwin.explanation.verdict.explanation import Explanation
from rippletwin.explanation.verdict.places import element_and_extent, join_words

SAME_VALUE = 0.05  # relative; mean pressures closer than this are one
OPENINGS = {
    "consistent": "The recordings are what the twin predicts within the data sheet's tolerances.",
    "calibration_only": "The line's nominal values are off by more than their stated tolerances, "
    "but no physics is missing: use the calibrated values and look at the data sheet.",
}


def summary_text(e: Explanation, result: dict, found: list[dict], base) -> str:
    """One paragraph an engineer can act on."""
    kind, fit = result["verdict"], result["fit"]
    before, after = fit["before"]["held_out"], fit["after"]["held_out"]
    words = [OPENINGS.get(kind, "")]
    names = [f"{f['effect'].name.replace('_', ' ')} at the {_place(e, f)}" for f in found]
    if kind == "named" and not found:  # what was named acts at shaft orders alone
        words = ["At the pistons' harmonics the twin lacks nothing."]
    elif kind in ("named", "ambiguous"):
        words = [
            f"The twin lacks {join_words(names)}: with it the misfit on data it has not seen goes "
            f"from {before:.1%} to {after:.1%} of the measured ripple."
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
        words += _against_the_sheet(e, ", which is what rejects it.")
        words += is_air_at_one_pressure(
            [f["effect"].name for f in found], [o.load_pressure for o in e.observations]
        )
        if kind == "ambiguous":
            classes = "; ".join(join_words(names) for names in result["equivalents"])
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
        elif found:
            unaccounted = ""
            if e.judgement.accepted.model_error > MAX_MODEL_ERROR_TO_NAME:
                unaccounted = ", which the pump and the sensors do not account for"
            words.append(
                f"Of what has a name {join_words(names)} comes nearest: misfit on unseen data "
                f"{before:.1%} to {after:.1%}{unaccounted}."
            )
            words += _against_the_sheet(e, ".")
    if kind in ("named", "ambiguous", "unexplained") and result["next_recording"]:
        words.append(f"Next: {result['next_recording']}.")
    if kind in ("named", "ambiguous") and found:
        if equivalent_places(e.search):
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
    pulled = alarms.largest_pull(e.judgement.accepted)
    if e.judgement.accepted.hypothesis and pulled[0] > alarms.PULL_ALARM:
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


def _against_the_sheet(e: Explanation, end: str) -> list[str]:
    """Where the data alone would do without an effect, and only the data sheet says no."""
    return [
        f"Without {w.effect.replace('_', ' ')} a fit at {w.misfit:.1%} would be had with "
        f"{w.parameter} at {w.value:.3g} {w.unit}, {w.pull:.0f} standard deviations from the "
        f"data sheet{end}"
        for w in e.without
        if w.rivals and w.pull > alarms.PULL_ALARM
    ]


def is_air_at_one_pressure(names: Sequence[str], pressures: Sequence[float | None]) -> list[str]:
    """What else accepted effects `names` may be where all `pressures` (Pa) are one: air is any
    liquid that yields less the more it is pressed. What tells their laws apart is how that goes
    on from one pressure to another."""
    known = [p for p in pressures if p is not None]
    if "entrained_air" not in names or not known or max(known) > (1 + SAME_VALUE) * min(known):
        return []
    return [
        "At one mean pressure any liquid that stiffens as it is compressed would do as well as "
        "air: record at another."
    ]


def _passive(result: dict) -> str:
    return "passive" if result["stand_in"]["passive"] else "not passive"


def _without_source(e: Explanation) -> str:
    """What a fit that knows nothing of the source says of the accepted effects."""
    for row in source_free_fits.compare_evidence(e.search, e.blind):
        if row["effects"] == e.judgement.accepted.label:
            if row["source_free"] > 0.2 * row["informed"]:
                return "It stands in a fit that is blind to the source too."
            return "Blind to the source it is not seen: it acts at the pump or only there is known."
    return ""


def _place(e: Explanation, entry: dict) -> str:
    element, (low, high) = element_and_extent(
        e.rig, entry["effect"], entry["place"], entry["parameters"]
    )
    if "position" in entry["parameters"]:
        return f"line, {low:.2f} to {high:.2f} m from the pump ({element})"
    return element
