"""The lumped chamber pump against conservation laws, symmetry and the frequency domain."""

import numpy as np
import pytest

from rippletwin.case.model import Fluid, Segment
from rippletwin.harmonics import peak_amplitudes
from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine
from rippletwin.line.frequency_domain.pipe_immittance import series_impedance, shunt_admittance
from rippletwin.pump.faults import Cylinder, Slipper
from rippletwin.pump.geometry import Geometry, kinematic_flow
from rippletwin.pump.outlets import ConstantPressure, Pipe, PressureWave
from rippletwin.pump.simulation import simulate

OIL = Fluid(density=870.0, kinematic_viscosity=3.2e-5)
SPEED = 1000.0
LOAD = 9.5e6
PIPE = Segment(length=5.0, diameter=0.02, wave_speed=1200.0)
POSITIONS = (0.5, 3.0)


@pytest.fixture(scope="module")
def constant():
    return simulate({}, OIL, SPEED, ConstantPressure(LOAD))


@pytest.fixture(scope="module")
def piped():
    return simulate({}, OIL, SPEED, Pipe(PIPE, POSITIONS, load_pressure=LOAD))


def harmonics(ripple, orders):
    """Peak complex amplitudes (..., F) of one revolution (..., M)."""
    return peak_amplitudes(ripple)[..., orders]


def relative_rms(a, b):
    """rms of the difference of the ripples over the rms of b's."""
    a, b = a - a.mean(), b - b.mean()
    return np.sqrt(np.mean((a - b) ** 2) / np.mean(b**2))


def expected_mean_flow(geometry, outlet_pressure, case_pressure_excess):
    """Displacement less compression and case leakage, m3/s: each chamber's volume, not its flows.

    Between the closing of suction and of delivery a chamber displaces its stroke, of which it
    needs V (C(p_delivery) - C(p_suction)) to compress what it holds, with V near the outer dead
    centre's; `case_pressure_excess` is the chambers' mean pressure over the case's.
    """
    air = geometry.air_fraction * 101325.0
    squeezed = (outlet_pressure - geometry.suction_pressure) / geometry.bulk_modulus
    squeezed += air / geometry.suction_pressure - air / outlet_pressure
    full = geometry.dead_volume + geometry.stroke_volume
    delivered = geometry.pistons * (geometry.stroke_volume - full * squeezed) * SPEED / 60
    return delivered - geometry.pistons * geometry.case_leakage * case_pressure_excess / 2


@pytest.mark.parametrize("outlet", ["constant", "piped"])
def test_mean_flow_is_displacement_less_losses(outlet, request):
    """Mass conservation over a cycle, from volumes and pressures alone, to 0.5 %.

    Half of the chamber time is at delivery pressure, so the leakage uses that, not the solution.
    """
    ripple = request.getfixturevalue(outlet)
    geometry = Geometry()
    pressure = ripple.pressure_mean
    expected = expected_mean_flow(geometry, pressure, pressure - geometry.suction_pressure)
    assert ripple.flow.mean() == pytest.approx(expected, rel=5e-3)
    assert expected > 0.95 * geometry.displacement * SPEED / 60  # losses are losses, not the flow


@pytest.mark.parametrize("speed,load", [(500.0, 4e6), (1500.0, 20e6)])
def test_incompressible_leak_free_mean_flow_is_displacement(speed, load):
    """With a fluid a thousand times stiffer and no leak the mean is displacement x speed.

    Less what the pistons move while the ports are shut, half the overlap before and after each
    dead centre, which no outlet sees: a share 1 - cos(overlap/2).
    """
    stiff = {"bulk_modulus": 1.4e12, "air_fraction": 0.0, "case_leakage": 0.0}
    ripple = simulate(stiff, OIL, speed, ConstantPressure(load))
    open_share = np.cos(np.radians(Geometry().port_overlap_deg / 2))
    expected = Geometry().displacement * speed / 60 * open_share
    assert ripple.flow.mean() == pytest.approx(expected, rel=5e-4)


