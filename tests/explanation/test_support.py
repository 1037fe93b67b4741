"""Which accepted effects remain, and how well each is supported: the rules on made evidence."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from made_fits import made_fit
from rippletwin.explanation.checks import support as rules
from rippletwin.explanation.checks.prior_sensitivity import WithoutEffect
from rippletwin.explanation.checks.robustness import Robustness, compare_beside_corrections
from rippletwin.explanation.checks.support import (
    Judged,
    Support,
    judge_beside_network,
    judge_beside_piece,
    judge_effects,
)
from rippletwin.explanation.localise.elements import NONE
from rippletwin.explanation.thresholds import (
    MAX_DISAGREEMENT,
    MIN_LOG_BAYES_FACTOR,
    MUCH_MODEL_ERROR,
    PULL_ALARM,
)
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.priors import lognormal, uniform

HOSE = (EFFECTS["viscoelastic_wall"], Place("segment 1", 0))
VOLUME = (EFFECTS["line_volume"], Place("position"))
LEAK = (EFFECTS["leak"], Place("position"))
CERTAIN = (EFFECTS["end_radiation"], Place("load"))
FRICTION = (EFFECTS["unsteady_friction"], Place("line"))
PIECE = (EFFECTS["passive_piece"], Place("position"))
NETWORK = (EFFECTS["passive_network"], Place("position", form="shunt"))
BASE = made_fit(0.0)
BARE = (NONE, None)


def made_support(member, level="established", plain=50.0):
    effect, place = member
    return Support(effect.name, str(place), level, Robustness(plain, plain, BARE, plain), 1.0, 0.0)


def without_each(workers, base, best):
    """The fits without each effect: no fit is run."""
    rests = [made_fit(1.0, *best.without(k)) for k in range(len(best.hypothesis))]
    return tuple(WithoutEffect(rest, rest, 0.1) for rest in rests)


# ---- robustness ----

PRESENT = {BARE: 100.0, ("segment", 1): 90.0, ("shunt", 2.0): 80.0, ("shunt", 2.25): 70.0}


def test_an_effect_is_compared_with_the_best_model_without_it():
    """Of two models without the effect the better one counts, element by element; one that only a
    single model has is compared with that; one that none has is left out."""
    absent = [{BARE: 50.0, ("segment", 1): 80.0}, {BARE: 60.0, ("shunt", 2.0): 65.0}]
    found = compare_beside_corrections(PRESENT, absent, ("segment", 1), spacing=0.1)
    assert (found.plain, found.own) == (40.0, 10.0)
    assert (found.element, found.least) == (("shunt", 2.0), 15.0)


@pytest.mark.parametrize(
    ("own", "spacing", "element", "least"),
    [
        (("shunt", 2.0), 0.1, ("shunt", 2.25), 60.0),  # 0.25 m away is another place
        (("shunt", 2.0), 0.25, ("shunt", 2.25), 60.0),  # as far as the spacing is, too
        (("shunt", 2.0), 0.26, ("segment", 1), 80.0),  # within it there is one place
        (("series", 2.0), 0.26, ("shunt", 2.25), 60.0),  # of another kind it never is
    ],
)
def test_an_effect_is_no_witness_against_itself(own, spacing, element, least):
    """Elements within the spacing of the effect's own, of its kind, are its own."""
    present = PRESENT | {own: PRESENT.get(own, 99.0)}
    absent = [dict.fromkeys(present, 10.0)]
    found = compare_beside_corrections(present, absent, own, spacing)
    assert (found.element, found.least) == (element, least)
    assert found.own == present[own] - 10.0


def test_a_segment_is_only_itself():
    """Numbers of segments are no positions: segment 2 is not within the spacing of segment 1."""
    present = {BARE: 50.0, ("segment", 1): 40.0, ("segment", 2): 30.0}
    found = compare_beside_corrections(
        present, [dict.fromkeys(present, 0.0)], ("segment", 1), spacing=5.0
    )
    assert (found.element, found.own) == (("segment", 2), 40.0)


# ---- effects that are only suggested ----


