"""Two effects at once: which pairs promise most, and that the true one is found."""

import numpy as np
import pytest

from rippletwin.explanation.fit_jobs import FitJob, Workers
from rippletwin.explanation.search.effect_pairs import (
    MIN_PAIR_PROMISE,
    PAIRS_FITTED,
    PAIRS_OF_ONE,
    Start,
    _most_promising,
    _promise,
    fit_best_pairs,
)
from rippletwin.explanation.thresholds import MIN_LOG_BAYES_FACTOR
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from synthetic_observations import make

VOLUME = (EFFECTS["line_volume"], Place("position"))
HOSE = (EFFECTS["viscoelastic_wall"], Place("segment 2", 1))
GAINS = [(EFFECTS["sensor_gain"], Place(f"sensor p{k}", k - 1)) for k in (1, 2)]
DELAYS = [(EFFECTS["sensor_delay"], Place(f"sensor p{k}", k - 1)) for k in (1, 2)]


def start(member, columns, residual):
    """A start that can change the readings along `columns` (N, D)."""
    directions = np.linalg.qr(columns)[0]
    return Start(member, np.zeros(1), directions, directions.T @ residual)


def test_a_promise_is_what_least_squares_leave_less_with_both_effects():
    """Proves the promise of a pair against a fit of all directions at once, also where the two have
    a direction in common."""
    rng = np.random.default_rng(3)
    residual, one, other = rng.normal(size=40), rng.normal(size=(40, 2)), rng.normal(size=(40, 3))
    for second in (other, np.column_stack([other, one[:, 0]])):
        both = np.column_stack([one, second])
        left = residual - both @ np.linalg.lstsq(both, residual, rcond=None)[0]
        expected = 0.5 * (residual @ residual - left @ left)
        pair = (start(member, x, residual) for member, x in ((HOSE, one), (VOLUME, second)))
        assert _promise(*pair) == pytest.approx(expected, rel=1e-9)


def test_no_pair_is_fitted_twice_and_no_effect_in_all_pairs():
    """Proves that one effect that promises much does not keep out the pairs without it, that a pair
    is begun from its best starts, and that one of no promise is left out."""
    rng = np.random.default_rng(4)
    basis = np.linalg.qr(rng.normal(size=(30, 8)))[0]
    residual = basis @ [20.0, 6.0, 5.0, 4.0, 3.9, 3.8, 0.1, 0.1]
    members = [HOSE, VOLUME, *GAINS, *DELAYS]
    starts = [start(m, basis[:, [k]], residual) for k, m in enumerate(members)]
    starts.append(start(VOLUME, basis[:, [6]], residual))
    pairs = _most_promising(starts)
    names = [frozenset(each.member for each in pair) for pair in pairs]
    assert names[0] == {HOSE, VOLUME} and pairs[0] == (starts[0], starts[1])
    assert len(set(names)) == len(names) <= PAIRS_FITTED
    assert max(sum(m in pair for pair in names) for m in members) == PAIRS_OF_ONE
    assert any(HOSE not in pair for pair in names)
    assert all(_promise(*pair) >= MIN_PAIR_PROMISE for pair in pairs)
    weak = [start(m, basis[:, [6 + k]], residual) for k, m in enumerate(GAINS)]
    assert _most_promising(weak) == []


def test_the_true_pair_is_found_among_all():
    """Proves on recordings of a line with a gain of one sensor and a delay of the other that the
    first pair is the true one, with its sizes, and holds the evidence that both must have."""
    true = (GAINS[1], DELAYS[0])
    values = {"sensor_gain@sensor p2.gain_error": 0.06, "sensor_delay@sensor p1.delay": 3e-5}
    bench, observations, _ = make(np.random.default_rng(11), true, values)
    workers = Workers(Twin(bench, observations), observations)
    (base,) = workers.fit([FitJob(())])
    found = fit_best_pairs(workers, base, [HOSE, VOLUME, *GAINS, *DELAYS])
    assert len(found) > 1
    assert found[0].evidence > base.evidence + 2.0 * MIN_LOG_BAYES_FACTOR
    assert {effect.name for effect, _ in found[0].hypothesis} == {"sensor_gain", "sensor_delay"}
    fitted = found[0].twin.values()
    size = {name.split("@")[0]: abs(x) for name, x in fitted.items() if "@" in name}
    assert size["sensor_gain"] == pytest.approx(0.06, rel=0.15)
    assert size["sensor_delay"] == pytest.approx(3e-5, rel=0.15)
