"""Laminar friction in the frequency domain from the time domain's sum of exponentials."""

from __future__ import annotations

import numpy as np

from rippletwin.line.time_domain.weighting_functions import FRICTION_RATES, FRICTION_WEIGHTS


def summed_friction(sigma: np.ndarray) -> np.ndarray:
    """sigma + 8 + 4 sum_k m_k sigma/(sigma + n_k): approximates `pipe_immittance.scaled_friction`.

    `sigma` = s R^2/nu, any shape; exact it would be sigma I0/I2.
    """
    sigma = np.asarray(sigma, dtype=complex)
    memory = np.sum(
        FRICTION_WEIGHTS * sigma[..., None] / (sigma[..., None] + FRICTION_RATES), axis=-1
    )
    return sigma + 8.0 + 4.0 * memory