@pytest.fixture
def levels(monkeypatch):
    """Name -> (level, plain log Bayes factor) of the effects, as the checks would find."""
    table = {}

    def judge_each(workers, best, without, halves):
        return tuple(made_support(m, *table[m[0].name]) for m in best.hypothesis)

    monkeypatch.setattr(rules, "fit_without_each_effect", without_each)
    monkeypatch.setattr(rules, "_judge_each", judge_each)
    return table


def test_the_weakest_suggested_effect_is_dropped_first(levels, monkeypatch):
    """Of two suggested effects the one of less evidence goes; the other is judged again."""
    levels |= {
        "viscoelastic_wall": ("suggested", 9.0),
        "line_volume": ("suggested", 3.0),
        "leak": ("established", 1.0),
    }
    judge_each, judged_at = rules._judge_each, []

    def noted(workers, best, *rest):
        judged_at.append(best.names)
        return judge_each(workers, best, *rest)

    monkeypatch.setattr(rules, "_judge_each", noted)
    judged = judge_effects(None, BASE, made_fit(100.0, HOSE, VOLUME, LEAK))
    assert judged_at[:2] == [
        ("viscoelastic_wall", "line_volume", "leak"),
        ("viscoelastic_wall", "leak"),
    ]
    assert judged.best.names == ("leak",)
    assert [s.name for s in judged.supports] == ["leak"] and len(judged.without) == 1


def test_the_last_effect_stays(levels):
    """It says what comes nearest, though it is only suggested."""
    levels["viscoelastic_wall"] = ("suggested", 1.0)
    best = made_fit(100.0, HOSE)
    judged = judge_effects(None, BASE, best)
    assert judged.best is best and judged.supports[0].level == "suggested"


def test_an_effect_that_is_always_there_stays(levels):
    """Weak evidence takes no physics away that must be there; the other suggested effect goes."""
    levels |= {"end_radiation": ("suggested", 0.0), "viscoelastic_wall": ("suggested", 5.0)}
    judged = judge_effects(None, BASE, made_fit(100.0, CERTAIN, HOSE))
    assert judged.best.names == ("end_radiation",)


# ---- beside a piece of another pipe ----


def test_the_effects_beside_a_piece_keep_what_they_have_beside_it(levels):
    """The piece is in all models that are judged; the judgement is of the named effects alone, and
    its best fit has these alone."""
    levels |= {"line_volume": ("suggested", 3.0), "leak": ("established", 50.0)}
    levels["passive_piece"] = ("established", 90.0)
    judged = judge_beside_piece(None, BASE, made_fit(100.0, VOLUME, LEAK, PIECE))
    assert judged.best.names == ("leak",)
    assert [(s.name, s.level) for s in judged.supports] == [("leak", "established")]
    assert len(judged.without) == 1 and judged.without[0].stated.names == ()


def test_a_piece_that_is_only_suggested_takes_nothing_with_it(levels):
    """It is dropped as any effect, and the others are judged without it."""
    levels |= {"leak": ("established", 50.0), "passive_piece": ("suggested", 1.0)}
    judged = judge_beside_piece(None, BASE, made_fit(100.0, LEAK, PIECE))
    assert judged.best.names == ("leak",) and len(judged.supports) == 1


# ---- beside a network ----


def judged_of(*members, levels=None):
    best = made_fit(100.0, *members)
    levels = levels or ["established"] * len(members)
    supports = tuple(made_support(m, level) for m, level in zip(members, levels))
    return Judged(best, supports, without_each(None, BASE, best))


@pytest.fixture
def beside(monkeypatch):
    """Sorted names beside the network -> evidence of the network with these effects alone."""
    table = {}

    def fit_without_beside(workers, network, judged):
        rests = [judged.best.without(k) for k in range(len(judged.best.hypothesis))]
        return [
            made_fit(table[tuple(sorted(e.name for e, _ in rest))], *rest, NETWORK)
            for rest in rests
        ]

    monkeypatch.setattr(rules, "fit_without_each_effect", without_each)
    monkeypatch.setattr(rules, "_fit_without_beside", fit_without_beside)
    return table


