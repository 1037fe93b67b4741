"""The next recording, the missing quantity and the place: against what was put into made data."""

from types import SimpleNamespace

import numpy as np
import pytest

from rippletwin.calibration.frequency_continuation import refine
from rippletwin.explanation.localise import free_corrections, missing_immittance
from rippletwin.explanation.verdict import next_experiment
from rippletwin.explanation.verdict.decision import equivalent_places, rival_fits
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from synthetic_observations import make

HOSE = ((EFFECTS["viscoelastic_wall"], Place("segment 2", 1)),)
AIR = ((EFFECTS["entrained_air"], Place("line")),)
TRUTH = {
    "viscoelastic_wall@segment 2.compliance_ratio": 0.2,
    "viscoelastic_wall@segment 2.retardation_time": 3e-4,
    "entrained_air@line.gas_fraction": 5e-3,
}
POINTS = ((1000, 9.5e6),)


@pytest.fixture(scope="module")
def hose():
    """Observations of a line with a hose, and the fit with the hose in it."""
    bench, observations, truth = make(np.random.default_rng(11), HOSE, TRUTH, points=POINTS)
    base = Twin(bench, observations)
    return base, observations, refine(base, HOSE, observations, [truth.theta]), truth


def test_missing_admittance_lies_on_the_law_that_was_put_in(hose):
    """At every frequency alone the data ask for the hose's admittance within four standard
    deviations in nine of ten, and the law is recognised."""
    _, observations, fit, _ = hose
    found = missing_immittance.missing_immittance(fit, observations)
    assert (found.where, found.unit) == ("segment 2", "m2/(Pa s)")
    s = 2j * np.pi * found.frequency_hz
    rig = fit.twin.calibrated_rig()
    segment = rig.line[1]
    truth = segment.area * s / (rig.fluid.density * segment.wave_speed**2) * 0.2 / (1 + 3e-4 * s)
    assert np.mean(np.abs(found.points - truth) < 4 * found.sd + 0.05 * np.abs(truth)) > 0.9
    assert "relaxing" in found.law_in_words


def test_the_free_element_is_the_segment_with_the_hose(hose):
    """About the line without its hose, a free admittance of segment 2 gains more evidence than a
    free correction of any other element, of any sensor and of any one place."""
    base, observations, _, truth = hose
    start = [truth.theta[truth.index[p.name]] for p in base.parameters]
    bare = refine(base, (), observations, [start])
    gains = free_corrections.locate_mismatch(bare, observations).log_bayes_factors
    assert max(gains, key=gains.get) in ("segment 2, shunt", "segment 2, series")
    assert gains["source"] < gains["segment 2, shunt"]


@pytest.mark.parametrize(
    "shape, word",
    [
        (lambda w: 3e-11 + 0j * w, "leak"),
        (lambda w: 2e-14j * w, "compliance or"),
        (lambda w: 1e-12 * (1 + 1j) * np.sqrt(w), "boundary"),
        (lambda w: -1e-11 * (1 + 0.3j) + 0 * w, "not passive"),
        (lambda w: 1e-6 / (30.0 + 1j * (w * 0.1 - 4e6 / w)), "resonator"),
    ],
)
def test_laws_are_told_by_their_shape(shape, word):
    """Each textbook immittance with 5 % noise is called by its name."""
    f = np.linspace(150.0, 4000.0, 26)
    noise = 1 + 0.05 * np.random.default_rng(1).normal(size=26)
    assert word in missing_immittance.describe_law(f, shape(2 * np.pi * f) * noise)


def test_nothing_is_lost_by_an_explanation_that_is_right(hose):
    """A rival that is the accepted explanation itself loses nothing on any recording, and another
    loses something on every one."""
    base, observations, fit, _ = hose
    air = refine(base, AIR, observations, [np.zeros(len(base.with_(effects=AIR).parameters))])
    for _, rig, observation in next_experiment.candidate_recordings(fit.twin, observations)[::4]:
        assert next_experiment.expected_loss(fit, fit, rig, observation) < 1e-6
        assert next_experiment.expected_loss(fit, air, rig, observation) > 1e-3


def test_what_is_free_at_one_point_is_told_at_another():
    """Air and a slower wave are one thing at one pressure. A parameter that the data leave free
    can take up less at a new speed and pressure than at the old ones recorded again."""
    bench, observations, truth = make(np.random.default_rng(4), AIR, TRUTH, points=POINTS)
    base = Twin(bench, observations)
    air = refine(base, AIR, observations, [truth.theta])
    plain = refine(base, (), observations, [np.zeros(len(base.parameters))])
    proposal = next_experiment.propose_recording(air, [plain], observations)
    again = next_experiment.expected_loss(air, plain, bench, observations[0])
    assert proposal.loss > again
    assert next_experiment.propose_recording(air, [air], observations) is None


def test_gains_of_two_sensors_are_one_class():
    """Places of one effect with equal evidence are a class; another effect is none of it."""

    def fit(name, sensor, evidence):
        pair = (EFFECTS[name], Place(f"sensor {sensor}"))
        return SimpleNamespace(
            hypothesis=(pair,), names=(name,), evidence=evidence, without=lambda k: ()
        )

    best = fit("sensor_gain", "p1", 100.0)
    others = [fit("sensor_gain", "p2", 99.0), fit("sensor_delay", "p2", 10.0)]
    search = SimpleNamespace(best=best, rivals=[best, *others], other_positions=[])
    assert equivalent_places(search) == (("sensor_gain at sensor p1", "sensor_gain at sensor p2"),)
    assert rival_fits(search) == others[:1]


def test_stand_in_is_positive_real():
    """Wherever its parameters are drawn, a nameless network has no negative resistance, at any
    complex frequency of the right half-plane."""
    rng, network = np.random.default_rng(5), EFFECTS["passive_network"]
    bench, observations, _ = make(rng, points=POINTS)
    pair = ((network, Place("position", form="shunt")),)
    twin = Twin(bench, observations, effects=pair)
    for _ in range(20):
        at = twin.with_(theta=2.0 * rng.normal(size=len(twin.theta)))
        assert missing_immittance.is_passive(SimpleNamespace(twin=at))
