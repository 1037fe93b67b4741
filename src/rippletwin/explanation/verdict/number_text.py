"""Sentences on numbers of the corrected twin: parameters, the pump, an unknown load, sensors."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from rippletwin.case.quantities import plain, unit_of, write_interval, write_stated, write_value
from rippletwin.case.words import join_words, name_parameter
from rippletwin.explanation.checks.cross_validation import Disagreement


def parameters_sentence(effect: str, parameters: Mapping[str, dict]) -> str:
    """Values and 95 % intervals, in brackets, of the parameters of an effect, which is told with
    its place; in units of a test bench."""
    told = []
    for name, parameter in parameters.items():
        unit, ends = unit_of(parameter["unit"], name), tuple(parameter["ci95"])
        value = write_value(parameter["value"], unit, ends)
        words = f"{name_parameter(name)} "
        if len(parameters) == 1 and words in effect:  # "delay of sensor p1: delay" says it twice
            words = ""
        told.append(f"{words}{value} ({write_interval(ends, unit)})")
    return plain(f"{effect[:1].upper()}{effect[1:]}: {join_words(told)}.")


def disagreement_sentences(
    found: Sequence[tuple[str, Mapping[str, dict], Disagreement]],
) -> list[str]:
    """The values that change where a part of the data is left out, against the law of the effect.

    found   of each effect: the effect with its place, its parameters, and the disagreement
    """
    told = []
    for effect, parameters, differs in found:
        name = differs.parameter.rpartition(".")[2]
        unit = unit_of(parameters[name]["unit"], name)
        part, whole = (write_value(value, unit) for value in (differs.part, differs.whole))
        told.append(
            f"{effect}, {name_parameter(name)} {whole} with all data and {part} without "
            f"{differs.left_out}"
        )
    if not told:
        return []
    return [
        plain(f"Values change where a part of the data is left out: {'; '.join(told)}."),
        "The law of the effect does not allow that, so other physics acts there.",
    ]


def pump_sentences(parameters: dict) -> list[str]:
    """The pump's parameters whose intervals exclude the data sheet's value, in the same units. The
    intervals hold for a pump of the model's form, which a real one need not have."""
    off = []
    for name, p in parameters.items():
        if not p["ci95"][0] <= p["sheet"] <= p["ci95"][1]:
            unit = unit_of(p["unit"], name)
            value = write_value(p["value"], unit, tuple(p["ci95"]))
            sheet = write_stated(p["sheet"], unit)
            off.append(f"{name_parameter(name)} {value} (data sheet {sheet})")
    if not off:
        return []
    return [
        plain(
            "The pump model fits the ripple with other numbers than the data sheet's: "
            f"{join_words(off)}."
        ),
        "They are the pump's own only if its ports open as those of the model.",
    ]


def load_sentences(load: dict | None) -> list[str]:
    """How much an unknown load reflects, over the observed band."""
    if load is None:
        return []
    parts, frequency_hz = load["reflection"], load["frequency_hz"]
    size = np.hypot(parts["re"], parts["im"])
    said = [
        f"{size[k]:.2f} at {frequency_hz[k]:.0f} Hz" for k in (0, len(size) // 2, len(size) - 1)
    ]
    return [f"The unknown load reflects {join_words(said)} of a wave's amplitude."]


def sensor_sentences(sensors: Mapping[str, dict]) -> list[str]:
    """Gains and phases of uncalibrated sensors."""
    said = [
        f"{name} {one['gain']['value']:.3f} (phase {np.rad2deg(one['phase']['value']):+.1f}°)"
        for name, one in sensors.items()
    ]
    return [f"Gains of the sensors: {join_words(said)}."] if said else []