def test_an_effect_that_the_network_makes_needless_is_dropped(beside):
    """With the network the line is better off without the volume; its support goes with it, and the
    hose keeps its own."""
    beside |= {("viscoelastic_wall",): 121.0, ("line_volume",): 60.0, (): 20.0}
    network = made_fit(120.0, HOSE, VOLUME, NETWORK)
    found, judged = judge_beside_network(None, BASE, network, judged_of(HOSE, VOLUME))
    assert found.evidence == 121.0 and found.names == ("viscoelastic_wall", "passive_network")
    assert judged.best.names == ("viscoelastic_wall",)
    assert [(s.name, s.level) for s in judged.supports] == [("viscoelastic_wall", "established")]


def test_the_first_of_two_effects_is_dropped_with_its_own_support(beside):
    """The support that goes is that of the effect that goes."""
    beside |= {("viscoelastic_wall",): 60.0, ("line_volume",): 121.0, (): 20.0}
    network = made_fit(120.0, HOSE, VOLUME, NETWORK)
    _, judged = judge_beside_network(None, BASE, network, judged_of(HOSE, VOLUME))
    assert [s.name for s in judged.supports] == ["line_volume"]


@pytest.mark.parametrize(
    ("gain", "before", "after"),
    [
        (MIN_LOG_BAYES_FACTOR, "established", "established"),
        (MIN_LOG_BAYES_FACTOR - 0.1, "established", "supported"),
        (0.0, "established", "supported"),  # no loss, no gain: it stays
        (0.0, "suggested", "suggested"),  # no level rises
    ],
)
def test_an_effect_keeps_its_level_if_it_keeps_its_evidence(beside, gain, before, after):
    """Beside the network an established effect must add what any effect must add."""
    beside[()] = 100.0 - gain
    network = made_fit(100.0, HOSE, NETWORK)
    found, judged = judge_beside_network(None, BASE, network, judged_of(HOSE, levels=[before]))
    assert found is network and judged.supports[0].level == after


def test_a_network_takes_nothing_away_that_is_always_there(beside):
    """Though the network is better off without it."""
    beside[()] = 500.0
    network = made_fit(100.0, CERTAIN, NETWORK)
    found, judged = judge_beside_network(None, BASE, network, judged_of(CERTAIN))
    assert found is network and judged.supports[0].level == "established"


def test_a_network_beside_no_effect_is_kept(beside):
    """There is nothing to leave out."""
    network = made_fit(100.0, NETWORK)
    found, judged = judge_beside_network(None, BASE, network, judged_of())
    assert found is network and judged.supports == ()


MUCH = MUCH_MODEL_ERROR


@pytest.mark.parametrize(
    ("left", "pull", "held_out", "rival", "hose"),
    [
        (MUCH, PULL_ALARM, MUCH, True, "established"),  # each at its limit
        (MUCH + 1e-9, 0.0, 0.0, False, "supported"),  # much is left: no matter who rivals
        (0.0, PULL_ALARM + 1e-9, 0.0, True, "supported"),
        (0.0, 0.0, MUCH + 1e-9, True, "supported"),
        (0.0, PULL_ALARM + 1e-9, MUCH + 1e-9, False, "established"),  # no data sheet does as well
    ],
)
def test_what_a_doubtful_line_establishes(monkeypatch, left, pull, held_out, rival, hose):
    """Where the explanation leaves much, the hose is no more than supported. Where a parameter
    contradicts the data sheet or held-out data leave much, it is if other values of the data sheet
    do nearly as well. Unsteady friction, which is in nearly every line, keeps its level."""
    monkeypatch.setattr(rules, "largest_pull", lambda fit: (pull, "viscosity"))
    judged = judged_of(HOSE, FRICTION)
    explanation = replace(judged.best, model_error=left)
    found = rules.withhold_what_is_in_doubt(judged, explanation, held_out, [rival, True])
    assert [support.level for support in found.supports] == [hose, "established"]


