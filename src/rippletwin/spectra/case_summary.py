"""The summary of a case that `rippletwin check` prints: as plain data, and in words."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np

from rippletwin.case.diagnosed_point import (
    SAME_PRESSURE,
    SAME_SPEED,
    recordings_to_diagnose,
)
from rippletwin.case.model import Case, Recording, Rig
from rippletwin.case.quantities import BAR, plain, write_value
from rippletwin.case.recording_advice import PlannedRecording, advise
from rippletwin.case.speed_estimate import estimate_speed
from rippletwin.spectra.noise import noise_cycle_scatter, noise_mad
from rippletwin.spectra.observation import Observation, observe, revolutions_of

MAX_ANALYSED_REVOLUTIONS = 256  # in the middle of a longer recording, for harmonics and noise
SPEED_BLOCKS = 12  # spread over a longer recording, in each of which the speed is estimated
SPEED_BLOCK_REVOLUTIONS = 32
SIGNIFICANT_POWER = 20.0  # |X|^2 over its variance; pure noise exceeds it once in 5e8


def summarise_rig(case: Case) -> dict:
    """The rig in short: line, load, sensors, number of recordings, warnings."""
    rig = case.rig
    return {
        "case": str(case.folder),
        "segments": len(rig.line),
        "length_m": rig.length,
        "load": rig.load.kind,
        "sensors": [{"name": s.name, "position_m": s.position} for s in rig.sensors],
        "recording_count": len(case.recordings),
        "healthy_count": len(case.healthy),
        "warnings": list(case.warnings),
        "advice": [
            *advise(rig, [PlannedRecording.of(r) for r in case.recordings]),
            *_left_out(case.recordings),
        ],
    }


def _left_out(recordings) -> Iterator[str]:
    """A sentence about recordings that the workflow's networks do not classify."""
    if any(r.kind == "periodic" and r.state != "healthy" for r in recordings):
        elsewhere = [r.label for r in recordings_to_diagnose(recordings)[1] if r.state != "healthy"]
        if elsewhere:
            yield (
                "The workflow's networks classify one operating point, within "
                f"{100 * SAME_SPEED:g} % of speed and {100 * SAME_PRESSURE:g} % of pressure. "
                f"Outside it: {', '.join(elsewhere)}. `rippletwin diagnose` takes all of them."
            )


def rig_in_words(rig: dict) -> Iterator[str]:
    """Lines of text of what `summarise_rig` returns."""
    sensors = ", ".join(f"{s['name']} at {s['position_m']:g} m" for s in rig["sensors"]) or "none"
    yield f"{rig['case']}: {rig['segments']} segment(s), {rig['length_m']:g} m, load: {rig['load']}"
    yield f"  sensors: {sensors}"
    yield f"  {rig['recording_count']} recording(s), {rig['healthy_count']} healthy"


def summarise_recording(
    recording: Recording, rig: Rig, progress: Callable[[str, int, int], None] | None = None
) -> tuple[dict, Observation]:
    """A recording as it is analysed: revolutions, speed, and mean, noise, harmonics by sensor.

    Returns the summary, and the observation that it is of.

    Of a long recording the MAX_ANALYSED_REVOLUTIONS in its middle are analysed; mean, noise and
    range of the speed are those of all of it.

    `progress` is called with the recording's label, how many steps of its analysis are done, and
    of how many.
    """
    known = {"label": recording.label, "kind": recording.kind, "state": recording.state}
    if recording.kind == "periodic":
        step = None if progress is None else partial(progress, recording.label)
        summary, observation = _periodic(recording, rig, step)
    else:
        observation = observe(recording, rig)
        summary = _spectral(recording, observation)
    return known | summary, observation


def recording_in_words(summary: dict) -> Iterator[str]:
    """Lines of text of what `summarise_recording` returns."""
    yield "{label} ({kind}, {state})".format(**summary)
    if summary["kind"] != "periodic":
        if "seconds" in summary:
            yield f"  {summary['seconds']:.1f} s"
        else:
            yield f"  measured {summary['repeats']} time(s)"
        low, high = summary["band_hz"]
        yield f"  {summary['frequencies']} frequencies, {low:g} to {high:g} Hz"
        for sensor in summary["sensors"]:
            yield (
                f"  {sensor['name']}: relative standard deviation {100 * sensor['scatter']:.2f} %"
            )
        return
    yield (
        f"  {summary['revolutions']} whole revolutions at {summary['speed_rpm']:.2f} r/min "
        f"(nominal {summary['nominal_speed_rpm']:g}); it varies by "
        f"{100 * summary['speed_wander']:.3f} % rms"
    )
    if summary["analysed_revolutions"] < summary["revolutions"]:
        low, high = summary["speed_range_rpm"]
        yield (
            f"  speed from beginning to end {low:.4g} to {high:.4g} r/min; harmonics and "
            f"scatter are those of {summary['analysed_revolutions']} revolutions in the middle"
        )
    for sensor in summary["sensors"]:
        piston, other = sensor["piston_harmonics"], sensor["other_orders"]
        noise, scatter = (
            plain(write_value(sensor[key], BAR)) for key in ("noise_pa", "cycle_scatter_pa")
        )
        yield (
            f"  {sensor['name']}: mean {sensor['mean_pa'] * BAR.factor:.2f} bar, noise {noise}, "
            f"scatter of the revolutions {scatter}; "
            f"above noise: {piston[0]} of {piston[1]} piston harmonics, "
            f"{other[0]} of {other[1]} other shaft orders; "
            f"{100 * sensor['repeating_share']:.2f} % of the ripple repeats"
        )


