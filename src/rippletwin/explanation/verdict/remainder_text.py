"""Sentences on what an explanation leaves: in the line, in the pump's ripple, at shaft orders."""

from __future__ import annotations

from collections.abc import Sequence

from rippletwin.case.quantities import unit_of, write_interval, write_share, write_value
from rippletwin.case.words import name_place
from rippletwin.explanation.localise.shaft_orders import ShaftEffect, ShaftOrders
from rippletwin.explanation.verdict.places import extent_in_words

RIPPLE_ERROR_RATIO = 3.0
"""Misfit with the nominal ripple over model error from which nearly all of it is an error of the
ripple: the rest, a tenth in power, is the model error."""


def remainder_sentences(remainder: dict | None) -> list[str]:
    """What remains, where and by which law, and what stands in for it."""
    if remainder is None:
        return []
    rest = (
        f"What then remains, beside errors of the pump's ripple, is "
        f"{write_share(remainder['model_error'])} of the reading"
    )
    if remainder["element"] is None:
        return [f"{rest}. No single element accounts for it."]
    where = name_place(remainder["element"])
    if remainder["element"] != "source":
        where += f", {extent_in_words(remainder['position_m'])}"
    sentences = [f"{rest}. It is {where}."]
    if remainder["law"] is not None:
        sentences.append(f"It behaves like {remainder['law']}.")
    network = remainder["stand_in"]
    if network is not None:
        kind = "passive" if network["passive"] else "not passive"
        sentences.append(f"In the twin a network ({network['form']}, {kind}) stands in for it.")
        for more in network.get("beside", ()):
            position = more["parameters"]["position"]["value"]
            like = f": {more['follows']}" if more["follows"] else ""
            where = extent_in_words([position, position])
            sentences.append(f"Another one ({more['form']}) acts {where}{like}.")
    return sentences


def ripple_sentences(observations: Sequence, fit: dict) -> list[str]:
    """How wrong the pump's nominal ripple is, where there is one and it is more wrong than the
    line."""
    if not any(o.source == "nominal" for o in observations):
        return []
    misfit, model_error = fit["nominal_ripple"]["in_sample"], fit["model_error"]["after"]
    if misfit < RIPPLE_ERROR_RATIO * model_error:
        return []
    return [
        f"With the pump's nominal flow ripple the corrected line misses {write_share(misfit)} of "
        f"the reading, with the corrected ripple {write_share(fit['after']['in_sample'])}."
    ]


def shaft_order_sentences(shaft_orders: ShaftOrders | None) -> list[str]:
    """What the shaft orders indicate."""
    if shaft_orders is None or not shaft_orders.effects:
        return []
    sentences = [
        "The shaft orders between the piston orders have "
        f"{write_share(shaft_orders.level)} of the ripple.",
        f"They indicate {' and '.join(map(_shaft_effect_in_words, shaft_orders.effects))}.",
    ]
    if "piston_spread" in shaft_orders.names:
        sentences.append("Unequal pistons resemble a fault of a single piston.")
    if not shaft_orders.converged:
        sentences.append("The fit of the modulation did not converge, so these numbers are rough.")
    return [" ".join(sentences)]


def _shaft_effect_in_words(effect: ShaftEffect) -> str:
    if effect.value is None:
        return "unequal pistons"
    is_speed = effect.name == "speed_fluctuation"
    unit = unit_of("rad" if is_speed else "1", "amplitude")
    value = write_value(effect.value, unit, effect.interval)
    between = ""
    if effect.interval is not None:
        between = f" (95 % interval {write_interval(effect.interval, unit)})"
    if is_speed:
        return f"a speed fluctuation, with a phase modulation of {value}{between}"
    return f"unequal pistons, by {value} of the mean flow{between}"
