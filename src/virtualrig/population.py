"""Recording of a rig of a population: the case folder that the tool is given, and the truth."""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import numpy as np

from virtualrig.draw_nuisance import LOAD_ERROR, SPEED_ERROR
from virtualrig.draw_population import DrawnRig, PlannedRecording
from virtualrig.faults import Leak
from virtualrig.folder import prepare_folder, recording_entry, write_recording, write_sheet
from virtualrig.instrument import Instrument, measure
from virtualrig.nuisance import seal_at, true_pump
from virtualrig.orbit import Bench, Orbit
from virtualrig.recorder import (
    SAMPLING_RATE_HZ,
    Take,
    compose_from_orbits,
    draw_speed_wander,
    sensed_pressure,
    settle_orbits,
)
from virtualrig.rig import build

CORRELATION_S = 1.0  # of the speed's wander
TOLERANCE = 20.0  # Pa: change in a revolution below which pressures count as periodic


def record_rig(
    drawn: DrawnRig,
    folder: Path,
    rng: np.random.Generator,
    progress: Callable[[str], None] = lambda label: None,
) -> dict:
    """Record all that is planned into `folder` (new or empty); returns the truth.

    The truth is {"recordings": {label: row}, "rig": the drawn rig}. Rows have `state`, `point`,
    `change` (norm of the ripple's change over that of the healthy ripple, of two runs of the rig in
    one state), `areas` (name of the fault -> area, m2, of the sharp-edged orifice that passes the
    leak's flow at the operating pressure with the data sheet's discharge coefficient), and
    `turn`, the crank turn of the first sample, from where the leaking chamber is furthest out.
    """
    prepare_folder(folder, None)
    entries, rows = [], {}
    for plan in drawn.recordings:
        take, change = record_planned(drawn, plan, rng)
        label = plan.point.label
        write_recording(folder / "recordings" / f"{label}.h5", take)
        entry = recording_entry(plan.point, with_ripple=False)
        entries.append(entry | {"state": "unknown" if label.startswith("unknown") else "healthy"})
        rows[label] = {
            "state": plan.state,
            "point": [plan.point.speed_rpm, plan.point.load_pressure],
            "change": change,
            "areas": equivalent_areas(drawn, plan),
            "turn": float(take.turns[0] % 1.0),
            "plan": asdict(plan),
        }
        progress(label)
    write_sheet(folder, drawn.sheet, entries)
    rig = {"sheet": drawn.sheet, "true": drawn.true, "nuisance": drawn.nuisance}
    return {"recordings": rows, "rig": rig}


def record_planned(
    drawn: DrawnRig, plan: PlannedRecording, rng: np.random.Generator
) -> tuple[Take, float]:
    """One recording, and the change of the ripple that its state makes."""
    nuisance, point = drawn.nuisance, plan.point
    pressure = point.load_pressure * (1 + LOAD_ERROR * rng.standard_normal())
    mean = point.speed_rpm * (1 + SPEED_ERROR * rng.standard_normal())
    count = round(point.seconds * SAMPLING_RATE_HZ)
    speed = mean * (1 + draw_speed_wander(count, nuisance["wander"], CORRELATION_S, rng))
    turns = rng.uniform() + np.concatenate([[0.0], np.cumsum(speed[:-1])]) / 60 / SAMPLING_RATE_HZ
    healthy = make_bench(drawn, drawn.true, plan.kelvin)
    bench = healthy
    before = None
    if plan.state != "healthy":
        before = healthy.settle(speed.mean(), pressure, tolerance=TOLERANCE)
    if plan.line is not None:
        bench = make_bench(drawn, plan.line, plan.kelvin)
    bench.set_faults(plan.faults)
    orbits = settle_orbits(bench, speed, pressure, TOLERANCE)
    middle = orbits[len(orbits) // 2]
    change = 0.0 if before is None else ripple_change(before, middle, bench.rig.sensing)
    clean = compose_from_orbits(orbits, bench.rig.sensing, speed, turns)
    read = measure(clean, turns, instrument_of(nuisance), rng)
    return Take(read, turns, middle), change


def make_bench(drawn: DrawnRig, true: dict, kelvin: float) -> Bench:
    """The rig with the line of `true`, `kelvin` warmer than on average."""
    return Bench(build(drawn.sheet, seal_at(drawn.sheet, true, drawn.nuisance, kelvin)))


def instrument_of(nuisance: dict) -> Instrument:
    """What the sensors add, of a rig's nuisance physics."""
    names = ("noise", "corner_hz", "scatter", "drift")
    return Instrument(offset=tuple(nuisance["offset"]), **{name: nuisance[name] for name in names})


def ripple_change(before: Orbit, after: Orbit, sensing: tuple) -> float:
    """Norm of the change of the sensed ripple over that of the ripple before."""
    ripples = [sensed_pressure(orbit, sensing) for orbit in (before, after)]
    old, new = (ripple - ripple.mean(axis=1, keepdims=True) for ripple in ripples)
    return float(np.linalg.norm(new - old) / np.linalg.norm(old))


def equivalent_areas(drawn: DrawnRig, plan: PlannedRecording) -> dict[str, float]:
    """Fault -> orifice area, m2, that passes the leak's flow at the operating pressure."""
    true = true_pump(drawn.sheet["pump"], drawn.nuisance)["discharge_coefficient"]
    ratio = true / drawn.sheet["pump"]["discharge_coefficient"]
    return {f.kind: f.leak_area * ratio for f in plan.faults if isinstance(f, Leak)}
