"""How far the data sheet is off: one factor on all its tolerances, estimated from a fit.

Some numbers of a line are determined by the data, wave speeds above all, and others by the data
sheet, such as the bore that all segments have in common. Where the first are several standard
deviations off, the others are hardly better. So the tolerances of the data sheet get a common
factor, the one of greatest evidence (empirical Bayes; MacKay 1992, Neural Computation 4:415, on the
scale of a prior).

Where the data sheet is far off, the fit may have settled in a mode that its tolerances favour,
which shows nothing of that. So the explanation is also begun anew with wider tolerances.
"""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.case.model import Rig, Uncertainty
from rippletwin.explanation.fit_jobs import Continuation, FitJob, FromTheta, Workers, make_base
from rippletwin.explanation.fit_starts import common_coordinates
from rippletwin.explanation.search.stepwise_search import Search
from rippletwin.explanation.thresholds import EQUIVALENT_LOG_BAYES_FACTOR
from rippletwin.twin.parameters import coordinates
from rippletwin.twin.twin import Twin

SCALES = np.geomspace(1.0, 4.0, 13)
WIDER = 2.0  # factor with which the explanation is begun anew where the fit needs none
RANDOM_STARTS = 4  # around each mode below a frequency limit
ROUNDING = 1e-9


def estimate_tolerance_scale(fit: Fit) -> float:
    """The factor on a fit's tolerances of the data sheet with the greatest evidence.

    With the factor that the fit's rig has already it is one of SCALES at most. 1 where no factor
    adds as much evidence as tells two explanations apart.
    """
    parameters = fit.twin.parameters
    stated = [k for k, p in enumerate(parameters) if p.is_sheet_number]
    if not stated or not np.isfinite(fit.evidence):
        return 1.0
    evidence = evidence_of_scales(fit.twin.theta[stated], fit.covariance[np.ix_(stated, stated)])
    within = SCALES * fit.twin.rig.tolerance_scale <= SCALES[-1] * (1.0 + ROUNDING)
    best = int(np.argmax(np.where(within, evidence, -np.inf)))
    return float(SCALES[best]) if evidence[best] >= EQUIVALENT_LOG_BAYES_FACTOR else 1.0


def evidence_of_scales(mean: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Log evidence of each of SCALES, less that of 1.

    mean, covariance   (P,), (P, P) of the posterior with priors N(0, 1)

    With the likelihood's precision L = covariance^-1 - I and b = covariance^-1 mean, a prior
    N(0, k^2) has the log evidence b^T (L + I/k^2)^-1 b/2 - log det(I + k^2 L)/2 + const.
    """
    precision, unit = np.linalg.inv(covariance), np.eye(len(mean))
    likelihood, b = precision - unit, precision @ mean
    log_evidence = np.array(
        [
            0.5 * b @ np.linalg.solve(likelihood + unit / k**2, b)
            - 0.5 * np.linalg.slogdet(unit + k**2 * likelihood)[1]
            for k in SCALES
        ]
    )
    return log_evidence - log_evidence[0]


def fit_with_wider_tolerances(workers: Workers, best: Fit) -> Fit | None:
    """A better fit of the hypothesis of `best` that wider tolerances of the data sheet find; else
    None.

    The factor is that of `estimate_tolerance_scale`, or WIDER where that is 1. The fit goes on from
    `best`, and is begun anew with random starts. The mode that it finds is fitted with the
    tolerances of `best` too: the wider ones must add as much evidence as tells two explanations
    apart.
    """
    scale = estimate_tolerance_scale(best)
    rig = scale_tolerances(best.twin.rig, WIDER if scale == 1.0 else scale)
    if rig.tolerance_scale > SCALES[-1] * (1.0 + ROUNDING):
        return None
    base = make_base(rig, workers.observations)
    twin = base.with_(effects=best.hypothesis)
    starts = (
        FromTheta(coordinates(twin.parameters, best.twin.values())),
        Continuation((common_coordinates(best, best.hypothesis),), RANDOM_STARTS),
    )
    fits = workers.fit([FitJob(best.hypothesis, start, base=base) for start in starts])
    wider = max(fits, key=lambda fit: fit.evidence)
    if wider.evidence <= best.evidence - EQUIVALENT_LOG_BAYES_FACTOR:
        return None
    start = FromTheta(coordinates(best.twin.parameters, wider.twin.values()))
    (stated,) = workers.fit([FitJob(best.hypothesis, start)])
    narrow = max(best, stated, key=lambda fit: fit.evidence)
    if wider.evidence >= narrow.evidence + EQUIVALENT_LOG_BAYES_FACTOR:
        return wider
    return None if narrow is best else narrow


def scale_tolerances(rig: Rig, scale: float) -> Rig:
    """The rig with `scale` times the data sheet's tolerances."""
    names = {f.name for f in fields(Uncertainty)} - {"sensor_gain"}
    wide = {name: scale * getattr(rig.uncertainty, name) for name in names}
    return replace(
        rig,
        uncertainty=replace(rig.uncertainty, **wide),
        tolerance_scale=scale * rig.tolerance_scale,
    )


def with_coordinates_of(search: Search, base: Twin) -> Search:
    """A search whose fits have the coordinates of twins like `base`, to start fits from."""

    def convert(fit: Fit) -> Fit:
        twin = base.with_(effects=fit.hypothesis)
        theta = coordinates(twin.parameters, fit.twin.values())
        return replace(fit, twin=twin.with_(theta=theta))

    return Search(
        convert(search.base),
        [convert(fit) for fit in search.single_effect_fits],
        convert(search.best),
        [convert(fit) for fit in search.rivals],
        [convert(fit) for fit in search.passive_networks],
        [convert(fit) for fit in search.other_positions],
    )
