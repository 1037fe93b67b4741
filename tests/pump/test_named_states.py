"""The pump in a named state against the pump model with the same leaks given by hand."""

import numpy as np
import pytest

from paper_rig import paper_rig
from rippletwin.pump.faults import Cylinder, Slipper
from rippletwin.pump.named_states import faults_of, simulate_state
from rippletwin.pump.outlets import ConstantPressure
from rippletwin.pump.simulation import simulate

SPEED_RPM, PRESSURE, LENGTH, SAMPLES = 1000.0, 9.5e6, 5.0, 512


def test_faults_of_a_state():
    """The healthy pump has none; C1 and C2 are both scratched blocks; another name is an error."""
    assert faults_of({}) == []
    assert faults_of({"S": 1e-7, "C2": 2e-7}) == [Slipper(1e-7), Cylinder(2e-7)]
    with pytest.raises(KeyError):
        faults_of({"X": 1e-7})


def test_a_fault_meets_the_orifice_of_the_healthy_pump():
    """The orifice coefficient is the healthy pump's, so that a leak lowers flow and pressure; the
    source is what the pump delivers into a constant pressure with the same leak."""
    rig = paper_rig(2, 1)
    healthy, _ = simulate_state(rig, SPEED_RPM, PRESSURE, LENGTH, {}, SAMPLES)
    faulty, source = simulate_state(rig, SPEED_RPM, PRESSURE, LENGTH, {"S": 1e-6}, SAMPLES)
    assert faulty.orifice == pytest.approx(healthy.orifice)
    assert faulty.flow.mean() < 0.999 * healthy.flow.mean()
    assert faulty.pressure_mean < 0.999 * healthy.pressure_mean
    by_hand = simulate(
        rig.pump, rig.fluid, SPEED_RPM, ConstantPressure(PRESSURE), [Slipper(1e-6)], SAMPLES
    )
    np.testing.assert_allclose(source.flow, by_hand.flow, rtol=1e-12)
    assert faulty.sensor_pressure.shape == (2, SAMPLES)
