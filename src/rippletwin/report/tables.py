"""Tables of a report: text to read and values to sort by."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rippletwin.calibration.fit import HALF_INTERVAL
from rippletwin.case.model import Case
from rippletwin.case.quantities import (
    unit_of,
    write_certainty,
    write_interval,
    write_number,
    write_quantity,
    write_value,
)
from rippletwin.case.words import name_effect, name_parameter, name_state
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.twin import Twin

UNDETERMINED_SD = 0.9  # of a prior's: a posterior that wide says that the data tell nothing
DIFFERENCE_DECIMALS = 2  # of a difference in per cent, mm or tolerances


class Cell(NamedTuple):
    """What is read, what is sorted by (a number or text), and a pull to be drawn, or None."""

    text: str
    value: float | str
    pull: float | None = None


@dataclass(frozen=True)
class Table:
    """A caption, the columns' titles, whether each holds numbers, and rows of cells."""

    caption: str
    columns: Sequence[str]
    is_number: Sequence[bool]
    rows: Sequence[Sequence[Cell]]


def text(words: str) -> Cell:
    """A cell of words."""
    return Cell(words, words)


def parameter_table(twin: Twin, covariance: np.ndarray | None) -> Table:
    """The numbers of line, fluid, load and pump beside the data sheet; the twin has no effects."""
    rows = []
    for k, p in enumerate(twin.parameters):
        if p.flat:
            continue
        sd = None if covariance is None else float(np.sqrt(max(covariance[k][k], 0.0)))
        rows.append(_parameter_row(p, float(twin.theta[k]), sd, twin.rig.tolerance_scale))
    return Table(
        "Line, fluid, load and pump: the twin's values beside the data sheet",
        (
            "Parameter",
            "Data sheet",
            "Twin",
            "95 % interval",
            "Difference",
            "Difference / tolerance",
        ),
        (False, True, True, True, True, True),
        rows,
    )


def tolerance_note(twin: Twin) -> str:
    """What `parameter_table` means by a tolerance, and by its *."""
    scale, tolerance, widened = twin.rig.tolerance_scale, "tolerance", ""
    if scale != 1.0:
        tolerance = "widened tolerance"
        widened = f"The twin was fitted with {scale:.2g} times the sheet's tolerances. "
    return (
        "A tolerance is a standard deviation that rig.yaml states; the shaded band is two of them "
        f"to either side. {widened}* The recordings do not determine this value: they hardly add "
        f"to what its {tolerance} says."
    )


def _parameter_row(p: Parameter, u: float, sd: float | None, tolerance_scale: float) -> list[Cell]:
    """`sd` is that of the coordinate u, of a prior with `tolerance_scale` times the tolerances."""
    unit = unit_of(p.unit, p.name)
    value, nominal = float(p.value(u)), p.nominal
    ends = None
    if sd is not None:
        low, high = (float(p.value(u + side * HALF_INTERVAL * sd)) for side in (-1, 1))
        ends = low, high
    interval = "unknown" if ends is None else write_interval(ends, unit)
    if sd is not None and sd > UNDETERMINED_SD:
        interval += " *"
    relative = p.name.partition("[")[0] not in ("position", "port_timing") and nominal
    difference, pull = value - nominal, p.stated_pull(u, tolerance_scale)
    if relative:
        percent = 100 * difference / nominal
        said = Cell(f"{_signed(percent)} %", percent)
    else:
        scale, name = (1e3, "mm") if p.unit == "m" else unit
        said = Cell(f"{_signed(difference * scale)} {name}", difference * scale)
    return [
        text(name_parameter(p.name)),
        Cell(write_value(nominal, unit), nominal),
        Cell(write_value(value, unit, ends), value),
        Cell(interval, 0.0 if ends is None else abs(ends[1] - ends[0])),
        said,
        Cell(_signed(pull), pull, pull),
    ]


def _signed(value: float) -> str:
    """A difference with its sign and two digits."""
    value = round(value, DIFFERENCE_DECIMALS)
    return ("+" if value > 0 else "") + write_number(value, significant=2)


def effect_table(effects: Sequence[Mapping]) -> Table:
    """Each parameter of each effect of verdict.json, with its interval."""
    rows = []
    for effect in effects:
        words = name_effect(effect["name"], effect.get("element"))
        support = effect.get("support", "")
        probability = effect.get("probability")
        said = "" if probability is None else write_certainty(probability)
        for name, entry in (effect.get("parameters") or {"": None}).items():
            cells = [Cell("", 0.0), Cell("", 0.0)]
            if entry is not None:
                unit, ends = unit_of(entry.get("unit", ""), name), entry.get("ci95")
                interval = "unknown" if ends is None else write_interval(tuple(ends), unit)
                ends = None if ends is None else tuple(ends)
                cells = [
                    Cell(write_value(entry["value"], unit, ends), entry["value"]),
                    Cell(interval, 0.0 if ends is None else abs(ends[1] - ends[0])),
                ]
            probable = Cell(said, -1.0 if probability is None else probability)
            parameter = text(_effect_parameter(name))
            rows.append([text(words), parameter, *cells, probable, text(support)])
    columns = ["Effect", "Parameter", "Value", "95 % interval", "Probability", "Support"]
    is_number = [False, False, True, True, True, False]
    if not any(row[-1].text for row in rows):
        del columns[-1], is_number[-1]
        for row in rows:
            del row[-1]
    return Table("Effects and their parameters", columns, is_number, rows)


def _effect_parameter(name: str) -> str:
    """A parameter's words; what it belongs to stands beside it."""
    return {
        "kinematic_viscosity": "kinematic viscosity",
        "amplitude": "amplitude",
        "length": "length",
    }.get(name) or name_parameter(name)


def recording_table(case: Case) -> Table:
    """The recordings with operating point and length."""
    rows = []
    for r in case.recordings:
        speed = Cell("", 0.0) if r.speed_rpm is None else Cell(f"{r.speed_rpm:.0f}", r.speed_rpm)
        pressure, seconds, rate = Cell("", 0.0), Cell("", 0.0), Cell("", 0.0)
        if r.load_pressure is not None:
            pressure = Cell(write_number(r.load_pressure / 1e5), r.load_pressure)
        if r.pressure is not None and r.sampling_rate_hz:
            duration = r.pressure.shape[-1] / r.sampling_rate_hz
            seconds = Cell(write_number(duration), duration)
            rate = Cell(write_number(r.sampling_rate_hz / 1e3), r.sampling_rate_hz)
        state = text(name_state(r.state))
        rows.append([text(r.label), state, text(r.kind), speed, pressure, seconds, rate])
    columns = ["Recording", "State", "Kind", "Speed / (r/min)", "Load pressure / bar"]
    columns += ["Duration / s", "Sampling rate / kHz"]
    return Table("Recordings", columns, (False, False, False, True, True, True, True), rows)


def severity_words(severity: Mapping) -> list[str]:
    """Each leak of a diagnosis in words: "worn slipper: 0.61 (0.44 to 0.85) mm²"."""
    return [
        f"{name_state(fault)}: "
        + write_quantity(entry["value"], unit_of(entry["unit"]), tuple(entry["ci95"]))
        for fault, entry in severity.items()
    ]
