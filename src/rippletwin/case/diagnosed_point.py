"""Which recordings of a case are diagnosed: those of one operating point."""

from __future__ import annotations

from collections.abc import Sequence

from rippletwin.case.model import Recording


def recordings_to_diagnose(
    recordings: Sequence[Recording],
) -> tuple[list[Recording], list[Recording]]:
    """Periodic recordings at the diagnosed operating point, and those at another one.

    The diagnosed point, nominal speed and load pressure, is that of the first periodic recording
    that is not healthy, or of the first periodic one where all are healthy. The order of the
    recordings is kept. Raises ValueError where none is periodic.
    """
    periodic = [recording for recording in recordings if recording.kind == "periodic"]
    if not periodic:
        raise ValueError("no periodic recording: there is nothing to diagnose")
    point = _point(next((r for r in periodic if r.state != "healthy"), periodic[0]))
    return (
        [recording for recording in periodic if _point(recording) == point],
        [recording for recording in periodic if _point(recording) != point],
    )


def _point(recording: Recording) -> tuple[float, float]:
    return recording.speed_rpm, recording.load_pressure
