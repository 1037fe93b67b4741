"""Fits with an unknown source, beside the fits with the source as stated.

With the source's amplitude and phase unknown at every frequency, effects at the pump cannot be seen
and effects in the line still can.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.explanation.fit_jobs import Workers, job_from
from rippletwin.explanation.search.stepwise_search import Search

SINGLE_EFFECTS_COMPARED = 6  # best single-effect fits that are repeated


def fits_to_compare(search: Search) -> list[Fit]:
    """The base, the best fit, the best single effects and the best passive network."""
    fits = [
        search.base,
        search.best,
        *search.single_effect_fits[:SINGLE_EFFECTS_COMPARED],
        *search.passive_networks[:1],
    ]
    return list({f.label: f for f in fits}.values())


def refit_source_free(workers: Workers, search: Search) -> list[Fit]:
    """Repeat `fits_to_compare` with an unknown source, each from its mode.

    Empty where no source is nominal.
    """
    if not any(o.source == "nominal" for o in workers.observations):
        return []
    return workers.fit([job_from(f, source_free=True) for f in fits_to_compare(search)])


def compare_evidence(search: Search, source_free_fits: Sequence[Fit]) -> list[dict]:
    """Log Bayes factors against the base, with the source as stated and with an unknown source.

    An effect for which a source-free fit finds no steady state is left out.
    """
    informed = {f.label: f.evidence for f in fits_to_compare(search)}
    source_free = {f.label: f.evidence for f in source_free_fits}
    return [
        {
            "effects": label,
            "informed": float(informed[label] - informed[""]),
            "source_free": float(source_free[label] - source_free[""]),
        }
        for label in informed
        if label and np.isfinite(source_free.get(label, -np.inf))
    ]
