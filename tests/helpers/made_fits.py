"""Fits with given evidence and model error, for tests of what is made of fits."""

from types import SimpleNamespace

from rippletwin.calibration.fit import Fit
from rippletwin.twin.priors import lognormal
from synthetic_observations import rig


def made_fit(evidence, *hypothesis, model_error=0.004, coordinate=0.0):
    """A fit of `hypothesis`; `coordinate` is that of the one parameter of its effects."""
    own = SimpleNamespace(name="viscoelastic_wall@segment 1.time", prior=lognormal(1e-3, 1.0))
    twin = SimpleNamespace(parameters=(own,), theta=(coordinate,), rig=rig())
    return Fit(hypothesis, twin, 0.0, evidence, None, model_error, 0.01, 0.01)
