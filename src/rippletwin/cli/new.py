"""rippletwin new CASE: write a commented rig.yaml from what a test bench knows."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rippletwin.case.oil import density_at, viscosity_at
from rippletwin.cli import options
from rippletwin.cli.options import CheckedValue
from rippletwin.errors import InputError
from rippletwin.line.wave_speed import YOUNGS_MODULUS, wave_speed

if TYPE_CHECKING:
    from rippletwin.case.new_sheet import NewSegment, NewSheet

MM, BAR, CST, LITRES_A_MINUTE = 1e-3, 1e5, 1e-6, 1 / 60000
LOADS = ("orifice", "open", "closed", "anechoic", "unknown")
STATES = ("healthy", "unknown", "slipper", "cylinder", "cylinder_slight", "cylinder_severe")
PRESSURE_UNITS = ("Pa", "kPa", "MPa", "bar", "psi")
EXAMPLE = ("recordings/healthy_0.h5", "healthy", 1000.0, 95.0)


def _parts(text: str, form: str, count: tuple[int, int]) -> list[str]:
    parts = [part.strip() for part in text.split(",")]
    if not count[0] <= len(parts) <= count[1] or not all(parts):
        raise ValueError(f"{text!r} is not {form}. separate them by commas")
    return parts


def _segment(text: str) -> tuple:
    """(length, bore, wall, material, measured wave speed), m and m/s; None where not given."""
    form = "LENGTH,BORE,WALL[,MATERIAL] or LENGTH,BORE,SPEEDm/s"
    parts = _parts(text, form, (2, 4))
    length, bore = (options.number(p, "length", "mm") * MM for p in parts[:2])
    if len(parts) > 2 and parts[2].endswith("m/s"):
        speed = options.number(parts[2].removesuffix("m/s"), "wave speed", "m/s")
        return length, bore, None, None, speed
    wall = options.number(parts[2], "wall", "mm") * MM if len(parts) > 2 else None
    material = parts[3] if len(parts) > 3 else "steel"
    if material not in YOUNGS_MODULUS:
        raise ValueError(
            f"{material} has no known modulus. choose one of {', '.join(YOUNGS_MODULUS)}; for a "
            "hose give the wave speed, as 3000,20,850m/s"
        )
    return length, bore, wall, material, None


def _sensor(text: str) -> tuple[str, float]:
    name, position = _parts(text, "NAME,POSITION in mm", (2, 2))
    try:
        value = float(position)
    except ValueError:
        value = math.nan
    if not (math.isfinite(value) and value >= 0):
        raise ValueError(f"{position} is no position. give mm from the pump outlet")
    return name, value * MM


def _recording(text: str) -> tuple[str, str, float, float]:
    file, state, speed, pressure = _parts(text, "FILE,STATE,R/MIN,BAR", (4, 4))
    if state not in STATES:
        raise ValueError(f"{state} is no state. choose one of {', '.join(STATES)}")
    return (
        file,
        state,
        options.number(speed, "speed", "r/min"),
        options.number(pressure, "pressure", "bar"),
    )


def _quantity(name: str, what: str, unit: str, help: str, default: float | None = None):
    kind = CheckedValue(unit, lambda text: options.number(str(text), what, unit))
    shown = default is not None
    return click.option(
        name, type=kind, metavar=unit, default=default, show_default=shown, help=help
    )


@click.command("new", short_help="write a commented rig.yaml from what a test bench knows")
@options.case
@click.option("--pistons", type=click.IntRange(3, 15), metavar="N", help="Number of pistons.")
@_quantity("--temperature", "temperature", "°C", "Of the oil at work.", 50.0)
@_quantity("--density", "density", "kg/m3", "Of the oil at 15 °C.", 870.0)
@_quantity("--viscosity", "viscosity", "cSt", "Of the oil at the working temperature.")
@_quantity("--viscosity-40", "viscosity", "cSt", "Of the oil at 40 °C; with --viscosity-100.")
@_quantity("--viscosity-100", "viscosity", "cSt", "Of the oil at 100 °C.")
@_quantity("--bulk-modulus", "bulk modulus", "bar", "Of the oil, isentropic.", 16000.0)
@click.option(
    "--segment",
    "segments",
    multiple=True,
    type=CheckedValue("SEGMENT", _segment),
    metavar="L,D,E",
    help="Length, bore and wall in mm, again for each piece, pump first; then the material "
    f"({', '.join(YOUNGS_MODULUS)}). With a measured wave speed: L,D,850m/s.",
)
@click.option(
    "--sensor",
    "sensors",
    multiple=True,
    type=CheckedValue("SENSOR", _sensor),
    metavar="NAME,X",
    help="Name and mm from the pump outlet, again for each sensor.",
)
@click.option("--load", type=click.Choice(LOADS), default="orifice", show_default=True)
@_quantity("--flow", "flow", "L/min", "Mean flow at the first recording; it sets the orifice.")
@click.option(
    "--recording",
    "recordings",
    multiple=True,
    type=CheckedValue("RECORDING", _recording),
    metavar="FILE,STATE,R/MIN,BAR",
    help=f"Again for each one. States: {', '.join(STATES)}.",
)
@click.option(
    "--unit",
    type=click.Choice(PRESSURE_UNITS),
    default="Pa",
    show_default=True,
    help="Of the pressure in the recordings.",
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
        remedy = "edit it, or name another folder: nothing is overwritten"
        raise InputError(case / "rig.yaml", "case", "is there already", remedy)
    if sys.stdin.isatty() if ask is None else ask:
        _ask(given)
    sheet = _sheet(given)
    path = write_new_sheet(sheet, case)
    advice = _advice(path)
    if as_json:
        print(json.dumps({"rig_yaml": str(path), "advice": advice}))
        return
    print(f"{path}: {len(sheet.segments)} segment(s), {len(sheet.sensors)} sensor(s)")
    for k, segment in enumerate(sheet.segments, 1):
        print(f"  segment {k}: wave speed {segment.wave_speed:.0f} m/s, {segment.origin}")
    print("\n".join(f"advice: {line}" for line in advice))
    print(f"Put the recordings where rig.yaml names them, then: rippletwin check {case}")


def _ask(given: dict) -> None:
    """Ask on the terminal for what the command line does not give."""
    if given["pistons"] is None:
        given["pistons"] = click.prompt("Pistons", type=click.IntRange(3, 15), default=9, err=True)
    if given["viscosity"] is None and given["viscosity_40"] is None:
        kind = CheckedValue("cSt", lambda text: options.number(str(text), "viscosity", "cSt"))
        question = f"Viscosity at {given['temperature']:g} °C, cSt"
        given["viscosity"] = _prompt(question, kind)
    for key, question, read in (
        ("segments", "Segment: length,bore,wall in mm, pump first", _segment),
        ("sensors", "Sensor: name,mm from the pump outlet", _sensor),
        ("recordings", "Recording: file,state,r/min,bar", _recording),
    ):
        if given[key]:
            continue
        found: list = []
        while (one := _prompt(f"{question} (empty: no more)", CheckedValue("", read), "")) != "":
            found.append(one)
        given[key] = tuple(found)


def _prompt(question: str, kind: CheckedValue, default: str | None = None):
    """An answer of the right kind; asked again until it is. An empty one is the default."""
    while True:
        text = click.prompt(question, default=default, show_default=False, err=True)
        if text == default:
            return default
        try:
            return kind.read(text)
        except ValueError as error:
            click.echo(str(error), err=True)


def _sheet(given: dict) -> NewSheet:
    """The sheet of what was given; raises InputError for what is missing."""
    from rippletwin.case.new_sheet import NewSheet

    missing = [key for key in ("pistons", "segments", "sensors") if not given[key]]
    viscosity = given["viscosity"]
    if viscosity is None and given["viscosity_40"] and given["viscosity_100"]:
        try:
            pair = given["viscosity_40"], given["viscosity_100"]
            viscosity = viscosity_at(*pair, given["temperature"])
        except ValueError as error:
            text = "give the two of the data sheet"
            raise InputError("command line", "--viscosity-100", str(error), text) from None
    missing += ["viscosity"] * (viscosity is None)
    if missing:
        names = ", ".join(f"--{key.rstrip('s') if key != 'pistons' else key}" for key in missing)
        remedy = "give them, or run in a terminal to be asked; see rippletwin new --help"
        raise InputError("command line", names, "not given", remedy)
    density = density_at(given["density"], given["temperature"])
    modulus = given["bulk_modulus"] * BAR
    recordings = given["recordings"] or (EXAMPLE,)
    unit = {} if given["unit"] == "Pa" else {"unit": given["unit"]}
    coefficient = None
    if given["flow"] and given["load"] == "orifice":
        flow = given["flow"] * LITRES_A_MINUTE
        coefficient = flow / math.sqrt(recordings[0][3] * BAR)
    return NewSheet(
        density=density,
        viscosity=viscosity * CST,
        temperature=f"at {given['temperature']:g} °C",
        pistons=given["pistons"],
        segments=[_new_segment(segment, density, modulus) for segment in given["segments"]],
        sensors=dict(given["sensors"]),
        load=given["load"],
        coefficient=coefficient,
        recordings=[
            {"file": f, "state": s, "speed_rpm": n, "load_pressure": p * BAR, **unit}
            for f, s, n, p in recordings
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
    origin = f"calculated for {modulus / BAR:.0f} bar bulk modulus"
    origin += ", a rigid wall" if wall is None else f", {wall / MM:g} mm of {material}"
    return NewSegment(length, bore, found, origin)


def _advice(path: Path) -> list[str]:
    """What the data must have, of a sheet that has been written; all of its errors are told."""
    from rippletwin.case.load import rig_of
    from rippletwin.case.recording_advice import PlannedRecording, advise
    from rippletwin.case.rig_yaml import read_sheet

    try:
        sheet = read_sheet(path)
    except InputError:
        path.unlink()  # so that the command can be given again
        raise
    planned = [
        PlannedRecording(entry["state"], entry["speed_rpm"], entry["load_pressure"])
        for entry in sheet["recordings"]
    ]
    return advise(rig_of(path.parent, sheet), planned)
