"""The decision: from the support of effects and the alarms to a verdict."""

from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from made_fits import made_fit
from rippletwin.explanation import explain
from rippletwin.explanation.checks.alarms import Alarms
from rippletwin.explanation.checks.bootstrap import NullDistribution
from rippletwin.explanation.checks.robustness import Robustness
from rippletwin.explanation.checks.support import Judged, Support, support_level
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
    equivalent_places,
    posterior_probabilities,
    rival_fits,
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


def test_evidence_within_the_null_distribution_is_none():
    """What cases without an effect reach as well names nothing, and the base is accepted; what
    exceeds all of them counts."""
    base, best = made_fit(0.0), made_fit(100.0, HOSE)
    search = Search(base, [best], best)
    for reached, verdict in ((200.0, "consistent"), (20.0, "named")):
        null = NullDistribution(tuple(np.linspace(0.0, 1.0, 20) * reached))
        decision = decide(search, NO_ALARM, [support("established")], null_distribution=null)
        assert decision.verdict == verdict
        assert decision.accepted is (best if verdict == "named" else base)


@pytest.mark.parametrize(
    ("alarms", "verdict"),
    [
        (replace(NO_ALARM, disagreement=(5.0, "length[1]")), "calibration_only"),
        (replace(NO_ALARM, drift=(1e-9, "healthy")), "unexplained"),
    ],
)
def test_points_that_disagree_and_halves_that_drift(alarms, verdict):
    """Another line at each point is a matter of calibration; a recording of two states is not."""
    base = made_fit(0.0)
    assert decide(Search(base, [], base), alarms).verdict == verdict


def test_a_suggestion_that_an_alarm_bears_out_stays_the_twins():
    """Nothing is established and something is missing: the twin takes what comes nearest."""
    base, best = made_fit(0.0), made_fit(100.0, HOSE)
    decision = decide(Search(base, [best], best), MISFIT_RAISED, [support("suggested")])
    assert decision.verdict == "unexplained" and decision.accepted is best
    assert [s.level for s in decision.supports] == ["suggested"]


ELSEWHERE = (EFFECTS["viscoelastic_wall"], Place("segment 2", 1))


def test_one_effect_at_two_places_is_no_ambiguity():
    """The hose is in either segment: it is named, and both places are told. The other fit is a
    rival, for which a next recording is sought."""
    base, best, other = made_fit(0.0), made_fit(50.0, HOSE), made_fit(49.0, ELSEWHERE)
    search = Search(base, [best, other], best, [best, other])
    assert equivalent_effects(search) == ()
    assert equivalent_places(search) == (
        ("viscoelastic_wall at segment 1", "viscoelastic_wall at segment 2"),
    )
    assert rival_fits(search) == [other]
    assert decide(search, NO_ALARM, [support("established")]).verdict == "named"


def test_no_other_place_is_told_of_another_effect():
    """A volume that fits as well is another effect, and has no part in the places of the hose."""
    base, best, other = made_fit(0.0), made_fit(50.0, HOSE), made_fit(49.0, VOLUME)
    assert equivalent_places(Search(base, [best, other], best, [best, other])) == ()


@pytest.mark.parametrize(
    ("rival", "counts"),
    [
        ((HOSE, VOLUME), False),  # it has the effect itself, and one more
        ((VOLUME, NETWORK), False),  # two in the place of one
        ((VOLUME,), True),
    ],
)
def test_a_substitute_replaces_one_effect_by_one(rival, counts):
    """Fits of as much evidence with other numbers of effects are no substitutes."""
    base, best, other = made_fit(0.0), made_fit(50.0, HOSE), made_fit(49.0, *rival)
    search = Search(base, [best, other], best, [best, other])
    assert bool(rival_fits(search)) == counts


@pytest.mark.parametrize(
    ("evidence", "counts"),
    [(50.0 - EQUIVALENT_LOG_BAYES_FACTOR, False), (50.1 - EQUIVALENT_LOG_BAYES_FACTOR, True)],
)
def test_a_substitute_is_closer_than_twenty_to_one(evidence, counts):
    base, best, other = made_fit(0.0), made_fit(50.0, HOSE), made_fit(evidence, VOLUME)
    search = Search(base, [best, other], best, [best, other])
    assert bool(rival_fits(search)) == counts


def test_an_effect_that_is_always_there_has_no_substitute():
    """Whatever else could do its work: it is known to be there."""
    radiation = (EFFECTS["end_radiation"], Place("load"))
    base, best, other = made_fit(0.0), made_fit(50.0, radiation), made_fit(49.0, VOLUME)
    assert rival_fits(Search(base, [best, other], best, [best, other])) == []


