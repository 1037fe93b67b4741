"""Laminar pipe friction: the momentum equation resolved over the radius.

In an axisymmetric laminar flow the axial velocity u(r, t) diffuses, u_t = -p_x/rho + nu (r
u_r)_r/r, u(R, t) = 0. Expanded in its own modes J0(j_n r/R), the flow of the pipe is a sum of
first-order lags,

    q = A sum_n w_n v_n,  v_n' = -p_x/rho - lambda_n v_n,  w_n = 4/j_n^2,  lambda_n = j_n^2 nu/R^2

(Szymanski, J. Math. Pures Appl. 11, 1932). The series converges like 1/n; a rational Krylov
projection of it (real shifts spread over the band of interest, one of them zero) needs about
ten lags. Being a Galerkin projection of a symmetric dissipative operator, it has positive
weights and real decay rates: the pipe stays passive, and a zero shift keeps the
Hagen-Poiseuille resistance exact.
"""

from functools import lru_cache

import numpy as np
from scipy.special import jn_zeros

_SERIES_TERMS = 6000
"""Modes of the full profile; the slowest-converging quantity, 1 - sum of weights, is then 7e-5."""


def _bessel_zeros(count: int) -> np.ndarray:
    """First `count` zeros of J0: scipy's, then McMahon's expansion (error < 1e-13)."""
    exact = jn_zeros(0, min(count, 100))
    beta = (np.arange(len(exact) + 1, count + 1) - 0.25) * np.pi
    e = 1 / (8 * beta)
    return np.concatenate([exact, beta + e - 124 / 3 * e**3 + 120928 / 15 * e**5])


@lru_cache(maxsize=32)
def velocity_modes(
    count: int, slowest: float = 200.0, fastest: float = 2e5
) -> tuple[np.ndarray, np.ndarray]:
    """Decay rates and weights of `count` lags that approximate the whole velocity profile.

    Rates are in units of nu/R^2, and so are `slowest` and `fastest`, the angular frequencies
    between which the approximation holds. The admittance of a metre of pipe is then
    (A/rho) sum_n weight_n/(s + rate_n nu/R^2). Returns (rates, weights), each (count,).
    """
    j = _bessel_zeros(_SERIES_TERMS)
    rates, forcing = j**2, 2 / j
    shifts = np.concatenate([[0.0], np.geomspace(slowest, fastest, count - 1)])
    basis, _ = np.linalg.qr(forcing[:, None] / (rates[:, None] + shifts))
    reduced = basis.T @ (rates[:, None] * basis)
    values, vectors = np.linalg.eigh(0.5 * (reduced + reduced.T))
    return values, (vectors.T @ (basis.T @ forcing)) ** 2


def steady_mode() -> tuple[np.ndarray, np.ndarray]:
    """The one lag of the steady (Hagen-Poiseuille) friction: rate 8 nu/R^2, weight one."""
    return np.array([8.0]), np.array([1.0])
