"""A baseline: orthogonal matching pursuit on what recalibration leaves.

The dictionary holds, for each effect at each place, the change that a little of it makes in the
whitened prediction of the calibrated twin, with what the calibrated parameters can do taken off.
Source: Pati, Rezaiifar, Krishnaprasad, 27th Asilomar Conference, 1993.
"""

from itertools import product

import numpy as np

from rippletwin.calibration.likelihood import Likelihood

LITTLE = {"normal": 0.2, "lognormal": -2.0, "uniform": 0.0}
"""Coordinate of a parameter that is not scanned, by the kind of its prior: a weak effect."""

STEP = 1e-4


def pick(base, candidates, observations) -> dict | None:
    """Name and element of the first atom, or None where it explains no more than chance would.

    An atom must lower the residual's square by more than 2 ln(atoms) + 10 of its variance: the
    largest of so many chances (Donoho, Johnstone, Biometrika 81, 1994) and twenty to one.
    """
    likelihood = Likelihood(base.twin, observations)
    theta = base.twin.theta
    likelihood.estimate_errors(likelihood.forward(theta))
    residual = likelihood.residual(theta)
    nuisance = np.stack(
        [likelihood.residual(theta + STEP * unit) - residual for unit in np.eye(len(theta))], axis=1
    )
    basis, _ = np.linalg.qr(nuisance)
    names, atoms = [], []
    for effect, place in candidates:
        for atom in _atoms(base, effect, place, likelihood, residual):
            atom = atom - basis @ (basis.T @ atom)
            size = np.linalg.norm(atom)
            if size > 0 and np.isfinite(size):
                names.append({"name": effect.name, "element": place.element})
                atoms.append(atom / size)
    left = residual - basis @ (basis.T @ residual)
    variance = np.sum(left**2) / max(len(left) - basis.shape[1], 1)
    gains = (np.array(atoms) @ left) ** 2 / variance
    best = int(np.argmax(gains))
    return names[best] if gains[best] > 2 * np.log(len(atoms)) + 10 else None


def _atoms(base, effect, place, likelihood, residual):
    """Changes of the residual, one a combination of the effect's scanned parameters."""
    twin = base.twin.with_(effects=((effect, place),))
    other = Likelihood(twin, likelihood.observations)
    other.model_error, other.source_sd = likelihood.model_error, likelihood.source_sd
    scans = [
        p.scan if len(p.scan) > 1 else (LITTLE[p.prior.kind],)
        for p in effect.parameters(base.twin.rig, place)
    ]
    for values in product(*scans):
        moved = other.residual(np.concatenate([base.twin.theta, values]))
        yield moved[: len(residual)] - residual  # the effect's own priors come last
