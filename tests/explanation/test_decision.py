"""The decision: from fits and checks to a verdict."""

from dataclasses import replace

import numpy as np
import pytest

from made_fits import made_fit
from rippletwin.calibration.misfit import Score
from rippletwin.explanation.checks.alarms import Alarms
from rippletwin.explanation.checks.cross_validation import Validation
from rippletwin.explanation.localise.source_free_fits import compare_evidence
from rippletwin.explanation.search.stepwise_search import Search
from rippletwin.explanation.thresholds import (
    DECISIVE_LOG_BAYES_FACTOR,
    EQUIVALENT_LOG_BAYES_FACTOR,
    MAX_MODEL_ERROR_TO_NAME,
    MIN_LOG_BAYES_FACTOR,
    PULL_ALARM,
)
from rippletwin.explanation.verdict.decision import (
    decide,
    equivalent_effects,
    posterior_probabilities,
)
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS

MISFIT_RAISED = Alarms(0.03, (1.0, "diameter[1]"), (1.0, "length[1]"), (1.0, ""))
NO_ALARM = replace(MISFIT_RAISED, misfit=0.004)
HOSE = (EFFECTS["viscoelastic_wall"], Place("segment 1", 0))
VOLUME = (EFFECTS["line_volume"], Place("position"))
NETWORK = (EFFECTS["passive_network"], Place("position", form="shunt"))
STRONG, WEAK = DECISIVE_LOG_BAYES_FACTOR + 1, DECISIVE_LOG_BAYES_FACTOR - 1


def validation(held_out, disagreement=1.0, in_sample=0.01):
    """Of a misfit of 2 % both in sample and held out, `in_sample` and `held_out` are left."""
    before = {"in_sample": Score(0.02, 0.01), "held_out": Score(0.02, 0.01)}
    after = {
        "in_sample": Score(in_sample, 0.5 * in_sample),
        "held_out": Score(held_out, 0.5 * held_out),
    }
    return Validation(before, after, ("recording 1",), disagreement)


@pytest.mark.parametrize(
    ("evidence", "held_out", "disagreement", "alarms", "verdict"),
    [
        (WEAK, 0.01, 1.0, NO_ALARM, "named"),
        (WEAK, 0.03, 1.0, NO_ALARM, "consistent"),  # the line fits, held-out data contradict
        (STRONG, 0.03, 1.0, NO_ALARM, "consistent"),  # the same, whatever the evidence in sample
        (STRONG, 0.015, 9.0, NO_ALARM, "unexplained"),  # decisive evidence, but folds disagree
        (STRONG, 0.03, 1.0, MISFIT_RAISED, "unexplained"),  # the line alone does not fit either
    ],
)
def test_an_explanation_must_hold_on_held_out_data(
    evidence, held_out, disagreement, alarms, verdict
):
    """An explanation that fails cross-validation is never named."""
    base, best = made_fit(0.0), made_fit(evidence, HOSE)
    decision = decide(Search(base, [best], best), alarms, validation(held_out, disagreement))
    assert decision.verdict == verdict
    assert decision.accepted is (base if verdict == "consistent" else best)


@pytest.mark.parametrize(
    ("in_sample", "alarms", "verdict"),
    [
        (0.021, NO_ALARM, "calibration_only"),
        (0.019, NO_ALARM, "consistent"),  # it fits better in sample, but not held out
        (0.021, MISFIT_RAISED, "unexplained"),  # the line alone does not fit either
    ],
)
def test_evidence_without_a_better_fit_points_to_the_data_sheet(in_sample, alarms, verdict):
    """Decisive evidence that comes from the priors alone means that nominal values are off."""
    base, best = made_fit(0.0), made_fit(DECISIVE_LOG_BAYES_FACTOR + 10, HOSE)
    decision = decide(
        Search(base, [best], best), alarms, validation(held_out=0.03, in_sample=in_sample)
    )
    assert decision.verdict == verdict
    assert decision.accepted is (best if verdict == "unexplained" else base)


