"""Recording of a drawn case: the folder that the tool is given, and the truth."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from virtualrig.draw import DrawnCase
from virtualrig.draw_rig import ripple_difference
from virtualrig.folder import (
    prepare_folder,
    recording_entry,
    ripple_name,
    write_recording,
    write_ripple,
    write_sheet,
)
from virtualrig.orbit import Bench
from virtualrig.pump import Pump
from virtualrig.recorder import Point, record, sensed_pressure
from virtualrig.resolution import (
    ALLOWED_ERROR,
    BASE_NUMERICS,
    SETTLING_TOLERANCE,
    build_drawn,
    choose_mesh,
    step_divisor,
    true_flow,
)
from virtualrig.rig import Rig
from virtualrig.source import constant_pressure_flow

_ROWS = 1536  # of the table of a nominal flow ripple


def record_concealed_case(drawn: DrawnCase, folder: Path, rng: np.random.Generator) -> dict:
    """Record a drawn case into `folder` (new or empty); returns its truth.

    The truth gains these keys:
        change, floor   see `change_and_floor`
        mesh            of a nonlinear line the highest `frequency` (Hz) that its mesh is made for,
                        its estimated `error` and the error `allowed` (Pa); else None
    """
    prepare_folder(folder, None)
    numerics, error = choose_mesh(drawn)
    rig = build_drawn(drawn, numerics)
    entries = []
    for point in drawn.points:
        flow, tolerance = true_flow(rig, point), SETTLING_TOLERANCE * rig.noise
        take = record(rig, point, rng, flow, tolerance, step_divisor(rig), marched=True)
        write_recording(folder / "recordings" / f"{point.label}.h5", take)
        write_ripple(folder / ripple_name(point), *nominal_flow_ripple(drawn.sheet, point))
        entries.append(recording_entry(point, with_ripple=True))
    write_sheet(folder, drawn.sheet, entries)
    mesh = None
    if error is not None:
        mesh = {
            "frequency": numerics["frequency"],
            "error": error,
            "allowed": ALLOWED_ERROR * rig.noise,
        }
    return drawn.truth | {"mesh": mesh} | change_and_floor(drawn)


def nominal_flow_ripple(sheet: dict, point: Point) -> tuple[np.ndarray, np.ndarray]:
    """Crank angle (_ROWS,) in degrees and flow (_ROWS,) in m3/s of the data sheet's pump."""
    flow = constant_pressure_flow(
        Pump(**sheet["pump"]), sheet["fluid"]["density"], point.speed_rpm, point.load_pressure
    )
    # resampled by its spectrum: every twelfth sample would alias the higher frequencies
    spectrum = np.fft.rfft(flow)[: _ROWS // 2 + 1] * (_ROWS / len(flow))
    spectrum[-1] = 0.0
    return 360 * np.arange(_ROWS) / _ROWS, np.fft.irfft(spectrum, n=_ROWS)


def change_and_floor(drawn: DrawnCase) -> dict[str, float]:
    """Sizes of the effects and of the flow's error at the sensors, by runs of the drawn rig.

    `change` is the norm of the change that the effects make at the first operating point, over that
    of the ripple without them. `floor` is the norm of the error that the nominal flow makes, over
    that of the ripple, root mean square over the operating points as held-out misfits are: no twin
    with the nominal flow can be better.
    """
    rig = build_drawn(drawn, BASE_NUMERICS)
    points = [replace(point, seconds=0.0) for point in drawn.points]

    def ripple(which: Rig, point: Point, flow) -> np.ndarray:
        # Stable time step, coarsest mesh: two runs are compared, and their errors are alike.
        orbit = Bench(which, flow=flow).settle(
            point.speed_rpm, point.load_pressure, tolerance=SETTLING_TOLERANCE * rig.noise
        )
        sensed = sensed_pressure(orbit, which.sensing)
        return sensed - sensed.mean(axis=1, keepdims=True)

    true = [ripple(rig, point, true_flow(rig, point)) for point in points]
    change = 0.0
    if drawn.seal["effects"]:
        plain = build_drawn(drawn, BASE_NUMERICS, effects=[])
        without = ripple(plain, points[0], true_flow(plain, points[0]))
        change = float(np.linalg.norm(true[0] - without) / np.linalg.norm(without))
    # The tool can find the phase modulation of the shaft: the nominal flow has it here.
    nominal = replace(rig, pump=Pump(**drawn.sheet["pump"]))
    errors = [
        ripple_difference(
            ripple(rig, point, true_flow(nominal, point)), wave, rig.pump.pistons, point
        )
        for point, wave in zip(points, true)
    ]
    return {"change": change, "floor": float(np.sqrt(np.mean(np.square(errors))))}
