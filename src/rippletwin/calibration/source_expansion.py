"""The most likely smooth error of nominal sources, given what the sensors read.

The factor of a source is not linear in its error (`smooth_source`), so the mode is found by
Gauss-Newton steps. The independent error is a share of the source as its smooth error leaves it;
its size is held within a step and follows after it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from rippletwin.calibration.smooth_source import SmoothSourceError, SourceExpansion
from rippletwin.calibration.source_expansion_kernel import find_amplitudes
from rippletwin.calibration.whitening import Whitening


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
    smooth = data.smooth
    amplitudes = find_amplitudes(
        data.values,
        data.prediction,
        data.sd,
        data.independent,
        smooth.frequencies,
        smooth.basis,
        smooth.sds(data.tau),
        start.amplitudes,
        steps,
    )
    return smooth.expand(amplitudes)


def whiten_with_source(data: SourceData, expansion: SourceExpansion) -> Whitening:
    """Whitening of the readings by all errors, the smooth one to first order."""
    return Whitening(
        data.prediction * expansion.factor,
        data.sd,
        data.independent,
        data.smooth.frequencies,
        data.smooth.sds(data.tau)[:, None] * data.smooth.basis,
    )
