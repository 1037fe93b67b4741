"""A passive rational function for an immittance that is known at some frequencies.

The time domain needs an immittance as elements N(s)/D(s) of low order. Poles come from vector
fitting (Gustavsen & Semlyen 1999, IEEE Trans. Power Delivery 14:1052). Residues are then found
again by nonnegative least squares in a basis of terms each of which is positive real: for real
poles -b and pairs s^2 + 2 d s + w^2,

    1,  s,  1/(s + b),  s/(s + b),  s/D,  (s + 2 d)/D,  s (w^2 + 2 d s)/D,   D the quadratic.

A pole at zero is moved to SLOWEST: an element needs a finite value at rest. A sum of terms with
nonnegative coefficients is passive at every frequency, also between and beyond those that are known
(Brune 1931, J. Math. Phys. 10:191). Where none follows the function, the error says so.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.optimize import nnls

ORDERS = (0, 2, 4, 8, 12, 16, 24, 40, 56)  # numbers of poles that are tried
RELOCATIONS = 8  # of the poles of one order
GOOD_ERROR = 1e-4  # relative: no higher order is tried
SLOWEST = 1e-3  # of the lowest frequency: rate of a term in the place of 1/s
FLOOR = 1e-3  # of the largest magnitude: smaller values are followed as well as that
NEGLIGIBLE = 1e-9  # share of a term in the function at its largest: it is left out

Term = tuple[tuple[float, ...], tuple[float, ...]]
"""Numerator and denominator of a term in s, highest power first."""


class PassiveFit(NamedTuple):
    """Terms whose sum is the function, and the relative rms error of that sum."""

    terms: tuple[Term, ...]
    error: float

    def at(self, s: np.ndarray) -> np.ndarray:
        """The function, in its own unit, at `s` (F,), 1/s."""
        total = np.zeros(np.shape(s), complex)
        for numerator, denominator in self.terms:
            total += np.polyval(numerator, s) / np.polyval(denominator, s)
        return total


def fit_passive_terms(s: np.ndarray, immittance: np.ndarray) -> PassiveFit:
    """The passive sum of terms of lowest order that follows `immittance` (F,) at `s` (F,), 1/s.

    Of all orders the best where none is good. s is imaginary and not zero.
    """
    s, wanted = np.asarray(s, complex), np.asarray(immittance, complex)
    unit, rate = np.max(np.abs(wanted)), np.sqrt(np.abs(s[0] * s[-1]))
    if unit == 0.0:
        return PassiveFit((), 0.0)
    z, h = s / rate, wanted / unit
    weight = 1.0 / np.maximum(np.abs(h), FLOOR)
    best = None
    for order in ORDERS:
        poles = first_poles(z, order)
        for _ in range(RELOCATIONS if order else 1):
            poles = relocate_poles(z, h, poles, weight) if order else poles
            fit = _passive_residues(z, h, poles, weight)
            if best is None or fit.error < best.error:
                best = fit
        if best.error < GOOD_ERROR:
            break
    return PassiveFit(tuple(_in_units(term, unit, rate) for term in best.terms), best.error)


def first_poles(z: np.ndarray, order: int) -> np.ndarray:
    """Lightly damped pairs, `order` poles, spread over the frequencies z (F,), as vector fitting
    begins. All are over one rate, without unit."""
    w = np.geomspace(np.abs(z[0]), np.abs(z[-1]), order // 2)
    pairs = np.column_stack([-0.01 * w + 1j * w, -0.01 * w - 1j * w])
    return pairs.ravel()


def partial_fractions(z: np.ndarray, poles: np.ndarray) -> np.ndarray:
    """Partial fractions (F, N) at z (F,) of `poles` (N,), complex ones in pairs: their real
    combinations are those of real functions."""
    columns = []
    for p in poles:
        if p.imag == 0.0:
            columns.append(1.0 / (z - p))
        elif p.imag > 0.0:
            one, other = 1.0 / (z - p), 1.0 / (z - np.conj(p))
            columns += [one + other, 1j * (one - other)]
    return np.array(columns).T


def relocate_poles(z, h, poles, weight) -> np.ndarray:
    """One step of vector fitting: the zeros (N,) of the common denominator become the `poles` (N,).

    h (F,) is the function at z (F,), `weight` (F,) how much each point counts.
    """
    parts = partial_fractions(z, poles)
    rows = np.column_stack([parts, np.ones_like(z), z, -h[:, None] * parts]) * weight[:, None]
    target = h * weight
    size = np.linalg.norm(rows, axis=0)
    solution = np.linalg.lstsq(
        np.vstack([rows.real, rows.imag]) / size, np.r_[target.real, target.imag], rcond=1e-12
    )[0]
    residues = (solution / size)[parts.shape[1] + 2 :]
    companion, row = np.zeros((len(residues), len(residues))), np.zeros(len(residues))
    k = 0
    for p in poles:
        if p.imag == 0.0:
            companion[k, k], row[k] = p.real, 1.0
            k += 1
        elif p.imag > 0.0:
            companion[k : k + 2, k : k + 2] = [[p.real, p.imag], [-p.imag, p.real]]
            row[k] = 2.0
            k += 2
    zeros = np.linalg.eigvals(companion - np.outer(row, residues))
    zeros = -np.abs(zeros.real) + 1j * zeros.imag  # stable
    return zeros[np.abs(zeros) > 0.0]


def _passive_residues(z, h, poles, weight) -> PassiveFit:
    """The best sum of positive real terms at these poles."""
    slow = SLOWEST * np.abs(z[0])
    terms: list[Term] = [((1.0,), (1.0,)), ((1.0, 0.0), (1.0,)), ((1.0,), (1.0, slow))]
    for p in poles:
        if p.imag == 0.0:
            terms += [((1.0,), (1.0, -p.real)), ((1.0, 0.0), (1.0, -p.real))]
        elif p.imag > 0.0:
            bend, square = -2.0 * p.real, abs(p) ** 2
            below = (1.0, bend, square)
            terms += [((1.0, 0.0), below), ((1.0, bend), below), ((bend, square, 0.0), below)]
    basis = np.column_stack([np.polyval(n, z) / np.polyval(d, z) for n, d in terms])
    size = np.max(np.abs(basis), axis=0)
    rows, target = basis / size * weight[:, None], h * weight
    share = nnls(np.vstack([rows.real, rows.imag]), np.r_[target.real, target.imag])[0]
    share[share < NEGLIGIBLE] = 0.0
    error = np.sqrt(np.mean(np.abs(rows @ share - target) ** 2))
    kept = [
        (tuple(c / w * x for x in numerator), denominator)
        for (numerator, denominator), c, w in zip(terms, share, size)
        if c > 0.0
    ]
    return PassiveFit(tuple(kept), float(error))


def _in_units(term: Term, unit: float, rate: float) -> Term:
    """A term of s/`rate`, times `unit`, as one of s."""
    numerator, denominator = (
        tuple(c * rate**-power for power, c in zip(range(len(part) - 1, -1, -1), part))
        for part in term
    )
    return tuple(unit * c for c in numerator), denominator
