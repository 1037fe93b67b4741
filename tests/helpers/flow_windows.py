"""Pressure windows of known flow ripples on the paper's line, for the tests of flow sensors."""

from __future__ import annotations

import numpy as np

from paper_rig import OIL, SEGMENTS, SENSORS
from rippletwin.harmonics import one_period, peak_amplitudes
from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine
from rippletwin.line.frequency_domain.pipe_immittance import series_impedance, shunt_admittance

SAMPLES, SPEED = 3072, 1000 / 60
TWO, THREE = SENSORS, (*SENSORS, 4.5)
RESISTANCE = 2 * 9.5e6 / 6.8e-4  # of the orifice, Pa s/m3


def line(positions=TWO, wave_speed_factor=1.0, resistance=RESISTANCE, own=0.0):
    """Factory (speed_hz, orders) -> the paper's line with a linear orifice and a source of
    capacitance `own`, m3/Pa."""

    def at(speed_hz, orders):
        s = 2j * np.pi * orders * speed_hz
        series = [
            series_impedance(
                s,
                density=OIL.density,
                viscosity=OIL.kinematic_viscosity,
                diameter=segment.diameter,
                friction="steady",
            )
            for segment in SEGMENTS
        ]
        shunt = [
            shunt_admittance(
                s,
                density=OIL.density,
                wave_speed=segment.wave_speed * wave_speed_factor,
                diameter=segment.diameter,
            )
            for segment in SEGMENTS
        ]
        return FrequencyDomainLine(
            s=s,
            lengths=np.array([segment.length for segment in SEGMENTS]),
            series=np.array(series),
            shunt=np.array(shunt),
            source_admittance=own * s,
            load=("impedance", np.full(len(s), resistance, complex)),
            sensor_positions=np.array(positions),
        )

    return at


def ripples(count, rng):
    """Smooth random flow ripples (count, M), m3/s: all shaft orders, falling with frequency."""
    orders = np.arange(1, SAMPLES // 2)
    size = 2e-5 / (1 + orders / 30)
    shape = (count, len(orders))
    harmonics = size * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape))
    return one_period(harmonics, SAMPLES, orders)


def record(network, flow, noise, rng, speed=SPEED):
    """Windows (n, S, M) that the sensors read for `flow` (n, M), with white noise of `noise` Pa."""
    orders = np.arange(1, SAMPLES // 2)
    response = network(speed, orders).readings()  # of unit flow
    windows = one_period(response * peak_amplitudes(flow)[:, None, orders], SAMPLES, orders)
    return windows + noise * rng.standard_normal(windows.shape)
