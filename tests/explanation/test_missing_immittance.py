"""The missing quantity against frequency, and the element in which it is missing."""

from types import SimpleNamespace

import numpy as np
import pytest

from rippletwin.calibration.frequency_continuation import refine
from rippletwin.explanation.localise.free_corrections import locate_mismatch
from rippletwin.explanation.localise.missing_immittance import (
    MissingImmittance,
    describe_law,
    find_missing_immittance,
    is_passive,
)
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from synthetic_observations import make

HOSE = ((EFFECTS["viscoelastic_wall"], Place("segment 2", 1)),)
TRUTH = {
    "viscoelastic_wall@segment 2.compliance_ratio": 0.2,
    "viscoelastic_wall@segment 2.retardation_time": 3e-4,
}
POINTS = ((1000, 9.5e6),)


@pytest.fixture(scope="module")
def hose():
    """Observations of a line with a hose, and the fit with the hose."""
    bench, observations, truth = make(np.random.default_rng(11), HOSE, TRUTH, points=POINTS)
    base = Twin(bench, observations)
    return base, observations, refine(base, HOSE, observations, [truth.theta]), truth


def test_the_missing_admittance_follows_the_true_law(hose):
    """At nine of ten frequencies alone the data give the hose's admittance within four standard
    deviations, and its law is recognised."""
    _, observations, fit, _ = hose
    missing = find_missing_immittance(fit, observations)
    assert (missing.where, missing.unit) == ("segment 2", "m2/(Pa s)")
    s = 2j * np.pi * missing.frequency_hz
    rig = fit.twin.calibrated_rig()
    segment = rig.line[1]
    truth = segment.area * s / (rig.fluid.density * segment.wave_speed**2) * 0.2 / (1 + 3e-4 * s)
    is_near = np.abs(missing.points - truth) < 4 * missing.sd + 0.05 * np.abs(truth)
    assert np.mean(is_near) > 0.9
    assert "relaxing compliance" in missing.law_in_words


def test_frequencies_at_which_nothing_changes_say_nothing():
    """A law is read from the points that have a standard deviation; those with none, where the
    effect changes nothing, leave it as it is, and no arithmetic fails."""
    frequency_hz = np.linspace(50.0, 4000.0, 30)
    points, sd = 2e-13j * frequency_hz, 1e-12 * np.ones(30)
    points[::4], sd[::4] = 0.0, 0.0
    with np.errstate(all="raise"):
        missing = MissingImmittance("", "", "", frequency_hz, points, points, sd)
        assert "proportional to jw)" in missing.law_in_words


def test_the_best_free_element_is_the_segment_with_the_hose(hose):
    """For the line without its hose, a free correction of segment 2 has a larger log Bayes factor
    than one of any other element, sensor or position."""
    base, observations, _, truth = hose
    start = [truth.theta[truth.index[p.name]] for p in base.parameters]
    bare = refine(base, (), observations, [start])
    values = locate_mismatch(bare, observations).log_bayes_factors
    assert max(values, key=values.get) in ("segment 2, shunt", "segment 2, series")
    assert values["source"] < values["segment 2, shunt"]


@pytest.mark.parametrize(
    ("immittance", "word"),
    [
        (lambda w: 3e-11 + 0j * w, "leak"),
        (lambda w: 2e-14j * w, "compliance or"),
        (lambda w: 1e-12 * (1 + 1j) * np.sqrt(w), "boundary"),
        (lambda w: -1e-11 * (1 + 0.3j) + 0 * w, "not passive"),
        (lambda w: 1e-6 / (30.0 + 1j * (w * 0.1 - 4e6 / w)), "resonator"),
    ],
)
def test_textbook_immittances_are_recognised(immittance, word):
    """Each textbook immittance with 5 % noise is described by its own law."""
    f = np.linspace(150.0, 4000.0, 26)
    noise = 1 + 0.05 * np.random.default_rng(1).normal(size=26)
    assert word in describe_law(f, immittance(2 * np.pi * f) * noise)


def test_a_passive_network_is_positive_real():
    """Wherever its parameters are drawn, a network has no negative resistance at any complex
    frequency of the right half-plane; the question is refused for a named effect."""
    rng, network = np.random.default_rng(5), EFFECTS["passive_network"]
    bench, observations, _ = make(rng, points=POINTS)
    pair = ((network, Place("position", form="shunt")),)
    twin = Twin(bench, observations, effects=pair)
    for _ in range(20):
        drawn = twin.with_(theta=2.0 * rng.normal(size=len(twin.theta)))
        assert is_passive(SimpleNamespace(twin=drawn))
    with pytest.raises(ValueError, match="named effect"):
        is_passive(SimpleNamespace(twin=Twin(bench, observations, effects=HOSE)))
