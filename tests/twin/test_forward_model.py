"""The forward model's response to a ripple so small that load and line are linear."""

from dataclasses import replace

import numpy as np

from paper_rig import paper_rig
from rippletwin.harmonics import flow_harmonics
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.twin import Twin
from synthetic_recordings import point


def test_unit_response_is_that_to_a_small_ripple():
    """With an orifice and with air, both nonlinear: a millionth of a ripple, over its harmonics."""
    rig = paper_rig()
    o = point(rig)
    flow = o.flow_ripple.flow
    small = replace(o.flow_ripple, flow=flow.mean() + 1e-6 * (flow - flow.mean()))
    o = replace(o, flow_ripple=small)
    twin = Twin(rig, [o], effects=((EFFECTS["entrained_air"], Place("line")),))
    theta = twin.theta + 0.3
    forward = ForwardModel(twin, [o])
    expected = forward(theta)[0] / flow_harmonics(small, o.orders)
    np.testing.assert_allclose(forward.unit_response(theta)[0], expected, rtol=1e-4)
