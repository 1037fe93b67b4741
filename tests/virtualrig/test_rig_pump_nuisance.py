"""Air, grooved ports and faults of the virtual rig's pump against scipy's implicit Runge-Kutta
method, which integrates the same laws written again in terms of pressure.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from virtualrig.faults import BlockedPort, CavitatingSuction, Leak, WornValvePlate
from virtualrig.pump import Pump, chamber_kinematics, compression, pump_tables, step_chambers

RHO, OUTLET, SPEED = 870.0, 9.5e6, 2 * np.pi * 1000 / 60
ATMOSPHERE = 1.01325e5
PUMP = Pump(pistons=3, dead_volume=4e-6, port_opening_deg=12.0, port_overlap_deg=10.0,
            groove_deg=4.0, groove_share=0.05, air=5e-3)  # fmt: skip
AREA = np.pi / 4 * PUMP.piston_diameter**2
RADIUS = PUMP.pitch_radius * np.tan(np.radians(PUMP.swash_angle_deg))
COEFFICIENT = PUMP.discharge_coefficient * np.sqrt(2 / RHO)
SHIFT = 2 * np.pi / 3 * np.arange(3)


def overlap_of_ports(x):
    """Two circles of one radius: the open lens when an edge has passed `x` of a diameter."""
    gap = 1 - np.clip(x, 0, 1)  # distance of the centres over two radii
    half = np.arccos(gap)
    return (2 * half - np.sin(2 * half)) / np.pi


def opening(angle):
    """Open share of the delivery port of PUMP."""
    angle = np.mod(angle, 2 * np.pi)
    shut = np.radians(PUMP.port_overlap_deg) / 2
    beyond = np.minimum(angle - shut, np.pi - shut - angle)
    groove = np.clip(1 + beyond / np.radians(PUMP.groove_deg), 0, 1) ** 2 * PUMP.groove_share
    return np.maximum(groove, overlap_of_ports(beyond / np.radians(PUMP.port_opening_deg)))


def root(drop):
    return drop / (drop**2 + 2e3**2) ** 0.25


def by_radau(times, slipper, gap, cross, cross_gap, worn, inlet, suction):
    """Chamber pressures (times, 3) and delivered flow (times,)."""

    def worn_area(phi):
        off = np.abs(np.mod(phi + np.pi / 2, np.pi) - np.pi / 2) / np.radians(15)
        return worn * np.clip(1 - off**2, 0, None)

    def ways(phi):
        delivery = PUMP.port_area * opening(phi) + worn_area(phi)
        return delivery, PUMP.port_area * opening(phi + np.pi) * inlet + worn_area(phi)

    def rate(time, p):
        phi = SPEED * time + SHIFT
        volume = PUMP.dead_volume + AREA * RADIUS * (1 + np.cos(phi))
        delivery, intake = ways(phi)
        gain = AREA * RADIUS * np.sin(phi) * SPEED - PUMP.case_leakage * p
        gain = gain - COEFFICIENT * delivery * root(p - OUTLET)
        gain = gain + COEFFICIENT * intake * root(suction - p)
        gain[0] -= COEFFICIENT * slipper * root(p[0]) + gap * p[0]
        across = COEFFICIENT * cross * root(p[0] - p[1]) + cross_gap * (p[0] - p[1])
        gain = gain + np.array([-across, across, 0.0])
        absolute = np.maximum(p + ATMOSPHERE, 2e3)
        softness = 1 / PUMP.bulk_modulus
        softness = softness + PUMP.air * (ATMOSPHERE / absolute) ** (1 / 1.2) / (1.2 * absolute)
        return gain / (volume * softness)

    solution = solve_ivp(rate, (0, times[-1]), np.full(3, OUTLET), "Radau", times,
                         rtol=1e-6, atol=1.0, max_step=2e-4)  # fmt: skip
    p = solution.y.T
    delivery = ways(SPEED * times[:, None] + SHIFT)[0]
    return p, (COEFFICIENT * delivery * root(p - OUTLET)).sum(axis=1)


def by_multistep(steps, turns, faults):
    """The same from `virtualrig.pump` at a constant outlet pressure, BDF4, last revolution."""
    chambers, ports = pump_tables(PUMP, RHO, faults)
    stations, matrix = np.zeros((3, 4)), np.zeros((4, 5))
    dt = 2 * np.pi / SPEED / steps
    past, x = [np.full(3, compression(OUTLET, ports)[0])] * 4, np.full(4, OUTLET)
    pressures, flows = [], []
    for step in range(1, steps * turns + 1):
        chamber_kinematics(SPEED * step * dt, SPEED, chambers, ports, stations)
        history = (4 * past[0] - 3 * past[1] + 4 / 3 * past[2] - past[3] / 4) / dt
        used = step_chambers(stations, history, 25 / 12 / dt, chambers, ports, 1e3,
                             1e3 * OUTLET, x, matrix)  # fmt: skip
        assert used <= 30
        past = [np.array([compression(p, ports)[0] for p in x[:3]]), *past[:3]]
        if step > steps * (turns - 1):
            pressures.append(x[:3].copy())
            flows.append((stations[:, 2] * root(x[:3] - OUTLET)).sum())
    return np.array(pressures), np.array(flows)


HOLE = 3e-7
LAMINAR = 0.4 * COEFFICIENT * HOLE / np.sqrt(OUTLET)  # 40 % of the orifice's flow at OUTLET
CASES = {
    "healthy": ((), {}),
    "leaks": (
        (
            Leak("slipper", HOLE, 0.4, OUTLET),
            Leak("cylinder", HOLE, 0.4, OUTLET),
            WornValvePlate(HOLE),
        ),
        {
            "slipper": 0.6 * HOLE,
            "gap": LAMINAR,
            "cross": 0.6 * HOLE,
            "cross_gap": LAMINAR,
            "worn": HOLE,
        },
    ),
    "a laminar leak alone": (
        (Leak("cylinder", HOLE, 1.0, OUTLET),),
        {"cross_gap": COEFFICIENT * HOLE / np.sqrt(OUTLET)},
    ),
    "blocked port": ((BlockedPort(0.1),), {"inlet": np.array([0.1, 1.0, 1.0])}),
    "cavitation": ((CavitatingSuction(-6e4),), {"suction": -6e4}),
}
"""What is wrong with the pump: for the rig, and for `by_radau`."""


@pytest.mark.parametrize("case", CASES)
def test_chambers_are_those_of_radau(case):
    """With air and grooves, healthy, with all leaks, and with each fault of the suction: the flow
    ripple to 0.5 %, the mean flow to 1e-4, chamber pressures to 1 %."""
    faults, arguments = CASES[case]
    sound = {"slipper": 0.0, "gap": 0.0, "cross": 0.0, "cross_gap": 0.0, "worn": 0.0,
             "inlet": 1.0, "suction": PUMP.suction_pressure}  # fmt: skip
    steps = 4608 * 4
    p, q = by_multistep(steps, 2, faults)
    times = 2 * np.pi / SPEED * (1 + np.arange(1, steps + 1) / steps)
    p_radau, q_radau = by_radau(times, **sound | arguments)
    assert (q - q_radau).std() < 5e-3 * q_radau.std()
    assert q.mean() == pytest.approx(q_radau.mean(), rel=1e-4)
    assert np.abs(p - p_radau).max() < 0.01 * OUTLET


def test_a_leak_passes_the_flow_of_its_orifice_at_the_reference_pressure():
    """Whatever its laminar share; at a quarter of the pressure a laminar leak passes a quarter, an
    orifice half."""
    for share in (0.0, 0.3, 1.0):
        sound, _ = pump_tables(PUMP, RHO)
        leaky, _ = pump_tables(PUMP, RHO, (Leak("slipper", HOLE, share, OUTLET, chamber=2),))
        hole, gap = (leaky - sound)[2, [5, 4]]
        assert (leaky - sound)[:2].any() == 0
        for part, expected in ((1.0, 1.0), (0.25, 0.5 * (1 - share) + 0.25 * share)):
            flow = hole * np.sqrt(part * OUTLET) + gap * part * OUTLET
            assert flow == pytest.approx(expected * COEFFICIENT * HOLE * np.sqrt(OUTLET), rel=1e-9)
