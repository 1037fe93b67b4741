"""Values of rig.yaml compared with what physics and engineering allow, and with each other.

A value in the wrong unit gives a twin that fits something and names a wrong cause. Outside the
possible range a value is an error, with the unit that it may have been meant in; outside the usual
range it is a warning.

Where the ranges come from. Liquids: Totten & De Negri (2011), Handbook of Hydraulic Fluid
Technology, 2nd ed.: mineral oil 850 to 900 kg/m3, water glycol 1080, phosphate ester 1150; ISO 3448
grades run from 2 to 3200 mm2/s. Wave speeds: Wylie & Streeter (1993), Fluid Transients in Systems,
ch. 1 and 3: 1000 to 1400 m/s in steel pipes, some hundred in hoses and with free gas. Gases: from
hydrogen at room temperature (0.08 kg/m3, 1300 m/s) to compressed gas. Pressures: industrial
hydraulics ends at 70 MPa, test benches at some hundred. Pumps: Ivantysyn & Ivantysynova (2001),
Hydrostatic Pumps and Motors: from 1 to 1000 cm3 a revolution. The possible ranges are those widened
by a factor of three to ten.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path

from rippletwin.case.sheet_values import entries, leaves, line_length, mapping, number
from rippletwin.errors import InputError


@dataclass(frozen=True)
class Range:
    """Possible and usual values of a field, and what a value in other units is multiplied by."""

    unit: str
    possible: tuple[float, float]
    usual: tuple[float, float]
    units: tuple[tuple[str, float], ...] = ()
    zero: bool = False  # whether 0 is allowed beside the possible values

    def other_units(self, value: float) -> str:
        """The units in which `value` would be usual, with what it is in the right one."""
        low, high = self.usual
        right = [(name, value * scale) for name, scale in self.units]
        fits = [
            f"{name} ({f'{value:.4g} {self.unit}'.strip()})"
            for name, value in right
            if low <= value <= high
        ]
        return " or ".join(fits[:2])


MILLIMETRES = (("mm", 1e-3), ("inches", 0.0254), ("cm", 1e-2))
PRESSURES = (("bar", 1e5), ("MPa", 1e6), ("kPa", 1e3), ("psi", 6894.76))
PER_CENT = (("per cent", 1e-2),)
RADIANS = (("rad", 180 / math.pi),)

BOTH = {
    "fluid.prandtl": Range("", (0.05, 50.0), (0.5, 2.0)),
    "line.segments.length": Range("m", (1e-4, 300.0), (5e-3, 60.0), MILLIMETRES),
    "line.segments.temperature": Range("K", (100.0, 3000.0), (200.0, 1500.0)),
    "load.coefficient": Range(
        "m3/s/sqrt(Pa)", (1e-14, 1e-2), (1e-10, 1e-4), (("L/min/sqrt(bar)", 5.27e-8),)
    ),
    "load.back_pressure": Range("Pa", (-1.1e5, 2e8), (-1.1e5, 5e7), PRESSURES, zero=True),
    "recordings.speed_rpm": Range("r/min", (10.0, 60000.0), (200.0, 20000.0), (("Hz", 60.0),)),
    "recordings.sampling_rate_hz": Range("Hz", (100.0, 2e7), (1e3, 1e6), (("kHz", 1e3),)),
    "recordings.min_frequency_hz": Range("Hz", (1e-2, 1e6), (1.0, 1e5), (("kHz", 1e3),)),
    "recordings.max_frequency_hz": Range("Hz", (1e-1, 1e6), (50.0, 1e5), (("kHz", 1e3),)),
    "recordings.relative_error": Range("", (1e-8, 0.99), (1e-5, 0.5), PER_CENT),
    "uncertainty.length": Range("", (1e-8, 0.5), (1e-5, 0.2), PER_CENT, zero=True),
    "uncertainty.diameter": Range("", (1e-8, 0.5), (1e-5, 0.2), PER_CENT, zero=True),
    "uncertainty.wave_speed": Range("", (1e-8, 0.5), (1e-5, 0.3), PER_CENT, zero=True),
    "uncertainty.viscosity": Range("", (1e-8, 0.99), (1e-5, 0.5), PER_CENT, zero=True),
    "uncertainty.load": Range("", (1e-8, 0.99), (1e-5, 0.5), PER_CENT, zero=True),
    "uncertainty.sensor_position": Range("m", (1e-8, 0.99), (1e-5, 0.2), MILLIMETRES, zero=True),
    "uncertainty.sensor_gain": Range("", (1e-8, 0.99), (1e-5, 0.5), PER_CENT, zero=True),
    "pump.piston_diameter": Range("m", (1e-3, 0.3), (4e-3, 0.08), MILLIMETRES),
    "pump.pitch_radius": Range("m", (2e-3, 1.0), (8e-3, 0.2), MILLIMETRES),
    "pump.swash_angle_deg": Range("deg", (0.5, 45.0), (2.0, 30.0), RADIANS),
    "pump.port_opening_deg": Range("deg", (1.0, 180.0), (4.0, 90.0), RADIANS),
    "pump.dead_volume": Range("m3", (1e-10, 1e-2), (5e-8, 1e-4), (("cm3", 1e-6), ("mm3", 1e-9))),
    "pump.bulk_modulus": Range(
        "Pa", (1e7, 1e11), (3e8, 5e9), (("GPa", 1e9), ("MPa", 1e6), ("bar", 1e5))
    ),
    "pump.port_area": Range("m2", (1e-8, 1e-1), (4e-6, 4e-3), (("mm2", 1e-6), ("cm2", 1e-4))),
    "pump.case_leakage": Range("m3/s/Pa", (1e-18, 1e-8), (1e-15, 1e-10), zero=True),
    "pump.suction_pressure": Range("Pa", (-1.1e5, 1e8), (-1.1e5, 1e7), PRESSURES, zero=True),
}
"""Ranges that hold for liquids and gases alike, by field without the indices."""

LIQUID = BOTH | {
    "fluid.density": Range("kg/m3", (300.0, 5000.0), (600.0, 2000.0), (("g/cm3", 1e3),)),
    "fluid.kinematic_viscosity": Range(
        "m2/s", (1e-8, 1e-2), (3e-7, 3e-3), (("cSt (mm2/s)", 1e-6), ("St (cm2/s)", 1e-4))
    ),
    "line.segments.diameter": Range("m", (2e-4, 0.3), (2e-3, 0.15), MILLIMETRES),
    "line.segments.wave_speed": Range("m/s", (20.0, 5000.0), (200.0, 2200.0), (("km/s", 1e3),)),
    "recordings.load_pressure": Range("Pa", (2e4, 1e9), (1e5, 7e7), PRESSURES),
}
"""The ranges of a liquid."""

GAS = BOTH | {
    "fluid.density": Range("kg/m3", (1e-3, 1000.0), (0.05, 300.0), (("g/cm3", 1e3),)),
    "fluid.kinematic_viscosity": Range(
        "m2/s", (1e-9, 1e-2), (1e-8, 1e-3), (("cSt (mm2/s)", 1e-6), ("St (cm2/s)", 1e-4))
    ),
    "line.segments.diameter": Range("m", (2e-4, 3.0), (5e-4, 1.0), MILLIMETRES),
    "line.segments.wave_speed": Range("m/s", (50.0, 3000.0), (100.0, 1500.0), (("km/s", 1e3),)),
    "recordings.load_pressure": Range("Pa", (1.0, 1e9), (10.0, 7e7), PRESSURES),
}
"""The ranges of a gas: a sheet that gives heat_capacity_ratio."""

LONGEST_IN_DIAMETERS = 2e4  # 400 m of 20 mm pipe; ripple does not come back from there
SMALLEST_PRESSURE = 1000.0  # Pa; a pressure below it other than 0 is most likely in bar or MPa
KELVIN = 273.15
PUMP_SIZE = ("piston_diameter", "pitch_radius", "swash_angle_deg")
PORT_OVERLAP_DEG = 5.0  # that a pump has where port_overlap_deg is not given


def implausible_values(path: Path, sheet: dict) -> list[InputError]:
    """An error for every value of a sheet that cannot be right, by itself or beside another."""
    errors = [error for found, _ in _compared(path, sheet) for error in found]
    wrong = {error.field for error in errors}
    errors += (e for fields, e in _contradictions(path, sheet) if wrong.isdisjoint(fields))
    return errors


def unusual_values(path: Path, sheet: dict) -> list[str]:
    """A line of text for every value of a sheet that is possible, but unusual, or is missed."""
    values = [warning for _, found in _compared(path, sheet) for warning in found]
    kinds = {entry.get("kind", "periodic") for entry in entries(sheet, "recordings")}
    return values + (warn_of_pump(mapping(sheet, "pump")) if "periodic" in kinds else [])


def warn_of_pump(pump: Mapping) -> list[str]:
    """The warning of a pump whose size is not given: numbers that are not are those of a generic
    pump."""
    given = {key for key, value in pump.items() if value is not None}
    missing = [key for key in PUMP_SIZE if key not in given]
    if not missing:
        return []
    if given <= {"pistons"}:
        return [
            "pump: only pistons is given, so that faults are those of a generic pump of 42 cm3 per "
            "revolution; give piston_diameter, pitch_radius and swash_angle_deg"
        ]
    return [
        f"pump: {', '.join(missing)} not given, so that numbers of a generic pump of 42 cm3 per "
        "revolution take their place; give piston_diameter, pitch_radius and swash_angle_deg, or "
        "pistons alone"
    ]


def _compared(path: Path, sheet: dict) -> Iterator[tuple[list[InputError], list[str]]]:
    """Errors and warnings of each value of a sheet that has a range."""
    ranges = GAS if "heat_capacity_ratio" in mapping(sheet, "fluid") else LIQUID
    for field, value in leaves(sheet):
        allowed = ranges.get(re.sub(r"\[\d+\]", "", field))
        if not isinstance(value, (int, float)) or isinstance(value, bool):
            continue
        if allowed is None or not math.isfinite(value):
            continue
        # what is not above zero where it must be is the schema's matter
        if (value == 0 and allowed.zero) or (value <= 0 and allowed.possible[0] > 0):
            continue
        yield _compare(path, field, value, allowed)


def _compare(
    path: Path, field: str, value: float, allowed: Range
) -> tuple[list[InputError], list[str]]:
    (low, high), (low_usual, high_usual) = allowed.possible, allowed.usual
    unit = f" {allowed.unit}" if allowed.unit else ""
    shown = f"{value:.6g}{unit}"
    meant = allowed.other_units(value)
    if field.endswith("temperature") and -KELVIN < value < low:
        meant = f"degrees Celsius ({value + KELVIN:.4g} K)"
    may_be = f"; it looks like {meant}" if meant else ""
    if not low <= value <= high:
        problem = f"{shown} is implausible: {low:g} to {high:g} is possible{may_be}"
        remedy = f"Give {allowed.unit or 'a share of one'}"
        if meant:
            remedy += f", not {meant.split(' (')[0]}"
        if field == "fluid.density" and value < low:
            remedy += "; a gas needs heat_capacity_ratio and prandtl too"
        return [InputError(path, field, problem, remedy)], []
    small = "pressure" in field and 0 < abs(value) < SMALLEST_PRESSURE and meant
    if small or not low_usual <= value <= high_usual:
        usual = f"{low_usual:g} to {high_usual:g} is usual"
        return [], [f"{field}: {shown} is unusual ({usual}){may_be}"]
    return [], []


Contradiction = tuple[tuple[str, ...], InputError]
"""The fields that contradict each other, and what is said of them."""


def _contradictions(path: Path, sheet: dict) -> Iterator[Contradiction]:
    """Values that are possible by themselves and not beside each other."""
    for index, segment in enumerate(entries(mapping(sheet, "line"), "segments")):
        length, diameter = number(segment, "length"), number(segment, "diameter")
        if length and diameter and length > LONGEST_IN_DIAMETERS * diameter > 0:
            field = f"line.segments[{index}]"
            problem = f"{length:g} m is {length / diameter:.3g} diameters"
            remedy = "Give length and diameter in metres"
            yield (
                (f"{field}.length", f"{field}.diameter"),
                InputError(path, f"{field}.length", problem, remedy),
            )
    yield from _uncertainty_contradictions(path, sheet)
    yield from _pump_contradictions(path, mapping(sheet, "pump"))
    back = number(mapping(sheet, "load"), "back_pressure") or 0.0
    for index, entry in enumerate(entries(sheet, "recordings")):
        pressure = number(entry, "load_pressure")
        if pressure and 0 < pressure <= back:
            field = f"recordings[{index}].load_pressure"
            problem = f"{pressure:g} Pa is not above the load's back_pressure, {back:g} Pa"
            remedy = "Correct one of them: flow runs from the line through the load"
            yield (field, "load.back_pressure"), InputError(path, field, problem, remedy)


def _uncertainty_contradictions(path: Path, sheet: dict) -> Iterator[Contradiction]:
    given = mapping(sheet, "uncertainty")
    line = [number(given, key) for key in ("length", "diameter", "wave_speed")]
    if line == [0.0, 0.0, 0.0]:
        field = "uncertainty"
        problem = "length, diameter and wave_speed are exact (0): nothing of the line can be fitted"
        remedy = "Give how well you know them, as 0.05 for 5 per cent; 0 is for single exact values"
        yield (field,), InputError(path, field, problem, remedy)
    position, length = number(given, "sensor_position"), line_length(sheet)
    if position and length and length / 2 < position:
        field = "uncertainty.sensor_position"
        problem = f"{position:g} m is more than half of the line, which is {length:g} m long"
        remedy = "Give metres, as 0.005 for 5 mm"
        yield (field,), InputError(path, field, problem, remedy)


def _pump_contradictions(path: Path, pump: dict) -> Iterator[Contradiction]:
    count, bore = number(pump, "pistons"), number(pump, "piston_diameter")
    radius = number(pump, "pitch_radius")
    if count and bore and radius and count >= 3:
        room = 2 * radius * math.sin(math.pi / count)  # between neighbouring pistons' axes
        if bore >= room > 0:
            field = "pump.piston_diameter"
            problem = f"{count:g} pistons of {bore:g} m overlap on a circle of radius {radius:g} m"
            remedy = "pitch_radius is that of the circle of the pistons' axes, both in metres"
            yield (field, "pump.pitch_radius"), InputError(path, field, problem, remedy)
    opening, overlap = number(pump, "port_opening_deg"), number(pump, "port_overlap_deg")
    shown = f"port_overlap_deg {PORT_OVERLAP_DEG if overlap is None else overlap:g}"
    if overlap is None:
        overlap, shown = PORT_OVERLAP_DEG, f"{shown}, its default,"
    if opening and overlap + 2 * opening > 180:
        field = "pump.port_opening_deg"
        problem = f"twice {opening:g} and {shown} exceed half a revolution"
        yield (field,), InputError(path, field, problem, "Correct one of them")
