"""Cross-validation: the folds, and the scores before and after."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rippletwin.calibration.misfit import Score
from rippletwin.errors import InputError
from rippletwin.explanation.checks import cross_validation
from rippletwin.explanation.checks.cross_validation import Validation, find_disagreement, make_folds
from rippletwin.explanation.fit_jobs import (
    FitJob,
    FromTheta,
    PlainCalibration,
    Workers,
    job_from,
)
from rippletwin.explanation.thresholds import MAX_DISAGREEMENT
from rippletwin.spectra.frequency_selection import select_frequencies
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from synthetic_effects import TRUTH, VOLUME
from synthetic_observations import POINTS, make


def test_before_is_the_better_of_base_and_plain_calibration():
    """The in-sample misfit chooses between the two, and the held-out misfit is that of the same
    fit, even where the other's is smaller. Without a plain calibration it is the base."""
    base = {"in_sample": Score(1.26, 0.4), "held_out": Score(0.40, 0.2)}
    plain = {"in_sample": Score(0.47, 0.2), "held_out": Score(0.50, 0.3)}
    assert Validation(base, base, base, (), 0.0, 0.0).without_effects == base
    assert Validation(base, base, base, (), 0.0, 0.0, plain).without_effects == plain
    assert Validation(plain, base, base, (), 0.0, 0.0, base).without_effects == plain


def test_plain_calibration_fits_better_than_the_base_where_physics_is_missing():
    """The data have a volume that no calibrated line has. The base leaves the large residuals to
    the source; the plain calibration reaches less than three quarters of its misfit, in sample. It
    is refitted in each fold with its own error model. A fit that is scored alone on what was left
    out has the score of an explanation, not that with the nominal ripple."""
    rig, observations, _ = make(np.random.default_rng(2), VOLUME, TRUTH, 2, POINTS[:2])
    workers = Workers(Twin(rig, observations), observations)
    base, calibrated = workers.fit([FitJob(()), FitJob((), PlainCalibration())])
    assert calibrated.plain and not base.plain
    checked = cross_validation.cross_validate(workers, base, base, None, calibrated)
    assert checked.without_effects is checked.calibrated
    assert checked.calibrated["in_sample"].misfit < 0.75 * checked.before["in_sample"].misfit
    alone = cross_validation.score_held_out(workers, base)
    assert alone == checked.after["held_out"] != checked.nominal_ripple["held_out"]
    fold = job_from(calibrated, observations=(0,))
    assert workers.fit([fold])[0].plain


def _fit(values, variances):
    """A fit whose parameters have these coordinates, which are their values, and variances."""
    names = list(values)
    twin = SimpleNamespace(
        parameters=[SimpleNamespace(name=name) for name in names],
        index={name: k for k, name in enumerate(names)},
        theta=np.array(list(values.values())),
        values=lambda: values,
    )
    return SimpleNamespace(twin=twin, covariance=np.diag(variances))


def test_a_disagreement_is_in_standard_deviations_of_the_difference():
    """The data of a part are among those of the whole, so the variance of their difference is the
    part's less the whole's. The largest of an effect's parameters is told with its two values and
    what the part leaves out. A number of the line, another effect, and what a part hardly
    determines are not compared."""
    leak, volume = "leak@position.conductance", "line_volume@position.volume"
    whole = _fit({"length[1]": 0.0, leak: 1.0, volume: 2.0}, [0.01, 0.03, 0.01])
    near = _fit({volume: 2.1, leak: 1.3, "length[1]": 9.0}, [0.02, 0.12, 0.02])
    far = _fit({volume: 2.6, leak: 0.4, "length[1]": 9.0}, [0.6, 0.12, 0.02])
    parts = [(near, "recording 1"), (far, "recording 2")]
    of_leak = find_disagreement(whole, parts, "leak@position.")
    assert of_leak.deviations == pytest.approx(0.6 / np.sqrt(0.12 - 0.03 + 1e-4))
    assert (of_leak.parameter, of_leak.whole, of_leak.part) == (leak, 1.0, 0.4)
    assert of_leak.left_out == "recording 2"
    of_volume = find_disagreement(whole, parts, "line_volume@position.")
    assert of_volume.deviations == pytest.approx(0.1 / np.sqrt(0.01 + 1e-4))
    assert find_disagreement(whole, parts) == of_leak
    assert find_disagreement(whole, parts, "side_branch@position.") is None


def _pressed(network, state, values, place):
    """A volume of gas, which has the compliance of VOLUME at 9.5 MPa: it falls with pressure."""
    effect = EFFECTS["line_volume"]
    scaled = values | {"volume": values["volume"] * 9.5e6 / state.mean_pressure}
    effect.apply(network, state, scaled, place)


@pytest.mark.parametrize("gas", [False, True])
def test_a_gas_is_no_volume_of_oil(gas):
    """Explained as a volume of oil, which has one compliance at all pressures, a gas gets another
    volume from either of two recordings, and they disagree by more than errors allow; a volume of
    oil gets the same. The gas is made by the law of ideal gases, which no effect has."""
    (volume, place), points = VOLUME[0], ((1000, 9.5e6), (1200, 15e6))
    made = ((replace(volume, apply=_pressed) if gas else volume, place),)
    rig, observations, truth = make(np.random.default_rng(3), made, TRUTH, 2, points)
    workers = Workers(Twin(rig, observations), observations)
    (whole,) = workers.fit([FitJob(VOLUME, FromTheta(truth.theta))])
    parts = [
        (workers.fit([FitJob(VOLUME, FromTheta(whole.twin.theta), observations=(k,))])[0], str(k))
        for k in range(2)
    ]
    found = find_disagreement(whole, parts, "line_volume@")
    assert (found.deviations > MAX_DISAGREEMENT) == gas


@pytest.mark.parametrize("count", [2, 3, 4, 5, 9])
def test_folds_of_few_frequencies_leave_some_to_fit(count):
    """Each frequency is held out by one of the two folds and fitted by the other."""
    _, (observation, *_), _ = make(np.random.default_rng(2), points=POINTS[:1])
    few = select_frequencies(observation, slice(count))
    held_out = []
    for fold in make_folds(Workers(None, [few])):
        ((fitted,), (left,)) = fold.fitted, fold.held_out
        assert len(fitted.frequency_hz) and len(left.frequency_hz)
        held_out += list(left.frequency_hz)
    assert sorted(held_out) == list(few.frequency_hz)


def test_a_single_frequency_is_refused():
    """Nothing can be held out of it."""
    _, (observation, *_), _ = make(np.random.default_rng(2), points=POINTS[:1])
    with pytest.raises(InputError, match="one frequency"):
        make_folds(Workers(None, [select_frequencies(observation, slice(1))]))


def test_a_fold_of_a_spectrum_says_which_eighths_it_leaves_out():
    """Counted from 1: the first fold leaves out the second eighth, which holds none of the lowest
    frequencies, and so on; the second fold leaves out the first."""
    _, (observation, *_), _ = make(np.random.default_rng(2), points=POINTS[:1])
    first, second = make_folds(Workers(None, [observation]))
    lowest = observation.frequency_hz[0]
    assert first.left_out == "even eighths of the band"
    assert lowest not in first.held_out[0].frequency_hz
    assert second.left_out == "odd eighths of the band"
    assert lowest in second.held_out[0].frequency_hz
