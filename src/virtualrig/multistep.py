"""SBDF4, a semi-implicit multistep method of fourth order, on rings of four steps.

Explicit terms are extrapolated, implicit ones follow the backward differentiation formula
(Ascher, Ruuth, Wetton, SIAM J. Numer. Anal. 32, 1995). A ring is (4, ...): the steps in turn.
"""

from numba import njit

DEPTH = 4
LEAD = 25 / 12
"""First coefficient of BDF4: LEAD x - (older values) = dt dx/dt."""


@njit(cache=True)
def extrapolate(rates, ring):
    """Replace the oldest of four rates by their extrapolation to the next step."""
    r0, r1 = rates[ring[0]].reshape(-1), rates[ring[1]].reshape(-1)
    r2, r3 = rates[ring[2]].reshape(-1), rates[ring[3]].reshape(-1)
    for i in range(len(r3)):
        r3[i] = 4 * (r0[i] + r2[i]) - 6 * r1[i] - r3[i]


@njit(cache=True)
def combine_past(past, ring):
    """Replace the oldest of four values by the past's part `out` of LEAD x - out = dt dx/dt."""
    x0, x1 = past[ring[0]].reshape(-1), past[ring[1]].reshape(-1)
    x2, x3 = past[ring[2]].reshape(-1), past[ring[3]].reshape(-1)
    third = 1 / 3
    for i in range(len(x3)):
        x3[i] = 4 * (x0[i] + third * x2[i]) - 3 * x1[i] - 0.25 * x3[i]
