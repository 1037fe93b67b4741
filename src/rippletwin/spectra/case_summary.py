"""The summary of a case that `rippletwin check` prints."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np

from rippletwin.case.model import Case, Recording, Rig
from rippletwin.spectra.angular_resampling import Revolutions
from rippletwin.spectra.noise import noise_cycle_scatter, noise_mad
from rippletwin.spectra.observation import Observation, observe, revolutions_of

SIGNIFICANT_POWER = 20.0  # |X|^2 over its variance; pure noise exceeds it once in 5e8


def summarise_case(
    case: Case, progress: Callable[[str, int, int], None] | None = None
) -> Iterator[str]:
    """Lines of text: the rig in one, then every recording as it is analysed.

    `progress` is called with a recording's label, how many steps of its analysis are done, and of
    how many.
    """
    rig = case.rig
    sensors = ", ".join(f"{s.name} at {s.position:g} m" for s in rig.sensors) or "none"
    yield f"{case.folder}: {len(rig.line)} segment(s), {rig.length:g} m, load: {rig.load.kind}"
    yield f"  sensors: {sensors}"
    yield f"  {len(case.recordings)} recording(s), {len(case.healthy)} healthy"
    for recording in case.recordings:
        yield f"{recording.label} ({recording.kind}, {recording.state})"
        if recording.kind == "periodic":
            step = None if progress is None else partial(progress, recording.label)
            yield from _periodic(recording, revolutions_of(recording, rig), rig, step)
        else:
            yield from _spectral(recording, observe(recording, rig))


def _periodic(
    recording: Recording, revolutions: Revolutions, rig: Rig, progress: Callable | None
) -> Iterator[str]:
    observation = observe(recording, rig, revolutions=revolutions, progress=progress)
    speed = revolutions.speed_hz
    yield (
        f"  {len(speed)} whole revolutions at {60 * observation.speed_hz:.2f} r/min (nominal "
        f"{recording.speed_rpm:g}), wandering by {100 * np.std(speed) / np.mean(speed):.3f} % rms"
    )
    mad, scatter = noise_mad(recording.pressure), noise_cycle_scatter(revolutions.windows)
    variance = observation.variance
    above = np.abs(observation.values) ** 2 > SIGNIFICANT_POWER * variance
    piston = observation.orders % rig.pump["pistons"] == 0
    for s, sensor in enumerate(rig.sensors):
        yield (
            f"  {sensor.name}: mean {observation.mean[s] / 1e6:.3f} MPa, "
            f"noise {mad[s]:.0f} Pa (wavelets), {scatter[s]:.0f} Pa (cycle scatter); above noise: "
            f"{np.sum(above[s] & piston)} of {np.sum(piston)} piston harmonics, "
            f"{np.sum(above[s] & ~piston)} of {np.sum(~piston)} other shaft orders"
        )


def _spectral(recording: Recording, observation: Observation) -> Iterator[str]:
    frequency = observation.frequency_hz
    if recording.kind == "random":
        yield f"  {recording.pressure.shape[1] / recording.sampling_rate_hz:.1f} s"
    else:
        yield f"  measured {len(recording.spectra)} time(s)"
    yield f"  {frequency.size} frequencies, {frequency[0]:g} to {frequency[-1]:g} Hz"
    deviation = np.sqrt(observation.variance)
    relative = np.linalg.norm(deviation, axis=1) / np.linalg.norm(observation.values, axis=1)
    names = [sensor.name for sensor in observation.sensors] or ["input impedance"]
    for name, value in zip(names, relative):
        yield f"  {name}: relative standard deviation {100 * value:.2f} %"
