"""Which frequencies of an observation are used: below a limit, piston orders, every n-th bin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rippletwin.errors import InputError

FREQUENCIES_PER_RESONANCE = 12  # of the line, whose resonances are 1/(2 delay) apart


def select_fitted_frequencies(observations: Sequence, rig, highest_hz: float | None = None) -> list:
    """The observations at the frequencies that are fitted.

    Of a periodic recording the piston orders of its band, the only ones of a healthy nominal pump.
    Of a dense spectrum FREQUENCIES_PER_RESONANCE: the error of a model has the bandwidth of the
    line's resonances, so that closer points are no further evidence.

    Raises InputError where nothing of an observation is left, as `check_sources`, and as
    `check_load_table`.
    """
    check_sources(observations)
    spacing = 1.0 / (2.0 * FREQUENCIES_PER_RESONANCE * rig.delay)
    prepared = []
    for o in observations:
        o = select_below(o, highest_hz)
        if o.orders is not None:
            keep = _own_harmonics(o, rig)
        else:
            keep = np.zeros(len(o.frequency_hz), bool)
            keep[
                np.unique(
                    np.searchsorted(
                        o.frequency_hz, np.arange(o.frequency_hz[0], o.frequency_hz[-1], spacing)
                    )
                )
            ] = True
            keep[0] = True  # a table may have one
        if not np.any(keep):
            raise InputError(
                o.label,
                "min_frequency_hz, max_frequency_hz",
                "no frequency that is fitted is between them (of a pump: multiples of its piston "
                "frequency)",
                "Give a wider band",
            )
        prepared.append(select_frequencies(o, keep))
    check_load_table(prepared, rig)
    return prepared


def _own_harmonics(observation, rig) -> np.ndarray:
    """Mask (F,) of the multiples of the piston frequency in the band of a periodic observation."""
    own = np.asarray(observation.orders) % rig.pump["pistons"] == 0
    return own & (observation.frequency_hz >= observation.min_frequency_hz)


def check_load_table(observations: Sequence, rig) -> None:
    """Raise InputError where a load impedance was not measured at a frequency that is fitted: the
    table's ends would stand for it. Of periodic observations the pistons' orders are fitted."""
    table = rig.load.frequency_hz
    for o in observations if table is not None else ():
        fitted = o.frequency_hz if o.orders is None else o.frequency_hz[_own_harmonics(o, rig)]
        low, high = np.min(fitted, initial=np.inf), np.max(fitted, initial=0.0)
        ends = ("min", table[0], low < table[0]), ("max", table[-1], high > table[-1])
        beyond = [(end, at) for end, at, is_passed in ends if is_passed]
        if beyond:
            keys = " and ".join(f"{end}_frequency_hz: {at:.6g}" for end, at in beyond)
            options = ", ".join(f"--{end}-frequency" for end, _ in beyond)
            raise InputError(
                "rig.yaml",
                "load.impedance, frequency_hz",
                f"the table reaches from {table[0]:.6g} to {table[-1]:.6g} Hz, but {o.label} is "
                f"fitted from {low:.6g} to {high:.6g} Hz",
                f"Give this recording {keys} (calibrate and explain: {options}), or measure the "
                "load over the whole band",
            )


def check_sources(observations: Sequence) -> None:
    """Raise InputError where all observations are readings of one sensor and of an unknown source:
    any line fits them then."""
    if observations and all(o.source == "free" and len(o.values) < 2 for o in observations):
        raise InputError(
            observations[0].label,
            "sensors",
            "one sensor, and a source whose amplitude is not known: the line cannot be fitted",
            "Give a second sensor, or of a pump its geometry or a flow_ripple",
        )


def select_frequencies(observation, keep: np.ndarray | slice):
    """The observation at the frequencies of a mask (F,), of indices or of a slice."""
    return replace(
        observation,
        frequency_hz=observation.frequency_hz[keep],
        orders=None if observation.orders is None else observation.orders[keep],
        values=observation.values[:, keep],
        covariance=observation.covariance[keep],
    )


def select_below(observation, max_frequency_hz: float | None = None, pistons: int = 1):
    """The observation at and below a frequency, Hz, and at multiples of `pistons` shaft orders.

    At least its lowest frequency is kept.
    """
    keep = np.ones(len(observation.frequency_hz), dtype=bool)
    if observation.orders is not None:
        keep &= np.asarray(observation.orders) % pistons == 0
    if max_frequency_hz is not None:
        lowest = np.min(observation.frequency_hz[keep])
        keep &= observation.frequency_hz <= max(max_frequency_hz, lowest)
    return observation if np.all(keep) else select_frequencies(observation, keep)
