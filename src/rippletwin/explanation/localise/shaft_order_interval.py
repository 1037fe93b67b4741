"""95 % interval of the amplitude of a shaft-order effect, by parametric bootstrap.

The amplitude has three errors: noise of the readings, errors of the twin that turns readings into
flow, and errors of the nominal ripple that a modulation is measured by. All three are drawn and the
amplitude is estimated again: the readings by their covariance and the model error, the parameters
of the twin by their posterior, the ripple by its estimated error. The interval is that of a normal
distribution with the bootstrap's standard deviation, and its bias taken off (Efron and Tibshirani
1993, An Introduction to the Bootstrap, secs. 6.2 and 10.2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.explanation.localise.shaft_orders import (
    ShaftOrders,
    estimate_flow,
    even_spectrum,
    fit_modulation,
    relative_spread,
    variance_about_twin,
    with_shaft_orders,
)
from rippletwin.twin.forward_model import ForwardModel

DRAWS = 60
MIN_VALID_SHARE = 0.9  # of the draws for which the line has a finite response
NORMAL_QUANTILE = 1.96


def add_amplitude_interval(
    shaft_orders: ShaftOrders | None,
    fit: Fit,
    observations: Sequence,
    highest_hz: float,
    draws: int = DRAWS,
    seed: int = 0,
) -> ShaftOrders | None:
    """`shaft_orders`, as analysed with the twin of `fit`, with the interval of its value.

    There is no interval without a name, or if the fit has no covariance.
    """
    if shaft_orders is None or shaft_orders.name is None:
        return shaft_orders
    if fit.covariance is None or not np.all(np.isfinite(fit.covariance)):
        return shaft_orders
    rng = np.random.default_rng(seed)
    pistons = fit.twin.rig.pump["pistons"]
    recordings = [
        _Recording(fit, o, is_shaft_order, shaft_orders, pistons)
        for o, is_shaft_order in with_shaft_orders(observations, pistons, highest_hz)
    ]
    values = np.empty(draws)
    for k in range(draws):
        theta = rng.multivariate_normal(fit.twin.theta, fit.covariance, method="eigh")
        values[k] = np.mean([recording.draw_amplitude(theta, rng) for recording in recordings])
    values = values[np.isfinite(values)]
    if len(values) < MIN_VALID_SHARE * draws:
        return shaft_orders
    centre = 2.0 * shaft_orders.value - np.mean(values)
    reach = NORMAL_QUANTILE * np.std(values, ddof=1)
    low, high = max(float(centre - reach), 0.0), float(centre + reach)
    return replace(shaft_orders, interval=(low, high))


class _Recording:
    """One recording, of which amplitudes are drawn."""

    def __init__(self, fit: Fit, o, is_shaft_order: np.ndarray, shaft_orders, pistons: int):
        self.o, self.is_shaft_order, self.pistons = o, is_shaft_order, pistons
        self.is_modulation = shaft_orders.name == "speed_fluctuation"
        self.modulation = shaft_orders.modulation[o.label]
        self.forward = ForwardModel(fit.twin, [o])
        # Each harmonic of the ripple has an error of its own, as in `posterior_at_fit`.
        self.ripple_sd = float(np.hypot(fit.source_sd, fit.smooth_sd))
        self.variance = variance_about_twin(o)
        extra = self.variance - o.variance
        covariance = o.covariance + np.einsum("sf,st->fst", extra, np.eye(len(extra)))
        self.root = np.linalg.cholesky(covariance)

    def draw_amplitude(self, theta: np.ndarray, rng: np.random.Generator) -> float:
        """The amplitude with errors drawn anew and the twin at `theta` (P,)."""
        o = self.o
        noise = np.einsum("fst,tf->sf", self.root, _circular_normal(rng, o.values.shape))
        (response,) = self.forward.unit_response(theta)
        if not np.all(np.isfinite(response)):
            return np.nan
        flow = estimate_flow(o.values + noise, response, self.variance)
        even = even_spectrum(self.forward, theta, flow, self.is_shaft_order)
        if not self.is_modulation:
            return relative_spread(o.orders, flow, self.pistons, even[0].real)
        error = self.ripple_sd * _circular_normal(rng, even.shape)
        even[1:] *= 1.0 + error[1:]
        fitted = fit_modulation(
            even, o.orders, self.is_shaft_order, flow, response, self.pistons, self.modulation
        )
        return abs(fitted.modulation)


def _circular_normal(rng: np.random.Generator, shape: tuple) -> np.ndarray:
    """Complex normal draws of unit variance."""
    return rng.normal(size=(*shape, 2)) @ np.array([1.0, 1j]) / np.sqrt(2.0)
