"""Passive networks find series elements that no library has, whatever the search named before."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from made_fits import made_fit
from rippletwin.explanation import explain
from rippletwin.explanation.checks.profile_intervals import effect_intervals
from rippletwin.explanation.checks.support import Judged
from rippletwin.explanation.fit_jobs import FitJob, open_workers
from rippletwin.explanation.search.passive_networks import accepted_network, fit_passive_networks
from rippletwin.explanation.search.stepwise_search import Search
from rippletwin.explanation.stages.preparation import prepare_base
from rippletwin.explanation.verdict.verdict_file import _remainder
from rippletwin.line.frequency_domain.line_network import Insert
from rippletwin.twin.effects.base import Effect, Place, on_line, position_place
from rippletwin.twin.effects.library import EFFECTS
from synthetic_observations import POINTS, make

POSITION = 4.5  # m, of 8.8
INERTANCE, CONDUCTANCE = 6e5, 6e-12  # Pa s2/m3, m3/(Pa s)


def leaking_joint(network, state, values, place):
    x = on_line(network, POSITION)
    network.inserts.append(Insert(x, "series", network.s * INERTANCE))
    network.inserts.append(Insert(x, "shunt", CONDUCTANCE + 0.0 * network.s))


JOINT = Effect("joint", "position", "any", "", "", lambda r, p: (), position_place, leaking_joint)


def explanation_of(rig, data, best):
    """What the remainder of a verdict is made of: an explanation and its effects' intervals."""
    explanation = SimpleNamespace(
        rig=rig, observations=data, decision=SimpleNamespace(accepted=best), remainder=None,
        validation=SimpleNamespace(after={"in_sample": SimpleNamespace(misfit=0.01)}),
    )  # fmt: skip
    return explanation, effect_intervals(best)


def test_a_leaking_joint_is_an_inertance_with_a_shunt_beside_it():
    """An inertance and a leak at one place, of which the library has only the leak. The best fit
    before is a volume in a wrong place. The first network is a series element or a short narrow
    piece, which is one, within 5 % of the line's length of the truth, and what is left of the model
    error is below 1 %; the line alone has more than 10 %. The verdict tells every network."""
    rig, observations, _ = make(
        np.random.default_rng(2), ((JOINT, Place("position")),), points=POINTS[:1]
    )
    base, data = prepare_base(rig, observations)
    with open_workers(base, data, 1) as workers:
        alone, wrong = workers.fit(
            [FitJob(()), FitJob(((EFFECTS["line_volume"], Place("position")),))]
        )
        networks = fit_passive_networks(workers, wrong)
    best = networks[0]
    first = next(member for member in best.hypothesis if not member[0].named)
    assert alone.model_error > 0.1
    values = best.twin.values()
    assert first[1].form != "shunt"
    if first[1].form is None:
        assert values["passive_piece@position.diameter_ratio"] < 0.8
        assert values["passive_piece@position.length"] < 0.1
    assert values[f"{first[0].name}@{first[1]}.position"] == pytest.approx(
        POSITION, abs=0.05 * rig.length
    )
    assert best.model_error < 0.01
    stand_in = _remainder(*explanation_of(rig, data, best))["stand_in"]
    told = [stand_in["form"], *(one["form"] for one in stand_in["beside"])]
    assert told == [
        f"{place.form} one-port" if place.form else "short two-port"
        for effect, place in best.hypothesis
        if not effect.named
    ]
    assert all(one["passive"] for one in (stand_in, *stand_in["beside"]))


def hose(network, state, values, place):
    """A quarter of a metre of pipe with two thirds of the wave speed, cut out of the line."""
    ends = np.cumsum(network.lengths)
    edges = np.unique(np.r_[0.0, ends, POSITION - 0.125, POSITION + 0.125])
    middles = 0.5 * (edges[1:] + edges[:-1])
    index = np.searchsorted(ends, middles)
    inside = (np.abs(middles - POSITION) < 0.125)[:, None]
    network.series = network.series[index]
    network.shunt = network.shunt[index] * np.where(inside, 1.5**2, 1.0)
    network.lengths = np.diff(edges)


HOSE = Effect("hose", "position", "any", "", "", lambda r, p: (), position_place, hose)


def test_intervals_and_wiring_are_those_of_the_network_that_stands_in(monkeypatch):
    """The network that is accepted beside the volume, and the one that was begun anew without it,
    get interval ends, and the wiring of the sensors is tested against them; the search has each
    hypothesis once and accepts the network with the intervals."""
    volume, network = (
        (EFFECTS[name], Place("position")) for name in ("line_volume", "passive_piece")
    )
    base, best = made_fit(0.0), made_fit(100.0, volume, model_error=0.05)
    beside, anew = made_fit(120.0, volume, network), made_fit(130.0, network)
    judged, told = Judged(best, (), ()), []
    ends = {0: (-1.0, 1.0)}
    monkeypatch.setattr(explain, "judge_effects", lambda *_: judged)
    monkeypatch.setattr(explain, "judge_beside_network", lambda w, b, fit, j: (fit, j))
    monkeypatch.setattr(
        explain, "add_profile_intervals", lambda w, fit: replace(fit, interval_ends=ends)
    )
    monkeypatch.setattr(explain, "fit_gas_rivals", lambda *_: [])
    monkeypatch.setattr(explain, "find_swapped_sensors", lambda b, o, fit: told.append(fit) or "")
    workers = SimpleNamespace(base=None, observations=[])
    for fits in ([beside, anew], [anew, beside]):
        monkeypatch.setattr(explain, "fit_passive_networks", lambda *_: fits)  # noqa: B023
        search, _, wrong = explain._judge_explanation(workers, Search(base, [best], best), None)
        accepted = accepted_network(search)
        assert accepted.hypothesis == fits[0].hypothesis and accepted.interval_ends == ends
        assert search.passive_networks[1:] == fits[1:]
        assert told[-1] is accepted and wrong == ""


def test_a_piece_of_hose_is_found_with_its_delay_and_impedance():
    """Observations of a line into which a hose is cut, which no named effect and no one-port is.
    The best network is one piece, within 1 % of the line's length of the truth; the waves pass it
    as late as 3/8 m of the line and its impedance is 2/3 of the line's, both to 5 %: these are what
    reflections and phases determine. Less than 1 % is left of 10 % and more, and the verdict tells
    a softer pipe."""
    rig, observations, _ = make(
        np.random.default_rng(3), ((HOSE, Place("position")),), points=POINTS[:2]
    )
    base, data = prepare_base(rig, observations)
    with open_workers(base, data, 1) as workers:
        (alone,) = workers.fit([FitJob(())])
        best = fit_passive_networks(workers, alone)[0]
    assert alone.model_error > 0.1
    assert best.names == ("passive_piece",)
    value = {name.split(".")[-1]: x for name, x in best.twin.values().items()}
    assert value["position"] == pytest.approx(POSITION, abs=0.01 * rig.length)
    speed = value["wave_speed_ratio"]
    assert value["length"] / speed == pytest.approx(0.25 * 1.5, rel=0.05)
    assert speed / value["diameter_ratio"] ** 2 == pytest.approx(1 / 1.5, rel=0.05)
    assert best.model_error < 0.01
    remainder = _remainder(*explanation_of(rig, data, best))
    assert remainder["stand_in"]["form"] == "short two-port"
    assert "softer pipe" in remainder["law"]
