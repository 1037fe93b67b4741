"""A fit begun from the true effects: what log evidence they add, and what it predicts."""

import numpy as np
import pytest

from concealed.oracle import add_nuisance, fit_effects, held_out_misfit, log_evidence_of
from rippletwin.explanation.fit_jobs import FitJob, Workers
from rippletwin.explanation.thresholds import MIN_LOG_BAYES_FACTOR
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from synthetic_observations import make

HOSE = ((EFFECTS["viscoelastic_wall"], Place("segment 2", 1)),)
STRENGTH = {"compliance_ratio": 0.2, "retardation_time": 3e-4}
VALUES = {f"viscoelastic_wall@segment 2.{name}": x for name, x in STRENGTH.items()}
TRUE = {
    "name": "viscoelastic_wall", "element": "segment 2", "position": None, "parameters": STRENGTH,
}  # fmt: skip


def recorded(effects):
    """Workers on data of a line with `effects`, and the true line's values."""
    rig, observations, twin = make(np.random.default_rng(1), effects, VALUES)
    return Workers(Twin(rig, observations), observations), twin.values()


def test_the_oracle_finds_an_effect_only_in_data_that_hold_it():
    """A hose wall that changes the ripple has several times the log evidence of chance; where a
    line without it made the data, the same wall has less than chance. An effect that the library
    does not have has no fit."""
    log_evidence = []
    for effects in (HOSE, ()):
        workers, line = recorded(effects)
        log_evidence.append(log_evidence_of(workers, fit_effects(workers, [TRUE], line)))
    assert log_evidence[0] > 5 * MIN_LOG_BAYES_FACTOR and log_evidence[1] < MIN_LOG_BAYES_FACTOR
    unknown = {"name": "resonator", "element": "position", "position": 1.0, "parameters": {}}
    assert fit_effects(workers, [unknown], {}) is None


def test_the_fit_from_the_truth_predicts_what_was_left_out():
    """Data of a line with a hose wall: the fit begun from it misfits held-out data much less than
    the line without it. Known of as nuisance, without numbers, it is found as well."""
    workers, line = recorded(HOSE)
    (without,) = workers.fit([FitJob(())])
    unstated = TRUE | {"parameters": {}}
    missed, told, found = (
        held_out_misfit(workers, fit, [], [])
        for fit in (
            without,
            fit_effects(workers, [TRUE], line),
            add_nuisance(workers, without, [unstated]),
        )
    )
    assert told < 0.5 * missed
    assert found == pytest.approx(told, rel=0.05)
