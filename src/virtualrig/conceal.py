"""A drawn case recorded: the folder that the tool is given, and the truth that it is not."""

from dataclasses import replace
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
from virtualrig.resolution import ALLOWED, NUMERICS, SETTLED, built, driving, refine, resolved
from virtualrig.rig import Rig
from virtualrig.source import constant_pressure_flow

_ROWS = 1536  # of a nominal flow ripple


def conceal(drawn: Drawn, folder: Path, rng: np.random.Generator) -> dict:
    """Record a drawn case into `folder` (new or empty); returns its truth.

    The truth gains, of the sensors' ripple, `change`: at the first operating point, the norm of
    what its effects change over that of the ripple without them; and `floor`: that of what the
    nominal flow's error makes over that of the ripple, which the best twin must leave, the root
    mean square over the operating points, as held-out misfits are; and `mesh`: of a line that is
    not linear, the highest frequency in Hz that its mesh was made for, the error that it leaves and
    the one allowed, Pa.
    """
    prepare(folder, None)
    numerics, error = resolved(drawn)
    rig = built(drawn, numerics)
    entries = []
    for point in drawn.points:
        flow, tolerance = driving(rig, point), SETTLED * rig.noise
        take = record(rig, point, rng, flow, tolerance, refine(rig), marched=True)
        write_recording(folder / "recordings" / f"{point.label}.h5", take)
        write_ripple(folder / ripple_name(point), *nominal_flow(drawn.sheet, point))
        entries.append(listed(point, with_ripple=True))
    write_sheet(folder, drawn.sheet, entries)
    mesh = None
    if error is not None:
        mesh = {"frequency": numerics["frequency"], "error": error, "allowed": ALLOWED * rig.noise}
    return drawn.truth | {"mesh": mesh} | compared(drawn)


def nominal_flow(sheet: dict, point: Point) -> tuple[np.ndarray, np.ndarray]:
    """Crank angle in degrees and flow in m3/s of the sheet's pump, one revolution."""
    flow = constant_pressure_flow(
        Pump(**sheet["pump"]), sheet["fluid"]["density"], point.speed_rpm, point.load_pressure
    )
    # resampled by its spectrum: taking every twelfth sample would fold what lies above
    spectrum = np.fft.rfft(flow)[: _ROWS // 2 + 1] * (_ROWS / len(flow))
    spectrum[-1] = 0.0
    return 360 * np.arange(_ROWS) / _ROWS, np.fft.irfft(spectrum, n=_ROWS)


def compared(drawn: Drawn) -> dict[str, float]:
    """`change` and `floor` of `conceal`, by runs of the drawn rig."""
    rig = built(drawn, NUMERICS)
    points = [replace(point, seconds=0.0) for point in drawn.points]

    def ripple(which: Rig, point: Point, flow) -> np.ndarray:
        # At the stable time step and on the coarsest mesh: two runs are compared, and their
        # numerics' errors are alike.
        orbit = Bench(which, flow=flow).settle(
            point.speed_rpm, point.load_pressure, tolerance=SETTLED * rig.noise
        )
        sensed = sense(orbit, which.sensing)
        return sensed - sensed.mean(axis=1, keepdims=True)

    true = [ripple(rig, point, driving(rig, point)) for point in points]
    change = 0.0
    if drawn.seal["effects"]:
        plain = built(drawn, NUMERICS, effects=[])
        without = ripple(plain, points[0], driving(plain, points[0]))
        change = float(np.linalg.norm(true[0] - without) / np.linalg.norm(without))
    # The shaft's swing is the tool's to find: the nominal flow with it is the best it can have.
    nominal = replace(rig, pump=Pump(**drawn.sheet["pump"]))
    errors = [
        difference(ripple(rig, point, driving(nominal, point)), wave, rig.pump.pistons, point)
        for point, wave in zip(points, true)
    ]
    return {"change": change, "floor": float(np.sqrt(np.mean(np.square(errors))))}
