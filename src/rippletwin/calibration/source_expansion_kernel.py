"""The arithmetic of `source_expansion`, compiled: it is done after every step of a fit."""

from __future__ import annotations

import numpy as np
from numba import njit

from rippletwin.calibration.whitening_kernel import prepare, remove_along

STEP_SHARES = (1.0, 0.5, 0.25, 0.1)  # of a step, tried one after the other until one gains
SETTLED = 0.1  # gain of a step in log posterior, below which it is the last


@njit(cache=True, error_model="numpy")
def find_amplitudes(values, prediction, sd, independent, nominal, basis, sds, start, steps):
    """Most likely amplitudes (J,) of the smooth error, by at most `steps` Gauss-Newton steps.

    values, prediction, sd   (S, F), independent (F,): those of `SourceData`
    nominal, basis, sds      (N,), (J, N) and (J,): its smooth error's frequencies, basis, and the
                             standard deviations of its amplitudes
    start                    (J,) amplitudes
    """
    count, scaled = values.shape[1], sds.reshape(-1, 1) * basis
    here = start.astype(np.complex128)
    for _ in range(steps):
        error = _error(here, nominal, basis, count)
        factor = np.exp(error)
        h, r = np.empty_like(prediction), np.empty_like(values)
        for s in range(len(values)):
            h[s] = prediction[s] * factor
            r[s] = (values[s] - h[s] * (1.0 - error)) / sd[s]
        u, diagonal, left, right, _ = prepare(h, sd, independent, nominal, scaled)
        whitened = remove_along(r.reshape(1, *r.shape), u, diagonal, nominal, left, right)
        pulled = remove_along(whitened, u, diagonal, nominal, right, left)[0]
        step = -here
        for j in range(len(basis)):
            total = 0j
            for n in range(len(nominal)):
                f = nominal[n]
                for s in range(len(values)):
                    total += basis[j, n] * np.conj(u[s, f]) * pulled[s, f]
            step[j] += sds[j] ** 2 * total
        cost = _cost(values, prediction, sd, u, diagonal, nominal, basis, sds, here)
        gain, there = 0.0, here
        for share in STEP_SHARES:
            there = here + share * step
            gain = cost - _cost(values, prediction, sd, u, diagonal, nominal, basis, sds, there)
            if gain > 0.0:
                break
        if not gain > 0.0:
            break
        here = there
        if gain < SETTLED:
            break
    return here


@njit(cache=True, error_model="numpy")
def _error(amplitudes, nominal, basis, count):
    """The smooth error (F,) of amplitudes (J,)."""
    error = np.zeros(count, np.complex128)
    for n in range(len(nominal)):
        for j in range(len(basis)):
            error[nominal[n]] += amplitudes[j] * basis[j, n]
    return error


@njit(cache=True, error_model="numpy")
def _cost(values, prediction, sd, u, diagonal, nominal, basis, sds, amplitudes):
    """Minus the log posterior of amplitudes (J,) but for a constant, all other errors being those
    that `u` and `diagonal` of `prepare` remove; infinite where it is not finite."""
    source = np.exp(_error(amplitudes, nominal, basis, values.shape[1]))
    cost = 0.0
    for f in range(values.shape[1]):
        along = 0j
        for s in range(len(values)):
            r = (values[s, f] - prediction[s, f] * source[f]) / sd[s, f]
            along += np.conj(u[s, f]) * r
        for s in range(len(values)):
            r = (values[s, f] - prediction[s, f] * source[f]) / sd[s, f]
            left = r - u[s, f] * diagonal[f] * along
            cost += left.real**2 + left.imag**2
    for j in range(len(amplitudes)):
        cost += (amplitudes[j].real ** 2 + amplitudes[j].imag ** 2) / sds[j] ** 2
    return cost if np.isfinite(cost) else np.inf
