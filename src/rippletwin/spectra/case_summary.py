"""The summary of a case that `rippletwin check` prints: as plain data, and in words."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from rippletwin.case.model import Case, Recording, Rig
from rippletwin.spectra.noise import noise_cycle_scatter, noise_mad
from rippletwin.spectra.observation import observe, revolutions_of

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
    }


def rig_in_words(rig: dict) -> Iterator[str]:
    """Lines of text of what `summarise_rig` returns."""
    sensors = ", ".join(f"{s['name']} at {s['position_m']:g} m" for s in rig["sensors"]) or "none"
    yield f"{rig['case']}: {rig['segments']} segment(s), {rig['length_m']:g} m, load: {rig['load']}"
    yield f"  sensors: {sensors}"
    yield f"  {rig['recording_count']} recording(s), {rig['healthy_count']} healthy"


def summarise_recording(
    recording: Recording, rig: Rig, progress: Callable[[str, int, int], None] | None = None
) -> dict:
    """A recording as it is analysed: revolutions, speed, and mean, noise, harmonics by sensor.

    `progress` is called with the recording's label, how many steps of its analysis are done, and
    of how many.
    """
    known = {"label": recording.label, "kind": recording.kind, "state": recording.state}
    if recording.kind == "periodic":
        step = None if progress is None else partial(progress, recording.label)
        return known | _periodic(recording, rig, step)
    return known | _spectral(recording, rig)


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
        f"(nominal {summary['nominal_speed_rpm']:g}), wandering by "
        f"{100 * summary['speed_wander']:.3f} % rms"
    )
    for sensor in summary["sensors"]:
        piston, other = sensor["piston_harmonics"], sensor["other_orders"]
        yield (
            f"  {sensor['name']}: mean {sensor['mean_pa'] / 1e6:.3f} MPa, "
            f"noise {sensor['noise_pa']:.0f} Pa (wavelets), {sensor['cycle_scatter_pa']:.0f} Pa "
            f"(cycle scatter); above noise: {piston[0]} of {piston[1]} piston harmonics, "
            f"{other[0]} of {other[1]} other shaft orders"
        )


def _periodic(recording: Recording, rig: Rig, progress: Callable | None) -> dict:
    revolutions = revolutions_of(recording, rig)
    observation = observe(recording, rig, revolutions=revolutions, progress=progress)
    speed = revolutions.speed_hz
    mad, scatter = noise_mad(recording.pressure), noise_cycle_scatter(revolutions.windows)
    above = np.abs(observation.values) ** 2 > SIGNIFICANT_POWER * observation.variance
    piston = observation.orders % rig.pump["pistons"] == 0
    return {
        "revolutions": len(speed),
        "speed_rpm": float(60 * observation.speed_hz),
        "nominal_speed_rpm": recording.speed_rpm,
        "speed_wander": float(np.std(speed) / np.mean(speed)),
        "sensors": [
            {
                "name": sensor.name,
                "mean_pa": float(observation.mean[s]),
                "noise_pa": float(mad[s]),
                "cycle_scatter_pa": float(scatter[s]),
                "piston_harmonics": [int(np.sum(above[s] & piston)), int(np.sum(piston))],
                "other_orders": [int(np.sum(above[s] & ~piston)), int(np.sum(~piston))],
            }
            for s, sensor in enumerate(rig.sensors)
        ],
    }


def _spectral(recording: Recording, rig: Rig) -> dict:
    observation = observe(recording, rig)
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
