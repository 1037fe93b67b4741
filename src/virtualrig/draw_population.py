"""Random rigs of a population, the states of their recordings, and how severe these are.

Every random number follows from the hash of the tool that is tried, the number of the trial and the
number of the rig.
"""

from dataclasses import dataclass, replace

import numpy as np

from virtualrig.draw import random_generator
from virtualrig.draw_nuisance import NUISANCE, RECORDING_KELVIN, draw_nuisance
from virtualrig.draw_rig import draw_data_sheet, draw_true_rig
from virtualrig.faults import BlockedPort, CavitatingSuction, Leak, WornValvePlate
from virtualrig.pump import ATMOSPHERE, Pump
from virtualrig.recorder import Point

HEALTHY_REPEATS = 3
STATES = (
    "healthy", "healthy", "slipper", "slipper", "cylinder", "cylinder",
    "slipper+cylinder", "slipper+cylinder", "valve_plate", "blocked_port", "cavitation",
    "changed_line",
)  # fmt: skip
"""Of the recordings of unknown state of a rig."""

SECONDS = 1.6
LEAK_SHARE = (3e-4, 0.1)
"""Flow through a leak at the operating pressure over the pump's: from one that hardly anyone could
see to a pump that is beyond its service limit of 90 % (ISO 4409 states volumetric efficiency)."""
COMPOUND_RATIO = 4.0  # of two leaks at most: one that drowns in the other cannot be told
WEAR_SHARE = (5e-4, 0.1)  # the same of the leak across the valve plate, while a land is passed
OPEN_SHARE = (0.8, 0.1)  # of a blocked suction port, slight to severe
SUCTION = (2.7e5, 3e4)  # absolute pressure, Pa, at a cavitating pump's inlet, slight to severe
LINE_CHANGE = (3e-3, 0.3)  # relative, of a length or a wave speed
CLEARANCE = 0.2  # m between sensors and joints: short pipes need small time steps


@dataclass(frozen=True)
class PlannedRecording:
    """A recording before it is made.

    `point` is the operating point that the operator sets, `state` one of STATES, `faults` those of
    the pump, `line` the line where somebody changed it, `kelvin` how much warmer the rig is.
    """

    point: Point
    state: str
    faults: tuple = ()
    line: dict | None = None
    kelvin: float = 0.0


@dataclass(frozen=True)
class DrawnRig:
    """A rig of the population: data sheet, true values, nuisance physics, planned recordings."""

    sheet: dict
    true: dict
    nuisance: dict
    recordings: tuple[PlannedRecording, ...]


def draw_rig(commit: str, number: int | str, rig: int) -> DrawnRig:
    """Rig `rig` of a trial."""
    rng = random_generator(commit, number, "population", rig)
    sheet = draw_sheet(rng)
    true = draw_true(sheet, rng)
    nuisance = draw_nuisance(rng, len(sheet["sensors"]), len(sheet["line"]["segments"]))
    points = draw_points(rng)
    healthy = [replace(points[0], label=f"healthy_0_{k}") for k in range(HEALTHY_REPEATS)]
    healthy += [replace(point, label=f"healthy_{k}") for k, point in enumerate(points[1:], 1)]
    plans = [
        PlannedRecording(point, "healthy", kelvin=float(RECORDING_KELVIN * rng.standard_normal()))
        for point in healthy
    ]
    session = nuisance["session_kelvin"]
    for k, state in enumerate(rng.permutation(STATES)):
        # three of four at the point that was recorded most often when the pump was healthy
        at = 0 if rng.uniform() < 0.75 else int(rng.integers(1, len(points)))
        point = replace(points[at], label=f"unknown_{k:02d}")
        plans.append(_draw_state(str(state), point, sheet, true, session, rng))
    return DrawnRig(sheet, true, nuisance, tuple(plans))


def draw_sheet(rng: np.random.Generator) -> dict:
    """A data sheet with a pump of 8 to 54 cm3 a revolution; its sensors are clear of joints."""
    sheet = draw_data_sheet(rng)
    pump = sheet["pump"]
    pump["piston_diameter"] = _digits(rng.uniform(0.012, 0.018))
    # room for all cylinders, with walls between them of 15 % of a bore
    least = 1.15 * pump["piston_diameter"] / (2.0 * np.sin(np.pi / pump["pistons"]))
    pump["pitch_radius"] = _digits(rng.uniform(max(0.024, least), 0.036))
    swept = Pump(**pump).displacement / pump["pistons"]
    pump["dead_volume"] = _digits(swept * rng.uniform(0.4, 0.9))
    pump["port_area"] = _digits(np.pi / 4 * pump["piston_diameter"] ** 2 * rng.uniform(0.4, 0.5))
    for segment in sheet["line"]["segments"]:
        segment["diameter"] = _digits(rng.uniform(0.013, 0.020))
    joints = np.cumsum([0.0, *(s["length"] for s in sheet["line"]["segments"])])
    count = len(sheet["sensors"])
    while True:
        places = np.sort([rng.uniform(0.25, 0.8), *rng.uniform(0.25, joints[-1], count - 1)])
        clear = abs(places[:, None] - joints).min() > CLEARANCE
        if clear and np.diff(places).min() > 0.5:
            break
    for sensor, place in zip(sheet["sensors"], places, strict=True):
        sensor["position"] = _digits(place)
    return sheet


