"""Fits with an unknown source, beside the fits with the source as stated.

With the source's amplitude and phase unknown at every frequency, effects at the pump cannot be seen
and effects in the line still can.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.explanation.fit_jobs import Workers, job_from


def refit_source_free(workers: Workers, fits: Sequence[Fit]) -> list[Fit]:
    """Repeat `fits` with an unknown source, each from its mode; none where no source is nominal."""
    if not any(o.source == "nominal" for o in workers.observations):
        return []
    return workers.fit([job_from(f, source_free=True) for f in fits])


def compare_evidence(fits: Sequence[Fit], source_free_fits: Sequence[Fit]) -> list[dict]:
    """Log Bayes factors against the base, with the source as stated and with an unknown source.

    `fits` include the base, and so do `source_free_fits` unless they are empty. An effect for which
    a source-free fit finds no steady state is left out.
    """
    informed = {f.label: f.evidence for f in fits}
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