@pytest.mark.parametrize(
    ("model_error", "coordinate", "verdict"),
    [
        (0.9 * MAX_MODEL_ERROR_TO_NAME, 0.9 * PULL_ALARM, "named"),
        (1.1 * MAX_MODEL_ERROR_TO_NAME, 0.0, "unexplained"),
        (0.004, 1.1 * PULL_ALARM, "unexplained"),
    ],
)
def test_a_similar_effect_gets_no_name(model_error, coordinate, verdict):
    """Too large a model error or an implausible parameter prevents a name, whatever the evidence.

    The twin takes the description all the same."""
    base = made_fit(0.0)
    best = made_fit(1000.0, HOSE, model_error=model_error, coordinate=coordinate)
    decision = decide(Search(base, [best], best), MISFIT_RAISED, validation(0.001, in_sample=0.001))
    assert decision.verdict == verdict and decision.accepted is best


@pytest.mark.parametrize("margin", [-1.0, 1.0])
def test_a_passive_network_must_clearly_exceed_a_poor_named_fit(margin):
    """A network takes the place of a poor named fit only beyond the equivalence margin."""
    base, best = made_fit(0.0), made_fit(100.0, HOSE, model_error=0.007)
    network = made_fit(100.0 + EQUIVALENT_LOG_BAYES_FACTOR + margin, NETWORK)
    search = Search(base, [best], best, passive_networks=[network])
    decision = decide(search, MISFIT_RAISED, validation(0.001, in_sample=0.001))
    assert decision.verdict == ("unexplained" if margin > 0 else "named")
    assert decision.accepted is (network if margin > 0 else best)


def test_equivalent_effects_are_ambiguous():
    """Of two single effects with nearly the same evidence neither is named alone."""
    base, best, other = made_fit(0.0), made_fit(50.0, HOSE), made_fit(49.0, VOLUME)
    search = Search(base, [best, other], best, [best, other])
    assert equivalent_effects(search) == (("line_volume", "viscoelastic_wall"),)
    decision = decide(search, NO_ALARM, validation(0.001))
    assert decision.verdict == "ambiguous"
    far = replace(search, rivals=[best, made_fit(40.0, VOLUME)])
    assert decide(far, NO_ALARM, validation(0.001)).verdict == "named"


def test_contradicting_data_end_in_bad_data_whatever_the_evidence():
    """A contradiction comes before everything else, and the base is what later stages use."""
    base, best = made_fit(0.0), made_fit(1000.0, HOSE)
    decision = decide(Search(base, [best], best), NO_ALARM, validation(0.001), "p3 is dead")
    assert (decision.verdict, decision.contradiction) == ("bad_data", "p3 is dead")
    assert decision.accepted is base


def test_posterior_probabilities_follow_from_the_evidence():
    """By Bayes' theorem with equal priors: exp(evidence) over its sum."""
    base, hose, volume = made_fit(0.0), made_fit(2.0, HOSE), made_fit(1.0, VOLUME)
    search = Search(base, [hose, volume], hose)
    total = 1.0 + np.exp(2.0) + np.exp(1.0)
    (probability,) = posterior_probabilities(search, hose).values()
    assert probability == pytest.approx(np.exp(2.0) / total)
    assert MIN_LOG_BAYES_FACTOR > 2.0  # so much evidence is far from a name


def test_an_effect_without_a_source_free_fit_is_left_out():
    """An effect for which no steady state is found has evidence -inf, which JSON cannot hold."""
    base = made_fit(0.0)
    search = Search(base, [made_fit(9.0, HOSE), made_fit(5.0, VOLUME)], made_fit(9.0, HOSE))
    source_free = [base, made_fit(-np.inf, HOSE), made_fit(3.0, VOLUME)]
    (row,) = compare_evidence(search.leading_fits, source_free)
    assert (row["effects"], row["source_free"]) == ("line_volume, position", 3.0)
