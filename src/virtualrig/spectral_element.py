"""Legendre-Gauss-Lobatto nodes, and the derivative and interpolation of polynomials on them.

Canuto, Hussaini, Quarteroni, Zang, Spectral Methods: Fundamentals in Single Domains, 2006,
section 2.3.
"""

import numpy as np
from numpy.polynomial import legendre


def lobatto(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and weights (degree + 1,) of Gauss-Lobatto quadrature on [-1, 1]."""
    series = np.zeros(degree + 1)
    series[-1] = 1
    inner = legendre.legroots(legendre.legder(series)) if degree > 1 else np.empty(0)
    nodes = np.concatenate([[-1.0], np.sort(inner.real), [1.0]])
    weights = 2 / (degree * (degree + 1) * legendre.legval(nodes, series) ** 2)
    return nodes, weights


def interpolation(nodes: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Matrix (len(x), len(nodes)) that evaluates the polynomial through `nodes` at `x`."""
    x = np.atleast_1d(x)
    matrix = np.ones((len(x), len(nodes)))
    for i, node in enumerate(nodes):
        others = np.delete(nodes, i)
        matrix[:, i] = np.prod((x[:, None] - others) / (node - others), axis=1)
    return matrix


def derivative(nodes: np.ndarray) -> np.ndarray:
    """Matrix D with (D f)_i = f'(x_i) for a polynomial f given by its values at `nodes`."""
    gap = nodes[:, None] - nodes + np.eye(len(nodes))
    scale = np.prod(gap, axis=1)
    matrix = scale[:, None] / (scale * gap)
    np.fill_diagonal(matrix, 0)
    np.fill_diagonal(matrix, -matrix.sum(axis=1))
    return matrix
