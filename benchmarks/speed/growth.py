"""How time and memory grow with segments, sensors, operating points and harmonics."""

from __future__ import annotations

import tracemalloc
from dataclasses import dataclass, replace

import numpy as np

from rippletwin.calibration.calibrate import calibrate
from rippletwin.case.model import Fluid, Load, Rig, Segment, Sensor
from rippletwin.spectra.observation import Observation
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.twin import Twin
from selfcheck_cases import kinematic_ripple
from speed.result import Claim, Result, Table
from speed.timing import alternate, in_words

LENGTH, PISTONS = 9.0, 9  # m
LINEAR = 1.15  # exponents up to it count as linear


@dataclass(frozen=True)
class Size:
    """Numbers of a case's parts."""

    segments: int = 3
    sensors: int = 2
    points: int = 1
    harmonics: int = 26


SIZES = {
    "segments": (2, 4, 8, 16),
    "sensors": (2, 4, 8, 16),
    "points": (1, 2, 4, 8),
    "harmonics": (26, 52, 104, 208),
}
CALIBRATED = {"segments": (1, 2, 4), "sensors": (2, 4, 8), "points": (1, 2, 4)}


def case(size: Size) -> tuple[Rig, list[Observation]]:
    """A rig of that size and recordings that its own twin made, with noise."""
    diameters = np.tile([0.0197, 0.0231, 0.0149], size.segments)[: size.segments]
    line = tuple(
        Segment(LENGTH / size.segments, float(d), 1020.0 + 40 * (k % 3))
        for k, d in enumerate(diameters)
    )
    places = np.linspace(0.05, 0.9, size.sensors) * LENGTH
    sensors = tuple(Sensor(f"p{k + 1}", float(x)) for k, x in enumerate(places))
    rig = Rig(Fluid(870.0, 3.2e-5), {"pistons": PISTONS}, line, sensors, Load("orifice"))
    orders = PISTONS * np.arange(1, size.harmonics + 1)
    blank = []
    for k in range(size.points):
        speed = (1000 + 60 * k) / 60
        blank.append(
            Observation(
                "periodic",
                f"point {k}",
                orders * speed,
                orders,
                np.ones((size.sensors, size.harmonics), complex),
                np.tile(4.0 * np.eye(size.sensors, dtype=complex), (size.harmonics, 1, 1)),
                np.full(size.sensors, 9e6),
                speed,
                9e6 + 5e5 * k,
                "nominal",
                kinematic_ripple(speed, 9e6 + 5e5 * k),
                sensors,
            )
        )
    rng = np.random.default_rng(0)
    twin = Twin(rig, blank)
    theta = np.clip(0.5 * rng.normal(size=len(twin.theta)), -1, 1)
    made = ForwardModel(twin, blank)(theta)
    noisy = [h + 2.0 * rng.normal(size=h.shape) for h in made]
    return rig, [replace(o, values=h) for o, h in zip(blank, noisy)]


def peak_memory(task) -> int:
    """Largest number of bytes that Python and NumPy hold at once during a task."""
    tracemalloc.start()
    task()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    return peak


def exponent(numbers, times) -> float:
    """Slope between the two largest sizes on logarithmic axes."""
    return float(np.log(times[-1] / times[-2]) / np.log(numbers[-1] / numbers[-2]))


def solve_task(size: Size):
    """A task that solves the line of all points once, at another theta each time."""
    rig, observations = case(size)
    twin = Twin(rig, observations)
    forward, rng = ForwardModel(twin, observations), np.random.default_rng(1)
    return lambda: forward(0.1 * rng.normal(size=len(twin.theta)))


def calibrate_task(size: Size):
    """A task that calibrates a twin to the recordings."""
    rig, observations = case(size)
    return lambda: calibrate(Twin(rig, observations), observations)


def measure(what: str, numbers, make, rounds: int) -> tuple[list[str], float]:
    """A row of the table, and the exponent of the time."""
    tasks = {str(n): make(replace(Size(), **{what: n})) for n in numbers}
    times = alternate(tasks, rounds)
    middle = [float(np.median(times[str(n)])) for n in numbers]
    memory = [peak_memory(task) for task in tasks.values()]
    growth = exponent(numbers, middle)
    row = [
        what,
        ", ".join(map(str, numbers)),
        ", ".join(map(in_words, middle)),
        f"{growth:.2f}",
        ", ".join(f"{m / 1e6:.2g}" for m in memory),
    ]
    return row, growth


def run(quick: bool = False) -> Result:
    """Growth of one solution of the line, and of a calibration."""
    columns = ["number of", "values", "time", "exponent", "memory, MB"]
    tables, claims = [], []
    for caption, sizes, make, rounds in (
        ("One solution of the line", SIZES, solve_task, 5),
        ("A calibration", CALIBRATED, calibrate_task, 1),
    ):
        rows = []
        for what, numbers in sizes.items():
            if quick:
                if make is calibrate_task:
                    continue
                numbers = numbers[:2]
            row, growth = measure(what, numbers, make, 1 if quick else rounds)
            rows.append(row)
            claims.append(
                Claim(
                    f"{caption[0].lower()}{caption[1:]}: exponent of the time in {what}",
                    growth,
                    LINEAR,
                    "",
                    at_least=False,
                )
            )
        if rows:
            tables.append(Table(caption, columns, rows))
    return Result(
        point=10,
        title="Growth",
        what=[
            "One of a case's numbers grows while the others stay at three segments, two sensors, "
            "one operating point and 26 harmonics. The exponent is that between the two largest "
            f"sizes; up to {LINEAR:g} it counts as linear. Memory is the peak of what Python and "
            "NumPy hold during the task.",
        ],
        claims=claims,
        tables=tables,
    )
