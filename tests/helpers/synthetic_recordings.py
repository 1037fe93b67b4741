"""Recordings made by the twin itself, with known truth and noise, for the tests of its fits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from paper_rig import PISTONS
from rippletwin.case.model import FlowRipple
from rippletwin.spectra.observation import Observation
from rippletwin.twin.twin import Twin


def flow_ripple(mean=6.7e-4, seed=0) -> FlowRipple:
    """Piston harmonics falling as 1/k, 8 % at the first, of random phase."""
    angle = np.linspace(0.0, 360.0, 3072, endpoint=False)
    k = np.arange(1, 60)
    phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(k))
    ripple = (0.08 / k) @ np.cos(PISTONS * np.outer(k, np.deg2rad(angle)) + phase[:, None])
    return FlowRipple(angle, mean * (1.0 + ripple), 9.5e6)


def point(rig, label="a", speed_rpm=1000.0, load_pressure=9.5e6, seed=0, highest_hz=4000.0):
    """An operating point: an observation whose values are still missing."""
    speed = speed_rpm / 60.0
    orders = PISTONS * np.arange(1, int(highest_hz / (PISTONS * speed)) + 1)
    return Observation(
        kind="periodic",
        label=label,
        frequency_hz=orders * speed,
        orders=orders,
        values=np.zeros((len(rig.sensors), len(orders)), complex),
        covariance=np.tile(np.eye(len(rig.sensors), dtype=complex), (len(orders), 1, 1)),
        mean=np.zeros(len(rig.sensors)),
        speed_hz=speed,
        load_pressure=load_pressure,
        source="nominal",
        flow_ripple=flow_ripple(6.7e-4 * speed_rpm / 1000.0, seed),
        sensors=rig.sensors,
    )


def three_points(rig, highest_hz=4000.0) -> list[Observation]:
    """Two speeds and two loads."""
    return [
        point(rig, "a", 1000.0, 9.5e6, 0, highest_hz),
        point(rig, "b", 1200.0, 9.5e6, 0, highest_hz),
        point(rig, "c", 1000.0, 5.0e6, 0, highest_hz),
    ]


def noisy(observation, values, sd, rng) -> Observation:
    """The observation of `values` with circular noise of standard deviation `sd` (Pa)."""
    parts = rng.standard_normal((2, *values.shape))
    return replace(
        observation,
        values=values + sd * (parts[0] + 1j * parts[1]) / np.sqrt(2.0),
        covariance=sd**2 * observation.covariance,
    )


def recordings(rig, points, seed, distance=None, sd=8.0, friction="steady"):
    """(true theta, observations): the truth lies `distance` prior standard deviations from the
    data sheet in every parameter, either way; drawn from the prior where None.

    8 Pa in a harmonic is what 4 kPa of white noise leaves after 160 revolutions of 3072 samples.
    """
    rng = np.random.default_rng(seed)
    twin = Twin(rig, points, friction=friction)
    count = len(twin.parameters)
    truth = (
        rng.standard_normal(count) if distance is None else distance * rng.choice([-1, 1], count)
    )
    truth = truth.astype(float)
    for label in twin.labels:
        truth[twin.index[f"angle[{label}]"]] = rng.uniform(0.0, 69.0)
    predicted = twin.predict(points, truth)
    return truth, [noisy(o, p, sd, rng) for o, p in zip(points, predicted)]


def line_errors(twin, truth, theta) -> np.ndarray:
    """Relative errors (2, n) of the segments' delays and impedances."""
    a, b = twin.arrays(truth), twin.arrays(theta)
    delay = (b.lengths / b.wave_speeds) / (a.lengths / a.wave_speeds) - 1.0
    impedance = (b.wave_speeds / b.diameters**2) / (a.wave_speeds / a.diameters**2) - 1.0
    return np.array([delay, impedance])
