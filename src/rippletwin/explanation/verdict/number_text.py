"""Sentences on numbers of the corrected twin: parameters, the pump, an unknown load, sensors."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rippletwin.explanation.verdict.places import join_words

LARGEST_PLAIN = 1e6  # larger numbers are written with a power of ten


def parameters_sentence(effect: str, parameters: Mapping[str, dict]) -> str:
    """Values and 95 % intervals of the parameters of an effect, which is told with its place."""
    told = []
    for name, parameter in parameters.items():
        unit = "" if parameter["unit"] == "1" else f" {parameter['unit']}"
        value, low, high = map(plain_number, (parameter["value"], *parameter["ci95"]))
        told.append(f"{spaced(name)} {value}{unit} (95 % interval {low} to {high})")
    return f"{effect[:1].upper()}{effect[1:]}: {join_words(told)}."


def pump_sentences(parameters: dict) -> list[str]:
    """The pump's parameters whose intervals exclude the data sheet's value."""
    off = []
    for name, p in parameters.items():
        if not p["ci95"][0] <= p["sheet"] <= p["ci95"][1]:
            unit = "" if p["unit"] == "1" else f" {p['unit']}"
            value, sheet = plain_number(p["value"]), plain_number(p["sheet"])
            off.append(f"{spaced(name)} {value}{unit} (data sheet {sheet})")
    return [f"The ripple indicates of the pump: {join_words(off)}."] if off else []


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
        f"{name} {one['gain']['value']:.3f} (phase {np.rad2deg(one['phase']['value']):+.1f} deg)"
        for name, one in sensors.items()
    ]
    return [f"Gains of the sensors: {join_words(said)}."] if said else []


def plain_number(value: float) -> str:
    """Three digits, without a power of ten up to a million: 3000, not 3e+03."""
    text = f"{value:.3g}"
    return f"{float(text):.0f}" if "e+" in text and abs(value) < LARGEST_PLAIN else text


def spaced(name: str) -> str:
    """An identifier with spaces between its words."""
    return name.replace("_", " ")
