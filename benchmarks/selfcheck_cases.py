"""Random cases of explain_selfcheck.py, made with the twin's own equations."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rippletwin.case.model import FlowRipple, Fluid, Load, Rig, Segment, Sensor
from rippletwin.explanation.search.stepwise_search import applicable_candidates
from rippletwin.pump.outlets import ConstantPressure
from rippletwin.pump.simulation import simulate
from rippletwin.spectra.observation import Observation
from rippletwin.twin.effects.library import candidates
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.twin import Twin

REVOLUTIONS, SAMPLES = 160, 3072
EFFECT_COUNTS = {"none": 0, "single": 1, "pair": 2}


def draw_rig(rng) -> Rig:
    """A line of two to four segments, 4 to 10 m long, with two or three sensors."""
    count = rng.integers(2, 5)
    lengths = rng.dirichlet(np.full(count, 3.0)) * rng.uniform(4.0, 10.0)
    line = tuple(
        Segment(float(x), float(rng.uniform(0.012, 0.025)), float(rng.uniform(900, 1350)))
        for x in lengths
    )
    total = float(np.sum(lengths))
    places = np.sort(rng.uniform(0.03, 0.95, rng.integers(2, 4))) * total
    while np.min(np.diff(places)) < 0.3:
        places = np.sort(rng.uniform(0.03, 0.95, len(places))) * total
    sensors = tuple(Sensor(f"p{k + 1}", float(x)) for k, x in enumerate(places))
    return Rig(Fluid(870.0, 3.2e-5), {"pistons": 9}, line, sensors, Load("orifice"))


def kinematic_ripple(speed_hz, pressure, depth=0.5, width=0.04, timing=0.12) -> FlowRipple:
    """Kinematic ripple of nine pistons, with backflows at the openings proportional to pressure."""
    angle = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    flow = np.zeros_like(angle)
    for k in range(9):
        own = (angle + 2 * np.pi * k / 9) % (2 * np.pi)
        flow += np.where(own < np.pi, np.sin(own), 0.0)
        flow -= depth * np.exp(-0.5 * ((own - timing) / width) ** 2) * pressure / 1e7
    return FlowRipple(np.rad2deg(angle), flow / flow.mean() * 40e-6 * speed_hz, pressure)


def draw_pump(rng) -> tuple[dict, dict]:
    """The pump on the data sheet and the true one."""
    sheet = {
        "pistons": 9,
        "bulk_modulus": float(rng.uniform(1.2e9, 1.5e9)),
        "port_opening_deg": float(rng.uniform(12.0, 30.0)),
        "port_overlap_deg": float(rng.uniform(1.0, 5.0)),
        "dead_volume": float(rng.uniform(1.5e-6, 4e-6)),
    }
    true = {
        "bulk_modulus": sheet["bulk_modulus"] * float(np.exp(0.04 * rng.normal())),
        "port_timing_deg": 0.3 * float(rng.normal()),
        "dead_volume": sheet["dead_volume"] * float(np.exp(0.02 * rng.normal())),
    }
    return sheet, sheet | true


def pump_ripple(rig, pump: dict, speed_hz: float, pressure: float) -> FlowRipple:
    """Flow ripple of the lumped pump into a constant pressure."""
    simulated = simulate(pump, rig.fluid, 60 * speed_hz, ConstantPressure(pressure))
    return FlowRipple(simulated.angle_deg, simulated.flow, pressure)


def draw_case(rng, kind: str, geometry: bool = False, draw_unlisted=None, points: int = 1):
    """(rig, observations, twin with the true values) of a case; see explain_selfcheck.py.

    draw_unlisted(rng, rig) gives the effects in place of those of the library; `points` is the
    least number of operating points.
    """
    rig = draw_rig(rng)
    noise = rng.uniform(0.5e3, 4e3)
    speeds = rng.permutation([1000, 1200, 1500])[: rng.integers(points, 4)] / 60
    shape = {
        "depth": rng.uniform(0.3, 0.6),
        "width": rng.uniform(0.03, 0.06),
        "timing": rng.uniform(0.1, 0.16),
    }
    wrong = {
        "depth": shape["depth"] * (1 + 0.04 * rng.normal()),
        "width": shape["width"] * (1 + 0.02 * rng.normal()),
        "timing": shape["timing"] + 0.002 * rng.normal(),  # rad, a tenth of a degree
    }
    if geometry:
        # Random numbers of its own: line and effects are those of the case without geometry.
        sheet, pump = draw_pump(np.random.default_rng(rng.bit_generator.seed_seq.entropy))
        rig = replace(rig, pump=sheet)
    observations, true_ripples = [], []
    for k, speed in enumerate(speeds):
        pressure = float(rng.uniform(5e6, 16e6))
        orders = 9 * np.arange(1, int(4000 / (9 * speed)) + 1)
        count = len(rig.sensors)
        covariance = np.eye(count) * 4 * noise**2 / (SAMPLES * REVOLUTIONS)
        observations.append(
            Observation(
                "periodic",
                f"point {k + 1}",
                orders * speed,
                orders,
                np.ones((count, len(orders)), complex),
                np.tile(covariance.astype(complex), (len(orders), 1, 1)),
                np.full(count, pressure),
                speed,
                pressure,
                "nominal",
                pump_ripple(rig, sheet, speed, pressure)
                if geometry
                else kinematic_ripple(speed, pressure, **wrong),
                rig.sensors,
            )
        )
        true_ripples.append(
            pump_ripple(rig, pump, speed, pressure)
            if geometry
            else kinematic_ripple(speed, pressure, **shape)
        )
    if draw_unlisted is None:
        effects = draw_effects(rng, rig, observations, EFFECT_COUNTS[kind])
    else:
        effects = draw_unlisted(rng, rig)
    twin = Twin(rig, observations, effects=effects)
    theta = np.clip(rng.normal(size=len(twin.theta)), -2.5, 2.5)
    for k, p in enumerate(twin.parameters):
        if p.flat:
            theta[k] = rng.uniform(-np.pi / 9, np.pi / 9) / 0.01
    true = [replace(o, flow_ripple=r) for o, r in zip(observations, true_ripples)]
    recorded = []
    for o, h in zip(observations, ForwardModel(twin, true)(theta)):
        error = rng.normal(size=(*h.shape, 2)) @ np.array([1, 1j]) / np.sqrt(2)
        recorded.append(replace(o, values=h + error * np.sqrt(o.covariance[0, 0, 0].real)))
    return rig, recorded, twin.with_(theta=theta)


def draw_effects(rng, rig, observations, count: int) -> tuple:
    """`count` different effects at random places, every effect equally likely."""
    allowed = applicable_candidates(rig, observations)
    names = sorted({effect.name for effect, _ in allowed})
    chosen = rng.permutation(names)[:count]
    effects = []
    for name in chosen:
        places = [c for c in candidates(rig) if c[0].name == name]
        effects.append(places[rng.integers(len(places))])
    return tuple(effects)
