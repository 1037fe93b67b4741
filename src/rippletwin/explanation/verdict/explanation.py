"""The result of `explain`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.ripple_correction import correct_ripple
from rippletwin.case.model import Rig
from rippletwin.explanation.checks.alarms import Alarms
from rippletwin.explanation.checks.bootstrap import NullDistribution
from rippletwin.explanation.checks.cross_validation import Validation
from rippletwin.explanation.checks.prior_sensitivity import PriorSensitivity
from rippletwin.explanation.localise.free_corrections import MismatchLocation
from rippletwin.explanation.localise.remainder import Remainder
from rippletwin.explanation.localise.shaft_orders import ShaftOrders
from rippletwin.explanation.search.stepwise_search import Search
from rippletwin.explanation.thresholds import MIN_LOG_BAYES_FACTOR
from rippletwin.explanation.verdict.decision import Decision
from rippletwin.spectra.corrected_ripple import CorrectedRipple
from rippletwin.twin.twin import Twin


@dataclass(frozen=True)
class Explanation:
    """Everything that was found; `verdict_file` writes it.

    observations       as fitted
    search             base, best explanation and rivals
    alarms             of the base fit
    validation         cross-validation of base, explanation and plain calibration
    decision           what the search decides; verdict.json also counts shaft orders
    source_free_fits   the leading fits of the search, with an unknown source
    prior_sensitivity  fits with wide priors without each accepted effect
    shaft_orders       ripple at orders that are no multiples of the number of pistons
    location           where the base lacks something; None where that cannot be said
    remainder          what the accepted fit leaves; None where it leaves nothing
    null_distribution  of the evidence without an effect, if it was asked for
    calibrated         plain calibration without effects; None where nothing is explained
    warnings           of the case, in plain words: what of the data sheet is unusual or missing
    """

    rig: Rig
    observations: tuple
    search: Search
    alarms: Alarms
    validation: Validation
    decision: Decision
    source_free_fits: tuple[Fit, ...] = ()
    prior_sensitivity: tuple[PriorSensitivity, ...] = ()
    shaft_orders: ShaftOrders | None = None
    location: MismatchLocation | None = None
    remainder: Remainder | None = None
    null_distribution: NullDistribution | None = None
    calibrated: Fit | None = None
    warnings: tuple[str, ...] = ()

    @property
    def without_effects(self) -> Fit:
        """The fit without effects whose scores are `validation.without_effects`."""
        if self.validation.without_effects is self.validation.before:
            return self.search.base
        return self.calibrated

    @property
    def min_log_bayes_factor(self) -> float:
        """Log evidence that an effect must add to be named."""
        if self.null_distribution is None:
            return MIN_LOG_BAYES_FACTOR
        return max(MIN_LOG_BAYES_FACTOR, self.null_distribution.threshold)

    @property
    def twin(self) -> Twin:
        """The corrected twin, which later stages use."""
        return self.decision.accepted.twin.with_(ripple=self.ripple)

    @cached_property
    def ripple(self) -> CorrectedRipple:
        """The pump's flow ripple as the accepted fit corrects it."""
        return correct_ripple(self.decision.accepted, self.observations)
