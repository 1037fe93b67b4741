"""Costs of the possible sizes of model error and source error, given residuals; see `posterior`."""

from __future__ import annotations

import numpy as np
from numba import njit

TINY = 1e-300


@njit(cache=True, error_model="numpy")
def error_costs(
    residual, h, variance, power, source_scale, nominal, basis, model_errors, sds, smooth_sds, scale
):
    """Minus the log likelihood of complex residuals, but for a constant: (T, G, D) for smooth_sds
    (T, J), sds (G,) and model_errors (D,).

    residual, h, variance   (S, F), in a basis in which the noise is diagonal
    power                   (F,) by which the square of a model error is multiplied
    source_scale            (F,) by which sds are multiplied; 0 for a known source, inf for a free
                            one, which is projected out
    nominal, basis          (N,) and (J, N): the frequencies with a smooth source error
    scale                   of the sum of squares, for the degrees of freedom that parameters take
    """
    sensors, count = h.shape
    functions = len(basis) if len(nominal) else 0
    costs = np.zeros((len(smooth_sds), len(sds), len(model_errors)))
    size, cross = np.empty(count), np.empty(count, np.complex128)
    gram, share = np.empty((functions, functions)), np.empty(functions, np.complex128)
    columns = np.ascontiguousarray(basis.T)  # the innermost loop goes along memory
    for d in range(len(model_errors)):
        common = 0.0  # what neither source error changes
        for f in range(count):
            total, size[f], cross[f] = 0.0, 0.0, 0.0
            for s in range(sensors):
                v = variance[s, f] + model_errors[d] ** 2 * power[f]
                r, p = residual[s, f], h[s, f]
                total += (r.real**2 + r.imag**2) / v
                size[f] += (p.real**2 + p.imag**2) / v
                cross[f] += np.conj(p) * r / v
                common += np.log(v)
            size[f] = max(size[f], TINY)
            common += scale * total
        for g in range(len(sds)):
            cost = common
            gram[:], share[:] = 0.0, 0.0
            for f in range(count):
                along = (cross[f].real ** 2 + cross[f].imag ** 2) / size[f]
                if np.isinf(source_scale[f]):
                    cost += np.log(size[f]) - scale * along
                else:
                    stretch = 1.0 + (source_scale[f] * sds[g]) ** 2 * size[f]
                    cost += np.log(stretch) - scale * (1.0 - 1.0 / stretch) * along
            for n in range(len(nominal)):
                f = nominal[n]
                gain = 1.0 / (1.0 + (source_scale[f] * sds[g]) ** 2 * size[f])
                for i in range(functions):
                    entry = columns[n, i] * gain
                    share[i] += entry * cross[f]
                    entry *= size[f]
                    for j in range(i + 1):
                        gram[i, j] += entry * columns[n, j]
            for t in range(len(smooth_sds)):
                costs[t, g, d] = cost + _smooth_cost(gram, share, smooth_sds[t], scale)
    return costs


@njit(cache=True, error_model="numpy")
def _smooth_cost(gram, share, sds, scale):
    """Log determinant of I + D G D less `scale` times b^H (I + D G D)^-1 b, b = D share, D =
    diag(sds); of G = `gram` the lower triangle is given. By Cholesky's decomposition."""
    n = len(share)
    root, solved, cost = np.zeros((n, n)), np.empty(n, np.complex128), 0.0
    for i in range(n):
        total = sds[i] * share[i]
        for j in range(i + 1):
            entry = sds[i] * gram[i, j] * sds[j]
            for k in range(j):
                entry -= root[i, k] * root[j, k]
            root[i, j] = np.sqrt(1.0 + entry) if i == j else entry / root[j, j]
            if j < i:
                total -= root[i, j] * solved[j]
        solved[i] = total / root[i, i]
        cost += 2.0 * np.log(root[i, i]) - scale * (solved[i].real ** 2 + solved[i].imag ** 2)
    return cost
