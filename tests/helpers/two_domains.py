"""A short line in both domains: method of characteristics and frequency domain side by side."""

import numpy as np

from rippletwin.case.model import FlowRipple, Fluid, Load, Rig, Segment, Sensor
from rippletwin.twin.propagation import propagate
from rippletwin.twin.twin import Twin

SPEED_HZ, PRESSURE, STEPS = 25.0, 9.5e6, 8192  # the default 12288 a revolution at 16.7 Hz
ORDERS = np.arange(1, 200)  # of the shaft, below 5 kHz
STRENGTH = 0.7  # of an effect's parameters, in standard deviations of their priors


def rig(load="orifice"):
    """A short oil line of two segments; with an open end one of air, where radiation counts."""
    oil = load != "open"
    line = (
        Segment(0.9, 0.02, 1020.0) if oil else Segment(0.41, 0.008, 343.0),
        Segment(0.637, 0.016, 1200.0) if oil else Segment(0.23, 0.009, 343.0),
    )
    sensors = (Sensor("p1", 0.12), Sensor("p2", line[0].length + 0.1))
    fluid = Fluid(870.0, 3.2e-5) if oil else Fluid(1.2, 1.5e-5, 1.4, 0.71)
    return Rig(fluid, {"pistons": 9}, line, sensors, Load(load))


def ripple(mean=1e-3):
    """Nine-piston ripple to 5 kHz, 6 % at the first harmonic and falling as 1/k."""
    angle = np.linspace(0.0, 360.0, 3072, endpoint=False)
    k = np.arange(1, 23)
    phase = np.random.default_rng(0).uniform(0, 2 * np.pi, len(k))
    wave = (0.06 / k) @ np.cos(9 * np.outer(k, np.deg2rad(angle)) + phase[:, None])
    return FlowRipple(angle, mean * (1.0 + wave), PRESSURE)


def corrected(*effects, load="orifice", strength=STRENGTH):
    """A twin at its data sheet with `effects` at `strength`."""
    twin = Twin(rig(load), effects=effects)
    count = len(Twin(rig(load)).parameters)
    return twin.with_(theta=np.where(np.arange(len(twin.parameters)) < count, 0.0, strength))


def both(twin, flow=None, healthy=None):
    """Harmonics (S, F) of the readings in time and in frequency."""
    gas = twin.rig.fluid.is_gas
    healthy = healthy or ripple(1e-5 if gas else 1e-3)
    flow = flow or healthy
    pressure = 1e5 if gas else PRESSURE
    moc = propagate(twin, flow.flow, healthy.flow, SPEED_HZ, pressure, steps=STEPS, tolerance=1e-4)
    assert moc.converged
    return moc.harmonics(ORDERS), twin.respond(flow, SPEED_HZ, pressure, ORDERS)


def misfit(a, b):
    return np.linalg.norm(a - b) / np.linalg.norm(b)
