"""One sentence about a recording that an engineer can act on."""

from __future__ import annotations

from rippletwin.case.quantities import plain, unit_of, write_quantity
from rippletwin.case.words import name_change, name_ordinal
from rippletwin.diagnosis.diagnosis import Diagnosis
from rippletwin.diagnosis.doubts import find_doubts

MARGIN = 0.01  # probability of another state that is worth mentioning


def describe_diagnosis(diagnosis: Diagnosis) -> str:
    """The diagnosis in words."""
    d = diagnosis
    if d.state == "unlike":
        text = _unlike(d)
    elif d.state == "healthy":
        text = f"healthy, with a probability of {_share(d.probabilities['healthy'])}"
    else:
        parts = [_fault(d, fault) for fault in d.best.state]
        text = f"{' and '.join(parts)}, with a probability of {_share(d.probabilities[d.state])}"
    others = {name: p for name, p in d.probabilities.items() if name != d.state and p > MARGIN}
    if others and d.state != "unlike":
        listed = ", ".join(f"{name} {_share(p)}" for name, p in others.items())
        text += f" (it may also be: {listed})"
    text += f"; compared with {d.anchor.label}"
    if d.anchor.distance:
        text += ", which is of another operating point, so that less can be told"
    for doubt in find_doubts(d):
        text += f"; {doubt}"
    return f"{d.label}: {text}."


def _unlike(d: Diagnosis) -> str:
    changed = name_change(d.unlikeness.element, d.unlikeness.orders)
    return f"neither healthy nor any fault that was tried: {changed}"


def _fault(d: Diagnosis, fault) -> str:
    area = d.severities[fault.name]
    size = write_quantity(area.value, unit_of("m2"), (area.low, area.high))
    text = plain(f"{fault.words} with a leak of {size}")
    if not fault.one_piston:
        return text
    piston = d.pistons.get(fault.name)
    if piston is None:
        return f"{text} at a piston that cannot be told"
    return f"{text} at the {name_ordinal(piston + 1)} piston to begin its delivery in the recording"


def _share(p: float) -> str:
    return "more than 99.9 %" if p > 0.999 else f"{100 * p:.3g} %"
