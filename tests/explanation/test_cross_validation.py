"""Cross-validation: the folds, and the scores before and after."""

import numpy as np

from rippletwin.calibration.misfit import Score
from rippletwin.explanation.checks import cross_validation
from rippletwin.explanation.checks.cross_validation import Validation
from rippletwin.explanation.fit_jobs import FitJob, PlainCalibration, Workers, job_from
from rippletwin.twin.twin import Twin
from synthetic_effects import TRUTH, VOLUME
from synthetic_observations import POINTS, make


def test_before_is_the_better_of_base_and_plain_calibration():
    """The in-sample misfit chooses between the two, and the held-out misfit is that of the same
    fit, even where the other's is smaller. Without a plain calibration it is the base."""
    base = {"in_sample": Score(1.26, 0.4), "held_out": Score(0.40, 0.2)}
    plain = {"in_sample": Score(0.47, 0.2), "held_out": Score(0.50, 0.3)}
    assert Validation(base, base, base, (), 0.0).without_effects == base
    assert Validation(base, base, base, (), 0.0, plain).without_effects == plain
    assert Validation(plain, base, base, (), 0.0, base).without_effects == plain


def test_plain_calibration_fits_better_than_the_base_where_physics_is_missing():
    """The data have a volume that no calibrated line has. The base leaves the large residuals to
    the source; the plain calibration reaches less than three quarters of its misfit, in sample. It
    is refitted in each fold with its own error model."""
    rig, observations, _ = make(np.random.default_rng(2), VOLUME, TRUTH, 2, POINTS[:2])
    workers = Workers(Twin(rig, observations), observations)
    base, calibrated = workers.fit([FitJob(()), FitJob((), PlainCalibration())])
    assert calibrated.plain and not base.plain
    checked = cross_validation.cross_validate(workers, base, base, None, calibrated)
    assert checked.without_effects is checked.calibrated
    assert checked.calibrated["in_sample"].misfit < 0.75 * checked.before["in_sample"].misfit
    fold = job_from(calibrated, observations=(0,))
    assert workers.fit([fold])[0].plain
