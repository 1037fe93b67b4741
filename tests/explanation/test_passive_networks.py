"""Passive networks find series elements that no library has, whatever the search named before."""

from types import SimpleNamespace

import numpy as np
import pytest

from rippletwin.explanation.checks.profile_intervals import effect_intervals
from rippletwin.explanation.explain import prepare_base
from rippletwin.explanation.fit_jobs import FitJob, open_workers
from rippletwin.explanation.search.passive_networks import fit_passive_networks
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


def test_a_leaking_joint_is_a_series_network_with_a_shunt_beside_it():
    """An inertance and a leak at one place, of which the library has only the leak. The best fit
    before is a volume in a wrong place. The first network is a series element within 5 % of the
    line's length of the truth, and what is left of the model error is below 1 %; the line alone
    has more than 10 %. The verdict tells every network."""
    rig, observations, _ = make(
        np.random.default_rng(2), ((JOINT, Place("position")),), points=POINTS[:2]
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
    assert first[1].form == "series"
    position = best.twin.values()[f"passive_network@{first[1]}.position"]
    assert position == pytest.approx(POSITION, abs=0.05 * rig.length)
    assert best.model_error < 0.01
    explanation = SimpleNamespace(
        rig=rig, observations=data, decision=SimpleNamespace(accepted=best), remainder=None,
        validation=SimpleNamespace(after={"in_sample": SimpleNamespace(misfit=0.01)}),
    )  # fmt: skip
    stand_in = _remainder(explanation, effect_intervals(best))["stand_in"]
    told = [stand_in["form"], *(one["form"] for one in stand_in["beside"])]
    assert told == [
        f"{place.form} one-port" for effect, place in best.hypothesis if not effect.named
    ]
    assert all(one["passive"] for one in (stand_in, *stand_in["beside"]))
