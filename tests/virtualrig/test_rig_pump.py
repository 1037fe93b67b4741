"""The virtual rig's pump against scipy's implicit Runge-Kutta method and against conservation
laws.
"""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from virtualrig.faults import Leak
from virtualrig.orbit import Bench
from virtualrig.pump import (
    Pump,
    chamber_kinematics,
    port_opening,
    pump_tables,
    step_chambers,
)
from virtualrig.rig import build, read_yaml

RHO, OUTLET, SPEED = 870.0, 9.5e6, 2 * np.pi * 1000 / 60
PUMP = Pump(pistons=3, dead_volume=4e-6, port_opening_deg=12.0)


def chambers_by_multistep(steps, turns, faults=()):
    """Chamber pressures and delivered flow at a constant outlet pressure, BDF4, last revolution."""
    chambers, ports = pump_tables(PUMP, RHO, faults)
    stations, matrix = np.zeros((3, 4)), np.zeros((4, 5))
    dt = 2 * np.pi / SPEED / steps
    past = [np.full(3, OUTLET)] * 4
    x = np.full(4, OUTLET)
    pressures, flows = [], []
    stiff_outlet = 1e3  # m3/s/Pa: holds the outlet at its pressure to within 1e-7 Pa
    for step in range(1, steps * turns + 1):
        chamber_kinematics(SPEED * step * dt, SPEED, chambers, ports, stations)
        history = (4 * past[0] - 3 * past[1] + 4 / 3 * past[2] - past[3] / 4) / dt
        lead = 25 / 12 / dt
        step_chambers(
            stations, history, lead, chambers, ports, stiff_outlet, stiff_outlet * OUTLET, x, matrix
        )
        past = [x[:3].copy(), *past[:3]]
        if step > steps * (turns - 1):
            drop = x[:3] - OUTLET
            through = stations[:, 2] * drop / (drop**2 + ports[7] ** 2) ** 0.25
            pressures.append(past[0])
            flows.append(through.sum())
    return np.array(pressures), np.array(flows)


def chambers_by_radau(times, fault_area=0.0):
    """The same equations, written again, integrated by scipy's Radau from the same start."""
    area = np.pi / 4 * PUMP.piston_diameter**2
    radius = PUMP.pitch_radius * np.tan(np.radians(PUMP.swash_angle_deg))
    half_overlap, ramp = np.radians(PUMP.port_overlap_deg) / 2, np.radians(PUMP.port_opening_deg)
    coefficient = PUMP.discharge_coefficient * np.sqrt(2 / RHO)
    shift = 2 * np.pi / 3 * np.arange(3)

    def root(drop):
        return drop / (drop**2 + 2e3**2) ** 0.25

    def opening(angle):
        angle = angle % (2 * np.pi)
        share = np.minimum(angle - half_overlap, np.pi - half_overlap - angle) / ramp
        share = np.clip(share, 0, 1)
        return coefficient * PUMP.port_area * share**2 * (3 - 2 * share)

    def rate(time, p):
        phi = SPEED * time + shift
        volume = PUMP.dead_volume + area * radius * (1 + np.cos(phi))
        gain = area * radius * np.sin(phi) * SPEED - PUMP.case_leakage * p
        gain = gain - opening(phi) * root(p - OUTLET)
        gain = gain + opening(phi + np.pi) * root(PUMP.suction_pressure - p)
        across = coefficient * fault_area * root(p[0] - p[1])
        gain = gain + np.array([-across, across, 0.0])
        return PUMP.bulk_modulus / volume * gain

    solution = solve_ivp(
        rate,
        (0, times[-1]),
        np.full(3, OUTLET),
        "Radau",
        times,
        rtol=1e-7,
        atol=10.0,
        max_step=1e-4,
    )
    p = solution.y.T
    delivered = opening(SPEED * times[:, None] + shift) * root(p - OUTLET)
    return p, delivered.sum(axis=1)


@pytest.mark.parametrize("leak_area", [0.0, 9e-7])
def test_chambers_are_those_of_radau(leak_area):
    """Healthy and with a leak between neighbours: flow ripple to 0.5 %, and halving the
    step moves it by less than 0.5 %."""
    faults = (Leak("cylinder", leak_area),) if leak_area else ()
    steps = 4608 * 4
    p, q = chambers_by_multistep(steps, 2, faults)
    times = 2 * np.pi / SPEED * (1 + np.arange(1, steps + 1) / steps)
    p_radau, q_radau = chambers_by_radau(times, leak_area)
    ripple = q_radau.std()
    assert (q - q_radau).std() < 5e-3 * ripple
    assert q.mean() == pytest.approx(q_radau.mean(), rel=1e-4)
    assert np.abs(p - p_radau).max() < 0.01 * OUTLET
    _, q_half = chambers_by_multistep(2 * steps, 2, faults)
    assert (q - q_half[1::2]).std() < 5e-3 * ripple