def _periodic(recording: Recording, rig: Rig, progress: Callable | None):
    pistons, rate = rig.pump["pistons"], recording.sampling_rate_hz
    part = _middle(recording)
    revolutions = revolutions_of(part, rig)
    observation = observe(part, rig, revolutions=revolutions, progress=progress)
    speed = revolutions.speed_hz
    mad, scatter = noise_mad(recording.pressure), noise_cycle_scatter(revolutions.windows)
    above = np.abs(observation.values) ** 2 > SIGNIFICANT_POWER * observation.variance
    piston = observation.orders % pistons == 0
    ripple = np.std(revolutions.windows, axis=(0, 2))
    count, speed_rpm = len(speed), float(60 * observation.speed_hz)
    extent = [speed_rpm, speed_rpm]
    if part is not recording:
        speeds = _speeds(recording, pistons)
        extent = [min([speed_rpm, *speeds]), max([speed_rpm, *speeds])]
        count = int(recording.pressure.shape[1] / rate * observation.speed_hz)
    summary = {
        "revolutions": count,
        "analysed_revolutions": len(speed),
        "speed_rpm": speed_rpm,
        "nominal_speed_rpm": recording.speed_rpm,
        "speed_wander": float(np.std(speed) / np.mean(speed)),
        "speed_range_rpm": extent,
        "sensors": [
            {
                "name": sensor.name,
                "mean_pa": float(np.mean(recording.pressure[s], dtype=float)),
                "noise_pa": float(mad[s]),
                "cycle_scatter_pa": float(scatter[s]),
                "repeating_share": float(max(1 - (scatter[s] / ripple[s]) ** 2, 0.0)),
                "piston_harmonics": [int(np.sum(above[s] & piston)), int(np.sum(piston))],
                "other_orders": [int(np.sum(above[s] & ~piston)), int(np.sum(~piston))],
            }
            for s, sensor in enumerate(rig.sensors)
        ],
    }
    return summary, observation


def _middle(recording: Recording) -> Recording:
    """The recording, or MAX_ANALYSED_REVOLUTIONS in the middle of one that is much longer."""
    samples = recording.pressure.shape[1]
    wanted = int(
        (MAX_ANALYSED_REVOLUTIONS + 4) * 60 / recording.speed_rpm * recording.sampling_rate_hz
    )
    if samples < 2 * wanted:
        return recording
    start = (samples - wanted) // 2
    return replace(recording, pressure=recording.pressure[:, start : start + wanted])


def _speeds(recording: Recording, pistons: int) -> list[float]:
    """Speeds, r/min, in blocks that are spread over the recording; those that can be told."""
    rate, samples = recording.sampling_rate_hz, recording.pressure.shape[1]
    size = int(SPEED_BLOCK_REVOLUTIONS * 60 / recording.speed_rpm * rate)
    starts = np.linspace(0, samples - size, SPEED_BLOCKS).astype(int)
    found = (
        estimate_speed(recording.pressure[:, s : s + size], rate, pistons, recording.speed_rpm)
        for s in starts
    )
    return [speed for speed in found if speed is not None]


def _spectral(recording: Recording, observation: Observation) -> dict:
    frequency = observation.frequency_hz
    deviation = np.sqrt(observation.variance)
    relative = np.linalg.norm(deviation, axis=1) / np.linalg.norm(observation.values, axis=1)
    names = [sensor.name for sensor in observation.sensors] or ["input impedance"]
    if recording.kind == "random":
        extent = {"seconds": recording.pressure.shape[1] / recording.sampling_rate_hz}
    else:
        extent = {"repeats": len(recording.spectra)}
    return extent | {
        "frequencies": int(frequency.size),
        "band_hz": [float(frequency[0]), float(frequency[-1])],
        "sensors": [{"name": n, "scatter": float(r)} for n, r in zip(names, relative)],
    }
