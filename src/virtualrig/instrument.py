"""What a sensor and its cable add to a pressure: coloured noise, offset and drift; and scatter."""

from dataclasses import dataclass

import numpy as np

from virtualrig.recorder import SAMPLING_RATE_HZ


@dataclass(frozen=True)
class Instrument:
    """`noise` Pa rms of each sensor, 1/f below `corner_hz`; `scatter` relative standard deviation
    of a revolution's ripple; `offset` (sensors,) Pa; `drift` Pa within a recording.
    """

    noise: float
    corner_hz: float
    scatter: float
    offset: tuple[float, ...]
    drift: float


def measure(
    pressure: np.ndarray, turns: np.ndarray, instrument: Instrument, rng: np.random.Generator
) -> np.ndarray:
    """What the logger keeps of a pressure (sensors, samples), Pa, at crank `turns` (samples,)."""
    sensors, count = pressure.shape
    mean = pressure.mean(axis=1, keepdims=True)
    read = mean + (pressure - mean) * revolution_scatter(turns, instrument.scatter, rng)
    read += coloured_noise(sensors, count, instrument.noise, instrument.corner_hz, rng)
    slope = instrument.drift * rng.standard_normal((sensors, 1))
    return read + np.asarray(instrument.offset)[:, None] + slope * np.linspace(-0.5, 0.5, count)


def revolution_scatter(turns: np.ndarray, deviation: float, rng: np.random.Generator) -> np.ndarray:
    """Factor (samples,) of the ripple: normal at each whole turn, linear between."""
    knots = np.arange(np.floor(turns[0]), np.ceil(turns[-1]) + 1)
    return np.interp(turns, knots, 1 + deviation * rng.standard_normal(len(knots)))


def coloured_noise(
    sensors: int, count: int, rms: float, corner_hz: float, rng: np.random.Generator
) -> np.ndarray:
    """Noise (sensors, count) of root mean square `rms`; its spectral density is 1 + corner/f.

    Source of the law: Keshner, Proc. IEEE 70, 1982. There is nothing below the first frequency of
    the recording.
    """
    frequency = np.fft.rfftfreq(count, 1 / SAMPLING_RATE_HZ)
    density = np.zeros(len(frequency))
    density[1:] = 1 + corner_hz / frequency[1:]
    spectrum = np.fft.rfft(rng.standard_normal((sensors, count)), axis=1) * np.sqrt(density)
    return rms * np.fft.irfft(spectrum, n=count, axis=1) / np.sqrt(density.mean())
