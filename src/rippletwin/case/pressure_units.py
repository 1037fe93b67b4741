"""Whether a recorded pressure can be pascals: against the load pressure and against the sign."""

from __future__ import annotations

import numpy as np

from rippletwin.case.model import Recording, Rig
from rippletwin.errors import InputError

UNITS = (("bar", 1e5), ("MPa", 1e6), ("kPa", 1e3), ("psi", 6894.76))
PASCALS = {"Pa": 1.0, **dict(UNITS)}
"""Unit of a recording's `unit` in rig.yaml -> Pa."""
LARGEST_COUNT = 2**24  # of a converter of 24 bits
VACUUM = -1.1e5  # Pa; gauge pressure cannot be lower
FEW = 1000  # samples that spare a look at all of a recording
LARGEST_FALL = 1e6  # Pa; of the mean pressure from a sensor to the load
LEAST_MEAN, MOST_MEAN = 0.8, 1.2  # of the load pressure, beside LARGEST_FALL; calibrated sensors
SURE_MEAN = 10.0  # of the ripple's rms, above which a sensor is not AC-coupled
LARGEST_RIPPLE = 1e8  # Pa rms, where no load pressure is stated


def unit_error(recording: Recording, rig: Rig, name: str, row: np.ndarray) -> InputError | None:
    """What is implausible in a sensor's samples (N,): unit, raw counts, sign; None where nothing.

    Mean and ripple are compared with the load pressure. Sensors may be AC-coupled: then the ripple
    alone is compared.
    """
    load = recording.load_pressure
    mean, ripple = float(np.mean(row)), float(np.std(row))
    if mean < VACUUM and abs(mean) > 10 * ripple:
        return InputError(
            recording.file,
            name,
            f"a mean of {mean:.3g} Pa is below vacuum: the sign is inverted",
            "Multiply the sensor's samples by -1, or correct its offset",
        )
    problem = _problem(abs(mean), ripple, load, rig)
    if problem is None:
        return None
    counts = _looks_like_counts(row)
    unit = None if ripple > LARGEST_RIPPLE else _unit_guess(abs(mean), load)
    looks, remedy = "", "Give pressure in Pa"
    if unit:
        looks = f" and looks like {unit[0]}"
        remedy = f"{remedy}: multiply by {unit[1]:g}, or give unit: {unit[0]} in rig.yaml"
    if counts:
        looks += f"{' or' if unit else ' and looks like'} raw counts: whole numbers only"
        remedy += "; raw counts need the recorder's scale, Pa a count, as scale in rig.yaml"
    stated = "load_pressure" if unit or counts else "unit, scale or load_pressure"
    return InputError(recording.file, name, problem + looks, f"{remedy}; or correct {stated}")


def count_warnings(recording: Recording, rig: Rig) -> list[str]:
    """A line that names the sensors whose samples may be raw counts: whole numbers without a mean
    that shows them to be pascals. None where none may be, or nothing was sampled."""
    if recording.pressure is None:
        return []
    largest = np.inf if recording.load_pressure is None else recording.load_pressure / 3
    names = [
        sensor.name
        for sensor, row in zip(rig.sensors, recording.pressure)
        if _looks_like_counts(row[:FEW]) and abs(np.mean(row)) < largest and _looks_like_counts(row)
    ]
    if not names:
        return []
    return [
        f"{recording.label}: {', '.join(names)}: whole numbers only; give scale in rig.yaml: the "
        "recorder's where they are raw counts, 1 where they are pressures"
    ]


def _problem(mean: float, ripple: float, load: float | None, rig: Rig) -> str | None:
    """What contradicts pascals in a mean and a ripple (rms); None where nothing does."""
    if load is None:
        if ripple <= LARGEST_RIPPLE and (rig.fluid.is_gas or ripple > 10):
            return None
        return f"a ripple of {ripple:.3g} rms is implausible as Pa"
    if mean > 3 * load + LARGEST_FALL:
        return f"a mean of {mean:.3g} is implausible beside a load pressure of {load:.3g} Pa"
    weak = ripple < 1e-4 * load and (mean < 10 * ripple or mean < load / 1000)
    if weak or ripple > load + LARGEST_FALL - VACUUM:  # it would fall far below vacuum
        return f"a ripple of {ripple:.3g} rms is implausible beside {load:.3g} Pa of load"
    if mean > 10 * ripple and mean < load / 3 - 2e5:
        return f"a mean of {mean:.3g} is implausible beside a load pressure of {load:.3g} Pa"
    return None


def _looks_like_counts(row: np.ndarray) -> bool:
    """Whether samples are whole numbers that a converter could have put out."""
    return bool(np.max(np.abs(row)) < LARGEST_COUNT and np.all(row == np.round(row)))


def _unit_guess(mean: float, load: float | None) -> tuple[str, float] | None:
    if load is None:
        return UNITS[0]
    near = min(UNITS, key=lambda unit: abs(np.log(max(mean, 1e-12) * unit[1] / load)))
    return near if 0.5 < mean * near[1] / load < 2 else None


def mean_warnings(recording: Recording, rig: Rig) -> list[str]:
    """A line where all sensors of a sampled recording have a mean pressure, and all contradict the
    load pressure that is stated."""
    load = recording.load_pressure
    if recording.pressure is None or load is None or not rig.sensors:
        return []
    means = [float(np.mean(row, dtype=float)) for row in recording.pressure]
    if max(means) >= LEAST_MEAN * load and min(means) <= MOST_MEAN * load + LARGEST_FALL:
        return []
    coupled = (abs(m) > SURE_MEAN * np.std(row) for m, row in zip(means, recording.pressure))
    if not all(coupled):  # the mean of an AC-coupled sensor is next to none
        return []
    shown = ", ".join(f"{sensor.name} {mean / 1e5:.4g}" for sensor, mean in zip(rig.sensors, means))
    return [
        f"{recording.label}: the sensors' means, {shown} bar, contradict load_pressure, "
        f"{load / 1e5:.4g} bar; correct load_pressure, unit or scale"
    ]
