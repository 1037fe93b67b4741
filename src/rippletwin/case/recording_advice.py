"""What recordings of a rig must have for an answer: sensors, operating points, band, length."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

from rippletwin.case.model import Recording, Rig

BAND_HZ = 4000.0  # up to which explain uses a recording
NYQUIST_SHARE = 0.4  # of the sampling rate, up to which spectra are used
FEW_PISTON_HARMONICS = 8
FEW_REVOLUTIONS = 100
SAME_PRESSURE = 0.1  # relative; closer together, two points determine no more than one


@dataclass(frozen=True)
class PlannedRecording:
    """What is known of a recording before it is read: state, speed (r/min), pressure (Pa), kind,
    and sampling rate (Hz) and length (s) where they are known."""

    state: str
    speed_rpm: float | None
    load_pressure: float | None
    sampling_rate_hz: float | None = None
    seconds: float | None = None
    kind: str = "periodic"

    @classmethod
    def of(cls, recording: Recording) -> PlannedRecording:
        """A recording that has been read."""
        rate, seconds = recording.sampling_rate_hz, None
        if recording.pressure is not None:
            seconds = recording.pressure.shape[1] / rate
        point = recording.speed_rpm, recording.load_pressure
        return cls(recording.state, *point, rate, seconds, recording.kind)


def advise(rig: Rig, recordings: Sequence[PlannedRecording]) -> list[str]:
    """Plain sentences, one for each thing that these recordings do not allow, with the remedy.

    Of a line that is excited without a pump, only sensors are told.
    """
    # a speed may be stated of a recording of noise too
    periodic = [r for r in recordings if r.kind == "periodic" and r.speed_rpm is not None]
    if recordings and not periodic:
        return list(_of_sensors(rig))
    return [
        *_of_sensors(rig),
        *_of_operating_points(rig, [r for r in periodic if r.state == "healthy"]),
        *_of_band(rig, periodic),
    ]


def half_wave_hz(rig: Rig) -> float | None:
    """The frequency up to which some pair of sensors is less than half a wave apart; None for
    fewer than two sensors."""
    places = sorted(s.position for s in rig.sensors)
    delays = [_delay(rig, a, b) for a, b in pairwise(places)]
    return 0.5 / min(delays) if delays and min(delays) > 0 else None


def _of_sensors(rig: Rig) -> Iterator[str]:
    if not rig.sensors:
        return
    if len(rig.sensors) == 1:
        yield (
            "One sensor: a fault of the sensor cannot be told from the line, nor can the place of "
            "an effect be found. Add a second one."
        )
        return
    limit = half_wave_hz(rig)
    if limit is not None and limit < BAND_HZ:
        places = sorted(s.position for s in rig.sensors)
        spacing = min(b - a for a, b in pairwise(places))
        yield (
            f"The nearest sensors are {spacing:.3g} m apart: from {limit:.0f} Hz on that is half a "
            f"wave and more, and at multiples of {limit:.0f} Hz two sensors tell as little as one. "
            f"A pair less than {spacing * limit / BAND_HZ:.2g} m apart covers the band to "
            f"{BAND_HZ:.0f} Hz."
        )
    if len(rig.sensors) == 2:
        yield "Two sensors place an effect between or outside them. A third narrows its place."


def _of_operating_points(rig: Rig, healthy: list[PlannedRecording]) -> Iterator[str]:
    if not healthy:
        yield (
            "No periodic recording of the healthy pump: the twin cannot be calibrated on the "
            "ripple. Record the pump while it is healthy."
        )
        return
    pressures = [r.load_pressure for r in healthy if r.load_pressure is not None]
    apart = pressures and max(pressures) > (1 + SAME_PRESSURE) * min(pressures)
    if not rig.fluid.is_gas and not apart:
        yield (
            "One mean pressure of the healthy pump: entrained air cannot be told from a lower wave "
            "speed, and no prediction is tested at another pressure. Record a second pressure."
        )
    speeds = [r.speed_rpm for r in healthy]
    if max(speeds) < (1 + SAME_PRESSURE / 5) * min(speeds):
        yield (
            "One speed of the healthy pump: the harmonics see the line at the same frequencies "
            "each time. A second speed separates leaks, branches and sensor errors better."
        )


def _of_band(rig: Rig, periodic: list[PlannedRecording]) -> Iterator[str]:
    known = [r for r in periodic if r.sampling_rate_hz]
    if not known:
        yield (
            f"Sample at {BAND_HZ / NYQUIST_SHARE / 1000:.0f} kHz or more: frequencies to "
            f"{BAND_HZ:.0f} Hz are used. Record {FEW_REVOLUTIONS} revolutions and more at constant "
            "speed."
        )
        return
    lowest = min(known, key=lambda r: r.sampling_rate_hz)
    end = NYQUIST_SHARE * lowest.sampling_rate_hz
    if end < BAND_HZ:
        harmonics = int(end / (rig.pump["pistons"] * lowest.speed_rpm / 60))
        few = " That is little for a line." if harmonics < FEW_PISTON_HARMONICS else ""
        yield (
            f"Sampling at {lowest.sampling_rate_hz:g} Hz ends the band at {end:.0f} Hz, "
            f"{harmonics} piston harmonics; {BAND_HZ:.0f} Hz are used where they are there.{few}"
        )
    short = [r for r in known if r.seconds and r.seconds * r.speed_rpm / 60 < FEW_REVOLUTIONS]
    if short:
        fewest = min(int(r.seconds * r.speed_rpm / 60) for r in short)
        yield (
            f"{len(short)} recording(s) of fewer than {FEW_REVOLUTIONS} revolutions, the shortest "
            f"of {fewest}: their noise is poorly known. Record {FEW_REVOLUTIONS} and more."
        )


def _delay(rig: Rig, start: float, end: float) -> float:
    """Travel time of a wave between two places, s."""
    total, begin = 0.0, 0.0
    for segment in rig.line:
        overlap = min(end, begin + segment.length) - max(start, begin)
        total += max(overlap, 0.0) / segment.wave_speed
        begin += segment.length
    return total