def test_stiff_fluid_and_ideal_ports_give_the_kinematic_flow():
    """The limit of a stiff fluid: the sum of the pistons' speeds (closed form).

    Ports open fast and without overlap, at a low pressure so that the orifices' crossing at the
    dead centres, which the closed form lacks, stays small.
    """
    ideal = {
        "bulk_modulus": 1.4e13, "air_fraction": 0.0, "case_leakage": 0.0,
        "port_overlap_deg": 0.0, "port_opening_deg": 0.5, "port_area": 4e-4,
    }  # fmt: skip
    ripple = simulate(ideal, OIL, SPEED, ConstantPressure(1.5e5), min_steps=24576)
    kinematic = kinematic_flow(ideal, SPEED, ripple.angle_deg)
    assert relative_rms(ripple.flow, kinematic) < 0.01
    assert ripple.flow.mean() == pytest.approx(kinematic.mean(), rel=1e-4)


@pytest.mark.parametrize("outlet", [ConstantPressure(LOAD), Pipe(PIPE, (), load_pressure=LOAD)])
def test_halving_the_step_leaves_the_ripple(outlet):
    """Self-convergence: the default step is fine enough (under 1 %, and shrinking)."""
    coarse, default, fine = (
        simulate({}, OIL, SPEED, outlet, min_steps=steps) for steps in (6144, 12288, 24576)
    )
    moved = relative_rms(default.flow, fine.flow)
    assert moved < 0.01
    assert relative_rms(coarse.flow, fine.flow) > 2 * moved
    assert default.flow.mean() == pytest.approx(fine.flow.mean(), rel=1e-4)


def test_result_is_periodic(piped):
    """It says so, and one more run started from its own orifice coefficient says the same."""
    assert piped.converged and piped.change < 1e-6
    again = simulate({}, OIL, SPEED, Pipe(PIPE, POSITIONS, orifice=piped.orifice))
    np.testing.assert_allclose(again.flow, piped.flow, atol=1e-5 * np.std(piped.flow))


def test_unfinished_run_says_so(monkeypatch):
    """A run cut off in its transient does not claim to be periodic."""
    monkeypatch.setattr("rippletwin.pump.simulation.MAX_REVOLUTIONS", 3)
    ripple = simulate({}, OIL, SPEED, Pipe(PIPE, (), load_pressure=LOAD), min_steps=3072)
    assert not ripple.converged and ripple.revolutions == 3 and ripple.change > 1e-6


@pytest.mark.parametrize("pistons", [7, 9])
def test_healthy_pump_has_only_piston_orders(pistons):
    """Equal pistons: a symmetry of the equations, so other orders vanish to rounding."""
    ripple = simulate({"pistons": pistons}, OIL, SPEED, ConstantPressure(LOAD), min_steps=6144)
    amplitude = np.abs(np.fft.rfft(ripple.flow))
    orders = np.arange(len(amplitude))
    assert amplitude[orders % pistons != 0].max() < 1e-6 * amplitude[pistons]


def test_realistic_size(piped):
    """Ripple of several per cent of the mean and tenths of MPa in the pipe, as pumps have."""
    assert 0.02 < piped.flow.std() / piped.flow.mean() < 0.08
    assert (np.ptp(piped.sensor_pressure, axis=1) > 1e5).all()
    assert (np.ptp(piped.sensor_pressure, axis=1) < 1e6).all()
    assert piped.chamber_pressure.min() > 0.0


def intervals_below(signal, level):
    """How many separate runs of a cyclic signal lie below `level`."""
    below = signal < level
    return int(np.sum(below & ~np.roll(below, 1)))


def test_slipper_drops_the_flow_once_a_revolution(constant):
    """Against the orifice law: a leak of Cd A sqrt(2 dp/rho) while the chamber is at pressure."""
    area = 4e-7
    faulty = simulate({}, OIL, SPEED, ConstantPressure(LOAD), Slipper(area))
    deficit = constant.flow - faulty.flow
    leak = 0.65 * area * np.sqrt(2 * (LOAD - 1e5) / OIL.density)
    plateau = deficit[(constant.angle_deg > 40) & (constant.angle_deg < 140)]
    np.testing.assert_allclose(plateau, leak, rtol=0.01)
    assert intervals_below(faulty.flow - constant.flow, -0.5 * leak) == 1
    assert (
        np.abs(deficit[(constant.angle_deg > 240) & (constant.angle_deg < 355)]).max() < 1e-3 * leak
    )
    spectrum = np.abs(np.fft.rfft(faulty.flow))
    assert spectrum[1] > 0.1 * spectrum[9]


