"""A state space that follows a line's response from the pump's flow to pressures.

    dx/dt = A x + B q,   p = C x + D q

q is the ripple of the pump's flow, p the ripples of the pressure at the pump outlet (first row) and
at the sensors. All rows share the poles, which vector fitting finds in the impedance at the pump
(Gustavsen & Semlyen 1999, IEEE Trans. Power Delivery 14:1052); they are stable. The line takes in
energy at every frequency, also outside the fitted ones: a rational impedance with stable poles is
passive if its real part is nowhere negative at s = jw (Brune 1931, J. Math. Phys. 10:191), and a
resistance is added until that is so. The other rows need none: a reading takes no energy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rippletwin.line.time_domain.passive_fit import (
    FLOOR,
    first_poles,
    partial_fractions,
    relocate_poles,
)

RELOCATIONS = 6  # of the poles of one order
GROWTH = 1.25  # of the number of poles from one order to the next
ORDERS_TRIED = 5
GOOD_ERROR = 2e-3  # relative, of every row: no higher order is tried
ABOVE = np.array([1.05, 1.3, 2.0, 4.0])
"""Poles above the band, over its highest frequency, for resonances of the line that lie there."""
CHECKED_BAND, CHECKS_PER_POLE = 20.0, 40  # where passivity is checked: over the band's end
POINTS_BEYOND, WEIGHT_BEYOND = 200, 1e-3
"""Frequencies above the band at which the impedance at the pump is kept near a resistance, with
this weight: otherwise the poles above the band would make it strongly negative there."""
MARGIN = 1.01  # of the resistance that is added, for what lies between these frequencies


@dataclass(frozen=True)
class StateSpace:
    """Matrices a (N, N) in 1/s, b (N, 1), c (P, N) and d (P, 1), from m3/s to Pa; error (P,) is the
    relative rms error of each row at the fitted frequencies."""

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray
    d: np.ndarray
    error: np.ndarray

    def at(self, s: np.ndarray) -> np.ndarray:
        """Response (P, F), Pa s/m3, at `s` (F,)."""
        eye = np.eye(len(self.a))
        states = [np.linalg.solve(each * eye - self.a, self.b)[:, 0] for each in np.ravel(s)]
        return self.c @ np.array(states).T + self.d


def fit_state_space(s: np.ndarray, response: np.ndarray) -> StateSpace:
    """The state space of lowest order that follows `response` (P, F), Pa s/m3, at `s` (F,), 1/s.

    The first row is the impedance at the pump. s is imaginary, rises, is dense enough to show each
    resonance, and is not zero. Of all orders the best where none is good: its error says so.
    """
    s, response = np.asarray(s, complex), np.asarray(response, complex)
    rate, unit = np.abs(s[-1]), np.max(np.abs(response[0]))
    z, port = s / rate, response[0] / unit
    weight, size = 1.0 / np.maximum(np.abs(port), FLOOR), np.abs(port)
    resonances = int(np.count_nonzero((size[1:-1] > size[:-2]) & (size[1:-1] > size[2:])))
    best, count = None, 2 * resonances + 8
    for _ in range(ORDERS_TRIED):
        poles = _even_poles(z, count)
        for _ in range(RELOCATIONS):
            poles = relocate_poles(z, port, poles, weight)
        above = (-0.2 + 1j) * ABOVE
        poles = np.concatenate([poles[poles.imag >= 0.0], above])  # of each pair one
        found = _realise(z, response / unit, poles)
        if best is None or found.error.max() < best.error.max():
            best = found
        if best.error.max() < GOOD_ERROR:
            break
        count = 2 * int(GROWTH * count / 2)
    return StateSpace(rate * best.a, best.b, rate * unit * best.c, unit * best.d, best.error)


def _even_poles(z: np.ndarray, count: int) -> np.ndarray:
    """Lightly damped pairs: a line's resonances are evenly spaced, where a lumped element's are
    spread over the decades; some of both."""
    few = 2 * (count // 10)
    w = np.linspace(np.abs(z[0]), np.abs(z[-1]), (count - few) // 2)
    pairs = np.column_stack([-0.01 * w + 1j * w, -0.01 * w - 1j * w])
    spread = first_poles(0.5 * z, few)  # off the even ones
    return np.concatenate([pairs.ravel(), spread])


def _realise(z: np.ndarray, response: np.ndarray, poles: np.ndarray) -> StateSpace:
    """The passive state space at these poles that fits best, in units of z."""
    starts = np.cumsum([0, *(1 + (p.imag > 0.0) for p in poles)])
    a, b = np.zeros((starts[-1], starts[-1])), np.zeros((starts[-1], 1))
    for p, k in zip(poles, starts):
        if p.imag > 0.0:
            a[k : k + 2, k : k + 2] = [[p.real, p.imag], [-p.imag, p.real]]
            b[k] = 2.0
        else:
            a[k, k], b[k] = p.real, 1.0
    basis = np.column_stack([partial_fractions(z, poles), np.ones_like(z)])
    beyond = 1j * np.geomspace(1.0 + 1.0 / len(z), CHECKED_BAND, POINTS_BEYOND)
    resistance = np.exp(np.mean(np.log(np.abs(response[0, -len(z) // 5 :]))))
    rest = np.column_stack([partial_fractions(beyond, poles), np.ones_like(beyond)])
    rest *= WEIGHT_BEYOND / resistance
    rows = np.array([_fit_row(basis, wanted) for wanted in response])
    rows[0] = _fit_row(basis, response[0], rest, np.full(POINTS_BEYOND, WEIGHT_BEYOND + 0j))
    checked = 1j * np.linspace(0.0, CHECKED_BAND, int(CHECKS_PER_POLE * CHECKED_BAND * len(poles)))
    real = np.concatenate(
        [
            (partial_fractions(part, poles) @ rows[0, :-1]).real
            for part in np.array_split(checked, 50)
        ]
    )
    rows[0, -1] += MARGIN * max(0.0, -np.min(real + rows[0, -1]))
    off = np.linalg.norm(rows @ basis.T - response, axis=1) / np.linalg.norm(response, axis=1)
    return StateSpace(a, b, rows[:, :-1], rows[:, -1:], off)


def _fit_row(basis: np.ndarray, wanted: np.ndarray, rows=(), values=()) -> np.ndarray:
    """Real coefficients (N + 1,) with the least relative errors of `wanted` (F,), and least errors
    of more `rows` that should be `values`."""
    scale = 1.0 / np.maximum(np.abs(wanted), FLOOR * np.max(np.abs(wanted)))
    columns, target = basis * scale[:, None], wanted * scale
    if len(rows):
        columns, target = np.vstack([columns, rows]), np.append(target, values)
    norm = np.linalg.norm(columns, axis=0)
    solution = np.linalg.lstsq(
        np.vstack([columns.real, columns.imag]) / norm,
        np.r_[target.real, target.imag],
        rcond=1e-12,
    )[0]
    return solution / norm
