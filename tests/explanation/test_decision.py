"""The decision: from the support of effects and the alarms to a verdict."""

from dataclasses import replace

import numpy as np
import pytest

from made_fits import made_fit
from rippletwin.explanation.checks.alarms import Alarms
from rippletwin.explanation.checks.robustness import Robustness
from rippletwin.explanation.checks.support import Support, support_level
from rippletwin.explanation.localise.source_free_fits import compare_evidence
from rippletwin.explanation.search.stepwise_search import Search
from rippletwin.explanation.thresholds import (
    EQUIVALENT_LOG_BAYES_FACTOR,
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

MISFIT_RAISED = Alarms(50.0, (1.0, "diameter[1]"), (1.0, "length[1]"), (1.0, ""))
NO_ALARM = replace(MISFIT_RAISED, misfit=0.0)
OFF_SHEET = replace(NO_ALARM, pull=(5.0, "diameter[1]"))
HOSE = (EFFECTS["viscoelastic_wall"], Place("segment 1", 0))
VOLUME = (EFFECTS["line_volume"], Place("position"))
NETWORK = (EFFECTS["passive_network"], Place("position", form="shunt"))
ENOUGH, TOO_LITTLE = MIN_LOG_BAYES_FACTOR + 1.0, MIN_LOG_BAYES_FACTOR - 1.0


def support(level, name="viscoelastic_wall", place="segment 1"):
    """Of one effect at a level."""
    return Support(name, place, level, Robustness(50.0, 50.0, ("source", None), 50.0), 1.0, 0.0)


@pytest.mark.parametrize(
    ("plain", "least", "own", "held_out", "pull", "level"),
    [
        (ENOUGH, ENOUGH, 0.1, 0.1, 0.0, "established"),
        (TOO_LITTLE, ENOUGH, 0.1, 0.1, 0.0, "suggested"),  # a free data sheet does as well
        (ENOUGH, ENOUGH, 0.1, -0.1, 0.0, "suggested"),  # held-out data speak against it
        (ENOUGH, TOO_LITTLE, 0.1, 0.1, 0.0, "supported"),  # an error elsewhere does as well
        (ENOUGH, ENOUGH, -0.1, 0.1, 0.0, "supported"),  # its law is not what is there
        (ENOUGH, ENOUGH, 0.1, 0.1, 1.1 * PULL_ALARM, "supported"),  # it is implausible
    ],
)
def test_an_effect_is_established_if_it_passes_every_check(
    plain, least, own, held_out, pull, level
):
    """Each check alone lowers the level."""
    robustness = Robustness(plain, least, ("source", None), own)
    assert support_level(robustness, held_out, pull) == level


@pytest.mark.parametrize(
    ("level", "alarms", "verdict"),
    [
        ("established", NO_ALARM, "named"),
        ("established", MISFIT_RAISED, "named"),  # whatever remains
        ("supported", NO_ALARM, "unexplained"),
        ("suggested", MISFIT_RAISED, "unexplained"),
        ("suggested", NO_ALARM, "calibration_only"),  # its evidence is that of the data sheet
    ],
)
def test_only_what_is_established_is_named(level, alarms, verdict):
    """The twin takes the description of what is missing, named or not."""
    base, best = made_fit(0.0), made_fit(100.0, HOSE)
    decision = decide(Search(base, [best], best), alarms, [support(level)])
    assert decision.verdict == verdict
    assert decision.accepted is (base if verdict == "calibration_only" else best)


def test_a_spurious_companion_does_not_take_the_true_effect_with_it():
    """One effect is established and another is not: the verdict is named."""
    base, best = made_fit(0.0), made_fit(100.0, HOSE, VOLUME)
    supports = [support("established"), support("supported", "line_volume", "position")]
    decision = decide(Search(base, [best], best), MISFIT_RAISED, supports)
    assert decision.verdict == "named" and decision.established == ("viscoelastic_wall",)


@pytest.mark.parametrize(
    ("alarms", "verdict"),
    [(NO_ALARM, "consistent"), (OFF_SHEET, "calibration_only"), (MISFIT_RAISED, "unexplained")],
)
def test_without_an_effect_the_alarms_decide(alarms, verdict):
    """Nothing is accepted: the alarms say whether the line alone accounts for the data."""
    base = made_fit(0.0)
    assert decide(Search(base, [], base), alarms).verdict == verdict


@pytest.mark.parametrize("margin", [-1.0, 1.0])
def test_a_passive_network_stands_in_for_what_remains(margin):
    """A network beside the effects is the twin's where it adds enough evidence, and the established
    effect keeps its name."""
    base, best = made_fit(0.0), made_fit(100.0, HOSE, model_error=0.05)
    network = made_fit(100.0 + EQUIVALENT_LOG_BAYES_FACTOR + margin, HOSE, NETWORK)
    search = Search(base, [best], best, passive_networks=[network])
    decision = decide(search, MISFIT_RAISED, [support("established")])
    assert decision.verdict == "named"
    assert decision.accepted is (network if margin > 0 else best)


def test_a_network_alone_is_unexplained():
    """Something without a name accounts for what is missing."""
    base, network = made_fit(0.0, model_error=0.05), made_fit(100.0, NETWORK)
    search = Search(base, [], base, passive_networks=[network])
    decision = decide(search, MISFIT_RAISED)
    assert decision.verdict == "unexplained" and decision.accepted is network


def test_equivalent_effects_are_ambiguous():
    """Of two single effects with nearly the same evidence neither is named alone."""
    base, best, other = made_fit(0.0), made_fit(50.0, HOSE), made_fit(49.0, VOLUME)
    search = Search(base, [best, other], best, [best, other])
    assert equivalent_effects(search) == (("line_volume", "viscoelastic_wall"),)
    assert decide(search, NO_ALARM, [support("established")]).verdict == "ambiguous"
    far = replace(search, rivals=[best, made_fit(40.0, VOLUME)])
    assert decide(far, NO_ALARM, [support("established")]).verdict == "named"


def test_contradicting_data_end_in_bad_data_whatever_the_evidence():
    """A contradiction comes before everything else, and the base is what later stages use."""
    base, best = made_fit(0.0), made_fit(1000.0, HOSE)
    supports = [support("established")]
    decision = decide(Search(base, [best], best), NO_ALARM, supports, "p3 is dead")
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


def test_a_network_without_what_was_named_establishes_nothing():
    """Begun anew, the network explains more without the wall that was established beside another
    line. With the wall it keeps the name."""
    base, best = made_fit(0.0), made_fit(100.0, HOSE, model_error=0.05)
    for hypothesis, verdict in (((NETWORK,), "unexplained"), ((HOSE, NETWORK), "named")):
        network = made_fit(200.0, *hypothesis)
        search = Search(base, [best], best, passive_networks=[network])
        decision = decide(search, NO_ALARM, [support("established")])
        assert decision.verdict == verdict and decision.accepted is network
        assert bool(decision.supports) == (verdict == "named")
