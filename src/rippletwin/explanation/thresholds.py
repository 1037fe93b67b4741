"""What evidence an effect must add, and how good a fit can be."""

from __future__ import annotations

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.posterior import MIN_MODEL_ERROR
from rippletwin.twin.effects.base import Effect

ACCEPT = 8.0
"""Log evidence that an effect must add. The largest that chance gave any effect of the library in
parametric bootstraps of no-effect cases with refitting is below it (docs/explain.md)."""

SURE = 2.0 * ACCEPT
"""Log evidence from which something is missing even where the line fits without and no explanation
holds on data left out."""

EQUIVALENT = 3.0  # two explanations closer than this cannot be told apart: twenty to one
CERTAIN = -3.0  # the same for an effect that no real line is without: twenty to one against it
GOOD = (
    1.25 * MIN_MODEL_ERROR
)  # relative model error at which a fit is as good as it can be believed


def needed(fit: Fit) -> float:
    """Log evidence that the newest effect of a fit must have added."""
    return needed_of(fit.hypothesis[-1][0])


def needed_of(effect: Effect) -> float:
    """Log evidence that an effect must add."""
    return CERTAIN if effect.certain else ACCEPT
