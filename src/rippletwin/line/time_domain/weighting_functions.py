"""Boundary layers as sums of exponentials, for the time domain: friction, and heat in a gas.

Zielke's weighting function W (1968, J. Basic Eng. 90, 109, eq. 13) enters the friction as

    F = (8 nu/R^2) q + (4 nu/R^2) int W(t - t') dq/dt' dt',     W(tau) = sum_k m_k exp(-n_k tau),

tau = nu t/R^2, which a recursion follows (Trikha 1975, J. Fluids Eng. 97, 97). The weights are
fitted in the frequency domain, to the impedance that shapes the ripple: a sum that is close in
W(tau) may still be percents off in it.

Heat conduction to the wall of a gas-filled tube makes Y' larger by the factor (Tijdeman 1975,
J. Sound Vib. 39, 1, eq. 32)

    gamma - (gamma - 1) I2(r)/I0(r) = 1 + (gamma - 1) sum_n 4/(r^2 + j_n^2),   r^2 = s R^2 Pr/nu,

j_n the zeros of J0: an infinite sum of retarded compliances. Ten positive ones, hence passive, are
fitted to it.
"""

from __future__ import annotations

import numpy as np

FRICTION_WEIGHTS = np.array(
    [1.10771, 1.96855, 3.93667, 7.71976, 15.0608, 29.3552, 57.2497, 112.791, 251.893, 1909.78]
)
FRICTION_RATES = np.array(
    [27.2585, 99.0197, 360.272, 1346.21, 5073.66, 19191.4, 72746.1, 277176, 1.11587e6, 9.69663e6]
)

HEAT_WEIGHTS = np.array(
    [4.11357, 5.70733, 10.8906, 21.7627, 43.5964, 87.2696, 174.229, 347.552, 770.711, 5852.14]
)
HEAT_RATES = np.array(
    [5.87781, 36.8627, 151.283, 606.245, 2430.60, 9747.55, 39025.4, 155662, 642385, 5.64739e6]
)


def recursion(step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """e, g, h (10,) of y_k <- e_k y_k + g_k dq - h_k dq_last over a step of tau = `step`.

    dq is the change of the flow over the step, dq_last that over the step before; exact for a flow
    that is a parabola through the three points. The straight line (h = 0) that is usual delays
    terms faster than the step by half a step, an error of first order that acts as a loss.
    """
    x = FRICTION_RATES * step
    e = np.exp(-x)
    mean = -np.expm1(-x) / x
    bend = (e - mean) / x + 0.5 * mean
    return e, FRICTION_WEIGHTS * (mean + bend), FRICTION_WEIGHTS * bend


def conduction_terms(rate: float, heat_capacity_ratio: float) -> tuple[tuple[float, float], ...]:
    """(kappa, tau in s) of ten terms kappa/(1 + s tau) for 1 less than the factor on Y' above.

    `rate` = nu/(Pr R^2) in 1/s. Their sum is off by at most 0.18 % for |r| below 1000.
    """
    excess = heat_capacity_ratio - 1.0
    return tuple((excess * m / n, 1.0 / (n * rate)) for m, n in zip(HEAT_WEIGHTS, HEAT_RATES))
