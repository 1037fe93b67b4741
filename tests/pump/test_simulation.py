"""The lumped chamber pump against conservation laws, symmetry and convergence."""

import numpy as np
import pytest

from default_pump import LOAD, OIL, PIPE, POSITIONS, SPEED, relative_rms
from kinematic_flow import kinematic_flow
from rippletwin.pump import chambers
from rippletwin.pump.faults import Cylinder, Slipper
from rippletwin.pump.geometry import Geometry
from rippletwin.pump.outlets import ConstantPressure, Pipe, PressureWave
from rippletwin.pump.simulation import simulate


def expected_mean_flow(geometry, outlet_pressure):
    """Displacement less compression and case leakage, m3/s: each chamber's volume, not its flows.

    Between the closing of suction and of delivery a chamber displaces its stroke, of which it
    needs V (C(p_delivery) - C(p_suction)) to compress what it holds, with V near the outer dead
    centre's. Air, a share of the volume at 101325 Pa, goes by Boyle's law of absolute pressures.
    Half of the chambers' time is at delivery pressure, so the leakage uses that, not the solution.
    """
    suction, delivery = (p + 101325.0 for p in (geometry.suction_pressure, outlet_pressure))
    squeezed = (delivery - suction) / geometry.bulk_modulus
    squeezed += geometry.air_fraction * 101325.0 * (1.0 / suction - 1.0 / delivery)
    full = geometry.dead_volume + geometry.stroke_volume
    delivered = geometry.pistons * (geometry.stroke_volume - full * squeezed) * SPEED / 60
    return delivered - geometry.pistons * geometry.case_leakage * (delivery - suction) / 2


@pytest.mark.parametrize("outlet", ["constant", "piped"])
def test_mean_flow_is_displacement_less_losses(outlet, request):
    """Mass conservation over a cycle, from volumes and pressures alone, to 0.5 %."""
    ripple = request.getfixturevalue(outlet)
    geometry = Geometry()
    expected = expected_mean_flow(geometry, ripple.pressure_mean)
    assert ripple.flow.mean() == pytest.approx(expected, rel=5e-3)
    assert expected > 0.95 * geometry.displacement * SPEED / 60  # losses are losses, not the flow


@pytest.mark.parametrize("suction,load", [(0.0, 1e5), (1e5, 4e5)])
def test_pressures_are_above_the_atmosphere(suction, load):
    """A tenth of air in the oil, compressed from an open or a boosted tank: the share of the stroke
    that this takes is Boyle's, of pressures above a vacuum. Wide ports, so that these are those of
    inlet and outlet."""
    airy = {"air_fraction": 0.1, "suction_pressure": suction, "port_area": 4e-4}
    ripple = simulate(airy, OIL, SPEED, ConstantPressure(load))
    expected = expected_mean_flow(Geometry.from_dict(airy), load)
    assert ripple.flow.mean() == pytest.approx(expected, rel=0.01)
    assert ripple.pressure_mean == pytest.approx(load)


LEAKS = {
    "sound": None,
    "slipper": Slipper(6e-7, 3),
    "cylinder, last and first": Cylinder(6e-7, 6),
    "several": (Slipper(2e-7, 0), Cylinder(6e-7, 4), Cylinder(3e-7, 5), Slipper(1e-6, 2)),
}


@pytest.mark.parametrize("pump", [{}, {"pistons": 7, "air_fraction": 0.02}], ids=["9", "7"])
@pytest.mark.parametrize("leaks", LEAKS.values(), ids=LEAKS)
def test_one_sound_chamber_stands_for_all_at_a_constant_pressure(pump, leaks):
    """All chambers solved together, into the same pressure given angle by angle, have the flow and
    the pressures that one sound chamber's and those of the leaking ones say."""
    few = simulate(pump, OIL, SPEED, ConstantPressure(LOAD), leaks)
    all_ = simulate(pump, OIL, SPEED, PressureWave(np.full(64, LOAD)), leaks)
    assert np.max(np.abs(few.flow - all_.flow)) < 1e-7 * np.max(all_.flow)  # the solver's tolerance
    assert np.max(np.abs(few.chamber_pressure - all_.chamber_pressure)) < 1e-6 * LOAD
    assert np.all(few.outlet_pressure == pytest.approx(LOAD))
    assert few.converged and few.pressure_mean == pytest.approx(all_.pressure_mean, rel=1e-12)


def test_pump_between_open_tanks_delivers_what_it_displaces():
    """Nothing is compressed and nothing leaks where inlet, outlet and case are at one pressure."""
    ripple = simulate({"port_overlap_deg": 0.0}, OIL, SPEED, ConstantPressure(0.0))
    assert ripple.flow.mean() == pytest.approx(Geometry().displacement * SPEED / 60, rel=2e-3)


@pytest.mark.parametrize(
    "speed,load,opening", [(500.0, 4e6, 30.0), (1500.0, 20e6, 30.0), (500.0, 4e6, 100.0)]
)
def test_incompressible_leak_free_mean_flow_is_displacement(speed, load, opening):
    """With a fluid a thousand times stiffer and no leak the mean is displacement x speed, however
    slowly the ports open.

    Less what the pistons move while the ports are shut, half the overlap before and after each
    dead centre, which no outlet sees: a share 1 - cos(overlap/2).
    """
    stiff = {"bulk_modulus": 1.4e12, "air_fraction": 0.0, "case_leakage": 0.0}
    stiff["port_opening_deg"] = opening
    ripple = simulate(stiff, OIL, speed, ConstantPressure(load))
    open_share = np.cos(np.radians(Geometry().port_overlap_deg / 2))
    expected = Geometry().displacement * speed / 60 * open_share
    assert ripple.flow.mean() == pytest.approx(expected, rel=1e-3)


