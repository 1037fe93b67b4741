"""The flow ripple that recordings correct."""

from dataclasses import replace

import numpy as np
import pytest

from rippletwin.calibration.fit import conclude_fit
from rippletwin.calibration.misfit import score_fit
from rippletwin.calibration.posterior import Posterior
from rippletwin.calibration.ripple_correction import correct_ripple, with_corrected_ripple
from rippletwin.harmonics import one_period, peak_amplitudes
from rippletwin.spectra.corrected_ripple import CorrectedRipple
from rippletwin.spectra.frequency_selection import select_frequencies
from synthetic_observations import make


def by_order(orders):
    """True over nominal harmonics of a pump that errs alike at the same shaft order."""
    return 1.0 - 0.4 * (1.0 - np.exp(-orders / 60.0)) * np.exp(0.01j * orders)


@pytest.fixture(scope="module")
def fitted():
    """A fit at the true line, and three recordings whose nominal ripple is wrong `by_order`."""
    _, observations, truth = make(np.random.default_rng(5), source=0.0)
    data = []
    for o in observations:
        flow = peak_amplitudes(o.flow_ripple.flow)
        flow[1:] /= by_order(np.arange(1, len(flow)))
        nominal = replace(o.flow_ripple, flow=one_period(flow, len(o.flow_ripple.flow)))
        data.append(replace(o, flow_ripple=nominal))
    model = Posterior(truth, data)
    model.estimate_errors(model.predict(truth.theta), truth.theta)
    return conclude_fit(model, (), truth.theta), data


def test_the_error_of_the_ripple_is_recovered(fitted):
    """The line is the true one, so what the sensors read beside the prediction is the known error
    of the ripple: it is found to 1 % where the ripple is stronger than a hundredth of its
    strongest harmonic, and the misfit falls from tens of per cent to less than one."""
    fit, data = fitted
    ripple = correct_ripple(fit, data)
    for o in data:
        power = np.mean(np.abs(o.values), axis=0)
        strong = power > 0.01 * np.max(power)
        np.testing.assert_allclose(
            ripple.at(o.label, o.orders)[strong], by_order(o.orders)[strong], atol=0.01
        )
    assert score_fit(fit, data).misfit > 0.1
    assert score_fit(fit, data, ripple=ripple).misfit < 0.01


def test_the_correction_holds_at_an_operating_point_that_was_not_fitted(fitted):
    """Two recordings correct the third one's ripple, at another speed and pressure, by the error
    that the pump has at the same shaft orders, whatever shaft angle each begins at."""
    fit, data = fitted
    ripple = correct_ripple(fit, data[:2])
    nominal = score_fit(fit, data[2:], turn=True).misfit
    assert score_fit(fit, data[2:], turn=True, ripple=ripple).misfit < 0.1 * nominal


def test_recordings_without_a_common_order_are_corrected_too(fitted):
    """One recording has the lower half of the band, another the upper half: each has the known
    error of its own orders, to 6 % at weak ones."""
    fit, data = fitted
    low, high = (
        select_frequencies(o, (o.orders < 100) if k == 0 else (o.orders > 100))
        for k, o in enumerate(data[:2])
    )
    ripple = correct_ripple(fit, [low, high])
    np.testing.assert_allclose(ripple.at(low.label, low.orders), by_order(low.orders), atol=0.06)
    assert np.all(np.isfinite(ripple.at(high.label, high.orders)))


def test_what_turns_the_shaft_is_no_error_of_the_ripple():
    """Recordings whose ratios differ by a turn of the shaft alone give the first one's ratio to a
    recording that was not fitted; without any the nominal ripple stays."""
    orders = np.arange(9, 100, 9)
    ratio = by_order(orders)
    turned = CorrectedRipple(
        {"a": orders, "b": orders},
        {"a": ratio, "b": ratio * np.exp(-0.02j * orders)},
        {"a": 0.0, "b": 0.02},
    )
    np.testing.assert_allclose(turned.at("c", orders), ratio, rtol=1e-12)
    np.testing.assert_array_equal(CorrectedRipple({}, {}, {}).at("c", orders), 1.0)


def test_the_corrected_ripple_is_the_same_beside_another_nominal_one(fitted):
    """The recordings with the ripple that is there as the nominal one: nothing is left to correct.
    With the nominal ripple of the fit the correction is that of the fit."""
    fit, data = fitted
    true = [
        replace(o, flow_ripple=replace(o.flow_ripple, flow=_with_errors(o.flow_ripple.flow)))
        for o in data
    ]
    found = correct_ripple(fit, data)
    for o, same, other in zip(
        data, with_corrected_ripple(fit, data, data), with_corrected_ripple(fit, data, true)
    ):
        power = np.mean(np.abs(o.values), axis=0)
        strong = power > 0.01 * np.max(power)
        known = same.corrected_ripple.at(o.label, o.orders)
        np.testing.assert_allclose(known, found.at(o.label, o.orders))
        left = other.corrected_ripple.at(o.label, o.orders)[strong]
        np.testing.assert_allclose(left, 1.0, atol=0.02)


def _with_errors(flow):
    """A nominal flow with the error `by_order` that the recordings have."""
    amplitudes = peak_amplitudes(flow)
    amplitudes[1:] *= by_order(np.arange(1, len(amplitudes)))
    return one_period(amplitudes, len(flow))
