"""95 % intervals of the amplitudes of shaft-order effects, by parametric bootstrap.

An amplitude has two errors: noise of the readings, and errors of the twin that turns readings into
flow. Both are drawn and the amplitudes are estimated again: the readings by their covariance and
the model error, the parameters of the twin by their posterior. A modulation has a third one, the
part of the pistons' deviations that looks like it, which is common to all recordings. The interval
is that of a normal distribution with the bootstrap's standard deviation, and its bias taken off
(Efron and Tibshirani 1993, An Introduction to the Bootstrap, secs. 6.2 and 10.2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rippletwin.calibration.fit import HALF_INTERVAL, Fit
from rippletwin.explanation.localise.modulation_fit import fit_modulation
from rippletwin.explanation.localise.order_flow import (
    estimate_order_flow,
    variance_about_twin,
    with_shaft_orders,
)
from rippletwin.explanation.localise.shaft_orders import ShaftOrders, amplitude_of
from rippletwin.twin.forward_model import ForwardModel

DRAWS = 60
MIN_VALID_SHARE = 0.9  # of the draws for which the line has a finite response


def add_amplitude_intervals(
    shaft_orders: ShaftOrders | None,
    fit: Fit,
    observations: Sequence,
    highest_hz: float,
    draws: int = DRAWS,
    seed: int = 0,
) -> ShaftOrders | None:
    """`shaft_orders`, as analysed with the twin of `fit`, with the intervals of its effects.

    highest_hz   of the shaft orders, as in the analysis
    draws        of noise and of the twin's parameters
    seed         of the random numbers

    There is no interval if the fit has no covariance.
    """
    if shaft_orders is None or not shaft_orders.effects:
        return shaft_orders
    if fit.covariance is None or not np.all(np.isfinite(fit.covariance)):
        return shaft_orders
    rng = np.random.default_rng(seed)
    pistons = fit.twin.rig.pump["pistons"]
    recordings = [
        _Recording(fit, o, shaft_orders, pistons)
        for o, _ in with_shaft_orders(observations, pistons, highest_hz)
    ]
    values = np.empty((draws, len(shaft_orders.effects)))
    for k in range(draws):
        theta = rng.multivariate_normal(fit.twin.theta, fit.covariance, method="eigh")
        pattern = complex(*rng.normal(size=2))
        drawn = [recording.draw_amplitudes(theta, pattern, rng) for recording in recordings]
        values[k] = np.mean(drawn, axis=0)
    is_known = np.array([effect.value is not None for effect in shaft_orders.effects])
    values = values[np.all(np.isfinite(values[:, is_known]), axis=1)]
    if len(values) < MIN_VALID_SHARE * draws:
        return shaft_orders
    effects = []
    for effect, column in zip(shaft_orders.effects, values.T):
        if effect.value is None:
            effects.append(effect)
            continue
        centre = 2.0 * effect.value - np.mean(column)
        reach = HALF_INTERVAL * np.std(column, ddof=1)
        interval = (max(float(centre - reach), 0.0), float(centre + reach))
        effects.append(replace(effect, interval=interval))
    return replace(shaft_orders, effects=tuple(effects))


class _Recording:
    """One recording, of which amplitudes are drawn."""

    def __init__(self, fit: Fit, o, shaft_orders: ShaftOrders, pistons: int):
        self.names, self.pistons = shaft_orders.names, pistons
        self.start = shaft_orders.modulation.get(o.label)
        self.o, self.forward = o, ForwardModel(fit.twin, [o])
        extra = variance_about_twin(o) - o.variance
        covariance = o.covariance + np.einsum("sf,st->fst", extra, np.eye(len(extra)))
        self.root = np.linalg.cholesky(covariance)

    def draw_amplitudes(
        self, theta: np.ndarray, pattern: complex, rng: np.random.Generator
    ) -> list[float]:
        """The amplitudes with errors drawn anew and the twin at `theta` (P,).

        pattern   the pistons' deviations that look like a modulation, in standard deviations
        """
        normal = rng.normal(size=(*self.o.values.shape, 2)) @ np.array([1.0, 1j]) / np.sqrt(2.0)
        noise = np.einsum("fst,tf->sf", self.root, normal)
        flow = estimate_order_flow(self.forward, theta, self.o.values + noise)
        if not np.all(np.isfinite(flow.values)):
            return [np.nan] * len(self.names)
        modulation = None
        if self.start is not None:
            modulation = fit_modulation(flow, self.pistons, self.start)
            error = modulation.error_by_spread(self.pistons) * pattern
            modulation = modulation._replace(amplitude=modulation.amplitude * (1.0 + error))
        return [amplitude_of(name, flow, modulation, self.pistons) for name in self.names]
