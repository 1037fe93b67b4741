"""Twins of a rig that its healthy recordings are fitted with, by what is fitted.

nominal      nothing: the data sheet, with unsteady friction
calibrated   the numbers of the data sheet
explained    also physics that the data sheet does not mention (`rippletwin explain`)
"""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import numpy as np

from rippletwin.calibration import report
from rippletwin.calibration.calibrate import Calibration, Settings, calibrate
from rippletwin.case.model import Case
from rippletwin.explanation.explain import explain
from rippletwin.explanation.verdict.verdict_file import write_verdict
from rippletwin.spectra.observation import observe
from rippletwin.twin.twin import Twin
from rippletwin.twin.twin_file import load_covariance


class FittedTwin(NamedTuple):
    """A twin, the covariance (P, P) of its theta or None, and what it leaves of the healthy ripple,
    relative."""

    twin: Twin
    covariance: np.ndarray | None
    misfit: float


def fit_nominal(case: Case, out: Path) -> FittedTwin:
    """The twin of the data sheet; only the shaft angles are fitted."""
    found = _calibrate(case)
    return FittedTwin(found.nominal, None, float(found.before.relative))


def fit_calibrated(case: Case, out: Path) -> FittedTwin:
    """The twin with the physics of the data sheet and unsteady friction."""
    found = _calibrate(case)
    report.save(found, out)
    return FittedTwin(found.twin, found.covariance, float(found.after.relative))


def fit_explained(case: Case, out: Path) -> FittedTwin:
    """The twin with the effects that `rippletwin explain` finds."""
    explanation = explain(case, processes=1)
    verdict = write_verdict(explanation, out)
    misfit = float(verdict["fit"]["after"]["in_sample"])
    return FittedTwin(explanation.twin, load_covariance(out / "twin.json"), misfit)


def _calibrate(case: Case) -> Calibration:
    observations = [observe(r, case.rig, piston_harmonics_only=True) for r in case.recordings]
    twin = Twin(case.rig, observations, friction="unsteady")
    return calibrate(twin, observations, Settings())


TWINS = {"nominal": fit_nominal, "calibrated": fit_calibrated, "explained": fit_explained}
