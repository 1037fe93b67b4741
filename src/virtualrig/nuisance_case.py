"""Concealed cases on rigs with nuisance physics: an effect hidden among what every bench has.

The rig is one of a population: its pump, its line and its sensors differ from the data sheet in
ways that no parameter of the tool has. A concealed effect comes on top. Both are in the truth: a
tool that names nuisance physics which is there is right.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from virtualrig.conceal import nominal_flow_ripple
from virtualrig.draw import (
    case_kinds,
    draw_effects,
    random_generator,
    truth_of_effect,
    truth_of_segments,
)
from virtualrig.draw_nuisance import RECORDING_KELVIN, draw_nuisance
from virtualrig.draw_population import (
    DrawnRig,
    PlannedRecording,
    draw_points,
    draw_sheet,
    draw_true,
)
from virtualrig.draw_rig import mean_flow, ripple_difference
from virtualrig.drawn_effect import DrawnEffect, RigContext
from virtualrig.folder import (
    prepare_folder,
    recording_entry,
    ripple_name,
    write_recording,
    write_ripple,
    write_sheet,
)
from virtualrig.nuisance import seal_at, segments_as_recorded, true_pump
from virtualrig.orbit import Bench
from virtualrig.population import (
    TOLERANCE,
    make_bench,
    record_planned,
    ripple_change,
    ripple_of,
)
from virtualrig.pump import Pump
from virtualrig.recorder import Point
from virtualrig.rig import build
from virtualrig.source import outlet_compliance

GEOMETRY_SHARE = 2 / 3
"""Of the cases whose data sheet gives the pump's geometry; the others give the number of pistons
and a flow ripple of the data sheet's pump into a constant pressure."""


@dataclass(frozen=True)
class NuisanceCase:
    """A case before it is recorded: the rig, whether its sheet gives the pump, and the truth."""

    rig: DrawnRig
    geometry: bool
    truth: dict


def draw_nuisance_case(count: int, commit: str, number: int | str, index: int) -> NuisanceCase:
    """Case `index` of `count`; kinds and effects come as in `virtualrig.draw`."""
    kind, running = case_kinds(count, commit, number)[index]
    rng = random_generator(commit, number, "nuisance case", index)
    sheet = draw_sheet(rng)
    true = draw_true(sheet, rng, off=kind == "off")
    nuisance = draw_nuisance(rng, len(sheet["sensors"]), len(sheet["line"]["segments"]))
    points = draw_points(rng, fewest=1)
    context = RigContext(
        rng,
        true["line"]["segments"],
        len(sheet["sensors"]),
        sheet["fluid"]["density"],
        sheet["pump"]["bulk_modulus"],
        float(np.mean([mean_flow(sheet, point) for point in points])),
        float(np.mean([point.load_pressure for point in points])),
        list(true["sensors"]),
    )
    effects, classes = draw_effects(
        kind, running, context, random_generator(commit, number, "effects")
    )
    plans = tuple(
        PlannedRecording(
            replace(point, label=f"healthy_{k}"),
            "healthy",
            kelvin=float(RECORDING_KELVIN * rng.standard_normal()),
        )
        for k, point in enumerate(points)
    )
    geometry = bool(rng.uniform() < GEOMETRY_SHARE)
    truth = {
        "kind": kind,
        "effects": [truth_of_effect(effect, sheet, true) for effect in effects],
        "nuisance": nuisance_effects(sheet, true),
        "classes": classes,
        "segments": truth_of_segments(
            segments_as_recorded(
                true["line"]["segments"],
                nuisance["temperature_drop"],
                float(np.mean([plan.kelvin for plan in plans])),
            ),
            context.density,
        ),
        "length": float(context.length),
        "noise": nuisance["noise"],
        "points": len(points),
        "sensors": len(sheet["sensors"]),
        "geometry": geometry,
        "mesh": None,
    }
    if not geometry:
        truth["effects"] = _with_chambers(truth["effects"], sheet, true, nuisance, points)
    true = _with_effects(sheet, true, nuisance, effects)
    return NuisanceCase(DrawnRig(sheet, true, nuisance, plans), geometry, truth)


def _with_chambers(
    effects: list[dict], sheet: dict, true: dict, nuisance: dict, points: Sequence[Point]
) -> list[dict]:
    """Effects of the truth; the volume of a `source_impedance` contains the chambers' compliance,
    as a volume of the first segment's liquid.

    The data sheet states a flow into a constant pressure, which leaves the chambers out. What the
    line then has at the pump is both.
    """
    density, wave_speed = sheet["fluid"]["density"], true["line"]["segments"][0]["wave_speed"]
    pump = Pump(**(sheet["pump"] | true_pump(sheet["pump"], nuisance)))
    pressure = float(np.mean([point.load_pressure for point in points]))
    chambers = outlet_compliance(pump, density, pressure) * density * wave_speed**2
    return [
        effect | {"parameters": {"volume": effect["parameters"]["volume"] + chambers}}
        if effect["name"] == "source_impedance"
        else effect
        for effect in effects
    ]


