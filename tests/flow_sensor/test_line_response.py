"""The line of a fitted twin that the flow sensor inverts."""

from dataclasses import replace

import numpy as np

import leaking_pump
from rippletwin.flow_sensor.line_response import line_factory
from rippletwin.twin.twin import Twin


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
