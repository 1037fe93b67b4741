"""The spectral virtual flow sensor: the line inverted harmonic by harmonic.

At each shaft order the state at the pump is two waves w = (f, b). Every sensor is one linear
equation m = A w for them, and the load is one more with a larger error. The linear estimate of
least mean square error is (Kay 1993, Fundamentals of Statistical Signal Processing, vol. 1,
theorem 11.1)

    w = (A^H R^-1 A + P^-1)^-1 A^H R^-1 m

with the covariance R of the equations' errors (sensor noise and model error) and the waves'
variance P. It is Tikhonov regularisation with physical weights: where two sensors are half a wave
apart and read the same, the load's equation determines the rest; without it the estimate goes to
zero instead of to infinity. (Two-sensor inversion and its blind frequencies: Johnston & Drew 1996,
Proc. IMechE I 210, 65.)
"""

from __future__ import annotations

import numpy as np

from rippletwin.flow_sensor.estimate import FlowEstimate, estimate
from rippletwin.flow_sensor.line_response import LineFactory, LineResponse, line_response

MODEL_ERROR = 0.01  # of a predicted pressure, over the wave amplitude
LOAD_ERROR = 0.1  # of the load's reflection coefficient


def estimate_flow(
    windows: np.ndarray,
    speed_hz: float | np.ndarray,
    line_at: LineFactory,
    noise: float | np.ndarray,
    bandwidth_hz: float,
    model_error: float = MODEL_ERROR,
    load_error: float | None = LOAD_ERROR,
    of: str = "source",
) -> FlowEstimate:
    """Outlet flow of each one-revolution window.

    Parameters
    ----------
    windows : (n, S, M) pressure in Pa at M equal steps of the shaft's angle.
    speed_hz : revolutions per second, one for all or (n,).
    line_at : the calibrated line, see `line_response.LineFactory` and `line_factory`.
    noise : standard deviation of a sample, Pa, one for all sensors or (S,).
    bandwidth_hz : shaft orders up to this frequency are estimated, the others are zero.
    model_error : error of a predicted pressure relative to the wave amplitude.
    load_error : error of the load's reflection coefficient; None leaves the load out.
    of : "source", the ideal flow source of the line, or "outlet", Q(0): they differ by what
        the source's own admittance takes.

    Raises ValueError for a bandwidth below the speed or above half the sampling rate.
    """

    def inversion(speed, orders, noise_power, power):
        response = line_response(line_at(speed, orders), of)
        return flow_operator(response, noise_power, power, model_error, load_error)

    return estimate(windows, speed_hz, inversion, noise, bandwidth_hz)


def flow_operator(
    response: LineResponse,
    noise_power: np.ndarray,
    power: np.ndarray,
    model_error: float,
    load_error: float | None,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """What an `estimate.Inversion` returns, from the line's response to the waves at the pump."""
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
