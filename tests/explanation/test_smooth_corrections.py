"""Free, smooth corrections: their likelihood, and what they tell of effects that are not there."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rippletwin.calibration.frequency_continuation import refine
from rippletwin.explanation.checks.robustness import compare_beside_corrections
from rippletwin.explanation.checks.support import evaluate_corrections, evaluate_without
from rippletwin.explanation.fit_jobs import FitJob, NearFit, Workers
from rippletwin.explanation.localise.elements import (
    NONE,
    elements_of,
    own_element,
    position_spacing,
)
from rippletwin.explanation.localise.remainder import _interval, find_remainder
from rippletwin.explanation.localise.smooth_corrections import (
    CORRELATION_HZ,
    smooth_basis,
)
from rippletwin.spectra.frequency_selection import select_fitted_frequencies
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from synthetic_effects import LEAK, TRUTH, VOLUME
from synthetic_observations import POINTS, make, rig


def test_basis_has_the_kernel_of_unit_complex_variance():
    """Real and imaginary part have half the variance each."""
    f = np.linspace(100.0, 4000.0, 40)
    basis = smooth_basis(f)
    kernel = np.exp(-0.5 * (np.subtract.outer(f, f) / CORRELATION_HZ) ** 2)
    assert np.allclose(2.0 * basis.T @ basis, kernel, atol=2e-2)


def spoilt(observations, row, error):
    """Observations whose sensor `row` has a relative error, a function of the frequency in Hz."""
    spoilt = []
    for o in observations:
        values = o.values.copy()
        values[row] *= 1.0 + error(o.frequency_hz)
        spoilt.append(replace(o, values=values))
    return spoilt


def unlisted(f):
    """Smooth, up to 8 % at 4 kHz, and of no effect's law: a phase that grows as the cube."""
    return -0.08j * (f / 4000.0) ** 3


@pytest.fixture(scope="module")
def line_with_volume():
    """A line with a volume whose second sensor has an unlisted error: twin, data, true theta."""
    bench, recorded, truth = make(np.random.default_rng(3), VOLUME, TRUTH, 3, POINTS[:2])
    data = spoilt(select_fitted_frequencies(recorded, bench), 1, unlisted)
    return Twin(bench, data), data, truth.theta


def robustness_of_last_effect(base, data, fit):
    """Of the last effect of a fit, against the line without it."""
    rest = fit.hypothesis[:-1]
    start = np.array(
        [fit.twin.theta[fit.twin.index[p.name]] for p in base.with_(effects=rest).parameters]
    )
    without = refine(base, rest, data, [start], exact=False)
    effect, place, values = fit.twin.effect_values(fit.twin.theta)[-1]
    own = own_element(effect, place, values, base.rig)
    elements = elements_of(base.rig, data, [own])
    absent = evaluate_without(base, data, (((without, None), (without, start)), without, elements))
    tried = list(dict.fromkeys(e for table in absent for e in table))
    present = evaluate_corrections(base, data, (fit, tried))
    spacing = position_spacing(base.rig, np.concatenate([o.frequency_hz for o in data]))
    return present, compare_beside_corrections(present, absent, own, spacing)


def test_a_true_effect_survives_an_unlisted_error_elsewhere(line_with_volume):
    """The volume keeps its evidence whatever element may err, and what remains belongs to the
    sensor that really errs."""
    base, data, theta = line_with_volume
    fit = refine(base, VOLUME, data, [theta], exact=False)
    present, robustness = robustness_of_last_effect(base, data, fit)
    assert robustness.least > 20.0 and robustness.own > 0.0
    best = max(present, key=present.get)
    assert best == ("sensor", 1)
    assert present[best] > present[NONE, None] + 20.0
    remainder = find_remainder(fit, data)
    assert remainder.element == ("sensor", 1)
    assert 0.005 < remainder.model_error < 0.1 and remainder.law is None


def test_an_effect_that_fits_an_unlisted_error_is_not_established(line_with_volume):
    """The phase error grows faster than that of a delay. A delay has the evidence to be named;
    beside a free correction at its own place its law is needless."""
    base, data, theta = line_with_volume
    first = refine(base, VOLUME, data, [theta], exact=False)
    wrong = (EFFECTS["sensor_delay"], Place("sensor p2", 1))
    (fit,) = Workers(base, data).fit([FitJob((*VOLUME, wrong), NearFit(first))])
    assert fit.evidence > first.evidence + 8.0
    _, robustness = robustness_of_last_effect(base, data, fit)
    assert robustness.own < 0.0 or robustness.least < 8.0


def test_the_remainder_of_an_unlisted_leak_is_at_its_place():
    """A leak that the fit does not have: the remainder is a shunt near it."""
    bench, recorded, truth = make(
        np.random.default_rng(4), LEAK, TRUTH, 3, POINTS[:2], source=0.0, noise=500.0
    )
    data = select_fitted_frequencies(recorded, bench)
    base = Twin(bench, data)
    start = np.array([truth.theta[truth.index[p.name]] for p in base.parameters])
    fit = refine(base, (), data, [start], exact=False)
    remainder = find_remainder(fit, data)
    kind, _ = remainder.element
    low, high = remainder.interval
    position = TRUTH["leak@position.position"]
    assert kind == "shunt" and low - 0.1 <= position <= high + 0.1 and high - low < 1.0
    assert remainder.law is not None


def test_a_line_of_one_segment_is_that_segment():
    """The own element of friction is all segments, and of one segment the element that is tried."""
    friction, place = EFFECTS["unsteady_friction"], Place("line")
    bench = rig()
    assert own_element(friction, place, {}, bench) == ("segment series", (0, 1, 2))
    single = replace(bench, line=bench.line[:1])
    own = own_element(friction, place, {}, single)
    assert own == ("segment series", 0) and own in elements_of(single, [])


def test_an_effect_at_a_segment_is_that_segment_whatever_it_is_said_to_act_on():
    """A user's effect of the line whose places are segments."""
    effect = replace(EFFECTS["viscoelastic_wall"], element="line")
    assert own_element(effect, Place("segment 2", 1), {}, rig()) == ("segment shunt", 1)


def test_elements_at_one_position_cannot_be_told_apart():
    """A shunt closer to an effect's shunt than the spacing is the effect's own element; a series
    element there, and a shunt further away, are others."""
    own, near, far, series = ("shunt", 2.0), ("shunt", 2.05), ("shunt", 2.2), ("series", 2.05)
    absent = {own: 0.0, near: 0.0, far: 0.0, series: 0.0, (NONE, None): 0.0}
    present = {own: 1.0, near: 2.0, far: 30.0, series: 20.0, (NONE, None): 40.0}
    robustness = compare_beside_corrections(present, [absent], own, spacing=0.1)
    assert robustness.own == 1.0 and robustness.plain == 40.0
    assert robustness.least == 20.0 and robustness.element == series


def test_what_remains_in_a_short_line_may_be_anywhere_in_it():
    """A line of less than a quarter of a wavelength has one position that is tried: the interval of
    what remains there is the whole line. Of two positions the better one has its half."""
    for promises, interval in (([5.0], (0.0, 2.0)), ([0.0, 50.0], (1.0, 2.0))):
        count = len(promises)
        positions = (np.arange(count) + 0.5) / count * 2.0
        corrections = SimpleNamespace(
            promises={"shunt": (positions, np.array(promises))}, network=SimpleNamespace(length=2.0)
        )
        assert _interval(corrections, ("shunt", positions[-1])) == interval
