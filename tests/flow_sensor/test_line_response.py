"""The line of a fitted twin that the flow sensor inverts."""

from dataclasses import replace

import numpy as np
import pytest

import leaking_pump
from rippletwin.flow_sensor.line_response import line_factory, line_response
from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine
from rippletwin.twin.twin import Twin


@pytest.mark.parametrize("position", [0.0, 2.0, 5.0])
def test_sensors_read_what_the_line_says(position):
    """Sensors at both ends and between, with a resistance in series and a volume beside the line at
    one of these places: waves at the pump give the readings of the line itself."""
    s = 2j * np.pi * np.linspace(20.0, 2000.0, 40)
    line = FrequencyDomainLine(
        s=s,
        lengths=np.array([5.0]),
        series=(2e6 * s + 1e8)[None],
        shunt=(2e-13 * s)[None],
        source_impedance=1e8 + 1e5 * s,
        load=("impedance", np.full(40, 3e9)),
        inserts=[(position, "series", np.full(40, 1e9)), (position, "shunt", 1e-14 * s)],
        sensor_positions=[0.0, 2.0, 5.0],
    )
    pressure, _ = line.respond(line.sensor_positions)
    response = line_response(line, of="outlet")
    # the waves whose flow at the pump is the source's and which agree with the load
    waves = np.linalg.solve(
        np.stack([response.to_flow, response.to_load], axis=1),
        np.tile([1.0, 0.0], (40, 1))[..., None],
    )
    readings = (response.to_sensors @ waves)[..., 0].T
    np.testing.assert_allclose(readings, pressure, rtol=1e-6)


def test_waves_meet_the_chambers_of_the_fitted_pump():
    """A twin whose fit made the dead volume larger, against one whose data sheet states that pump:
    the same admittance at the outlet, which is not that of the first one's data sheet."""
    rig = leaking_pump.rig()
    twin = Twin(rig, [leaking_pump.record("a")], uncertain_pump=True)
    theta = twin.theta.copy()
    theta[twin.index["dead_volume"]] = 3.0
    fitted = twin.with_(theta=theta)
    stated = Twin(replace(rig, pump=fitted.fitted_pump()))
    at = leaking_pump.SPEED / 60.0, leaking_pump.ORDERS
    found, same, sheet = (
        line_factory(each, leaking_pump.LOAD)(*at).source_admittance
        for each in (fitted, stated, Twin(rig))
    )
    np.testing.assert_allclose(found, same, rtol=1e-9)
    assert np.linalg.norm(found - sheet) > 0.05 * np.linalg.norm(sheet)
