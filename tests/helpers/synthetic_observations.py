"""Observations made with the twin's own forward model, for tests of explaining it."""

from dataclasses import replace

import numpy as np

from paper_rig import paper_rig
from rippletwin.case.model import FlowRipple
from rippletwin.harmonics import one_period, peak_amplitudes
from rippletwin.spectra.corrected_ripple import CorrectedRipple
from rippletwin.spectra.observation import Observation
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.twin import Twin

POINTS = ((1000, 9.5e6), (1200, 15e6), (1500, 5e6))  # r/min, Pa


def rig(sensors=3):
    """The paper's line with two or three sensors."""
    return paper_rig(sensors, third_sensor=6.5)


def ripple(speed_hz, pressure, depth=1.0):
    """Kinematic ripple of nine pistons with a backflow at the opening of each, 40 cc/rev, or
    `depth` of that ripple."""
    angle = 2 * np.pi * np.arange(3072) / 3072
    flow = np.zeros_like(angle)
    for k in range(9):
        own = (angle + 2 * np.pi * k / 9) % (2 * np.pi)
        flow += np.where(own < np.pi, np.sin(own), 0.0)
        flow -= 0.5 * np.exp(-0.5 * ((own - 0.12) / 0.04) ** 2) * pressure / 1e7
    flow = 1.0 + depth * (flow / flow.mean() - 1.0)
    return FlowRipple(np.rad2deg(angle), flow * 40e-6 * speed_hz, pressure)


def _with_error(flow_ripple, speed_hz, size, rng):
    """The ripple with a relative error of its harmonics that is smooth in frequency."""
    c = rng.normal(size=(4, 2)) @ np.array([1, 1j])
    flow = peak_amplitudes(flow_ripple.flow)
    frequency_hz = speed_hz * np.arange(len(flow))
    waves = np.cos(np.pi * np.outer(np.arange(4), frequency_hz) / 4000)
    flow[1:] *= 1 + 0.5 * size * (c @ waves)[1:]
    return replace(flow_ripple, flow=one_period(flow, len(flow_ripple.flow)))


def make(rng, effects=(), values=None, sensors=3, points=POINTS, source=0.03, noise=2e3, depth=1.0):
    """(rig, observations, true twin): nominal values off by their uncertainty, a smooth relative
    error `source` of the flow ripple, white sensor noise of `noise` Pa over 160 revolutions."""
    values, bench, observations = values or {}, rig(sensors), []
    for k, (speed, pressure) in enumerate(points):
        shaft = speed / 60
        orders = 9 * np.arange(1, int(4000 / (9 * shaft)) + 1)
        covariance = np.tile(np.eye(sensors) * 4 * noise**2 / (3072 * 160), (len(orders), 1, 1))
        observations.append(
            Observation(
                "periodic",
                f"point {k + 1}",
                orders * shaft,
                orders,
                np.ones((sensors, len(orders)), complex),
                covariance.astype(complex),
                np.zeros(sensors),
                shaft,
                pressure,
                "nominal",
                ripple(shaft, pressure, depth),
                bench.sensors,
            )
        )
    twin = Twin(bench, observations, effects=effects)
    theta = rng.normal(size=len(twin.theta))
    for k, p in enumerate(twin.parameters):
        if p.flat:
            theta[k] = rng.uniform(-np.pi / 9, np.pi / 9) / 0.01
        if p.name in values:
            theta[k] = p.prior.coordinate(values[p.name])
    true = [
        replace(o, flow_ripple=_with_error(o.flow_ripple, o.speed_hz, source, rng))
        for o in observations
    ]
    forward = ForwardModel(twin, true)
    recorded = []
    for o, h in zip(observations, forward(theta)):
        error = rng.normal(size=(*h.shape, 2)) @ np.array([1, 1j]) / np.sqrt(2)
        recorded.append(replace(o, values=h + error * np.sqrt(o.covariance[0, 0, 0].real)))
    return bench, recorded, twin.with_(theta=theta)


def with_known_ripple(observations, ratio):
    """The observations with a corrected ripple of `ratio` times the nominal one at every order."""
    known = CorrectedRipple(
        {o.label: np.asarray(o.orders) for o in observations},
        {o.label: np.full(len(o.orders), ratio + 0j) for o in observations},
        {o.label: 0.0 for o in observations},
    )
    return [replace(o, corrected_ripple=known) for o in observations]
