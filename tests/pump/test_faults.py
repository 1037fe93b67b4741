"""Leaks of a worn pump, against the orifice law and conservation of the flow."""

import numpy as np
import pytest

from default_pump import LOAD, OIL, SPEED
from rippletwin.pump.faults import Cylinder, Slipper
from rippletwin.pump.geometry import LEAK_DISCHARGE, Geometry
from rippletwin.pump.outlets import ConstantPressure
from rippletwin.pump.simulation import simulate


def intervals_below(signal, level):
    """How many separate runs of a cyclic signal lie below `level`."""
    below = signal < level
    return int(np.sum(below & ~np.roll(below, 1)))


def test_slipper_drops_the_flow_once_a_revolution(constant):
    """Against the orifice law: a leak of Cd A sqrt(2 dp/rho) while the chamber is at pressure."""
    area = 4e-7
    faulty = simulate({}, OIL, SPEED, ConstantPressure(LOAD), Slipper(area))
    deficit = constant.flow - faulty.flow
    leak = LEAK_DISCHARGE * area * np.sqrt(2 * LOAD / OIL.density)
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
    drop = np.maximum(faulty.chamber_pressure[0], 0.0)
    leak = LEAK_DISCHARGE * area * np.sqrt(2 * drop / OIL.density)
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
    leak = LEAK_DISCHARGE * area * np.sqrt(2 * LOAD / OIL.density)
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
    """Faults of chambers that do not meet add up when the outlet pressure is constant."""
    outlet = ConstantPressure(LOAD)
    slipper, cylinder = Slipper(4e-7), Cylinder(5e-7, piston=4)
    both = simulate({}, OIL, SPEED, outlet, [slipper, cylinder]).flow
    single = [simulate({}, OIL, SPEED, outlet, fault).flow for fault in (slipper, cylinder)]
    np.testing.assert_allclose(both, sum(single) - constant.flow, atol=1e-4 * both.mean())


def test_a_leak_has_the_discharge_coefficient_of_the_sheet_or_its_own():
    """Of the same flow: an area at the 0.7 of a sheet that states no coefficient, and a larger one
    at the 0.65 that a sheet states, which is also that of the default pump's ports."""
    stated = {"discharge_coefficient": Geometry.discharge_coefficient}
    own, larger = (
        simulate(pump, OIL, SPEED, ConstantPressure(LOAD), Slipper(area))
        for pump, area in (({}, 4e-7), (stated, 4e-7 * 0.7 / 0.65))
    )
    np.testing.assert_allclose(own.flow, larger.flow, rtol=1e-9)