def draw_true(sheet: dict, rng: np.random.Generator, off: bool = False) -> dict:
    """True fluid, line and sensors, the sensors clear of joints; `off` as in `draw_true_rig`."""
    while True:
        true = draw_true_rig(sheet, rng, off=off)
        joints = np.cumsum([0.0, *(s["length"] for s in true["line"]["segments"])])
        if abs(np.array(true["sensors"])[:, None] - joints).min() > 0.5 * CLEARANCE:
            kept = {key: true[key] for key in ("fluid", "line", "sensors")}
            return kept | {"seed": int(rng.integers(2**31))}


def draw_points(rng: np.random.Generator, fewest: int = 2) -> list[Point]:
    """`fewest` to three operating points that differ in speed and pressure."""
    count = int(rng.integers(fewest, 4))
    speeds = rng.permutation([800.0, 1000.0, 1250.0, 1500.0])[:count] + rng.integers(-9, 10) * 10.0
    pressures = rng.permutation([6e6, 9e6, 12e6, 15e6])[:count] + rng.integers(-10, 11) * 1e5
    pairs = zip(speeds, pressures, strict=True)
    return [Point("", float(speed), float(pressure), SECONDS) for speed, pressure in pairs]


def _draw_state(
    state: str, point: Point, sheet: dict, true: dict, session: float, rng: np.random.Generator
) -> PlannedRecording:
    """A recording of `state` with a severity drawn on a logarithmic scale."""
    pump, density = Pump(**sheet["pump"]), sheet["fluid"]["density"]
    flow = pump.displacement * point.speed_rpm / 60
    hole = flow / (0.65 * np.sqrt(2 * point.load_pressure / density))  # that would pass all of it

    def leak(kind: str, share: float) -> Leak:
        area = share * hole
        chamber = int(rng.integers(pump.pistons))
        return Leak(kind, area, NUISANCE["laminar"].draw(rng), point.load_pressure, chamber)

    faults, line = (), None
    if state == "valve_plate":
        faults = (WornValvePlate(_log_uniform(*WEAR_SHARE, rng) * hole),)
    elif state == "blocked_port":
        faults = (BlockedPort(_log_uniform(*OPEN_SHARE, rng)),)
    elif state == "cavitation":
        faults = (CavitatingSuction(_log_uniform(*SUCTION, rng) - ATMOSPHERE),)
    elif state == "changed_line":
        line = _change_line(true, rng)
    elif state != "healthy":
        share, ratio = _log_uniform(*LEAK_SHARE, rng), COMPOUND_RATIO ** rng.uniform(-0.5, 0.5)
        kinds = state.split("+")
        shares = (share,) if len(kinds) == 1 else (share * ratio, share / ratio)
        faults = tuple(map(leak, kinds, shares))
    kelvin = session + RECORDING_KELVIN * rng.standard_normal()
    return PlannedRecording(point, state, faults, line, float(kelvin))


def _change_line(true: dict, rng: np.random.Generator) -> dict:
    """`true` after somebody changed the line: a longer pipe, a softer hose or a dead end."""
    size = _log_uniform(*LINE_CHANGE, rng)
    segments = [dict(segment) for segment in true["line"]["segments"]]
    changed = int(rng.integers(len(segments)))
    kind = str(rng.choice(["longer", "softer", "branch"]))
    result = true | {"line": {"segments": segments}, "change": [kind, changed + 1, size]}
    if kind == "softer":
        segments[changed]["wave_speed"] *= 1 - size
    elif kind == "longer":
        end = sum(segment["length"] for segment in segments[: changed + 1])
        added = size * segments[changed]["length"]
        segments[changed]["length"] += added
        result["sensors"] = [x + added if x > end else x for x in true["sensors"]]
    else:
        end = sum(segment["length"] for segment in segments[: changed + 1])
        last = changed == len(segments) - 1
        result["branches"] = [
            {
                "position": end - segments[changed]["length"] if last else end,
                "length": float(rng.uniform(0.3, 1.0)),
                "diameter": segments[changed]["diameter"] * float(np.sqrt(size)),
                "wave_speed": segments[changed]["wave_speed"],
            }
        ]
    return result


def _log_uniform(low: float, high: float, rng: np.random.Generator) -> float:
    return float(low * (high / low) ** rng.uniform())


def _digits(value: float) -> float:
    return float(f"{value:.4g}")
