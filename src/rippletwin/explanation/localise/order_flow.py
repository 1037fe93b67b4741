"""The flow at the pump at every shaft order, as the sensors and the twin of the line imply it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rippletwin.spectra.frequency_selection import select_below, select_frequencies
from rippletwin.twin.forward_model import ForwardModel

LINE_MODEL_ERROR = 0.02
"""Relative error of the twin at shaft orders, per sensor and order. It is larger than at the piston
orders: there the load is fitted with all products of harmonics, here it is linear."""


class OrderFlow(NamedTuple):
    """Peak complex amplitudes of the flow at the pump in one recording.

    orders     (F,) shaft orders
    values     (F,) flow, m3/s
    variance   (F,) its variance, (m3/s)^2
    gain       (F,) norm over the sensors of the pressures that a unit of flow makes, Pa s/m3
    unmatched  (S, F) readings less those that the flow makes, Pa
    mean_flow  m3/s; NaN where it is not known
    """

    orders: np.ndarray
    values: np.ndarray
    variance: np.ndarray
    gain: np.ndarray
    unmatched: np.ndarray
    mean_flow: float


def estimate_order_flow(
    forward: ForwardModel, theta: np.ndarray, readings: np.ndarray | None = None
) -> OrderFlow:
    """The flow that fits the readings of all sensors best (weighted least squares).

    forward   that of one observation, with all its shaft orders
    theta     (P,) parameters of its twin
    readings  (S, F) Pa, in place of those of the observation
    """
    (o,) = forward.observations
    readings = o.values if readings is None else readings
    (response,) = forward.unit_response(theta)
    weight = 1.0 / variance_about_twin(o)
    square = np.sum(weight * np.abs(response) ** 2, axis=0)
    is_guessed = forward.twin.guessed_load
    mean_flow = np.nan if is_guessed else float(forward.twin.operating_point(o).mean_flow)
    flow = np.sum(weight * np.conj(response) * readings, axis=0) / square
    return OrderFlow(
        np.asarray(o.orders, int),
        flow,
        1.0 / square,
        np.sqrt(np.sum(np.abs(response) ** 2, axis=0)),
        readings - response * flow,
        mean_flow,
    )


def with_shaft_orders(observations: Sequence, pistons: int, highest_hz: float) -> list[tuple]:
    """(observation in its band, mask (F,) of orders that are no multiple of `pistons`) where there
    are any."""
    below = [select_below(o, highest_hz) for o in observations if o.orders is not None]
    selected = [select_frequencies(o, o.frequency_hz >= o.min_frequency_hz) for o in below]
    pairs = [(o, np.asarray(o.orders) % pistons != 0) for o in selected]
    return [(o, is_shaft_order) for o, is_shaft_order in pairs if np.any(is_shaft_order)]


def variance_about_twin(o) -> np.ndarray:
    """Variance (S, F), Pa2, of an observation about the twin: noise and LINE_MODEL_ERROR."""
    return o.variance + LINE_MODEL_ERROR**2 * np.mean(np.abs(o.values) ** 2, axis=0)
