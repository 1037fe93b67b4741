"""When a search is resumed because the ripple is better known."""

import numpy as np
import pytest

from rippletwin.calibration.fit import conclude_fit
from rippletwin.calibration.posterior import Posterior
from rippletwin.explanation.stages.staged_search import changes_prediction
from synthetic_observations import POINTS, make, with_known_ripple


@pytest.mark.parametrize(
    ("depth", "ratio", "changes"), [(1.0, 1.0, False), (1.0, 1.6, True), (0.01, 1.6, False)]
)
def test_a_better_known_ripple_matters_where_the_load_is_not_linear(depth, ratio, changes):
    """A ripple 1.6 times the nominal one changes what an orifice makes of it, but not of a ripple a
    hundredth as large, for which the orifice is a resistance; the nominal ripple changes nothing.
    """
    _, data, truth = make(np.random.default_rng(2), points=POINTS[:2], depth=depth, noise=20.0)
    model = Posterior(truth, data)
    model.estimate_errors(model.predict(truth.theta), truth.theta)
    fit = conclude_fit(model, (), truth.theta)
    assert changes_prediction(fit, data, with_known_ripple(data, ratio)) is changes
