"""The pump's flow into a constant pressure."""

import pytest

from virtualrig.pump import Pump
from virtualrig.source import constant_pressure_flow, outlet_compliance


@pytest.mark.parametrize("bulk_modulus", [1.3e9, 0.65e9])
def test_mean_flow_is_displacement_less_leakage_and_compression(bulk_modulus):
    """The mean flow is the swept volume, less leakage during the half turn at high pressure, less
    the compression of a full chamber once a turn, by hand. It agrees to 5 % of the compression,
    which is 1 or 2 % of the flow; the compression of the dead volume alone would not do."""
    pump = Pump(dead_volume=2e-6, case_leakage=3e-13, bulk_modulus=bulk_modulus)
    speed_hz, pressure, density = 1000.0 / 60, 9.5e6, 870.0
    flow = constant_pressure_flow(pump, density, 60 * speed_hz, pressure).mean()
    leakage = pump.pistons * pump.case_leakage * pressure / 2
    stroke = pump.displacement / pump.pistons
    strain = (pressure - pump.suction_pressure) / pump.bulk_modulus
    compression = strain * (pump.dead_volume + stroke) * pump.pistons * speed_hz
    expected = pump.displacement * speed_hz - leakage - compression
    assert compression > 0.01 * expected
    assert flow == pytest.approx(expected, abs=0.05 * compression)


def test_half_of_the_chambers_are_a_compliance_at_the_outlet():
    """A chamber is open for half a turn less the overlap. Over that half its mean volume is the
    dead volume and half a stroke, by hand."""
    pump = Pump(dead_volume=2e-6, port_overlap_deg=4.0)
    stroke = pump.displacement / pump.pistons
    open_chambers = pump.pistons * (180.0 - 4.0) / 360.0
    expected = open_chambers * (pump.dead_volume + 0.5 * stroke) / pump.bulk_modulus
    assert outlet_compliance(pump, 870.0, 9.5e6) == pytest.approx(expected, rel=0.01)
