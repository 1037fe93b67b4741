"""Calibrate the twin of a case: its healthy recordings at the pistons' harmonics."""

from __future__ import annotations

from collections.abc import Callable

from rippletwin.calibration.calibrate import Calibration, calibrate
from rippletwin.case.model import Case
from rippletwin.errors import InputError
from rippletwin.spectra.observation import Observation, observe
from rippletwin.twin.twin import Twin


def calibrate_case(
    case: Case,
    friction: str = "steady",
    progress: Callable[[str], None] | None = None,
) -> Calibration:
    """Fit the twin to the healthy recordings of a case; `Calibration.twin` is the fitted twin.

    friction  "none", "steady" (the paper's) or "unsteady"
    progress  is called with a sentence after each frequency limit

    Raises InputError where no recording is healthy, where the band of one holds no harmonic of the
    pistons, and as `check_sources` and `check_load_table`; ValueError for another friction law.
    """
    observations = observe_healthy(case)
    twin = Twin(case.rig, observations, friction=friction)
    return calibrate(twin, observations, progress=progress)


def observe_healthy(case: Case) -> list[Observation]:
    """What a calibration fits: the healthy recordings of a case at the pistons' harmonics.

    Raises InputError as `calibrate_case`.
    """
    if not case.healthy:
        raise InputError(
            case.folder / "rig.yaml",
            "recordings",
            "none has state: healthy",
            "calibration needs at least one healthy recording",
        )
    return [observe(r, case.rig, piston_harmonics_only=True) for r in case.healthy]
