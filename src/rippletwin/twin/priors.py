"""Prior distributions, each a map from a standard normal coordinate to the parameter."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr, ndtri

MAX_BOUNDED = 1.0 - 1e-9  # whose coordinate is finite


@dataclass(frozen=True)
class Prior:
    """A proper prior, written as a map from a standard normal coordinate u to the parameter.

    kind "normal":    x = centre + scale u
    kind "lognormal": x = centre exp(scale u), for positive parameters
    kind "uniform":   x = centre + scale Phi(u), on [centre, centre + scale]
    kind "bounded":   x = tanh(scale u), on (-1, 1) about zero

    In u every prior is N(0, 1): pulls are read off directly and Laplace's integral is over u.
    """

    kind: str
    centre: float | np.ndarray  # arrays: one kind of prior for many parameters (`Priors`)
    scale: float | np.ndarray

    def value(self, u):
        """Parameter, in its own unit, at coordinate u, any shape."""
        if self.kind == "normal":
            return self.centre + self.scale * u
        if self.kind == "lognormal":
            return self.centre * np.exp(self.scale * u)
        if self.kind == "bounded":
            return np.tanh(self.scale * u)
        return self.centre + self.scale * ndtr(u)

    def coordinate(self, x):
        """Inverse of `value`, any shape; a uniform's ends are clipped to finite coordinates.

        0 where the prior has no width: its parameter is exact, whatever x is.
        """
        if self.scale == 0.0:
            return np.zeros(np.shape(x))[()]
        if self.kind == "normal":
            return (x - self.centre) / self.scale
        if self.kind == "lognormal":
            return np.log(x / self.centre) / self.scale
        if self.kind == "bounded":
            return np.arctanh(np.clip(x, -MAX_BOUNDED, MAX_BOUNDED)) / self.scale
        return ndtri(np.clip((x - self.centre) / self.scale, 1e-3, 1 - 1e-3))


class Priors:
    """Several priors at once."""

    def __init__(self, priors: Sequence[Prior]):
        self._count = len(priors)
        self._kinds = []
        for kind in dict.fromkeys(p.kind for p in priors):
            own = np.array([k for k, p in enumerate(priors) if p.kind == kind])
            centres = np.array([priors[k].centre for k in own])
            scales = np.array([priors[k].scale for k in own])
            self._kinds.append((own, Prior(kind, centres, scales)))

    def value(self, u: np.ndarray) -> np.ndarray:
        """Parameters (P,) at coordinates u (P,)."""
        values = np.empty(self._count)
        for own, prior in self._kinds:
            values[own] = prior.value(u[own])
        return values


def normal(mean: float, deviation: float) -> Prior:
    """Normal prior with mean and standard deviation in the parameter's unit."""
    return Prior("normal", mean, deviation)


def lognormal(median: float, log_deviation: float) -> Prior:
    """Lognormal prior: median in the parameter's unit, standard deviation of its logarithm."""
    return Prior("lognormal", median, log_deviation)


def uniform(low: float, high: float) -> Prior:
    """Uniform prior on [low, high]."""
    return Prior("uniform", low, high - low)


def bounded(deviation: float) -> Prior:
    """Prior on (-1, 1) about zero, of standard deviation `deviation` where that is small."""
    return Prior("bounded", 0.0, deviation)
