"""Calibrate the twin of a case: its healthy recordings at the pistons' harmonics."""

from __future__ import annotations

from collections.abc import Callable

from rippletwin.calibration.calibrate import Calibration, Settings, calibrate
from rippletwin.case.model import Case
from rippletwin.errors import InputError
from rippletwin.spectra.observation import observe
from rippletwin.twin.twin import Twin


def calibrate_case(
    case: Case,
    friction: str = "steady",
    max_frequency_hz: float | None = None,
    progress: Callable[[str], None] | None = None,
) -> Calibration:
    """Fit the twin to the healthy recordings of a case; `Calibration.twin` is the fitted twin.

    friction          "none", "steady" (the paper's) or "unsteady"
    max_frequency_hz  nothing above it is used; None for the recordings' own band
    progress          is called with a sentence after each frequency limit

    Raises InputError where no recording is healthy, and where the band leaves nothing of one.
    """
    if not case.healthy:
        raise InputError(
            case.folder / "rig.yaml",
            "recordings",
            "none has state: healthy",
            "calibration needs at least one healthy recording",
        )
    observations = [observe(r, case.rig, piston_harmonics_only=True) for r in case.healthy]
    _check_band(observations, max_frequency_hz)
    twin = Twin(case.rig, observations, friction=friction)
    settings = Settings(max_frequency_hz=max_frequency_hz)
    return calibrate(twin, observations, settings, progress=progress)


def _check_band(observations, max_frequency: float | None) -> None:
    """Raise InputError where nothing of a recording is below `max_frequency`."""
    lowest = max(o.frequency_hz[0] for o in observations)
    if max_frequency is not None and max_frequency < lowest:
        raise InputError(
            "command line",
            "--max-frequency",
            f"{max_frequency:g} Hz leaves nothing of a recording, whose lowest frequency is "
            f"{lowest:.4g} Hz",
            "give a multiple of the pump's piston frequency, or leave it out",
        )
