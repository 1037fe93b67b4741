"""Where fits start: scans of a new effect's parameters, and coordinates from other fits."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product

import numpy as np

from rippletwin.calibration.fit import Fit, Hypothesis
from rippletwin.twin.twin import Twin

WEAK_COORDINATE = -2.0  # of a weak effect's strength, in prior standard deviations


def scan_starts(rig, hypothesis: Hypothesis) -> list[dict[str, float]]:
    """Starts for the newest effect of a hypothesis, coordinates by name: all combinations of its
    parameters' scans."""
    return _combined(rig, hypothesis, lambda parameter: parameter.scan)


def weak_effect_starts(rig, hypothesis: Hypothesis, positions: int) -> list[dict[str, float]]:
    """Starts, coordinates by name, for a newest effect of small strength.

    Positive parameters without a scan start at WEAK_COORDINATE. A position starts at `positions`
    points along the line: near a good fit the modes are narrow.
    """

    def coordinates(parameter):
        prior = parameter.prior
        if prior.kind == "lognormal" and len(parameter.scan) == 1:
            return (WEAK_COORDINATE,)
        if parameter.name == "position":
            share = (np.arange(positions) + 0.5) / positions
            return tuple(prior.coordinate(prior.centre + prior.scale * share))
        return parameter.scan

    return _combined(rig, hypothesis, coordinates)


def _combined(rig, hypothesis: Hypothesis, coordinates: Callable) -> list[dict[str, float]]:
    if not hypothesis:
        return [{}]
    effect, place = hypothesis[-1]
    parameters = effect.parameters(rig, place)
    names = [f"{effect.name}@{place}.{p.name}" for p in parameters]
    return [dict(zip(names, us)) for us in product(*map(coordinates, parameters))]


def transfer_theta(fit: Fit, hypothesis: Hypothesis, base: Twin) -> np.ndarray:
    """theta (P,) of a twin with another hypothesis; parameters that `fit` has keep its values."""
    twin = base.with_(effects=hypothesis)
    return np.array(
        [
            fit.twin.theta[fit.twin.index[p.name]] if p.name in fit.twin.index else 0.0
            for p in twin.parameters
        ]
    )


def common_coordinates(fit: Fit, hypothesis: Hypothesis) -> dict[str, float]:
    """Fitted coordinates by name of the effects that another hypothesis has too."""
    names = {f"{effect.name}@{place}" for effect, place in hypothesis}
    index, theta = fit.twin.index, fit.twin.theta
    return {name: float(theta[k]) for name, k in index.items() if name.rpartition(".")[0] in names}
