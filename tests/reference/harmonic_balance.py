"""Periodic steady state of a line with a nonlinear load, by harmonic balance.

The linear rest of the system is one relation a p + b q = c per harmonic
(`FrequencyDomainLine.load_relation`), whatever effects it carries; the load is a law q = f(p) in
the time domain. Both hold at once where

    r(P) = a P + b F[f(p0 + p(t))] - c = 0,       F[] the harmonics of a period.

Newton's method with the Jacobian frozen at the mean slope g0 of the law, which is diagonal, needs
one transform each way a pass. For a passive line (Re b/a >= 0) its error shrinks at least by
max|f'(p(t)) - g0|/g0 a pass in the mean square: a few per cent at the ripple of a pump. Where that
is too slow, full Newton steps are solved by GMRES with the same diagonal as preconditioner.
(Harmonic balance: Kundert & Sangiovanni-Vincentelli 1986, IEEE Trans. CAD 5, 521.)
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.fft import next_fast_len
from scipy.sparse.linalg import LinearOperator, gmres

from rippletwin.harmonics import one_period, peak_amplitudes
from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine

OVERSAMPLING = 4  # samples a period over the highest order: products to third order alias nowhere
_SMOOTH = 1e-4  # of the mean drop: below it the orifice law is linear, so that its slope is finite


@dataclass(frozen=True)
class Balance:
    """What the load does over a period; peak amplitudes.

    pressure, flow   (F,) Pa and m3/s at the load
    mean_flow        m3/s, and `coefficient` m3/s/sqrt(Pa) of the orifice (1 for another law)
    residual         |a P + b Q - c| over |c|, both in units of pressure
    passes           evaluations of the law or its slope operator
    converged        whether `residual` fell below the tolerance
    """

    pressure: np.ndarray
    flow: np.ndarray
    mean_flow: float
    coefficient: float
    residual: float
    passes: int
    converged: bool


def square_law(drop: np.ndarray, mean_drop: float) -> tuple[np.ndarray, np.ndarray]:
    """sqrt(p) and its slope for a drop in Pa, odd and smooth through zero: p/(p^2 + d^2)^(1/4).

    d = 1e-4 of the mean drop; a positive drop near the mean is off by 3e-9.
    """
    square = drop * drop + (_SMOOTH * mean_drop) ** 2
    root = 1.0 / np.sqrt(np.sqrt(square))
    return drop * root, root * (1.0 - 0.5 * drop * drop / square)


def balance_orifice(
    network: FrequencyDomainLine,
    *,
    mean_pressure: float,
    coefficient: float | None = None,
    mean_flow: float | None = None,
    back_pressure: float = 0.0,
    orders: np.ndarray | None = None,
    tolerance: float = 1e-10,
    passes: int = 40,
) -> Balance:
    """Solve q = K sqrt(p - p_back) at the load of `network` and leave the state there.

    Give the `mean_pressure` at the load (Pa) and either K (`coefficient`, m3/s/sqrt(Pa)) or the
    `mean_flow` (m3/s) that it lets through, ripple included. `orders` (F,) are the whole numbers
    that `network.s` is multiples of; by default 1..F. Orders that are not there carry no pressure.
    At most `passes` corrections are made to the linearised orifice's pressure; 1 is enough inside
    a fit (docs/explanation/line.md has the errors).

    Afterwards `network.load` is ("state", (p, q)), so that its response is that at full amplitude.
    Raises ValueError where not exactly one of K and mean flow is given, the mean drop is not
    positive, or `network.s` is not in the ratio of `orders`.
    """
    if (coefficient is None) == (mean_flow is None):
        raise ValueError("give either coefficient or mean_flow")
    drop = mean_pressure - back_pressure
    if not drop > 0:
        raise ValueError(f"the mean pressure must lie above the back pressure, not {drop} Pa")

    k = coefficient

    def law(ripple):
        nonlocal k
        root, slope = square_law(drop + ripple, drop)
        if mean_flow is not None:
            k = mean_flow / root.mean()
        return k * root, k * slope

    result = balance(network, law, orders=orders, tolerance=tolerance, passes=passes)
    return replace(result, coefficient=float(k))


def balance(
    network: FrequencyDomainLine,
    law: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
    *,
    orders: np.ndarray | None = None,
    tolerance: float = 1e-10,
    passes: int = 40,
) -> Balance:
    """Any load law: `law(ripple (N,)) -> (q (N,), dq/dp (N,))`, ripple about the mean pressure.

    See `balance_orifice` for the rest.
    """
    grid = _Grid.of(network, orders)
    a, b, c = network.load_relation()
    _, slope = law(np.zeros(1))
    diagonal = a + b * slope[0]
    size = np.linalg.norm(c / diagonal)
    p = base = c / diagonal
    step, last, inner = np.zeros_like(p), np.inf, 0
    for done in range(passes + 1):
        flow, slope = law(grid.wave(p))
        q = grid.harmonics(flow)
        residual = (a * p + b * q - c) / diagonal
        error = float(np.linalg.norm(residual) / size) if size else 0.0
        if error < tolerance or done == passes:
            break
        if error > last:  # too far: the law bends more than its slope said
            step = 0.5 * step
        else:
            slow = done > 1 and error > 0.3 * last
            base, last, step = p, error, residual
            if slow:
                step, count = _newton_step(residual, a, b, slope, diagonal, grid)
                inner += count
        p = base - step
    network.load = "state", (p, q)
    return Balance(p, q, float(np.mean(flow)), 1.0, error, done + 1 + inner, error < tolerance)


def _newton_step(residual, a, b, slope, diagonal, grid):
    """Solve (a + b G) step = diagonal residual, G the law's slope as an operator on harmonics.

    G maps a harmonic and its conjugate, so the unknowns are real and imaginary parts.
    """
    count = 0

    def apply(x):
        nonlocal count
        count += 1
        y = x.view(complex)
        y = (a * y + b * grid.harmonics(slope * grid.wave(y))) / diagonal
        return y.view(float)

    size = 2 * len(residual)
    operator = LinearOperator((size, size), matvec=apply, dtype=float)
    step, _ = gmres(operator, residual.view(float), rtol=1e-3, maxiter=3, restart=30)
    return step.view(complex), count


@dataclass(frozen=True)
class _Grid:
    """Harmonics at whole orders and one period of N samples, each from the other."""

    orders: np.ndarray
    samples: int

    @classmethod
    def of(cls, network: FrequencyDomainLine, orders: np.ndarray | None) -> _Grid:
        s = network.s
        orders = np.arange(1, len(s) + 1) if orders is None else np.asarray(orders)
        whole = orders.astype(int)
        if np.max(np.abs(s - s[0] / whole[0] * whole)) > 1e-9 * abs(s[-1]):
            raise ValueError("network.s must be in the ratio of the orders (by default 1, 2, 3...)")
        return cls(whole, next_fast_len(OVERSAMPLING * int(whole.max()) + 1, real=True))

    def wave(self, harmonics: np.ndarray) -> np.ndarray:
        return one_period(harmonics, self.samples, self.orders)

    def harmonics(self, wave: np.ndarray) -> np.ndarray:
        return peak_amplitudes(wave)[self.orders]
