"""A passive end of a line by its reflection coefficient.

A causal and passive end reflects with R(s), |R| <= 1 in the right half-plane. In the variable

    zeta = (w0 - s)/(w0 + s)

the half-plane is the unit disc, and every rational R of degree K has Schur parameters g_0 ... g_K
in (-1, 1) (Schur 1917, J. reine angew. Math. 147:205):

    R_K = g_K,   R_k = (g_k + zeta R_{k+1})/(1 + g_k zeta R_{k+1}),   R = R_0.

No choice of them is active or acausal. All zero is an anechoic end; g_0 = 1 a closed one and
g_0 = -1 an open one, whatever the rest. g_k acts after a delay of about 2 k/w0: few of them are an
end whose memory is short.
"""

from __future__ import annotations

import numpy as np


def reflection_coefficient(s: np.ndarray, schur, rate: float) -> np.ndarray:
    """R (..., F) at `s` (F,), 1/s, for Schur parameters `schur`, a sequence of scalars or (..., 1).

    `rate` is w0 in 1/s.
    """
    zeta = (rate - s) / (rate + s)
    reflected = np.zeros_like(zeta)
    for g in reversed(schur):
        reflected = (g + zeta * reflected) / (1.0 + g * zeta * reflected)
    return reflected


def end_impedance(reflection: np.ndarray, characteristic) -> np.ndarray:
    """Z = Zc (1 + R)/(1 - R) of an end that reflects R (..., F); `characteristic` Zc, Pa s/m3."""
    return characteristic * (1.0 + reflection) / (1.0 - reflection)
