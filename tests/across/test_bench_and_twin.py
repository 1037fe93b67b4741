"""Every effect of the virtual rig against the same effect of the twin, at full ripple.

Nothing is fitted. The twin gets the true line, the true flow ripple and the effect's true values,
as a seal states them, and must predict the rig's sensor readings. The two share neither code nor
method: spectral elements in time, transfer matrices and harmonic balance in frequency.
"""

from functools import cache

import numpy as np
import pytest

from rippletwin.case.model import FlowRipple, Fluid, Load, Rig, Segment, Sensor
from rippletwin.spectra.observation import Observation
from rippletwin.twin.effects.library import candidates
from rippletwin.twin.twin import Twin
from virtualrig.draw_effects import LIBRARY
from virtualrig.draw_rig import HIGHEST_HZ
from virtualrig.drawn_effect import RigContext
from virtualrig.orbit import Bench
from virtualrig.recorder import Point, sensed_pressure
from virtualrig.resolution import BASE_NUMERICS, BASE_STEP_DIVISOR, true_flow
from virtualrig.rig import build

NO_VALUES = {"piston_spread", "speed_fluctuation"}  # parametrised differently by rig and twin
ALLOWED_MISFIT = 0.002  # the twin approximates the mean pressure along the line
QUICK = ("leak",)
SLOW = tuple(name for name in LIBRARY if name not in NO_VALUES and name not in QUICK)
LEVEL = 0.7  # of the strength, from invisible (0) to plain (1)
SPEED, PRESSURE = 1000.0, 6e6  # r/min, Pa
SEGMENTS = (  # thin pipe: the mean pressure falls by 1.5 % along the line
    {"length": 2.1, "diameter": 0.0125, "wave_speed": 1240.0},
    {"length": 1.3, "diameter": 0.0152, "wave_speed": 1110.0},
)
POSITIONS = (0.35, 1.7, 2.9)
FLUID = {"density": 865.0, "kinematic_viscosity": 6e-5}
PUMP = {
    "pistons": 9, "piston_diameter": 0.014, "pitch_radius": 0.030, "swash_angle_deg": 16.0,
    "dead_volume": 3e-6, "bulk_modulus": 1.3e9, "port_area": 8e-5, "port_opening_deg": 12.0,
    "port_overlap_deg": 2.0, "discharge_coefficient": 0.65, "case_leakage": 2e-13,
    "suction_pressure": 2e5,
}  # fmt: skip
SHEET = {
    "fluid": FLUID,
    "pump": PUMP,
    "line": {"segments": [dict(segment) for segment in SEGMENTS]},
    "sensors": [{"name": f"p{k}", "position": x} for k, x in enumerate(POSITIONS, 1)],
}


def readings(*names):
    """Harmonics (S, F) of a line with effects: readings of the rig, predictions of the twin."""
    point = Point("here", SPEED, PRESSURE, 0.0, "healthy")
    plain = true_flow(build(SHEET, {}), point)(SPEED)
    context = RigContext(
        np.random.default_rng(1),
        [dict(segment) for segment in SEGMENTS],
        len(POSITIONS),
        FLUID["density"],
        PUMP["bulk_modulus"],
        float(plain.mean()),
        PRESSURE,
    )
    effects = [LIBRARY[name](context, LEVEL) for name in names]
    seal = {"effects": [e.entry for e in effects], "numerics": BASE_NUMERICS, "noise": 1e3}
    rig = build(SHEET, seal)
    orbit = Bench(rig, flow=true_flow(rig, point), step_divisor=BASE_STEP_DIVISOR).settle(
        SPEED, PRESSURE, tolerance=5
    )
    orders = 9 * np.arange(1, int(HIGHEST_HZ * 60 / SPEED / 9) + 1)
    sensed = sensed_pressure(orbit, rig.sensing)
    read = 2 * np.fft.rfft(sensed, axis=1)[:, orders] / orbit.pressure.shape[1]

    angle = 360 * np.arange(len(plain)) / len(plain)
    true = Rig(
        Fluid(FLUID["density"], FLUID["kinematic_viscosity"]),
        {"pistons": 9},
        tuple(Segment(**segment) for segment in SEGMENTS),
        tuple(Sensor(s["name"], s["position"]) for s in SHEET["sensors"]),
        Load("orifice"),
    )
    observation = Observation(
        "periodic", "here", orders * SPEED / 60, orders, np.ones_like(read),
        np.tile(np.eye(len(read), dtype=complex), (len(orders), 1, 1)),
        sensed.mean(axis=1), SPEED / 60, PRESSURE, "nominal",
        FlowRipple(angle, plain), true.sensors,
    )  # fmt: skip
    placed = [
        next(
            (effect, place)
            for effect, place in candidates(true)
            if (effect.name, place.element) == (e.name, e.element)
            and {p.name for p in effect.parameters(true, place)} >= set(e.parameters)
        )
        for e in effects
    ]
    twin = Twin(true, friction="steady", effects=placed)
    values = {
        f"{e.name}@{place}.{name}": value
        for e, (_, place) in zip(effects, placed)
        for name, value in e.parameters.items()
    }
    for e, (_, place) in zip(effects, placed):
        if e.name == "leak":
            values[f"leak@{place}.pressure_exponent"] = 0.4999 if "orifice" in e.arguments else 1e-4
        if e.name == "source_impedance":
            values[f"source_impedance@{place}.conductance"] = 1e-18
    theta = np.zeros(len(twin.parameters))
    for k, p in enumerate(twin.parameters):
        if p.name in values:
            theta[k] = p.prior.coordinate(values.pop(p.name))
    assert not values
    return read, twin.predict([observation], theta)[0]


readings_of = cache(readings)


def misfit(read, predicted):
    """Relative misfit of the twin."""
    return np.linalg.norm(predicted - read) / np.linalg.norm(read)


@pytest.mark.parametrize("name", [*QUICK, *(pytest.param(n, marks=pytest.mark.long) for n in SLOW)])
def test_an_effect_of_the_rig_is_the_effect_of_the_twin(name):
    """It changes the ripple by more than three per cent, and the twin predicts it to 0.2 %."""
    read, predicted = readings(name)
    without = readings_of()[1]
    print(f"{name}: {misfit(read, predicted):.4f} of {misfit(read, without):.2f}")
    assert misfit(read, without) > 0.03
    assert misfit(read, predicted) < ALLOWED_MISFIT


def test_a_line_without_effects_is_the_same():
    """Rig and twin agree to 0.2 % on the line alone."""
    assert misfit(*readings_of()) < ALLOWED_MISFIT