@pytest.mark.parametrize(("gain", "hose"), [(2.9, "established"), (3.1, "supported")])
def test_a_fit_that_did_not_converge_establishes_what_is_usual_alone(monkeypatch, gain, hose):
    """Where one more step promises more than 3 of log posterior, the fit is at no mode: the hose is
    no more than supported, unsteady friction keeps its level."""
    monkeypatch.setattr(rules, "largest_pull", lambda fit: (0.0, ""))
    judged = judged_of(HOSE, FRICTION)
    explanation = replace(judged.best, model_error=0.004, expected_gain=gain)
    found = rules.withhold_what_is_in_doubt(judged, explanation, 0.004, [False, False])
    assert [support.level for support in found.supports] == [hose, "established"]


def test_an_effect_must_be_plausible_in_the_explanation_too(monkeypatch):
    """A network that stands in moves the parameters of the effects: an effect, usual or not, whose
    own are not plausible then is no more than supported."""
    pulls = {
        "viscoelastic_wall@segment 1.": PULL_ALARM,
        "unsteady_friction@line.": PULL_ALARM + 0.1,
    }
    monkeypatch.setattr(rules, "_pull_of_effect", lambda fit, label: pulls[label])
    monkeypatch.setattr(rules, "largest_pull", lambda fit: (0.0, ""))
    judged = judged_of(HOSE, FRICTION)
    explanation = replace(judged.best, model_error=0.004)
    found = rules.withhold_what_is_in_doubt(judged, explanation, 0.004, [True, True])
    assert [support.level for support in found.supports] == ["established", "supported"]


def test_each_effect_is_left_out_in_two_ways(monkeypatch):
    """Beside the network, and beside one that begins anew without it: the better fit counts."""
    monkeypatch.setattr(rules, "job_without_effect", lambda fit, k, base: ("kept", k))
    monkeypatch.setattr(rules, "extension_job", lambda fit, member: ("anew", fit.names, member))
    asked = []

    def fit(jobs):
        asked.extend(jobs)
        return [made_fit(value) for value in (5.0, 6.0, 9.0, 2.0)]

    workers = SimpleNamespace(fit=fit, base=None)
    network = made_fit(100.0, HOSE, VOLUME, NETWORK)
    fits = rules._fit_without_beside(workers, network, judged_of(HOSE, VOLUME))
    assert asked == [
        ("kept", 0), ("kept", 1),
        ("anew", ("line_volume",), NETWORK), ("anew", ("viscoelastic_wall",), NETWORK),
    ]  # fmt: skip
    assert [f.evidence for f in fits] == [9.0, 6.0]


# ---- plausible values ----


def test_the_pull_is_that_of_the_effects_own_sizes():
    """Largest coordinate of the effect's parameters, either way; neither a position nor another
    effect's parameter counts."""
    parameters = (
        SimpleNamespace(name="leak@position.position", prior=uniform(0.0, 5.0)),
        SimpleNamespace(name="leak@position.conductance", prior=lognormal(1e-11, 1.0)),
        SimpleNamespace(name="leak@position.exponent", prior=lognormal(1.0, 1.0)),
        SimpleNamespace(name="line_volume@position.volume", prior=lognormal(1e-5, 1.0)),
    )
    twin = SimpleNamespace(parameters=parameters, theta=np.array([9.0, -3.0, 2.0, 8.0]))
    fit = replace(BASE, twin=twin)
    assert rules._pull_of_effect(fit, "leak@position.") == 3.0
    assert rules._pull_of_effect(fit, "side_branch@position.") == 0.0


