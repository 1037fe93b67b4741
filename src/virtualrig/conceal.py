"""A drawn case recorded: the folder that the tool is given, and the truth that it is not."""

from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np

from virtualrig.draw import Drawn, difference
from virtualrig.folder import (
    listed,
    prepare,
    ripple_name,
    write_recording,
    write_ripple,
    write_sheet,
)
from virtualrig.orbit import Bench
from virtualrig.pump import Pump
from virtualrig.recorder import Point, record, sense
from virtualrig.rig import Rig, build
from virtualrig.source import constant_pressure_flow

NUMERICS = {"frequency": 7000.0, "points": 8.0, "degree": 7, "modes": 10}
REFINE = 3
"""Of a drawn rig: wrong by less than a tenth of its noise, as `virtualrig.exact` checks before any
case is drawn. Ripples are stronger and noise is weaker here than on the built-in rig, and a line
that ends in a volume rings on for forty revolutions, so that errors add up: hence elements of
higher degree and a third of the stable time step."""

SETTLED = 0.01
"""Pressures are periodic when they change by less than this share of the noise in a revolution."""

_ROWS = 1536  # of a nominal flow ripple


def conceal(drawn: Drawn, folder: Path, rng: np.random.Generator) -> dict:
    """Record a drawn case into `folder` (new or empty); returns its truth.

    The truth gains, of the sensors' ripple, `change`: at the first operating point, the norm of
    what its effects change over that of the ripple without them; and `floor`: that of what the
    nominal flow's error makes over that of the ripple, which the best twin must leave, the root
    mean square over the operating points, as held-out misfits are.
    """
    prepare(folder, None)
    rig = build(drawn.sheet, drawn.seal | {"numerics": NUMERICS})
    entries = []
    for point in drawn.points:
        flow, tolerance = driving(rig, point), SETTLED * rig.noise
        take = record(rig, point, rng, flow, tolerance, REFINE, marched=True)
        write_recording(folder / "recordings" / f"{point.label}.h5", take)
        write_ripple(folder / ripple_name(point), *nominal_flow(drawn.sheet, point))
        entries.append(listed(point, with_ripple=True))
    write_sheet(folder, drawn.sheet, entries)
    return drawn.truth | compared(drawn, rig)


def driving(rig: Rig, point: Point):
    """Function of the speed in r/min: the true pump's flow (SAMPLES,), which drives the line."""
    return cache(
        partial(
            constant_pressure_flow,
            rig.pump,
            rig.network.density,
            pressure=point.load_pressure,
            ripple=rig.ripple,
        )
    )


def nominal_flow(sheet: dict, point: Point) -> tuple[np.ndarray, np.ndarray]:
    """Crank angle in degrees and flow in m3/s of the sheet's pump, one revolution."""
    flow = constant_pressure_flow(
        Pump(**sheet["pump"]), sheet["fluid"]["density"], point.speed_rpm, point.load_pressure
    )
    # resampled by its spectrum: taking every twelfth sample would fold what lies above
    spectrum = np.fft.rfft(flow)[: _ROWS // 2 + 1] * (_ROWS / len(flow))
    spectrum[-1] = 0.0
    return 360 * np.arange(_ROWS) / _ROWS, np.fft.irfft(spectrum, n=_ROWS)


def compared(drawn: Drawn, rig: Rig) -> dict[str, float]:
    """`change` and `floor` of `conceal`, by runs of the rig built from the drawn case."""
    points = [replace(point, seconds=0.0) for point in drawn.points]

    def ripple(which: Rig, point: Point, flow) -> np.ndarray:
        # At the stable time step: two runs are compared, and their numerics' errors are alike.
        orbit = Bench(which, flow=flow).settle(
            point.speed_rpm, point.load_pressure, tolerance=SETTLED * rig.noise
        )
        sensed = sense(orbit, which.sensing)
        return sensed - sensed.mean(axis=1, keepdims=True)

    true = [ripple(rig, point, driving(rig, point)) for point in points]
    change = 0.0
    if drawn.seal["effects"]:
        plain = build(drawn.sheet, drawn.seal | {"numerics": NUMERICS, "effects": []})
        without = ripple(plain, points[0], driving(plain, points[0]))
        change = float(np.linalg.norm(true[0] - without) / np.linalg.norm(without))
    # The shaft's swing is the tool's to find: the nominal flow with it is the best it can have.
    nominal = replace(rig, pump=Pump(**drawn.sheet["pump"]))
    errors = [
        difference(ripple(rig, point, driving(nominal, point)), wave, rig.pump.pistons, point)
        for point, wave in zip(points, true)
    ]
    return {"change": change, "floor": float(np.sqrt(np.mean(np.square(errors))))}
