"""Observations of a leaking pump, coupled to its pipe step by step in time, with known truth.

The pump that makes them is not quite the data sheet's, and the line's state drifts from one
recording to the next; the twin of the data sheet works in the frequency domain.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np

from rippletwin.case.model import Fluid, Load, Rig, Segment, Sensor
from rippletwin.pump.outlets import Pipe
from rippletwin.pump.simulation import simulate
from rippletwin.spectra.observation import Observation

PISTONS, SPEED, LOAD = 9, 1000.0, 9.5e6
SHEET = {"pistons": PISTONS, "bulk_modulus": 1.3e9, "discharge_coefficient": 0.65}
TRUE = {**SHEET, "bulk_modulus": 1.26e9, "port_timing_deg": 0.2, "dead_volume": 3.6e-6}
OIL, LENGTH, DIAMETER, WAVE_SPEED = Fluid(870.0, 3.2e-5), 5.0, 0.02, 1200.0
SENSORS = (Sensor("p1", 0.5), Sensor("p2", 3.0))
ORDERS = np.arange(1, 181)
NOISE = 5.0  # Pa, standard deviation of a harmonic


def rig() -> Rig:
    """The data sheet's."""
    line = (Segment(LENGTH, DIAMETER, WAVE_SPEED),)
    return Rig(OIL, dict(SHEET), line, SENSORS, Load("orifice"))


def record(label, fault=None, turn=0.0, rng=None, wave_speed=WAVE_SPEED, diameter=DIAMETER):
    """An observation of the true pump with a fault, its shaft at `turn` (rad) past piston 0's outer
    dead centre at the first sample. The operator has set the load pressure anew."""
    rng = rng or np.random.default_rng(0)
    pressure = _pressure(tuple(fault) if isinstance(fault, list) else fault, wave_speed, diameter)
    values = 2.0 * np.fft.rfft(pressure)[:, ORDERS] / pressure.shape[1]
    noise = rng.normal(size=(2, *values.shape)) / np.sqrt(2.0)
    values = values * np.exp(1j * ORDERS * turn) + NOISE * (noise[0] + 1j * noise[1])
    return Observation(
        kind="periodic",
        label=label,
        frequency_hz=ORDERS * SPEED / 60.0,
        orders=ORDERS,
        values=values,
        covariance=np.tile(NOISE**2 * np.eye(len(SENSORS), dtype=complex), (len(ORDERS), 1, 1)),
        mean=pressure.mean(axis=1),
        speed_hz=SPEED / 60.0,
        load_pressure=LOAD,
        source="nominal",
        flow_ripple=None,
        sensors=SENSORS,
    )


@cache
def _pressure(fault, wave_speed, diameter):
    """Pressure (sensors, samples) at the sensors over a revolution, Pa."""
    pipe = Pipe(
        Segment(LENGTH, diameter, wave_speed),
        tuple(s.position for s in SENSORS),
        load_pressure=LOAD,
    )
    run = simulate(TRUE, OIL, SPEED, pipe, fault, samples_per_revolution=1536, min_steps=3072)
    return run.sensor_pressure


def first_sensor(observation: Observation) -> Observation:
    """The observation as a line with the first sensor alone gives it."""
    return replace(
        observation,
        values=observation.values[:1],
        covariance=observation.covariance[:, :1, :1],
        mean=observation.mean[:1],
        sensors=observation.sensors[:1],
    )
