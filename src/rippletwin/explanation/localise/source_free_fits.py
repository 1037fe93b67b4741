"""Fits repeated with the source unknown, beside those with the source as stated."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rippletwin.calibration.fit import Fit

SINGLES_COMPARED = 6  # single effects looked at without the source too


def fits_to_compare(search) -> list[Fit]:
    """The fits worth a second look without the source: base, best and the best single effects."""
    fits = [
        search.base,
        search.best,
        *search.singles[:SINGLES_COMPARED],
        *search.passive_networks[:1],
    ]
    return list({f.label: f for f in fits}.values())


def refit_source_free(pool, search) -> list[Fit]:
    """`compared` fits again with a likelihood that is blind to the source, each from where it was.

    Effects at the pump vanish there, effects in the line do not. Empty where no source is known.
    """
    if not any(o.source == "nominal" for o in pool.observations):
        return []
    return pool.fit(
        [
            {"hypothesis": f.hypothesis, "theta": f.twin.theta, "source_free": True}
            for f in fits_to_compare(search)
        ]
    )


def compare_evidence(search, blind_fits: Sequence[Fit]) -> list[dict]:
    """Log evidence over the base with the source's ripple known as stated, and blind to it; not of
    an effect with which no steady state is found there."""
    informed = {f.label: f.evidence for f in fits_to_compare(search)}
    unseen = {f.label: f.evidence for f in blind_fits}
    return [
        {
            "effects": label,
            "informed": float(informed[label] - informed[""]),
            "source_free": float(unseen[label] - unseen[""]),
        }
        for label in informed
        if label and np.isfinite(unseen.get(label, -np.inf))
    ]