def test_ports_that_are_open_together_leak_as_two_orifices_in_series():
    """A negative overlap: what delivery loses to suction follows from the areas alone.

    Where the pistons hardly move, both orifices of a chamber pass the same flow: A = A1 A2 /
    sqrt(A1^2 + A2^2) in one (Merritt 1967, Hydraulic Control Systems), twice a revolution in each
    chamber. Areas by their own formula, a smooth step from half the overlap before a dead centre.
    """
    pump = {
        "bulk_modulus": 1.4e13, "air_fraction": 0.0, "case_leakage": 0.0,
        "port_overlap_deg": -8.0, "port_opening_deg": 30.0,
    }  # fmt: skip
    g = Geometry.from_dict(pump)
    angle = np.linspace(-4.0, 4.0, 4001)  # deg about a dead centre
    one, other = ((4.0 + a) / 30.0 for a in (angle, -angle))
    one, other = (g.port_area * (3 * u**2 - 2 * u**3) for u in (one, other))
    both = one * other / np.hypot(one, other).clip(1e-300)
    share = 2 * g.pistons * np.trapezoid(both, angle) / 360.0
    lost = g.discharge_coefficient * share * np.sqrt(2 * LOAD / OIL.density)
    slowly = 100.0  # r/min: a piston displaces little while both are open
    delivered = simulate(pump, OIL, slowly, ConstantPressure(LOAD)).flow.mean()
    assert g.displacement * slowly / 60 - delivered == pytest.approx(lost, rel=0.01)


def test_stiff_fluid_and_ideal_ports_give_the_kinematic_flow():
    """The limit of a stiff fluid: the sum of the pistons' speeds (closed form).

    Ports open fast and without overlap, at a low pressure so that the orifices' crossing at the
    dead centres, which the closed form lacks, stays small.
    """
    ideal = {
        "bulk_modulus": 1.4e13, "air_fraction": 0.0, "case_leakage": 0.0,
        "port_overlap_deg": 0.0, "port_opening_deg": 0.5, "port_area": 4e-4,
    }  # fmt: skip
    ripple = simulate(ideal, OIL, SPEED, ConstantPressure(5e4), min_steps=24576)
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
    """It is reported periodic, and a run with its orifice coefficient gives the same flow."""
    assert piped.converged and piped.change < 1e-6
    again = simulate({}, OIL, SPEED, Pipe(PIPE, POSITIONS, orifice=piped.orifice))
    np.testing.assert_allclose(again.flow, piped.flow, atol=1e-5 * np.std(piped.flow))


def test_unfinished_run_is_not_reported_periodic(monkeypatch):
    """A run stopped in its transient is not converged."""
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
    assert piped.chamber_pressure.min() > -101325.0


@pytest.mark.parametrize(
    "pump,outlet",
    [
        ({"piston": 9}, ConstantPressure(LOAD)),
        ({"port_area": -1e-4}, ConstantPressure(LOAD)),
        ({"port_overlap_deg": 180.0}, ConstantPressure(LOAD)),
    ],
)
def test_impossible_geometry_is_named(pump, outlet):
    """The error names the key."""
    with pytest.raises(ValueError, match=next(iter(pump))):
        simulate(pump, OIL, SPEED, outlet)


def test_a_pressure_that_is_no_number_has_no_flow():
    """Newton's method claims no solution where one of its pressures is nan, be it in the last step
    of a run."""
    tables = np.array([[1e-5, 1e-5], [1e-3, 1e-3], [1e-7, 1e-7], [0.0, 0.0]])
    compressed, leaks = 1e7 / 1.5e9, np.zeros(2)

    def flow(target):
        pressures = np.full(3, 1e7)
        return chambers.solve_stage(
            pressures, np.zeros(2), target, 1e-6, tables, (1.5e9, 0.0, 0.0, 1e5), leaks, leaks,
            1e7, 0.0, np.empty((3, 3)), np.empty(3),
        )  # fmt: skip

    assert np.isfinite(flow(np.full(2, compressed)))
    assert np.isnan(flow(np.array([compressed, np.nan])))


def test_defaults_grow_with_the_pump():
    """A pump of half the size in each direction delivers as large a share of its displacement as
    the default one: at each speed and pressure losses in ports, by compression and by leakage are
    the same shares. A stated number stays, and an unknown pump is the default one."""
    small = {"piston_diameter": 0.0085, "pitch_radius": 0.01675}
    shares = []
    for pump in ({}, small):
        geometry = Geometry.from_dict(pump)
        flow = simulate(pump, OIL, 1500.0, ConstantPressure(2e7)).flow.mean()
        shares.append(flow / (geometry.displacement * 25.0))
    assert 0.85 < shares[1] == pytest.approx(shares[0], abs=0.02)
    assert Geometry.from_dict({"pistons": 7}).dead_volume == Geometry().dead_volume
    assert Geometry.from_dict(small | {"dead_volume": 3e-6}).dead_volume == 3e-6