def test_ports_open_one_at_a_time():
    """Both ports are shut about the dead centres, and never open to a chamber together."""
    _, ports = pump_tables(Pump(port_overlap_deg=4.0), RHO)
    angle = np.radians(np.arange(0, 360, 0.25))
    delivery = np.array([port_opening(a, ports) for a in angle])
    suction = np.array([port_opening(a + np.pi, ports) for a in angle])
    assert not np.any((delivery > 0) & (suction > 0))
    shut = np.abs((np.degrees(angle) + 90) % 180 - 90) <= 2
    assert not delivery[shut].any() and not suction[shut].any()
    assert delivery.max() == suction.max() == 1


@pytest.mark.parametrize("overlap", [-8.0, 0.0, 4.0])
def test_a_port_opens_as_it_closes(overlap):
    """A smooth step from half the overlap behind the dead centre on, or before it where the overlap
    is negative: by this test's own formula, without a jump where a turn ends."""
    _, ports = pump_tables(Pump(port_overlap_deg=overlap), RHO)
    angle = np.arange(-90, 270, 0.25)
    found = np.array([port_opening(a, ports) for a in np.radians(angle)])
    x = np.clip((90 - overlap / 2 - np.abs(angle - 90)) / 30, 0, 1)
    np.testing.assert_allclose(found, 3 * x**2 - 2 * x**3, atol=1e-12)
    assert np.count_nonzero(found[angle < 0]) == max(-overlap / 2 * 4 - 1, 0)


def rig(**effects):
    """A small rig: the built-in pump on one short pipe."""
    known = {
        "fluid": {"density": RHO, "kinematic_viscosity": 3.2e-5},
        "pump": read_yaml("src/virtualrig/sheet.yaml")["pump"],
        "line": {"segments": [{"length": 1.5, "diameter": 0.0197, "wave_speed": 1023.0}]},
        "sensors": [{"name": "p1", "position": 0.4}],
    }
    return build(known, {"faults": FAULTS, "numerics": {"frequency": 3000.0}, **effects})


FAULTS = {"slipper": {"leak_area": 6e-7}, "cylinder": {"leak_area": 9e-7}}


@pytest.fixture(scope="module")
def healthy():
    return Bench(rig()).settle(3000.0, OUTLET)


def test_coupled_pump_loses_no_flow(healthy):
    """Delivered flow is displacement less case leakage, and less what compression takes, to 0.2 %.

    A chamber is full at suction pressure when its delivery begins, and has to be brought to the
    outlet's first, which takes (p_out - p_in)/B of its greatest volume; case leakage acts over the
    half of the turn that is spent at high pressure.
    """
    pump = rig().pump
    ideal = pump.displacement * 3000 / 60
    pressure = healthy.outlet_pressure.mean()
    fullest = pump.pistons * pump.dead_volume + pump.displacement
    compression = fullest * 3000 / 60 * (pressure - pump.suction_pressure) / pump.bulk_modulus
    leakage = pump.pistons / 2 * pump.case_leakage * pressure
    assert healthy.outlet_flow.mean() == pytest.approx(ideal - compression - leakage, rel=2e-3)


def test_healthy_ripple_repeats_with_every_piston_and_faults_once_a_turn(healthy):
    """Equal pistons leave no shaft orders below the ninth; a slipper fault takes flow once a
    turn and a cylinder fault twice."""
    orders = np.abs(np.fft.rfft(healthy.outlet_flow))[1:60]
    piston = orders[8::9].max()
    assert np.delete(orders, np.arange(8, 59, 9)).max() < 2e-3 * piston
    for state, drops in (("slipper", 1), ("cylinder", 2)):
        faulty = Bench(rig(), (state,)).settle(3000.0, OUTLET, healthy.valve)
        lost = healthy.outlet_flow - faulty.outlet_flow
        slow = np.fft.rfft(lost)
        slow[8:] = 0
        slow = np.fft.irfft(slow, len(lost))
        above = slow > 0.5 * slow.max()
        assert lost.mean() > 0.005 * healthy.outlet_flow.mean()
        assert np.count_nonzero(np.diff(above.astype(int), append=above[:1]) == 1) == drops


def test_crank_speed_ripple_sweeps_the_same_volume(healthy):
    """A crank that speeds up and slows down twice a turn delivers the same mean flow, but ripples
    with the speed by about its amplitude."""
    effect = [{"name": "speed_fluctuation", "order": 2, "amplitude": 0.02}]
    swung = Bench(rig(effects=effect)).settle(3000.0, OUTLET, healthy.valve)
    assert swung.outlet_flow.mean() == pytest.approx(healthy.outlet_flow.mean(), rel=1e-3)
    second = 2 * np.abs(np.fft.rfft(swung.outlet_flow)[2]) / len(swung.outlet_flow)
    assert second == pytest.approx(0.02 * healthy.outlet_flow.mean(), rel=0.4)


def test_a_second_spread_comes_on_top_of_the_first():
    """Deviations of two spreads add, piston by piston."""
    one, two = np.full((3, 3), 0.01), np.array([[0.02, 0.0, 0.1]] * 3)
    pump = PUMP.with_spread(one).with_spread(two)
    np.testing.assert_array_equal(pump.spread, one + two)
