"""SBDF4, a semi-implicit multistep method of fourth order, on rings of four steps.

Explicit terms are extrapolated, implicit ones follow the backward differentiation formula
(Ascher, Ruuth, Wetton, SIAM J. Numer. Anal. 32, 1995). A ring is (4, M): the steps in turn.
"""

from numba import njit

from virtualrig.compilation import step_function

DEPTH = 4
LEAD = 25 / 12
"""First coefficient of BDF4: LEAD x - (older values) = dt dx/dt."""
_THIRD = 1 / 3


@njit(cache=True)
def ahead(r0, r1, r2, r3):
    """Extrapolation of four rates, the newest first, to the next step."""
    return 4 * (r0 + r2) - 6 * r1 - r3


@njit(cache=True)
def past_part(x0, x1, x2, x3):
    """The older values' part `out` of LEAD x - out = dt dx/dt, of four values, the newest first."""
    return 4 * (x0 + _THIRD * x2) - 3 * x1 - 0.25 * x3


@step_function
def extrapolate(rates, ring):
    """Replace the oldest of four rates by their extrapolation to the next step."""
    r0, r1, r2, r3 = rates[ring[0]], rates[ring[1]], rates[ring[2]], rates[ring[3]]
    for i in range(len(r3)):
        r3[i] = ahead(r0[i], r1[i], r2[i], r3[i])


@step_function
def combine_past(past, ring):
    """Replace the oldest of four values by the past's part (`past_part`)."""
    x0, x1, x2, x3 = past[ring[0]], past[ring[1]], past[ring[2]], past[ring[3]]
    for i in range(len(x3)):
        x3[i] = past_part(x0[i], x1[i], x2[i], x3[i])