def test_slipper_leak_integral_is_the_flow_deficit(constant):
    """Conservation over the revolution: what the leak takes is what the outlet lacks.

    The leak is integrated from the solved chamber pressure by the orifice law. Over the stroke the
    chamber's other losses change a little, and as the port closes the leak drains the chamber
    rather than the outlet, hence 2 %.
    """
    area = 4e-7
    faulty = simulate({}, OIL, SPEED, ConstantPressure(LOAD), Slipper(area))
    drop = np.maximum(faulty.chamber_pressure[0] - 1e5, 0.0)
    leak = 0.65 * area * np.sqrt(2 * drop / OIL.density)
    # once the delivery port is shut the leak comes from no delivery
    facing = faulty.angle_deg < 180.0 - Geometry().port_overlap_deg / 2
    assert (leak * facing).mean() == pytest.approx(
        constant.flow.mean() - faulty.flow.mean(), rel=0.02
    )


def test_cylinder_drops_the_flow_twice_a_revolution(constant):
    """Two drops: one chamber at pressure and the other not, at either dead centre, 180 deg apart.

    Each drop's plateau follows the orifice law between delivery and suction pressure.
    """
    area = 8e-7
    faulty = simulate({}, OIL, SPEED, ConstantPressure(LOAD), Cylinder(area))
    deficit = constant.flow - faulty.flow
    leak = 0.65 * area * np.sqrt(2 * (LOAD - 1e5) / OIL.density)
    # with the compression ripple of the pump averaged out over a piston's spacing
    width = len(deficit) // 9
    smooth = np.real(np.fft.ifft(np.fft.fft(deficit) * np.fft.fft(np.ones(width) / width, 3072)))
    assert intervals_below(-smooth, -0.5 * leak) == 2
    for first, last in ((17, 33), (196, 208)):
        inside = (constant.angle_deg > first) & (constant.angle_deg < last)
        np.testing.assert_allclose(deficit[inside], leak, rtol=0.05)
    elsewhere = (constant.angle_deg > 70) & (constant.angle_deg < 170)
    assert np.abs(deficit[elsewhere]).max() < 0.02 * leak


def test_severe_cylinder_loses_more_than_slight():
    """C1 and C2 differ by the size of the path: the deficit grows with its area."""
    healthy, slight, severe = (
        simulate({}, OIL, SPEED, ConstantPressure(LOAD), fault, min_steps=6144).flow.mean()
        for fault in (None, Cylinder(2e-7), Cylinder(8e-7))
    )
    assert (healthy - severe) == pytest.approx(4 * (healthy - slight), rel=0.15)


def test_compound_fault_is_the_sum_of_far_apart_faults(constant):
    """Faults of chambers that do not meet add up when the outlet pressure is held."""
    outlet = ConstantPressure(LOAD)
    slipper, cylinder = Slipper(4e-7), Cylinder(5e-7, piston=4)
    both = simulate({}, OIL, SPEED, outlet, [slipper, cylinder]).flow
    single = [simulate({}, OIL, SPEED, outlet, fault).flow for fault in (slipper, cylinder)]
    np.testing.assert_allclose(both, sum(single) - constant.flow, atol=1e-4 * both.mean())


def pipe_response(piped, position, harmonics):
    """Pressure and flow at `position` from those at the pump, by the pipe's exact solution.

    p(x) = cosh(g x) p0 - Zc sinh(g x) q0 with g, Zc of steady laminar friction; no load needed.
    """
    p0 = np.fft.rfft(piped.outlet_pressure)[:harmonics]
    q0 = np.fft.rfft(piped.flow)[:harmonics]
    s = 2j * np.pi * np.arange(harmonics) * SPEED / 60
    s[0] = 1e-9j  # mean flow: the limit of s -> 0
    area = PIPE.area
    series = OIL.density / area * (s + 32 * OIL.kinematic_viscosity / PIPE.diameter**2)
    shunt = area * s / (OIL.density * PIPE.wave_speed**2)
    g, zc = np.sqrt(series * shunt), np.sqrt(series / shunt)
    p = np.cosh(g * position) * p0 - zc * np.sinh(g * position) * q0
    q = np.cosh(g * position) * q0 - np.sinh(g * position) / zc * p0
    return p, q


@pytest.mark.parametrize("sensor", [0, 1])
def test_sensor_pressure_agrees_with_the_frequency_domain(piped, sensor):
    """The pipe's exact solution driven by the computed outlet state, to 5 kHz (300 orders)."""
    expected, _ = pipe_response(piped, POSITIONS[sensor], 300)
    computed = np.fft.rfft(piped.sensor_pressure[sensor])[:300]
    assert np.linalg.norm((computed - expected)[1:]) < 1e-5 * np.linalg.norm(expected[1:])
    assert computed[0].real == pytest.approx(expected[0].real, rel=1e-6)


