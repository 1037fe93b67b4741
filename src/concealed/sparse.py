"""A baseline: the first step of orthogonal matching pursuit on the residual of calibration.

The dictionary holds, for each effect at each place, the change that a weak effect makes in the
whitened prediction of the calibrated twin, less its projection on the changes that the calibrated
parameters make.
Source: Pati, Rezaiifar, Krishnaprasad, 27th Asilomar Conference, 1993.
"""

from collections.abc import Iterator, Sequence
from itertools import product

import numpy as np

from rippletwin.calibration.likelihood import Likelihood

WEAK_COORDINATES = {"normal": 0.2, "lognormal": -2.0, "uniform": 0.0}
"""Coordinate of a parameter without a scan, by the kind of its prior."""

DIFFERENCE_STEP = 1e-4


def pick_by_matching_pursuit(base, candidates: Sequence, observations: Sequence) -> dict | None:
    """`name` and `element` of the best atom, or None where chance explains as much.

    `base` is the fit without effects, `candidates` are (effect, place) pairs. An atom is picked if
    it lowers the square of the residual by more than 2 ln(atoms) + 10 of the residual's variance.
    The first term is the largest of so many chance values (Donoho, Johnstone, Biometrika 81, 1994),
    the second a margin.
    """
    likelihood = Likelihood(base.twin, observations)
    theta = base.twin.theta
    prediction = likelihood.predict(theta)
    likelihood.estimate_errors(prediction, theta)
    residual = likelihood.residual(theta, prediction)
    moved = [theta + DIFFERENCE_STEP * unit for unit in np.eye(len(theta))]
    changes = [likelihood.residual(m, likelihood.predict(m)) - residual for m in moved]
    nuisance = np.stack(changes, axis=1)
    basis, _ = np.linalg.qr(nuisance)
    names, atoms = [], []
    for effect, place in candidates:
        for atom in _atoms(base, effect, place, likelihood, residual):
            atom = atom - basis @ (basis.T @ atom)
            size = np.linalg.norm(atom)
            if size > 0 and np.isfinite(size):
                names.append({"name": effect.name, "element": place.element})
                atoms.append(atom / size)
    remaining = residual - basis @ (basis.T @ residual)
    variance = np.sum(remaining**2) / max(len(remaining) - basis.shape[1], 1)
    gains = (np.array(atoms) @ remaining) ** 2 / variance
    best = int(np.argmax(gains))
    return names[best] if gains[best] > 2 * np.log(len(atoms)) + 10 else None


def _atoms(base, effect, place, likelihood: Likelihood, residual: np.ndarray) -> Iterator:
    """Changes of the residual, one for each combination of the effect's scanned parameters."""
    twin = base.twin.with_(effects=((effect, place),))
    other = Likelihood(twin, likelihood.observations)
    other.model_error, other.source_sd = likelihood.model_error, likelihood.source_sd
    scans = [
        p.scan if len(p.scan) > 1 else (WEAK_COORDINATES[p.prior.kind],)
        for p in effect.parameters(base.twin.rig, place)
    ]
    for values in product(*scans):
        moved = np.concatenate([base.twin.theta, values])
        changed = other.residual(moved, other.predict(moved))
        yield changed[: len(residual)] - residual  # the effect's own priors come last
