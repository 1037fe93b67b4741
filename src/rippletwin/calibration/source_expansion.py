"""The most likely smooth error of nominal sources, given what the sensors read.

The factor of a source is not linear in its error (`smooth_source`), so the mode is found by
Gauss-Newton steps. The independent error is a share of the source as its smooth error leaves it;
its size is held within a step and follows after it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rippletwin.calibration.smooth_source import SmoothSourceError, SourceExpansion
from rippletwin.calibration.whitening import Whitening

STEP_SHARES = (1.0, 0.5, 0.25, 0.1)
SETTLED = 0.1  # gain of a step in log posterior, below which it is the last


class SourceData(NamedTuple):
    """Readings and what they are compared with, in a basis in which the noise is diagonal.

    values, prediction   (S, F) complex, the prediction with the nominal source
    sd                   (S, F) standard deviations of what is independent between sensors
    independent          (F,) relative error of the source that is independent between frequencies
    smooth, tau          its smooth error and the standard deviation of that
    """

    values: np.ndarray
    prediction: np.ndarray
    sd: np.ndarray
    independent: np.ndarray
    smooth: SmoothSourceError
    tau: float


def find_most_likely_expansion(
    data: SourceData, start: SourceExpansion, steps: int
) -> SourceExpansion:
    """The expansion about the most likely smooth error after at most `steps` steps."""
    here = start
    for _ in range(steps):
        h = data.prediction * here.factor
        whitening = whiten_with_source(data, here)
        r = data.values - data.prediction * here.mean
        step = data.smooth.most_likely(whitening.pull(h, r), data.tau) - here.amplitudes
        alone = Whitening(h, data.sd, data.independent)
        cost = _cost(data, alone, here)
        for share in STEP_SHARES:
            there = data.smooth.expand(here.amplitudes + share * step)
            gain = cost - _cost(data, alone, there)
            if gain > 0.0:
                break
        else:
            return here
        here = there
        if gain < SETTLED:
            return here
    return here


def whiten_with_source(data: SourceData, expansion: SourceExpansion) -> Whitening:
    """Whitening of the readings by all errors, the smooth one to first order."""
    return Whitening(
        data.prediction * expansion.factor,
        data.sd,
        data.independent,
        data.smooth.frequencies,
        data.smooth.sds(data.tau)[:, None] * data.smooth.basis,
    )


def _cost(data: SourceData, alone: Whitening, expansion: SourceExpansion) -> float:
    """Minus the log posterior of a smooth error but for a constant, the covariance of all else
    being that of `alone`; infinite where it is not finite."""
    error = data.smooth.error(expansion.amplitudes)
    source = expansion.mean + expansion.factor * error
    r = alone.apply(data.values - data.prediction * source)
    prior = expansion.amplitudes / data.smooth.sds(data.tau)
    cost = float(np.sum(np.abs(r) ** 2) + np.sum(np.abs(prior) ** 2))
    return cost if np.isfinite(cost) else np.inf
