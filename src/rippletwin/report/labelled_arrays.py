"""Results as xarray datasets: named dimensions, coordinates, and units in attributes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import xarray as xr

from rippletwin.calibration.misfit import with_likely_amplitude
from rippletwin.case.model import Recording, Sensor
from rippletwin.diagnosis.simulated_fault import SimulatedFault
from rippletwin.spectra.observation import Observation
from rippletwin.twin.reflection import stated_unit
from rippletwin.twin.twin import Twin

if TYPE_CHECKING:
    from rippletwin.explanation.verdict.explanation import Explanation

PASCAL = {"units": "Pa"}


def to_xarray(
    result: Recording | Observation | SimulatedFault | Twin | Explanation,
    sensors: Sequence[Sensor] | None = None,
) -> xr.Dataset | xr.DataTree:
    """A result with names and units.

    sensors : of a recording or a simulated fault, which have no names of their own: `rig.sensors`.

    recording       `pressure` (sensor, time), Pa gauge
    observation     `measured` (sensor, frequency), complex peak amplitudes in Pa, with `sd`
    simulated fault `pressure` (sensor, time), Pa gauge, of one revolution
    twin            `value` and `data_sheet` (parameter), in the unit of the coordinate `unit`
    explanation     a tree with one dataset for each recording: that of its observation, with the
                    twin's `predicted` and, without the effects, `predicted_without_effects`; a
                    source that is not known has its likeliest amplitude

    Raises TypeError for anything else.
    """
    if isinstance(result, Recording):
        return _recording(result, sensors)
    if isinstance(result, Observation):
        return label_spectra(result)
    if isinstance(result, SimulatedFault):
        attributes = {"leak_area_m2": result.area, "mean_flow_m3_s": result.mean_flow}
        return _pressures(result.pressure, result.time_s, sensors, attributes)
    if isinstance(result, Twin):
        return _parameters(result)
    if hasattr(result, "observations") and hasattr(result, "without_effects"):
        twins = {
            "predicted": result.twin,
            "predicted_without_effects": result.without_effects.twin,
        }
        return xr.DataTree.from_dict(
            {each.label: label_spectra(each, twins) for each in result.observations}
        )
    raise TypeError(f"no xarray form of a {type(result).__name__}")


def label_spectra(observation: Observation, twins: Mapping[str, Twin] | None = None) -> xr.Dataset:
    """The spectra of an observation; each of the `twins` predicts it under its name."""
    unit = "Pa"
    if observation.kind == "input_impedance":
        unit = "1" if observation.normalised else "Pa s/m3"
    dims, attributes = ("sensor", "frequency"), {"units": unit}
    data = {
        "measured": (dims, observation.values, attributes | {"long_name": "peak amplitude"}),
        "sd": (dims, np.sqrt(observation.variance), attributes | {"long_name": "of the error"}),
    }
    for name, twin in (twins or {}).items():
        data[name] = (dims, _predict(twin, observation), attributes)
    coords = {"frequency": ("frequency", observation.frequency_hz, {"units": "Hz"})}
    if observation.orders is not None:
        coords["order"] = ("frequency", observation.orders, {"long_name": "shaft order"})
    if len(observation.sensors) == len(observation.values):
        coords |= _sensor_coords(observation.sensors)
    stated = {"speed_hz": observation.speed_hz, "load_pressure_pa": observation.load_pressure}
    known = {name: value for name, value in stated.items() if value is not None}
    return xr.Dataset(data, coords, {"label": observation.label, **known})


def _predict(twin: Twin, observation: Observation) -> np.ndarray:
    """What a twin predicts of an observation, in its unit; a free source has the amplitude that
    comes nearest to what was measured."""
    predicted = twin.predict([observation])[0]
    if observation.kind == "input_impedance":
        return stated_unit(observation, twin.rig) * (1.0 + predicted) / (1.0 - predicted)
    return with_likely_amplitude(observation, predicted, observation.values)


def _recording(recording: Recording, sensors: Sequence[Sensor] | None) -> xr.Dataset:
    if recording.pressure is None or not recording.sampling_rate_hz:
        raise TypeError(f"{recording.label} holds spectra: observe it first")
    time = np.arange(recording.pressure.shape[1]) / recording.sampling_rate_hz
    attributes = {"label": recording.label, "state": recording.state}
    return _pressures(recording.pressure, time, sensors, attributes)


def _pressures(pressure, time_s, sensors: Sequence[Sensor] | None, attributes) -> xr.Dataset:
    """Pressures (S, N) over time."""
    coords = {"time": ("time", time_s, {"units": "s"})}
    if sensors is not None:
        coords |= _sensor_coords(sensors)
    data = {"pressure": (("sensor", "time"), pressure, PASCAL | {"long_name": "gauge pressure"})}
    return xr.Dataset(data, coords, attributes)


def _sensor_coords(sensors: Sequence[Sensor]) -> dict:
    position = [sensor.position for sensor in sensors]
    return {
        "sensor": ("sensor", [sensor.name for sensor in sensors]),
        "position": ("sensor", position, {"units": "m", "long_name": "from the pump outlet"}),
    }


def _parameters(twin: Twin) -> xr.Dataset:
    values = [float(p.value(u)) for p, u in zip(twin.parameters, twin.theta)]
    nominal = [float(p.nominal) for p in twin.parameters]
    return xr.Dataset(
        {"value": ("parameter", values), "data_sheet": ("parameter", nominal)},
        {
            "parameter": [p.name for p in twin.parameters],
            "unit": ("parameter", [p.unit for p in twin.parameters]),
        },
    )