def test_flow_and_pressure_at_the_load_obey_the_orifice(piped):
    """Frequency-domain state at the pipe's end, in time: q = K_v sqrt(p) at every instant.

    Checked to 5 kHz, against the orifice's flow limited to the same band.
    """
    p, q = pipe_response(piped, PIPE.length, 300)
    samples = len(piped.flow)
    pressure, flow = (np.fft.irfft(np.pad(x, (0, samples // 2 + 1 - 300))) for x in (p, q))
    assert relative_rms(flow, piped.orifice * np.sqrt(pressure)) < 0.02
    assert flow.mean() == pytest.approx(piped.orifice * np.sqrt(pressure).mean(), rel=1e-4)
    assert pressure.mean() == pytest.approx(LOAD, rel=1e-3)


def test_coupled_mean_flow_equals_uncoupled(constant, piped):
    """Coupling loses no flow: a few kPa of pressure apart, the means agree to a few 1e-4."""
    assert piped.flow.mean() == pytest.approx(constant.flow.mean(), rel=5e-4)


@pytest.mark.parametrize(
    "pump,outlet",
    [
        ({"piston": 9}, ConstantPressure(LOAD)),
        ({"port_area": -1e-4}, ConstantPressure(LOAD)),
        ({"port_opening_deg": 100}, ConstantPressure(LOAD)),
    ],
)
def test_impossible_geometry_is_named(pump, outlet):
    """The error names the key."""
    with pytest.raises(ValueError, match=next(iter(pump))):
        simulate(pump, OIL, SPEED, outlet)


def test_sensor_outside_the_pipe_is_refused():
    with pytest.raises(ValueError, match="outside"):
        Pipe(PIPE, (5.5,), load_pressure=LOAD)


def test_norton_source_answers_a_line_as_the_coupled_pump_does(piped):
    """Flow into a constant pressure and mean chamber compliance stand in for the coupled pump.

    Independent truth: the pump coupled to the pipe step by step in time. The source drives the
    same pipe in the frequency domain; without its admittance the pressure would be off by a
    quarter at the lowest harmonics and by more than itself overall.
    """
    free = simulate({}, OIL, SPEED, ConstantPressure(piped.outlet_pressure.mean()))
    orders = 9 * np.arange(1, 28)
    s = 2j * np.pi * orders * SPEED / 60
    truth = harmonics(piped.sensor_pressure, orders)

    def error(admittance, count):
        network = FrequencyDomainLine(
            s=s,
            lengths=np.array([PIPE.length]),
            series=series_impedance(
                s, density=OIL.density, viscosity=OIL.kinematic_viscosity,
                diameter=PIPE.diameter, friction="steady",
            )[None],
            shunt=shunt_admittance(
                s, density=OIL.density, wave_speed=PIPE.wave_speed, diameter=PIPE.diameter
            )[None],
            source_flow=harmonics(free.flow, orders),
            source_admittance=admittance,
            load=("admittance", piped.flow.mean() / (2 * LOAD)),
            sensor_positions=np.array(POSITIONS),
        )  # fmt: skip
        difference = (network.readings() - truth)[:, :count]
        return np.linalg.norm(difference) / np.linalg.norm(truth[:, :count])

    assert error(free.source_admittance(s), 5) < 0.05
    assert error(free.source_admittance(s), 27) < 0.2
    assert error(0.0, 27) > 1.0


def test_pump_against_the_pressure_of_a_pipe_delivers_as_in_the_pipe(piped):
    """Independent truth: the pump coupled to the pipe step by step in time. Against the pressure
    that it makes there, as sampled, its flow is the same to 2 % of the ripple, where the flow into
    a constant pressure differs by a third of it and more."""
    wave = simulate({}, OIL, SPEED, PressureWave(piped.outlet_pressure))
    free = simulate({}, OIL, SPEED, ConstantPressure(piped.outlet_pressure.mean()))
    ripple = np.linalg.norm(piped.flow - piped.flow.mean())
    assert np.linalg.norm(wave.flow - piped.flow) < 0.02 * ripple
    assert np.linalg.norm(free.flow - piped.flow) > 0.33 * ripple
