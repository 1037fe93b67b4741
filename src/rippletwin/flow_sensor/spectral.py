"""The spectral virtual flow sensor: the line inverted harmonic by harmonic.

At each shaft order the state at the pump is two waves w = (f, b); every sensor is one linear
equation m = A w for them, the load one more that is trusted less. The linear estimate of least
mean square error (Kay 1993, Fundamentals of Statistical Signal Processing, vol. 1, theorem 11.1),

    w = (A^H R^-1 A + P^-1)^-1 A^H R^-1 m,

has the errors R of the equations (sensor noise, and a part of the reading for what the model gets
wrong) and P, the waves' variance. It is Tikhonov regularisation with weights that mean something:
where two sensors stand half a wave apart and see the same, the load's equation takes over; without
it the estimate goes to zero instead of to infinity. (Two-sensor inversion and its blind
frequencies: Johnston & Drew 1996, Proc. IMechE I 210, 125.)
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from rippletwin.flow_sensor.line import LineResponse, NetworkFactory, line_response

MODEL_ERROR = 0.01
LOAD_ERROR = 0.1
SPEED_STEP = 2e-4  # relative: windows closer than that share a network


@dataclass(frozen=True)
class FlowEstimate:
    """Flow ripple at the pump outlet of n windows, zero mean, nothing above the bandwidth.

    flow (n, M) m3/s; orders (F,); harmonics (n, F) complex peak amplitudes; standard_deviation
    (F,) of the complex harmonics' error as the model of errors has it, and `prior` (F,) what it
    would be without any sensor: where the first is not far below, an order is not measured.
    """

    flow: np.ndarray
    orders: np.ndarray
    harmonics: np.ndarray
    standard_deviation: np.ndarray
    prior: np.ndarray


def estimate_flow(
    windows: np.ndarray,
    speed_hz: float | np.ndarray,
    network: NetworkFactory,
    noise: float | np.ndarray,
    bandwidth_hz: float,
    model_error: float = MODEL_ERROR,
    load_error: float | None = LOAD_ERROR,
) -> FlowEstimate:
    """Outlet flow of each one-revolution window.

    Parameters
    ----------
    windows : (n, S, M) pressure in Pa at M equal steps of the shaft's angle.
    speed_hz : revolutions per second, one for all or (n,).
    network : the calibrated line, see `NetworkFactory`.
    noise : standard deviation of a sample, Pa, one for all sensors or (S,).
    bandwidth_hz : shaft orders up to this frequency are estimated, the others are zero.
    model_error : error of a predicted pressure relative to the wave amplitude.
    load_error : error of the load's reflection coefficient; None leaves the load out.

    Raises ValueError for a bandwidth below the speed or above half the sampling rate.
    """
    windows = np.asarray(windows, dtype=float)
    count, sensors, samples = windows.shape
    speeds = np.broadcast_to(np.asarray(speed_hz, dtype=float), (count,))
    orders = orders_within(bandwidth_hz, speeds.mean(), samples)
    measured = np.fft.rfft(windows, axis=-1)[..., orders] * (2 / samples)  # (n, S, F)
    noise_power = 4 / samples * np.broadcast_to(np.asarray(noise, float) ** 2, (sensors,))
    # The largest reading stands for the waves: a node at one sensor is rarely one at the others.
    power = np.max(np.mean(np.abs(measured) ** 2, axis=0), axis=0)  # (F,)

    harmonics = np.empty((count, len(orders)), complex)
    variance = np.zeros(len(orders))
    bins = np.rint((speeds / speeds.mean() - 1) / SPEED_STEP)
    for step in np.unique(bins):
        members = np.flatnonzero(bins == step)
        response = line_response(network(float(speeds[members].mean()), orders))
        inverse, error, prior = flow_operator(response, noise_power, power, model_error, load_error)
        harmonics[members] = np.einsum("fs,nsf->nf", inverse, measured[members])
        variance += error * len(members) / count
    spectrum = np.zeros((count, samples // 2 + 1), complex)
    spectrum[:, orders] = harmonics * (samples / 2)
    return FlowEstimate(
        flow=np.fft.irfft(spectrum, samples, axis=-1),
        orders=orders,
        harmonics=harmonics,
        standard_deviation=np.sqrt(variance),
        prior=np.sqrt(prior),
    )


def flow_operator(
    response: LineResponse,
    noise_power: np.ndarray,
    power: np.ndarray,
    model_error: float,
    load_error: float | None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(F, S) matrix from sensor harmonics to flow; the variance (F,) of its error and the prior's.

    `noise_power` (S,) is the variance of a complex harmonic, Pa2; `power` (F,) the waves' variance.
    """
    a = response.to_sensors
    error = noise_power + (model_error**2 * power)[:, None]  # (F, S)
    weighted = np.conj(np.swapaxes(a, 1, 2)) / error[:, None, :]  # A^H R^-1, (F, 2, S)
    precision = weighted @ a + np.eye(2) / power[:, None, None]
    if load_error is not None:
        row = response.to_load[:, None, :]
        precision = precision + np.conj(np.swapaxes(row, 1, 2)) @ row / (
            load_error**2 * power[:, None, None]
        )
    to_flow = response.to_flow[:, None, :]
    gain = to_flow @ np.linalg.inv(precision)  # (F, 1, 2)
    variance = (gain @ np.conj(np.swapaxes(to_flow, 1, 2))).real[:, 0, 0]
    prior = power * np.sum(np.abs(response.to_flow) ** 2, axis=-1)
    return (gain @ weighted)[:, 0], variance, prior


def orders_within(bandwidth_hz: float, speed_hz: float, samples: int) -> np.ndarray:
    """Shaft orders 1, 2, ... up to `bandwidth_hz`, (F,) integers."""
    highest = int(np.floor(bandwidth_hz / speed_hz * (1 + 1e-9)))
    if not 1 <= highest < samples / 2:
        raise ValueError(
            f"a bandwidth of {bandwidth_hz} Hz at {speed_hz} rev/s needs between 1 and "
            f"{(samples - 1) // 2} orders"
        )
    return np.arange(1, highest + 1)


def band_limit(flow: np.ndarray, speed_hz: float, bandwidth_hz: float) -> np.ndarray:
    """`flow` (..., M) over one revolution with only the orders that a sensor estimates.

    Whatever is compared with an estimate, or learnt from to judge one, should pass this first.
    """
    samples = flow.shape[-1]
    orders = orders_within(bandwidth_hz, speed_hz, samples)
    spectrum = np.fft.rfft(flow, axis=-1)
    kept = np.zeros_like(spectrum)
    kept[..., orders] = spectrum[..., orders]
    return np.fft.irfft(kept, samples, axis=-1)
