"""The result of `explain`."""

from __future__ import annotations

from dataclasses import dataclass

from rippletwin.calibration.fit import Fit
from rippletwin.explanation.checks import alarms
from rippletwin.explanation.checks.bootstrap import NullDistribution
from rippletwin.explanation.checks.cross_validation import (
    Validation,
)
from rippletwin.explanation.checks.prior_sensitivity import (
    WithoutEffect,
)
from rippletwin.explanation.localise import free_corrections
from rippletwin.explanation.localise.shaft_orders import (
    ShaftOrders,
)
from rippletwin.explanation.search.stepwise_search import Search
from rippletwin.explanation.thresholds import ACCEPT
from rippletwin.explanation.verdict.decision import Judgement
from rippletwin.twin.twin import Twin


@dataclass(frozen=True)
class Explanation:
    """All that was found; `rippletwin.explanation.verdict.verdict_file` writes it down.

    observations are as fitted; single holds the base fitted to each of them alone, shaft what the
    shaft orders say that are no multiples of the pistons' number, blind the fits that know nothing
    of the source (`fits_to_compare`), located where the base lacks something,
    without what a free data sheet would make of the data without each accepted effect, chance the
    draws without an effect where they were asked for.
    """

    rig: object
    observations: tuple
    alarms: alarms.Alarms
    search: Search
    judgement: Judgement
    validation: Validation
    single: tuple[Fit, ...]
    shaft: ShaftOrders | None = None
    blind: tuple[Fit, ...] = ()
    located: free_corrections.Located | None = None
    without: tuple[WithoutEffect, ...] = ()
    chance: NullDistribution | None = None

    @property
    def threshold(self) -> float:
        """Log evidence that an effect must add to be named."""
        return ACCEPT if self.chance is None else max(ACCEPT, self.chance.threshold)

    @property
    def twin(self) -> Twin:
        """The corrected twin, which later stages use."""
        return self.judgement.accepted.twin
