"""The forward model: its response to a ripple so small that load and line are linear, and what it
says where no steady state is found."""

from dataclasses import replace

import numpy as np
import pytest

from paper_rig import paper_rig
from rippletwin.calibration.posterior import Posterior
from rippletwin.harmonics import flow_harmonics
from rippletwin.line.frequency_domain.orifice_load import OrificeLoad
from rippletwin.spectra.frequency_selection import select_frequencies
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


AIR = ((EFFECTS["entrained_air"], Place("line")),)
NEVER_REACHED = -1.0  # tolerance of an orifice that iterates in vain


@pytest.mark.parametrize(("effects", "frozen"), [((), False), (AIR, False), (AIR, True)])
def test_an_orifice_that_does_not_settle_is_told(monkeypatch, effects, frozen):
    """The orifice alone, beside air, and beside air that is frozen: the prediction is finite but no
    steady state, so that a descent refuses it and `Twin.predict` warns. Without the obstacle the
    same models find one."""
    rig = paper_rig()
    o = point(rig)
    twin = Twin(rig, [o], effects=effects)
    posterior = Posterior(twin, [o])
    posterior.values = posterior.values + 1e5

    def objective():
        posterior.forward.freeze_compliance = frozen
        prediction = posterior.predict(twin.theta)
        assert np.all(np.isfinite(prediction))
        return posterior.objective(twin.theta, prediction)

    whole = OrificeLoad.solve
    with monkeypatch.context() as obstacle:
        obstacle.setattr(OrificeLoad, "solve", lambda *a, **_: whole(*a, tolerance=NEVER_REACHED))
        assert objective() == np.inf
        with pytest.warns(RuntimeWarning, match="a: no steady state"):
            twin.predict([o])
    assert np.isfinite(objective())


@pytest.mark.parametrize("effects", [(), AIR])
@pytest.mark.parametrize("kept", [slice(4, None), slice(3, 4), np.r_[0:2, 5:8]])
def test_harmonics_left_out_of_a_band_are_still_in_the_ripple(effects, kept):
    """The readings of some harmonics are those of the whole band: with its low ones left out, one
    alone, and a part in the middle left out. Orifice and air couple all of them. The top order
    stays, up to which more are added."""
    rig = paper_rig()
    whole = point(rig)
    top = len(whole.orders) - 1
    columns = np.append(np.arange(len(whole.orders))[kept], top)
    part = select_frequencies(whole, columns)
    twin = Twin(rig, [whole], effects=effects)
    (expected,), (found,) = (ForwardModel(twin, [o])(twin.theta) for o in (whole, part))
    np.testing.assert_allclose(found, expected[:, columns], rtol=1e-9)
