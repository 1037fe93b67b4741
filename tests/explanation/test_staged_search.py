"""What follows from an explanation: a better known ripple, and a pump that responds to the line."""

from dataclasses import replace

import numpy as np
import pytest

from coupled_pump import PUMP, SPEED, coupled
from rippletwin.calibration.fit import conclude_fit
from rippletwin.calibration.posterior import Posterior
from rippletwin.explanation.fit_jobs import FitJob, Workers, make_base
from rippletwin.explanation.stages import staged_search
from rippletwin.explanation.stages.staged_search import changes_prediction, settle_ripple
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


def _settled(rig, data):
    """The fit of what the data sheet knows, and the data and the fit with a settled ripple."""
    base = make_base(rig, data)
    (fit,) = Workers(base, data).fit([FitJob(())])
    return fit, *settle_ripple(base, data, fit)


def test_the_pump_responds_to_the_line():
    """Recordings at two speeds of a pump that is coupled to its line in time and is stiffer than
    its data sheet says. Settled, they are far likelier, and the ripple errs by less than a tenth of
    what it did."""
    pump = PUMP | {"bulk_modulus": 1.2 * PUMP["bulk_modulus"]}
    rig, one = coupled(pump)
    _, other = coupled(pump, 1.3 * SPEED, "b")
    fit, settled, best = _settled(rig, [one, other])
    print(fit.evidence, best.evidence, fit.source_sd, best.source_sd)
    assert all(o.flow_ripple is not None for o in settled)
    assert best.evidence > fit.evidence + 100.0
    assert best.source_sd < 0.1 * fit.source_sd


def test_a_response_that_explains_nothing_is_not_kept():
    """The same pump, with a ripple that differs from the simulated one by 40 % at every harmonic:
    its response is wrong as well, and the recordings stay as they are."""
    rig, o = coupled()
    rng = np.random.default_rng(5)
    error = 0.4 * rng.standard_normal((2, len(o.orders)))
    data = [replace(o, values=o.values * np.exp(error[0] + 1j * error[1]))]
    fit, settled, best = _settled(rig, data)
    print(fit.evidence, best.evidence, fit.source_sd, best.source_sd)
    assert all(o.flow_ripple is None for o in settled)


@pytest.mark.parametrize("unconverged", [1, 2])
def test_a_response_must_add_more_than_a_fit_leaves_open(monkeypatch, unconverged):
    """The coupled pump, whose response adds some 90 to the log evidence and is kept otherwise,
    where the first or the second fit promises 1000 by a further step: no response is kept."""
    refit, fits = staged_search._refit, []

    def fit_again(*args):
        fits.append(refit(*args))
        return replace(fits[-1], expected_gain=1000.0 if len(fits) == unconverged else 0.0)

    monkeypatch.setattr(staged_search, "_refit", fit_again)
    rig, o = coupled(PUMP | {"bulk_modulus": 1.2 * PUMP["bulk_modulus"]})
    _, settled, _ = _settled(rig, [o])
    print([fit.evidence for fit in fits])
    assert all(o.flow_ripple is None for o in settled)
    assert len(fits) == 2