def test_other_positions_are_those_of_the_best_hypothesis():
    """A position found on the way, beside effects that were left again, is none of the answer's."""
    base, best = made_fit(0.0), made_fit(50.0, HOSE)
    same, left = made_fit(49.0, HOSE), made_fit(49.0, HOSE, VOLUME)
    search = Search(base, [best], best, other_positions=[same, left])
    assert rival_fits(search) == [same]


def test_another_position_that_the_best_fit_has_left_behind_is_no_rival():
    """The best fit has come to a better mode since the positions were searched."""
    base, best = made_fit(0.0), made_fit(50.0, HOSE)
    near = made_fit(50.1 - EQUIVALENT_LOG_BAYES_FACTOR, HOSE)
    far = made_fit(49.9 - EQUIVALENT_LOG_BAYES_FACTOR, HOSE)
    assert rival_fits(Search(base, [best], best, other_positions=[near, far])) == [near]


def test_a_hypothesis_in_two_orders_has_one_probability():
    """A hose and a volume were found from either side and fitted twice, less well last: they count
    once, by the better fit."""
    base, both = made_fit(0.0), made_fit(2.0, HOSE, VOLUME)
    search = Search(base, [], both, [made_fit(1.5, VOLUME, HOSE)])
    for accepted in (both, made_fit(1.0, HOSE, VOLUME)):
        found = posterior_probabilities(replace(search, rivals=[*search.rivals, both]), accepted)
        assert found["line_volume"] == pytest.approx(np.exp(2.0) / (1.0 + np.exp(2.0)))


def test_probabilities_of_much_evidence_are_numbers():
    """exp(evidence) overflows from 710 on. Evidence of 1e4 beside 1e4 - 1 has the probability of 1
    beside 0, and a hypothesis that was fitted twice counts once."""
    base, best, other = made_fit(0.0), made_fit(1e4, HOSE), made_fit(1e4 - 1.0, VOLUME)
    search = Search(base, [best, other], best, [best, best])
    probability = posterior_probabilities(search, best)["viscoelastic_wall"]
    assert probability == pytest.approx(1.0 / (1.0 + np.exp(-1.0)))


@pytest.mark.parametrize(
    ("alarms", "wiring", "verdict"),
    [
        (NO_ALARM, "", "calibration_only"),
        (MISFIT_RAISED, "", "unexplained"),
        (NO_ALARM, "p1 and p2 are exchanged", "bad_data"),
    ],
)
def test_the_scores_are_those_of_what_is_accepted(monkeypatch, alarms, wiring, verdict):
    """Where the explanation is rejected, as a suggestion or for wrong wiring, the line alone is
    accepted and cross-validated. A suggestion that is accepted keeps its scores."""
    base, best = made_fit(0.0), made_fit(100.0, HOSE)
    search = Search(base, [best], best)
    sheet, point = (SimpleNamespace(rivals=True),), SimpleNamespace(label="point 1")
    rig = SimpleNamespace(delay=0.01, load=SimpleNamespace(frequency_hz=None))
    stand_ins = {
        "prepare_stage": lambda *_: SimpleNamespace(base=None, observations=[point]),
        "search_in_stages": lambda stage, *_: (stage, search),
        "open_workers": lambda *_: nullcontext(SimpleNamespace(fit=lambda jobs: [None])),
        "_judge_explanation": lambda *_: (
            search,
            Judged(best, (support("suggested"),), ()),
            wiring,
        ),
        "fit_each_observation": lambda *_: [],
        "read_alarms": lambda *_: alarms,
        "refit_source_free": lambda *_: [],
        "cross_validate": lambda w, base, fit, *_: SimpleNamespace(of=fit, model_error=0.004),
        "compare_without_each_effect": lambda *_: sheet,
        "withhold_what_is_in_doubt": lambda judged, *_: judged,
        "add_sensor_tolerance": lambda fit, _: fit,
        "locate_mismatch": lambda *_: None,
        "find_remainder": lambda *_: None,
        "analyse_shaft_orders": lambda *_: None,
    }
    for name, stand_in in stand_ins.items():
        monkeypatch.setattr(explain, name, stand_in)
    found = explain.explain_observations(rig, [point])
    assert found.decision.verdict == verdict
    assert found.validation.of is found.decision.accepted
    assert found.decision.accepted is (best if verdict == "unexplained" else base)
