"""rippletwin simulate FAULT: what the sensors of a twin's rig would read with a fault."""

from __future__ import annotations

import csv
import json

import click

from rippletwin import store
from rippletwin.cli import options
from rippletwin.cli.progress import warn
from rippletwin.errors import InputError

PASCAL_PER_BAR = 1e5
SQUARE_METRES = {"mm2": 1e-6, "m2": 1.0}


def read_area(text: str) -> float:
    """Area in m2 of a text with its unit: 0.2mm2, 2e-7m2.

    Raises
    ------
    ValueError : says what is wrong, and how to write it.
    """
    remedy = "Give a positive area with its unit, such as 0.2mm2 or 2e-7m2"
    for unit, factor in SQUARE_METRES.items():
        if text.strip().endswith(unit):
            try:
                return factor * options.number(text.strip().removesuffix(unit), "area", unit)
            except ValueError:
                raise ValueError(f"{text} is no leak area. {remedy}") from None
    raise ValueError(f"{text} has no unit of area. {remedy}")


def _quantity(name: str, what: str, unit: str, help: str):
    kind = options.CheckedValue(unit, lambda text: options.number(text, what, unit))
    return click.option(name, required=True, metavar=unit, type=kind, help=help)


@click.command("simulate", short_help="write what the sensors would read with a fault")
@click.argument("fault", metavar="FAULT")
@click.option(
    "--twin",
    "twin_file",
    required=True,
    metavar="TWIN.json",
    help="The twin, as explain or calibrate wrote it.",
)
@click.option(
    "--severity",
    "areas",
    multiple=True,
    metavar="AREA",
    type=options.CheckedValue("AREA", read_area),
    help="Area of the leak with its unit, such as 0.2mm2 or 2e-7m2; again for more.",
)
@_quantity("--speed", "speed", "RPM", "Speed of the shaft in r/min.")
@_quantity("--pressure", "pressure", "BAR", "Gauge pressure before the load of the healthy pump.")
@options.effects("An effect of the twin that a Python file defines as EFFECT, again for more.")
@options.out_file("CSV file with one revolution, in s and Pa.", required=False)
@options.json_output
def command(
    fault: str,
    twin_file: str,
    areas: tuple[float, ...],
    speed: float,
    pressure: float,
    effects: tuple[str, ...],
    out: str | None,
    as_json: bool,
) -> None:
    """Write one revolution of what the twin's sensors would read with FAULT.

    FAULT is healthy, slipper, cylinder, valve_plate, or a Python file that defines FAULT.
    """
    if out is None and not as_json:
        raise InputError(
            "command line", "--out", "no file is named", "Name one, or print JSON with --json"
        )
    healthy = fault == "healthy"
    if healthy == bool(areas):
        raise InputError(
            "command line",
            "--severity",
            "a healthy pump has no leak" if healthy else f"the leak area of {fault} is missing",
            "Leave it out" if healthy else "Give one, such as --severity 0.2mm2",
        )
    from rippletwin.diagnosis.faults.library import find_fault
    from rippletwin.diagnosis.simulated_fault import simulate_fault
    from rippletwin.twin.twin_file import load_twin

    found = find_fault(fault)
    twin = load_twin(twin_file, effects)
    runs = [
        simulate_fault(twin, found, area, speed, pressure * PASCAL_PER_BAR)
        for area in areas or (0.0,)
    ]
    warn(dict.fromkeys(text for run in runs for text in run.warnings))
    names = [sensor.name for sensor in twin.rig.sensors]
    if out is not None:
        _write_csv(out, names, runs)
    if as_json:
        result = {
            "fault": "healthy" if found is None else found.name,
            "speed_rpm": speed,
            "load_pressure_pa": pressure * PASCAL_PER_BAR,
            "time_s": runs[0].time_s.tolist(),
            "severities": [
                {
                    "area_m2": run.area,
                    "mean_flow_m3_s": run.mean_flow,
                    "pressure_pa": dict(zip(names, run.pressure.tolist())),
                }
                for run in runs
            ],
        }
        print(json.dumps(result))
    else:
        print(out)


def _write_csv(path: str, names: list[str], runs: list) -> None:
    """Columns time_s and one for each sensor; before them area_m2 where there are several areas."""
    several = len(runs) > 1
    with store.whole(path) as scratch, scratch.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*(["area_m2"] if several else []), "time_s", *names])
        for run in runs:
            for time, row in zip(run.time_s.tolist(), run.pressure.T.tolist()):
                writer.writerow([*([run.area] if several else []), time, *row])
