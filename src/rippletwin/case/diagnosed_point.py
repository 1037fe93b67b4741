"""Which recordings of a case are diagnosed: those of one operating point."""

from __future__ import annotations

from collections.abc import Sequence

from rippletwin.case.model import Recording

SAME_SPEED, SAME_PRESSURE = 0.005, 0.02
"""Relative differences from the diagnosed point within which a recording is at that point."""


def recordings_to_diagnose(
    recordings: Sequence[Recording],
) -> tuple[list[Recording], list[Recording]]:
    """Periodic recordings at the diagnosed operating point, and those at another one.

    The diagnosed point, nominal speed and load pressure, is that of the first periodic recording
    that is not healthy, or of the first periodic one where all are healthy. A recording is at that
    point where its speed differs by no more than SAME_SPEED and its pressure by no more than
    SAME_PRESSURE. The order of the recordings is kept. Raises ValueError where none is periodic.
    """
    periodic = [recording for recording in recordings if recording.kind == "periodic"]
    if not periodic:
        raise ValueError("no periodic recording: there is nothing to diagnose")
    first = next((r for r in periodic if r.state != "healthy"), periodic[0])
    near = [_is_near(recording, first) for recording in periodic]
    return (
        [recording for recording, here in zip(periodic, near) if here],
        [recording for recording, here in zip(periodic, near) if not here],
    )


def reference_recordings(recordings: Sequence[Recording]) -> list[Recording]:
    """Recordings at the diagnosed point whose state is known; the first one there where none is.

    Faults are simulated for their operating point and networks are scored with them, so that a
    further recording of unknown state changes neither.
    """
    here = recordings_to_diagnose(recordings)[0]
    return [r for r in here if r.state != "unknown"] or here[:1]


def unknown_recordings(recordings: Sequence[Recording]) -> list[Recording]:
    """Recordings at the diagnosed point whose state is to be told."""
    return [r for r in recordings_to_diagnose(recordings)[0] if r.state == "unknown"]


def _is_near(recording: Recording, other: Recording) -> bool:
    """Whether two recordings are of one operating point, within the tolerances."""
    pairs = (
        (recording.speed_rpm, other.speed_rpm, SAME_SPEED),
        (recording.load_pressure, other.load_pressure, SAME_PRESSURE),
    )
    return all(
        a == b or (None not in (a, b) and abs(a / b - 1) <= tolerance) for a, b, tolerance in pairs
    )
