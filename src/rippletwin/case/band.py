"""The band of a recording that is used, and the frequencies to which plane waves are alone."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from rippletwin.case.model import Recording, Rig
from rippletwin.errors import InputError

DEFAULT_MAX_HZ = 5000.0  # of a sampled recording whose band is not stated
FIRST_CROSS_MODE = 1.841  # first zero of J1', for a circular section


def plane_wave_limit(rig: Rig) -> tuple[float, int]:
    """Frequency in Hz, and number of the segment where it is lowest, above which waves across the
    pipe travel too: 1.841 a/(pi D) (Morse & Ingard 1968, Theoretical Acoustics, sec. 9.2)."""
    limits = [FIRST_CROSS_MODE * s.wave_speed / (np.pi * s.diameter) for s in rig.line]
    lowest = int(np.argmin(limits))
    return float(limits[lowest]), lowest + 1


def narrow_band(
    recording: Recording, lowest_hz: float | None, highest_hz: float | None
) -> Recording:
    """The recording with the narrower of its own band and another.

    Raises InputError where nothing is between them.
    """
    lows = [x for x in (recording.min_frequency_hz, lowest_hz) if x is not None]
    highs = [x for x in (recording.max_frequency_hz, highest_hz) if x is not None]
    low, high = max(lows, default=None), min(highs, default=None)
    if low is not None and high is not None and low >= high:
        raise InputError(
            "command line",
            "--min-frequency, --max-frequency",
            f"nothing of {recording.label} is between {low:g} and {high:g} Hz",
            "Give a lower and a higher frequency, in this order",
        )
    return replace(recording, min_frequency_hz=low, max_frequency_hz=high)


def limit_to_ripple(recording: Recording) -> tuple[Recording, list[str]]:
    """The recording up to the highest order that its stated flow ripple resolves, and a line that
    says so where that is less than its band. Of another kind than `periodic` the ripple is not
    used."""
    ripple = recording.flow_ripple
    if ripple is None or recording.kind != "periodic":
        return recording, []
    limit = (ripple.highest_order + 0.5) * recording.speed_rpm / 60.0
    highest = _highest(recording)
    if highest <= limit:
        return recording, []
    needed = 2 * int(highest * 60.0 / recording.speed_rpm) + 2
    warning = (
        f"{recording.label}: used up to {limit:.4g} instead of {highest:.4g} Hz, since the angles "
        f"of its flow_ripple resolve no higher harmonics; give {needed} even angles or more"
    )
    return replace(recording, max_frequency_hz=limit), [warning]


def band_warnings(rig: Rig, recordings: Sequence[Recording]) -> Iterator[str]:
    """A line for every recording that is used above the plane-wave limit of the rig."""
    limit, segment = plane_wave_limit(rig)
    for recording in recordings:
        highest = _highest(recording)
        if highest > limit:
            yield (
                f"{recording.label}: used up to {highest:.4g} Hz, but above {limit:.4g} Hz waves "
                f"across segment {segment} travel too (1.841 a/(pi D)), which the twin does not "
                "have; give max_frequency_hz or --max-frequency"
            )


def _highest(recording: Recording) -> float:
    """The highest frequency, Hz, that is used: of the stated band, as far as the data go."""
    stated = recording.max_frequency_hz
    if recording.frequency_hz is not None:
        last = float(recording.frequency_hz[-1])
        return last if stated is None else min(stated, last)
    return min(stated or DEFAULT_MAX_HZ, 0.4 * recording.sampling_rate_hz)
