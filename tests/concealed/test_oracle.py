"""Log evidence of the true effects, fitted from their true values."""

import numpy as np

from concealed.oracle import log_evidence_of_effects
from rippletwin.explanation.thresholds import MIN_LOG_BAYES_FACTOR
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from synthetic_observations import make


def test_the_oracle_finds_an_effect_only_in_data_that_hold_it():
    """A hose wall that changes the ripple has several times the log evidence of chance; where a
    line without it made the data, the same wall has less than chance. An effect that the library
    does not have has none."""
    hose = ((EFFECTS["viscoelastic_wall"], Place("segment 2", 1)),)
    strength = {"compliance_ratio": 0.2, "retardation_time": 3e-4}
    values = {f"viscoelastic_wall@segment 2.{name}": x for name, x in strength.items()}
    true = {"name": "viscoelastic_wall", "element": "segment 2", "position": None}
    log_evidence = []
    for effects in (hose, ()):
        rig, observations, twin = make(np.random.default_rng(1), effects, values)
        base, described = Twin(rig, observations), [true | {"parameters": strength}]
        log_evidence.append(log_evidence_of_effects(base, observations, described, twin.values()))
    assert log_evidence[0] > 5 * MIN_LOG_BAYES_FACTOR and log_evidence[1] < MIN_LOG_BAYES_FACTOR
    unknown = {"name": "resonator", "element": "position", "position": 1.0, "parameters": {}}
    assert log_evidence_of_effects(base, observations, [unknown], {}) is None
