"""Gas or liquid in a volume on the line: two mean pressures tell, or a large ripple at one."""

import numpy as np
import pytest

from rippletwin.explanation.fit_jobs import FitJob, FromTheta, Workers
from rippletwin.explanation.search.gas_rivals import fit_gas_rivals
from rippletwin.explanation.search.stepwise_search import Search, applicable_candidates
from rippletwin.explanation.thresholds import EQUIVALENT_LOG_BAYES_FACTOR, MIN_LOG_BAYES_FACTOR
from rippletwin.explanation.verdict.decision import equivalent_effects
from rippletwin.explanation.verdict.next_experiment import propose_recording
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.parameters import coordinates
from rippletwin.twin.twin import Twin
from synthetic_observations import POINTS, make

GAS = (EFFECTS["gas_volume"], Place("position"))
LIQUID = (EFFECTS["line_volume"], Place("position"))
GAS_OF = {
    "gas_volume@position.position": 2.4,
    "gas_volume@position.gas_volume": 4e-7,
    "gas_volume@position.polytropic_exponent": 1.3,
}
LIQUID_OF = {"line_volume@position.position": 2.4, "line_volume@position.volume": 4e-5}


def fits(truth, values, points, **given):
    """Workers on data with one effect; fits with liquid and with gas, begun at the truth."""
    rng = np.random.default_rng(3)
    bench, observations, true = make(rng, (truth,), values, points=points, **given)
    workers = Workers(Twin(bench, observations), observations)
    jobs = []
    for pair in (LIQUID, GAS):
        twin = workers.base.with_(effects=(pair,))
        at = {f"{pair[0].name}@position.position": 2.4} | true.values()
        jobs.append(FitJob((pair,), FromTheta(coordinates(twin.parameters, at))))
    return workers, *workers.fit(jobs)


@pytest.mark.parametrize(("truth", "values"), [(GAS, GAS_OF), (LIQUID, LIQUID_OF)])
def test_mean_pressures_tell_gas_from_liquid(truth, values):
    """At 5 to 15 MPa the true one of the two has more evidence than the search asks for, and the
    search tries the gas."""
    workers, liquid, gas = fits(truth, values, POINTS)
    lead = gas.evidence - liquid.evidence
    assert (lead if truth is GAS else -lead) > MIN_LOG_BAYES_FACTOR
    assert GAS in applicable_candidates(workers.base.rig, workers.observations)
    assert fit_gas_rivals(workers, liquid) == []


def test_at_one_pressure_a_large_ripple_tells_gas_from_liquid():
    """True gas is fitted as a volume of liquid. Its rival, the gas, has more evidence than the
    search asks for, because crests meet a stiffer gas than troughs."""
    workers, liquid, _ = fits(GAS, GAS_OF, POINTS[:1])
    (rival,) = fit_gas_rivals(workers, liquid)
    assert rival.evidence - liquid.evidence > MIN_LOG_BAYES_FACTOR


def test_at_one_pressure_and_a_small_ripple_a_volume_may_be_gas():
    """True gas is found as a volume of liquid. Its rival is the gas, of the true size within 15 %,
    beside which nothing is better: both are told, and a recording at another pressure."""
    workers, liquid, _ = fits(GAS, GAS_OF, POINTS[:1], depth=0.02)
    assert GAS not in applicable_candidates(workers.base.rig, workers.observations)
    (rival,) = fit_gas_rivals(workers, liquid)
    assert rival.hypothesis == (GAS,)
    assert abs(rival.evidence - liquid.evidence) < EQUIVALENT_LOG_BAYES_FACTOR
    found = rival.twin.values()
    assert found["gas_volume@position.gas_volume"] == pytest.approx(4e-7, rel=0.15)
    assert found["gas_volume@position.position"] == pytest.approx(2.4, abs=0.03)
    search = Search(liquid, [liquid], liquid, [rival])
    assert equivalent_effects(search) == (("gas_volume", "line_volume"),)
    proposal = propose_recording(liquid, [rival], workers.observations)
    assert "bar" in proposal.recording or "MPa" in proposal.recording
    assert proposal.loss > EQUIVALENT_LOG_BAYES_FACTOR
