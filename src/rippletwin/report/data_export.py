"""Ripples, spectra, a twin's values and its line as files for other programs: CSV, MAT, JSON."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np
from scipy.io import savemat

from rippletwin import store
from rippletwin.harmonics import one_period
from rippletwin.spectra.observation import Observation
from rippletwin.twin.state_space import twin_state_space
from rippletwin.twin.twin import Twin

SAMPLES_AN_ORDER = 4  # at least, of an exported ripple's highest order


def ripple_of(observation: Observation) -> tuple[np.ndarray, np.ndarray] | None:
    """Time (M,), s, and pressure (S, M), Pa gauge, of one revolution at the mean speed, made of the
    observation's mean and shaft orders; None where it has no shaft orders."""
    if observation.orders is None:
        return None
    count = SAMPLES_AN_ORDER * int(observation.orders[-1])
    orders = np.append(0, observation.orders)
    spectrum = np.column_stack([observation.mean, observation.values])
    time = np.arange(count) / count / observation.speed_hz
    return time, one_period(spectrum, count, orders)


def export_observation(observation: Observation, folder: str | Path) -> list[Path]:
    """Write LABEL_spectrum.csv, LABEL.mat and, of a periodic recording, LABEL_ripple.csv.

    Spectra are complex peak amplitudes in Pa, an impedance is in Pa s/m3 or relative as the
    recording states it; `sd` is the standard deviation of the complex error.
    """
    folder = Path(folder)
    names = [sensor.name for sensor in observation.sensors]
    if len(names) != len(observation.values):  # an impedance has no sensors
        names = ["impedance"]
    sd, ripple = np.sqrt(observation.variance), ripple_of(observation)
    columns = {"frequency_hz": observation.frequency_hz}
    if observation.orders is not None:
        columns["order"] = observation.orders
    for name, values, error in zip(names, observation.values, sd):
        columns |= {f"{name}_re": values.real, f"{name}_im": values.imag, f"{name}_sd": error}
    data = {
        "label": observation.label,
        "kind": observation.kind,
        "sensors": np.array(names, dtype=object),
        "frequency_hz": observation.frequency_hz,
        "spectrum": observation.values,
        "spectrum_sd": sd,
        "mean": observation.mean,
    }
    spectrum_file = folder / f"{observation.label}_spectrum.csv"
    _write_csv(spectrum_file, columns)
    written = [spectrum_file]
    if ripple is not None:
        time, pressure = ripple
        data |= {"order": observation.orders, "speed_hz": observation.speed_hz}
        data |= {"time_s": time, "ripple": pressure}
        written.append(folder / f"{observation.label}_ripple.csv")
        _write_csv(written[-1], {"time_s": time, **dict(zip(names, pressure))})
    written.append(folder / f"{observation.label}.mat")
    _write_matlab(written[-1], data)
    return written


def export_twin(twin: Twin, covariance: np.ndarray | None, path: str | Path) -> Path:
    """Write the twin's values with units and, where `covariance` (P, P) of its theta is known, the
    standard deviations to first order."""
    values = {}
    for k, (parameter, u) in enumerate(zip(twin.parameters, twin.theta)):
        entry = {"value": float(parameter.value(u)), "unit": parameter.unit}
        if covariance is not None:
            entry["sd"] = float(parameter.value_sd(u, np.sqrt(covariance[k, k])))
        values[parameter.name] = entry
    result = {
        "friction": twin.friction_law,
        "effects": [{"name": effect.name, "place": str(place)} for effect, place in twin.effects],
        "values": values,
    }
    return store.write_text(path, json.dumps(result, indent=1) + "\n")


def export_state_space(twin: Twin, observation: Observation, folder: str | Path) -> list[Path]:
    """Write LABEL_state_space.json and .mat: the twin's line at a recording's operating point from
    the pump's flow ripple to pressure ripples, valid over the recording's band."""
    folder = Path(folder)
    band = [float(observation.frequency_hz[0]), float(observation.frequency_hz[-1])]
    space = twin_state_space(twin, observation, *band)
    matrices = {"A": space.a, "B": space.b, "C": space.c, "D": space.d}
    about = {
        "label": observation.label,
        "input": "flow ripple of the pump, m3/s",
        "outputs": ["pump outlet", *(sensor.name for sensor in twin.rig.sensors)],
        "output_unit": "Pa",
        "band_hz": band,
        "relative_error": space.error,
    }
    written = [folder / f"{observation.label}_state_space{suffix}" for suffix in (".json", ".mat")]
    plain = {name: np.asarray(value).tolist() for name, value in (about | matrices).items()}
    store.write_text(written[0], json.dumps(plain, indent=None) + "\n")
    about["outputs"] = np.array(about["outputs"], dtype=object)
    _write_matlab(written[1], {**about, **matrices})
    return written


def _write_csv(path: Path, columns: Mapping[str, np.ndarray]) -> None:
    """Columns of equal length under their names; numbers keep all their digits."""
    rows: Iterable = zip(*(np.asarray(column).tolist() for column in columns.values()))
    with store.whole(path) as scratch, scratch.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(columns)
        writer.writerows(rows)


def _write_matlab(path: Path, data: Mapping[str, object]) -> None:
    with store.whole(path) as scratch:
        savemat(scratch, data, oned_as="row")
