"""Thresholds that decide a verdict: evidence, misfit, parameters, folds and shaft orders.

Evidence is compared as a log Bayes factor: the difference of two log evidences (natural
logarithm). exp(3) is about 20.
"""

from __future__ import annotations

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.case.model import Rig
from rippletwin.twin.effects.base import Effect, Place

# Evidence

MIN_LOG_BAYES_FACTOR = 8.0
"""An effect is accepted if it adds at least this. In parametric bootstraps of cases without an
effect, with refitting, none does (tests/explanation/test_bootstrap.py)."""

EQUIVALENT_LOG_BAYES_FACTOR = 3.0  # two explanations closer than this are equivalent: 20 to 1

MIN_LOG_BAYES_FACTOR_ALWAYS_PRESENT = -3.0
"""The same for an effect that is always present: beside another effect it is accepted unless the
data are 20 to 1 against it. Alone it needs as much as any."""

FALSE_ALARM_RATE = 0.02  # of cases without an effect, for the threshold of a bootstrap

LITTLE_MODEL_ERROR = 0.004
"""Relative model error of a twin that lacks nothing which matters, where it is not estimated: the
speed wanders while harmonics are averaged, the orifice's exponent is not exactly 1/2, a mesh is
finite."""

GOOD_MODEL_ERROR = 1.25 * LITTLE_MODEL_ERROR
"""Relative model error up to which no effect can improve a fit noticeably. It saves work: beside
such a fit no network is tried. No name depends on it."""

GOOD_RIPPLE_ERROR = 0.05
"""Relative error of the nominal ripple up to which the same holds. A line that lacks an element
leaves to the pump what it cannot fit: with two sensors each harmonic has one equation more than the
pump has unknowns."""

MUCH_MODEL_ERROR = 0.05
"""Relative model error above which only a usual effect is established. The checks of an effect
allow for an error elsewhere to first order. Where physics is left out that makes more than a few
per cent, an effect that is not there may pass them."""


def leaves_nothing(fit: Fit) -> bool:
    """Whether a fit is as good as the data allow, in the readings and in the pump's ripple."""
    ripple_error = np.hypot(fit.source_sd, fit.smooth_sd)
    return bool(fit.model_error <= GOOD_MODEL_ERROR and ripple_error <= GOOD_RIPPLE_ERROR)


# Parameters and data of several recordings

PULL_ALARM = 4.0  # prior standard deviations between a parameter and the data sheet
DISAGREEMENT_ALARM = 4.0  # standard deviations between the fits of two operating points
MAX_DISAGREEMENT = 5.0
"""Standard deviations between the values of an effect's parameter from a part of the data and from
all data, up to which they count as the same. Physics that is there rarely has more, an accumulator
under the name of a volume has (docs/explanation/explain.md)."""
DRIFT_SIGNIFICANCE = 1e-3  # p-value that both halves of a recording are of one state
WIDE_PRIOR_ERROR_RATIO = 2.0
"""Between the accepted fit and a fit without an effect with wide priors. One whose misfit and model
error are less than this times the accepted ones is a rival; one that misfits less by this factor
refutes the effect."""

# Shaft orders that are no multiples of the number of pistons

MIN_SHAFT_ORDER_LEVEL = 0.01  # relative to the ripple; below it the orders have no name
SHAFT_ORDER_SIGNIFICANCE = 1e-6  # p-value that the orders are noise
MIN_COHERENT_SHARE = 0.5  # of the energy at shaft orders that one flow at the pump accounts for
MODULATION_SIGNIFICANCE = 0.02
"""Probability that pistons of independent deviations put as much of the energy into the pattern of
a modulation. It is the rate at which such a pump alone gets a speed fluctuation."""


def min_log_bayes_factor(rig: Rig, effect: Effect, place: Place) -> float:
    """Log evidence that an effect must add to be accepted beside another."""
    certain = effect.certain(rig, place)
    return MIN_LOG_BAYES_FACTOR_ALWAYS_PRESENT if certain else MIN_LOG_BAYES_FACTOR


def min_log_bayes_factor_of_newest(fit: Fit) -> float:
    """The same of the newest effect of a fit."""
    return min_log_bayes_factor(fit.twin.rig, *fit.hypothesis[-1])


def surplus_evidence(fit: Fit) -> float:
    """Log evidence of a fit beyond what each of its effects must add."""
    rig = fit.twin.rig
    return fit.evidence - sum(min_log_bayes_factor(rig, *member) for member in fit.hypothesis)
