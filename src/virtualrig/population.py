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

    The truth is {"recordings": {label: row}, "rig": the drawn rig}. Keys of a row:
        state     as planned
        point     speed, r/min, and load pressure, Pa, as the operator sets them
        change    norm of the ripple's change over that of the healthy ripple, of two runs of the
                  rig in one state of temperature
        weakest   where there are two faults, the change that the lesser one makes beside the other;
                  else `change`
        areas     fault -> area, m2, of the sharp-edged orifice that passes the leak's flow at the
                  operating pressure with the data sheet's discharge coefficient
        pistons   fault -> see `delivering_piston`
        plan      all that was planned
    """
    prepare_folder(folder, None)
    entries, rows = [], {}
    for plan in drawn.recordings:
        take, changes = record_planned(drawn, plan, rng)
        label = plan.point.label
        write_recording(folder / "recordings" / f"{label}.h5", take)
        entry = recording_entry(plan.point, with_ripple=False)
        entries.append(entry | {"state": "unknown" if label.startswith("unknown") else "healthy"})
        rows[label] = changes | {
            "state": plan.state,
            "point": [plan.point.speed_rpm, plan.point.load_pressure],
            "areas": equivalent_areas(drawn, plan),
            "pistons": {
                fault.kind: delivering_piston(fault, drawn.sheet["pump"]["pistons"], take.turns[0])
                for fault in plan.faults
                if isinstance(fault, Leak)
            },
            "plan": asdict(plan),
        }
        progress(label)
    write_sheet(folder, drawn.sheet, entries)
    rig = {"sheet": drawn.sheet, "true": drawn.true, "nuisance": drawn.nuisance}
    return {"recordings": rows, "rig": rig}


def record_planned(
    drawn: DrawnRig, plan: PlannedRecording, rng: np.random.Generator
) -> tuple[Take, dict[str, float]]:
    """One recording, and `change` and `weakest` of its state (see `record_rig`)."""
    nuisance, point = drawn.nuisance, plan.point
    pressure = point.load_pressure * (1 + LOAD_ERROR * rng.standard_normal())
    mean = point.speed_rpm * (1 + SPEED_ERROR * rng.standard_normal())
    count = round(point.seconds * SAMPLING_RATE_HZ)
    speed = mean * (1 + draw_speed_wander(count, nuisance["wander"], CORRELATION_S, rng))
    turns = rng.uniform() + np.concatenate([[0.0], np.cumsum(speed[:-1])]) / 60 / SAMPLING_RATE_HZ
    bench = make_bench(drawn, plan.line or drawn.true, plan.kelvin)
    bench.set_faults(plan.faults)
    orbits = settle_orbits(bench, speed, pressure, TOLERANCE)
    middle = orbits[len(orbits) // 2]
    clean = compose_from_orbits(orbits, bench.rig.sensing, speed, turns)
    read = measure(clean, turns, instrument_of(nuisance), rng)
    return Take(read, turns, middle), change_of_state(drawn, plan, bench, middle, pressure)


def change_of_state(
    drawn: DrawnRig, plan: PlannedRecording, bench: Bench, orbit: Orbit, pressure: float
) -> dict[str, float]:
    """`change` and `weakest` of the state whose orbit on `bench` at load `pressure` is given."""
    if plan.state == "healthy":
        return {"change": 0.0, "weakest": 0.0}

    def settle(bench: Bench, faults: tuple) -> Orbit:
        bench.set_faults(faults)
        return bench.settle(orbit.speed_rpm, pressure, tolerance=TOLERANCE)

    sensing = bench.rig.sensing
    changed = plan.line is not None
    healthy = settle(make_bench(drawn, drawn.true, plan.kelvin) if changed else bench, ())
    change = weakest = ripple_change(ripple_of(healthy, sensing), ripple_of(orbit, sensing))
    if len(plan.faults) > 1:
        alone = [settle(bench, (fault,)) for fault in plan.faults]
        scale = ripple_norm(healthy, sensing)
        weakest = min(ripple_norm(orbit, sensing, other) for other in alone) / scale
    return {"change": change, "weakest": weakest}


def make_bench(drawn: DrawnRig, true: dict, kelvin: float) -> Bench:
    """The rig with the line of `true`, `kelvin` warmer than on average."""
    return Bench(build(drawn.sheet, seal_at(drawn.sheet, true, drawn.nuisance, kelvin)))


def instrument_of(nuisance: dict) -> Instrument:
    """What the sensors add, of a rig's nuisance physics."""
    names = ("noise", "corner_hz", "scatter", "drift")
    return Instrument(offset=tuple(nuisance["offset"]), **{name: nuisance[name] for name in names})


def ripple_change(before: np.ndarray, after: np.ndarray) -> float:
    """Norm of the change of a sensed ripple (sensors, records) over that of the ripple before."""
    return float(np.linalg.norm(after - before) / np.linalg.norm(before))


def ripple_norm(orbit: Orbit, sensing: tuple, less: Orbit | None = None) -> float:
    """Norm of the sensed ripple of an orbit, `less` that of another one."""
    ripple = ripple_of(orbit, sensing)
    if less is not None:
        ripple = ripple - ripple_of(less, sensing)
    return float(np.linalg.norm(ripple))


def ripple_of(orbit: Orbit, sensing: tuple) -> np.ndarray:
    """Sensed pressure (sensors, records) of an orbit without its mean."""
    pressure = sensed_pressure(orbit, sensing)
    return pressure - pressure.mean(axis=1, keepdims=True)


def equivalent_areas(drawn: DrawnRig, plan: PlannedRecording) -> dict[str, float]:
    """Fault -> orifice area, m2, that passes the leak's flow at the operating pressure."""
    true = true_pump(drawn.sheet["pump"], drawn.nuisance)["discharge_coefficient"]
    ratio = true / drawn.sheet["pump"]["discharge_coefficient"]
    return {f.kind: f.leak_area * ratio for f in plan.faults if isinstance(f, Leak)}


def delivering_piston(leak: Leak, pistons: int, turn: float) -> int:
    """How many pistons begin their delivery after crank `turn` before the leaking one does.

    Of the two pistons of a scratched cylinder block it is the one that delivers first.
    """
    chamber = leak.chamber + (leak.kind == "cylinder")
    return int(np.ceil(pistons * (1 - turn % 1.0)) - 1 - chamber) % pistons