def nuisance_effects(sheet: dict, true: dict) -> list[dict]:
    """What the nuisance physics is in the words of a verdict, as `truth_of_effect` has them.

    The pump responds to the line; where the data sheet gives its geometry, its chambers differ from
    the sheet's.
    """
    segments = [f"segment {k}" for k in range(1, len(true["line"]["segments"]) + 1)]
    line = [("unsteady_friction", "line", {}, None)]
    line += [
        ("viscoelastic_wall", element, {}, None)
        for element in ("line", *segments)  # every wall creeps
    ]
    for name, position in zip([s["name"] for s in sheet["sensors"]], true["sensors"]):
        line.append(("line_volume", "position", {}, position))
        line += [
            (effect, f"sensor {name}", {}, None)
            for effect in ("sensor_gain", "sensor_dynamics", "sensor_delay")
        ]
    line += [
        (name, "source", {}, None)
        for name in ("source_impedance", "piston_spread", "speed_fluctuation")
    ]
    return [
        truth_of_effect(DrawnEffect(name, element, {}, None, position, parameters), sheet, true)
        for name, element, parameters, position in line
    ]


def _with_effects(sheet: dict, true: dict, nuisance: dict, effects: list[DrawnEffect]) -> dict:
    """`true` with the concealed effects.

    The rig divides volumes by the true pump's bulk modulus, so they are scaled to keep the
    compliances of the truth.
    """
    factor = true_pump(sheet["pump"], nuisance)["bulk_modulus"] / sheet["pump"]["bulk_modulus"]
    segments, entries = [dict(s) for s in true["line"]["segments"]], []
    for effect in effects:
        entry = dict(effect.entry)
        if effect.name == "viscoelastic_wall":
            segments[entry["segment"] - 1]["wall"] = (entry["compliance"], entry["time"])
            continue
        if "volume" in entry:
            entry["volume"] *= factor
        entries.append(entry)
    return true | {"line": {"segments": segments}, "effects": entries}


def record_nuisance_case(case: NuisanceCase, folder: Path, rng: np.random.Generator) -> dict:
    """Record a case into `folder` (new or empty); returns its truth.

    The truth gains `change` and `floor` (see `change_by_effects` and `floor_of`), and `seal`: the
    true rig and its nuisance physics.
    """
    prepare_folder(folder, None)
    drawn, entries = case.rig, []
    for plan in drawn.recordings:
        take, _ = record_planned(drawn, plan, rng)
        write_recording(folder / "recordings" / f"{plan.point.label}.h5", take)
        if not case.geometry:
            ripple = nominal_flow_ripple(drawn.sheet, plan.point)
            write_ripple(folder / ripple_name(plan.point), *ripple)
        entries.append(recording_entry(plan.point, with_ripple=not case.geometry))
    sheet = drawn.sheet
    if not case.geometry:
        sheet = sheet | {"pump": {"pistons": sheet["pump"]["pistons"]}}
    write_sheet(folder, sheet, entries)
    seal = drawn.true | {"nuisance": drawn.nuisance}
    ripples = true_ripples(drawn)
    return case.truth | {
        "seal": seal,
        "change": change_by_effects(drawn, ripples[0]),
        "floor": floor_of(drawn, ripples),
    }


def true_ripples(drawn: DrawnRig) -> list[np.ndarray]:
    """Sensed ripple (sensors, records), Pa, of the true rig at every operating point as set."""
    return [
        settled_ripple(make_bench(drawn, drawn.true, plan.kelvin), plan.point)
        for plan in drawn.recordings
    ]


def settled_ripple(bench: Bench, point: Point) -> np.ndarray:
    """Sensed ripple (sensors, records), Pa, of a bench that settles at an operating point."""
    orbit = bench.settle(point.speed_rpm, point.load_pressure, tolerance=TOLERANCE)
    return ripple_of(orbit, bench.rig.sensing)


def floor_of(drawn: DrawnRig, ripples: list[np.ndarray]) -> float:
    """Relative error that the data sheet's pump on the true rig makes at the sensors, at the shaft
    angle that makes it least; root mean square over the operating points.

    `ripples` are the `true_ripples`."""
    errors = []
    for plan, true in zip(drawn.recordings, ripples, strict=True):
        seal = seal_at(drawn.sheet, drawn.true, drawn.nuisance, plan.kelvin)
        # The pump is replaced in the rig that is built: volumes are divided by the true modulus.
        rig = replace(build(drawn.sheet, seal), pump=Pump(**drawn.sheet["pump"]))
        nominal = settled_ripple(Bench(rig), plan.point)
        errors.append(ripple_difference(nominal, true, rig.pump.pistons, plan.point))
    return float(np.sqrt(np.mean(np.square(errors))))


def change_by_effects(drawn: DrawnRig, after: np.ndarray) -> float:
    """Norm of the change of the sensors' ripple by the concealed effects over that of the ripple
    without them, of two runs of the rig at the first operating point.

    `after` is the true ripple there, with the effects."""
    if not _has_effects(drawn.true):
        return 0.0
    plan = drawn.recordings[0]
    plain = {key: value for key, value in drawn.true.items() if key != "effects"}
    plain["line"] = {
        "segments": [
            {key: value for key, value in s.items() if key != "wall"}
            for s in plain["line"]["segments"]
        ]
    }
    before = settled_ripple(make_bench(drawn, plain, plan.kelvin), plan.point)
    return ripple_change(before, after)


def _has_effects(true: dict) -> bool:
    return bool(true["effects"]) or any("wall" in s for s in true["line"]["segments"])
