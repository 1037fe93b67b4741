"""From recordings to observations: complex values with a covariance, whatever the kind."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from rippletwin.case.band import DEFAULT_MAX_HZ
from rippletwin.case.model import FlowRipple, Recording, Rig, Sensor
from rippletwin.errors import InputError
from rippletwin.harmonics import peak_amplitudes
from rippletwin.spectra.angular_resampling import (
    NoShaftRippleError,
    Revolutions,
    cut_revolutions,
)
from rippletwin.spectra.corrected_ripple import CorrectedRipple
from rippletwin.spectra.frequency_selection import select_frequencies
from rippletwin.spectra.speed_regression import mean_speed, regress_to_mean_speed
from rippletwin.spectra.transfer_function import coherent_spectra

MAX_SAMPLING_SHARE = 0.4  # of the sampling rate, up to which frequencies are kept
DEFAULT_RELATIVE_ERROR = 0.02  # of a spectrum or impedance without repeats or a stated error
SMOOTHED_FREQUENCIES = 51  # over which the scatter of repeats is averaged


@dataclass(frozen=True)
class Observation:
    """A recording as every later stage uses it.

    values (S, F) complex: peak amplitudes in Pa (periodic, random, spectrum), or the impedance
    (S = 1; Pa s/m3, or in units of the first segment's characteristic impedance if `normalised`).
    covariance (F, S, S) = E[e e^H] of the complex errors e of values, taken as circular: the real
    and the imaginary part each have half the variance. orders (F,) are shaft orders, None where the
    source is not the shaft. Fits use nothing below `min_frequency_hz`. mean (S,) is the mean
    pressure, Pa. `source` is what is known of the flow source: "known" (impedance), "nominal" (a
    flow ripple or a pump model) or "free". `modulation` b, rad: the shaft leads uniform rotation by
    Re(b exp(j t)) rad, and modulates the nominal ripple. `corrected_ripple` is what is known of the
    ripple beyond the nominal one: what load and compliance do in no proportion follows from it.
    """

    kind: str
    label: str
    frequency_hz: np.ndarray
    orders: np.ndarray | None
    values: np.ndarray
    covariance: np.ndarray
    mean: np.ndarray
    speed_hz: float | None
    load_pressure: float | None
    source: str
    flow_ripple: FlowRipple | None
    sensors: tuple[Sensor, ...]
    normalised: bool = False
    min_frequency_hz: float = 0.0
    modulation: complex = 0.0
    corrected_ripple: CorrectedRipple | None = None

    @property
    def variance(self) -> np.ndarray:
        """Variance (S, F) of the complex errors of values, in their unit squared, each sensor and
        frequency alone."""
        return np.einsum("fss->sf", self.covariance).real


def observe(
    recording: Recording,
    rig: Rig,
    max_frequency_hz: float | None = None,
    piston_harmonics_only: bool = False,
    revolutions: Revolutions | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Observation:
    """The observation of a recording.

    max_frequency_hz : highest frequency kept; None is 5 kHz, or 0.4 times the sampling rate where
        that is lower, or all of a spectrum.
    piston_harmonics_only : keep only the orders that are multiples of the number of pistons.
    revolutions : of a periodic recording, where they are known already (`revolutions_of`).
    progress : called with how many steps of a periodic recording's analysis are done, and of all.

    Frequencies outside the recording's own band are not kept; of a periodic recording those below
    it are, unless `piston_harmonics_only`: its orders count from 1, and who uses them leaves out
    those below `min_frequency_hz`. Raises InputError where nothing is left, and where no ripple of
    a periodic recording repeats with the shaft.
    """
    own = recording.max_frequency_hz
    if own is not None:
        max_frequency_hz = own if max_frequency_hz is None else min(own, max_frequency_hz)
    if recording.kind == "periodic":
        revolutions = revolutions or revolutions_of(recording, rig)
        observation = _observe_periodic(
            recording, rig, revolutions, max_frequency_hz, piston_harmonics_only, progress
        )
    elif recording.kind == "random":
        observation = _observe_random(recording, rig, max_frequency_hz)
    else:
        observation = _observe_spectra(recording, rig, max_frequency_hz)
    low = recording.min_frequency_hz or 0.0
    kept = observation.frequency_hz >= low
    _check_any(recording, kept)
    observation = replace(observation, min_frequency_hz=low)
    together = observation.orders is not None and not piston_harmonics_only
    return observation if together else select_frequencies(observation, kept)


def revolutions_of(
    recording: Recording, rig: Rig, samples_per_revolution: int | None = None
) -> Revolutions:
    """The whole revolutions of a periodic recording.

    Raises InputError where no ripple repeats with the shaft: the pump stands still, or the speed is
    another one.
    """
    try:
        return cut_revolutions(
            recording.pressure,
            recording.sampling_rate_hz,
            rig.pump["pistons"],
            recording.speed_rpm,
            samples_per_revolution,
        )
    except NoShaftRippleError:
        raise InputError(
            recording.file,
            "speed_rpm",
            f"no ripple repeats with the shaft at {recording.speed_rpm:g} r/min",
            "Correct speed_rpm or pump.pistons, or leave the recording out",
        ) from None


def _observe_periodic(
    recording, rig, revolutions, max_frequency_hz, piston_harmonics_only, progress
) -> Observation:
    speed_hz = mean_speed(revolutions.speed_hz)
    highest = _highest(max_frequency_hz, recording.sampling_rate_hz)
    orders = np.arange(1, int(highest / speed_hz) + 1)
    _check_any(recording, orders > 0)
    windows = revolutions.windows
    spectra = np.stack([peak_amplitudes(window)[:, orders] for window in windows])
    spectra -= spectra_of_drift(windows.mean(axis=2), windows.shape[2], orders)
    values, covariance = regress_to_mean_speed(spectra, revolutions.speed_hz, orders, progress)
    if piston_harmonics_only:
        kept = orders % rig.pump["pistons"] == 0
        orders, values, covariance = orders[kept], values[:, kept], covariance[kept]
    nominal = recording.flow_ripple is not None or len(rig.pump) > 1
    return Observation(
        kind=recording.kind,
        label=recording.label,
        frequency_hz=orders * speed_hz,
        orders=orders,
        values=values,
        covariance=covariance,
        mean=revolutions.windows.mean(axis=(0, 2)),
        speed_hz=speed_hz,
        load_pressure=recording.load_pressure,
        source="nominal" if nominal else "free",
        flow_ripple=recording.flow_ripple,
        sensors=rig.sensors,
    )


def spectra_of_drift(means: np.ndarray, samples: int, orders: np.ndarray) -> np.ndarray:
    """Peak amplitudes (R, S, K) of the ramps that slow drift of a sensor, or of the pressure, adds
    to revolutions of so many samples, whose means are (R, S). The mean of a revolution drifts by as
    much as the next ones differ."""
    if len(means) < 2:
        return np.zeros((*means.shape, len(orders)))
    ramp = (np.arange(samples) + 0.5) / samples
    return np.gradient(means, axis=0)[..., None] * peak_amplitudes(ramp)[orders]


def _check_any(recording: Recording, kept: np.ndarray) -> None:
    """Raise InputError where no frequency is kept."""
    if not np.any(kept):
        raise InputError(
            recording.file,
            "min_frequency_hz, max_frequency_hz",
            "no frequency of the recording is between them",
            "Give a wider band",
        )


def _observe_random(recording, rig, max_frequency_hz) -> Observation:
    values, covariance, frequency_hz = coherent_spectra(
        recording.pressure, recording.sampling_rate_hz, rig
    )
    keep = frequency_hz <= _highest(max_frequency_hz, recording.sampling_rate_hz)
    return Observation(
        kind=recording.kind,
        label=recording.label,
        frequency_hz=frequency_hz[keep],
        orders=None,
        values=values[:, keep],
        covariance=covariance[keep],
        mean=recording.pressure.mean(axis=1),
        speed_hz=None,
        load_pressure=recording.load_pressure,
        source="free",
        flow_ripple=None,
        sensors=rig.sensors,
    )


def _observe_spectra(recording, rig, max_frequency_hz) -> Observation:
    # at 0 Hz, where a table may begin, no wave is, and the scatter of silence is not relative
    keep = recording.frequency_hz > 0.0
    if max_frequency_hz is not None:
        keep &= recording.frequency_hz <= max_frequency_hz
    frequency_hz, repeats = recording.frequency_hz[keep], recording.spectra[:, :, keep]
    values = repeats.mean(axis=0)
    impedance = recording.kind == "input_impedance"
    if impedance:
        first = rig.line[0]
        unit = 1.0 if recording.normalised else rig.fluid.density * first.wave_speed / first.area
        # Errors of R = (Z - Zc)/(Z + Zc) are even over frequency; dZ = (Z + Zc)^2/(2 Zc) dR.
        size = np.abs(values + unit) ** 2 / (2 * unit)
    else:
        size = np.sqrt(np.mean(np.abs(values) ** 2, axis=0, keepdims=True)) * np.ones_like(values)
    relative = recording.relative_error or DEFAULT_RELATIVE_ERROR
    if len(repeats) > 1:
        relative = _relative_scatter(repeats - values, np.abs(size))
    variance = (relative * np.abs(size)) ** 2
    return Observation(
        kind=recording.kind,
        label=recording.label,
        frequency_hz=frequency_hz,
        orders=None,
        values=values,
        covariance=np.einsum("sf,st->fst", variance, np.eye(len(values))).astype(complex),
        mean=np.full(len(values), recording.load_pressure or 0.0),
        speed_hz=None,
        load_pressure=recording.load_pressure,
        source="known" if impedance else "free",
        flow_ripple=None,
        sensors=() if impedance else rig.sensors,
        normalised=recording.normalised,
    )


def _relative_scatter(residual: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Relative standard deviation (S, F) of the mean of repeats from `residual` (R, S, F).

    Two or three repeats determine little at one frequency: the scatter is averaged over
    SMOOTHED_FREQUENCIES of them.
    """
    count = len(residual)
    variance = np.sum(np.abs(residual / size) ** 2, axis=0) / (count - 1) / count
    return np.sqrt(uniform_filter1d(variance, SMOOTHED_FREQUENCIES, axis=-1, mode="nearest"))


def _highest(max_frequency_hz: float | None, sampling_rate_hz: float) -> float:
    limit = DEFAULT_MAX_HZ if max_frequency_hz is None else max_frequency_hz
    return min(limit, MAX_SAMPLING_SHARE * sampling_rate_hz)
