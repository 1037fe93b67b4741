"""rippletwin new CASE: write a commented rig.yaml from what a test bench knows."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rippletwin.case.new_sheet import COMMENTS
from rippletwin.case.oil import density_at, viscosity_at
from rippletwin.cli import options
from rippletwin.cli.bench_values import (
    BULK_MODULUS,
    DENSITY,
    FLOW,
    PRESSURE,
    PUMP,
    STATES,
    TEMPERATURE,
    VISCOSITY,
    WALL,
    BenchQuantity,
    labels_of,
    read_pistons,
    read_recording,
    read_segment,
    read_sensor,
)
from rippletwin.cli.options import CheckedValue
from rippletwin.cli.progress import warn
from rippletwin.errors import InputError, raise_any
from rippletwin.line.wave_speed import YOUNGS_MODULUS, wave_speed

if TYPE_CHECKING:
    from collections.abc import Callable

    from rippletwin.case.new_sheet import NewSegment, NewSheet

CST = VISCOSITY.factor
LOADS = ("orifice", "open", "closed", "anechoic", "unknown")
PRESSURE_UNITS = ("Pa", "kPa", "MPa", "bar", "psi")
EXAMPLE = ("recordings/healthy_0.h5", "healthy", 1000.0, 95e5)
DEFAULTS = {"temperature": 50.0, "unit": "Pa"}
"""What is asked for in a terminal, and has a value where nobody answers."""


def _quantity(name: str, quantity: BenchQuantity, help: str, default: float | None = None):
    kind = CheckedValue(quantity.unit, quantity.read)
    shown = default is not None
    return click.option(
        name, type=kind, metavar=quantity.unit, default=default, show_default=shown, help=help
    )


def _pump(command):
    """An option for each number of the pump that a catalogue or a drawing has."""
    for key, quantity in reversed(PUMP.items()):
        name = f"--{key.removesuffix('_deg').replace('_', '-')}"
        help = f"Of the pump: {COMMENTS[key]}."
        kind = CheckedValue(quantity.unit, quantity.read)
        command = click.option(name, key, type=kind, metavar=quantity.unit, help=help)(command)
    return command


@click.command("new", short_help="write a commented rig.yaml from what a test bench knows")
@options.case
@click.option(
    "--pistons", type=CheckedValue("N", read_pistons), metavar="N", help="Number of pistons."
)
@_pump
@_quantity("--temperature", TEMPERATURE, "Of the oil at work; 50 where it is not given.")
@_quantity("--density", DENSITY, "Of the oil at 15 °C.", 870.0)
@_quantity("--viscosity", VISCOSITY, "Of the oil at the working temperature.")
@_quantity("--viscosity-40", VISCOSITY, "Of the oil at 40 °C; with --viscosity-100.")
@_quantity("--viscosity-100", VISCOSITY, "Of the oil at 100 °C.")
@_quantity("--bulk-modulus", BULK_MODULUS, "Of the oil, isentropic.", 16000.0)
@click.option(
    "--segment",
    "segments",
    multiple=True,
    type=CheckedValue("SEGMENT", read_segment),
    metavar="L,D,E",
    help="Length, bore and wall in mm, again for each piece, pump first; then the material "
    f"({', '.join(YOUNGS_MODULUS)}). With a measured wave speed: L,D,850m/s.",
)
@click.option(
    "--sensor",
    "sensors",
    multiple=True,
    type=CheckedValue("SENSOR", read_sensor),
    metavar="NAME,X",
    help="Name and mm from the pump outlet, again for each sensor.",
)
@click.option("--load", type=click.Choice(LOADS), default="orifice", show_default=True)
@_quantity("--flow", FLOW, "Mean flow at the first recording; it sets the orifice.")
@click.option(
    "--recording",
    "recordings",
    multiple=True,
    type=CheckedValue("RECORDING", read_recording),
    metavar="FILE,STATE,R/MIN,BAR",
    help=f"Again for each one. States: {', '.join(STATES)}.",
)
@click.option(
    "--unit",
    type=click.Choice(PRESSURE_UNITS),
    help="Of the pressure in the recordings; Pa where it is not given.",
)
@click.option("--ask/--no-ask", default=None, help="Ask for what is not given; on in a terminal.")
@options.json_output
def command(case: Path, ask: bool | None, as_json: bool, **given) -> None:
    """Write CASE/rig.yaml, with units of a test bench turned into SI units.

    The wave speed of each segment follows from the oil's bulk modulus, bore and wall. What the
    data must have for an answer is printed.
    """
    from rippletwin.case.new_sheet import write_new_sheet

    if (case / "rig.yaml").exists():
        remedy = "Edit it, or name another folder: nothing is overwritten"
        raise InputError(case / "rig.yaml", "case", "is there already", remedy)
    if sys.stdin.isatty() if ask is None else ask:
        _ask(given)
    for key, value in DEFAULTS.items():
        given[key] = value if given[key] is None else given[key]
    sheet = _sheet(given)
    path = write_new_sheet(sheet, case)
    warnings, advice = _judge(path)
    if not given["recordings"]:
        _, _, speed, pressure = EXAMPLE
        warnings.append(
            f"no --recording is given: that of rig.yaml, {speed:g} r/min and {pressure / 1e5:g} "
            "bar, is an example; correct it"
        )
    warn(warnings)
    if as_json:
        print(json.dumps({"rig_yaml": str(path), "warnings": warnings, "advice": advice}))
        return
    print("\n".join([f"{path}:", *_in_words(sheet), *(f"advice: {line}" for line in advice)]))
    print(f"Put the recordings where rig.yaml names them, then: rippletwin check {case}")


def _ask(given: dict) -> None:
    """Ask on the terminal for what the command line does not give."""
    if given["pistons"] is None:
        given["pistons"] = _prompt("Pistons", read_pistons)
    for key, quantity in PUMP.items():
        if given[key] is None:
            question = f"Pump's {quantity.what}, {quantity.unit} (empty: not known)"
            given[key] = _prompt(question, quantity.read, empty=True)
    if given["temperature"] is None:
        question = f"Temperature of the oil, °C (empty: {DEFAULTS['temperature']:g})"
        given["temperature"] = _prompt(question, TEMPERATURE.read, empty=True)
    if given["viscosity"] is None and given["viscosity_40"] is None:
        known = given["temperature"]
        celsius = DEFAULTS["temperature"] if known is None else known
        given["viscosity"] = _prompt(f"Viscosity at {celsius:g} °C, cSt", VISCOSITY.read)
    for key, question, read in (
        ("segments", "Segment: length,bore,wall in mm, pump first", read_segment),
        ("sensors", "Sensor: name,mm from the pump outlet", read_sensor),
    ):
        given[key] = given[key] or _prompt_all(question, read)
    if given["flow"] is None and given["load"] == "orifice":
        given["flow"] = _prompt("Mean flow, L/min (empty: not known)", FLOW.read, empty=True)
    recording = "Recording: file,state,r/min,bar"
    given["recordings"] = given["recordings"] or _prompt_all(recording, read_recording)
    if given["unit"] is None:
        units = ", ".join(PRESSURE_UNITS)
        question = f"Unit of the recorded pressure: {units} (empty: {DEFAULTS['unit']})"
        given["unit"] = _prompt(question, _unit, empty=True)


def _unit(text: str) -> str:
    if text not in PRESSURE_UNITS:
        raise ValueError(f"{text} is no unit that is known. Choose one of the list")
    return text


def _prompt_all(question: str, read: Callable) -> tuple:
    """Answers until an empty one."""
    found: list = []
    while (one := _prompt(f"{question} (empty: no more)", read, empty=True)) is not None:
        found.append(one)
    return tuple(found)


def _prompt(question: str, read: Callable, empty: bool = False):
    """What `read` makes of an answer; asked again until it can. None where it may be empty."""
    while True:
        default = "" if empty else None
        text = click.prompt(question, default=default, show_default=False, err=True)
        if text == "" and empty:
            return None
        try:
            return read(text)
        except ValueError as error:
            click.echo(str(error), err=True)


def _sheet(given: dict) -> NewSheet:
    """The sheet of what was given; raises InputError for what is missing."""
    from rippletwin.case.new_sheet import NewSheet

    missing = [key for key in ("pistons", "segments", "sensors") if not given[key]]
    viscosity = given["viscosity"]
    if viscosity is None and given["viscosity_40"] and given["viscosity_100"]:
        try:
            pair = given["viscosity_40"] / CST, given["viscosity_100"] / CST
            viscosity = CST * viscosity_at(*pair, given["temperature"])
        except ValueError as error:
            text = "Give the two of the data sheet"
            raise InputError("command line", "--viscosity-100", str(error), text) from None
    if viscosity is None:
        one = given["viscosity_40"] or given["viscosity_100"]
        absent = "viscosity_100" if given["viscosity_40"] else "viscosity_40"
        missing.append(absent.replace("_", "-") if one else "viscosity")
    if missing:
        names = ", ".join(f"--{key.rstrip('s') if key != 'pistons' else key}" for key in missing)
        remedy = "Give them, or run in a terminal to be asked; see rippletwin new --help"
        raise InputError("command line", names, "not given", remedy)
    density = density_at(given["density"], given["temperature"])
    modulus = given["bulk_modulus"]
    recordings = given["recordings"] or (EXAMPLE,)
    unit = {} if given["unit"] == "Pa" else {"unit": given["unit"]}
    flow, coefficient = given["flow"], None
    if flow and given["recordings"] and given["load"] == "orifice":
        coefficient = flow / math.sqrt(recordings[0][3])
    return NewSheet(
        density=density,
        viscosity=viscosity,
        temperature=f"at {given['temperature']:g} °C",
        pump={"pistons": given["pistons"]} | {key: given[key] for key in PUMP},
        segments=[_new_segment(segment, density, modulus) for segment in given["segments"]],
        sensors=given["sensors"],
        load=given["load"],
        coefficient=coefficient,
        mean_flow=flow if coefficient is None else None,
        recordings=[
            {"file": f, **label, "state": s, "speed_rpm": n, "load_pressure": p, **unit}
            for (f, s, n, p), label in zip(recordings, labels_of([f for f, *_ in recordings]))
        ],
    )


def _new_segment(segment: tuple, density: float, modulus: float) -> NewSegment:
    """A segment with the wave speed that was measured, or follows from oil, bore and wall."""
    from rippletwin.case.new_sheet import NewSegment

    length, bore, wall, material, speed = segment
    if speed is not None:
        return NewSegment(length, bore, speed, "measured", measured=True)
    stiffness = YOUNGS_MODULUS[material or "steel"]
    found = wave_speed(density, modulus, bore, wall, stiffness)
    origin = f"calculated for {modulus / PRESSURE.factor:.0f} bar bulk modulus"
    origin += ", a rigid wall" if wall is None else f", {wall / WALL.factor:g} mm of {material}"
    return NewSegment(length, bore, found, origin)


def _in_words(sheet: NewSheet) -> list[str]:
    """What has been understood, a line each."""
    length = sum(segment.length for segment in sheet.segments)
    lines = [f"  line: {length:.4g} m, load: {sheet.load}"]
    lines += [
        f"  segment {k}: wave speed {segment.wave_speed:.0f} m/s, {segment.origin}"
        for k, segment in enumerate(sheet.segments, 1)
    ]
    lines.append("  sensors: " + ", ".join(f"{n} at {x:.4g} m" for n, x in sheet.sensors))
    size = sheet.displacement
    if size is not None:
        lines.append(f"  pump: {size * 1e6:.3g} cm3 per revolution; compare it with the catalogue")
    return lines


def _judge(path: Path) -> tuple[list[str], list[str]]:
    """Warnings of a sheet that has been written, and what the data must have; raises InputError
    for all of its errors."""
    from rippletwin.case.load import rig_of
    from rippletwin.case.plausibility import unusual_values
    from rippletwin.case.recording_advice import PlannedRecording, advise
    from rippletwin.case.rig_yaml import read_sheet

    try:
        sheet = read_sheet(path)
    except InputError as error:
        path.unlink()  # so that the command can be given again
        raise_any(
            InputError("command line", one.field, one.problem, one.remedy) for one in error.errors
        )
    planned = [
        PlannedRecording(entry["state"], entry["speed_rpm"], entry["load_pressure"])
        for entry in sheet["recordings"]
    ]
    return unusual_values(path, sheet), advise(rig_of(path.parent, sheet), planned)