@pytest.mark.parametrize(
    ("plain", "own", "pull", "held_out", "deviations", "level"),
    [
        # each at its limit
        (MIN_LOG_BAYES_FACTOR, 0.0, PULL_ALARM, 1e-9, MAX_DISAGREEMENT, "established"),
        # held-out data add nothing
        (MIN_LOG_BAYES_FACTOR, 0.0, PULL_ALARM, 0.0, MAX_DISAGREEMENT, "suggested"),
        (MIN_LOG_BAYES_FACTOR, -1e-9, PULL_ALARM, 1e-9, MAX_DISAGREEMENT, "supported"),
        (MIN_LOG_BAYES_FACTOR, 0.0, PULL_ALARM + 1e-9, 1e-9, MAX_DISAGREEMENT, "supported"),
        (MIN_LOG_BAYES_FACTOR, 0.0, PULL_ALARM, 1e-9, MAX_DISAGREEMENT + 1e-9, "supported"),
        (MIN_LOG_BAYES_FACTOR - 1e-9, 0.0, PULL_ALARM, 1e-9, MAX_DISAGREEMENT, "suggested"),
    ],
)
def test_levels_at_their_limits(plain, own, pull, held_out, deviations, level):
    """What just reaches a limit passes, but for held-out data, which must gain."""
    robustness = Robustness(plain, MIN_LOG_BAYES_FACTOR, BARE, own)
    assert rules.support_level(robustness, held_out, pull, deviations) == level


def test_held_out_gains_add_over_the_folds(monkeypatch):
    """Each effect's is the log probability with all effects less that without it, over all folds,
    of fits to each fold's own recordings. The fits with all effects are compared with the whole."""
    monkeypatch.setattr(rules, "_log_predictive", lambda fit, held_out: fit.evidence * held_out)
    asked = []

    def fit(jobs):
        asked.append([(job.observations, job.hypothesis) for job in jobs])
        return [made_fit(value) for value in (10.0, 7.0, 9.0)]

    workers = SimpleNamespace(fit=fit)
    folds = [
        SimpleNamespace(workers=workers, indices=(k,), held_out=share, left_out=f"recording {k}")
        for k, share in enumerate((1.0, 2.0))
    ]
    best = made_fit(100.0, HOSE, VOLUME)
    monkeypatch.setattr(
        rules,
        "find_disagreement",
        lambda whole, parts, label: (label, [(part.evidence, left) for part, left in parts]),
    )
    gains, disagreements = rules._check_on_folds(best, without_each(None, BASE, best), folds)
    assert gains == [9.0, 3.0]
    parts = [(10.0, "recording 0"), (10.0, "recording 1")]
    assert disagreements == [
        ("viscoelastic_wall@segment 1.", parts),
        ("line_volume@position.", parts),
    ]
    assert asked == [[((k,), (HOSE, VOLUME)), ((k,), (VOLUME,)), ((k,), (HOSE,))] for k in range(2)]


def test_every_element_is_tried_with_and_without_an_effect(monkeypatch):
    """Each element that any model without an effect was given, listed or promising, is given to the
    model with all effects too; a listed one with the least margin decides, whichever it is."""
    listed = [BARE, ("segment", 1), ("source", None), ("sensor", 0), ("load", None)]
    promising = ("shunt", 2.0)
    own = ("segment", 1)
    best = made_fit(100.0, HOSE)
    twin = SimpleNamespace(
        rig=None,
        theta=best.twin.theta,
        parameters=best.twin.parameters,
        effect_values=lambda theta: [(*HOSE, {})],
    )
    best = replace(best, twin=twin)
    absent = [dict.fromkeys([*listed, promising], 0.0)]
    replacements = {
        "make_folds": lambda workers, halves: [],
        "own_element": lambda *arguments: own,
        "elements_of": lambda *arguments: listed,
        "transfer_theta": lambda *arguments: None,
        "position_spacing": lambda *arguments: 0.1,
        "_check_on_folds": lambda *arguments: ([1.0], [None]),
    }
    for name, function in replacements.items():
        monkeypatch.setattr(rules, name, function)
    for weakest in [*listed[2:], promising]:

        def evaluate(function, jobs, weakest=weakest):
            if function is rules.evaluate_without:
                return [absent for _ in jobs]
            return [{e: 1.0 if e == weakest else 50.0 for e in tried} for _, tried in jobs]

        workers = SimpleNamespace(
            map=evaluate, base=None, observations=[SimpleNamespace(frequency_hz=np.ones(2))]
        )
        (found,) = rules._judge_each(workers, best, without_each(None, BASE, best), None)
        assert (found.robustness.element, found.robustness.least) == (weakest, 1.0)
        assert (found.name, found.place, found.level) == (
            "viscoelastic_wall",
            "segment 1",
            "supported",
        )
