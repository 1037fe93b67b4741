"""The physics-informed virtual flow sensor: one network for the line, a linear head a window.

Pressure and flow along the line are

    [p, q](x, t) = Re sum_k exp(j k W t) sum_m c_km phi_m(x, k W),

periodic in time by construction (Fourier features in t), with a neural network for the shape
functions phi: the trunk. The equations of the line are linear, so with the trunk given, every
window's coefficients c, its head, are a linear least-squares problem (as in the transfer of
Desai et al. 2021, One-shot transfer learning of physics-informed neural networks):

    data      p at the sensors is what was measured
    equations dp/dx + Z'(s) q = 0 and dq/dx + Y'(s) p = 0 at collocation points
    joints    p and q fit where segments or lumped elements meet
    load      p and q at the end are in the load's ratio

The trunk is trained once, at the calibrated parameters, on data, equations, joints and the waves at
the pump, for known states there, whose sensor readings the twin predicts. The load has a part in a
window's head alone. In each training step the heads are solved
exactly and only the trunk moves (variable projection; Golub & Pereyra 1973, SIAM J. Numer. Anal.
10, 413). Each uniform piece of line has shape functions of its own (Jagtap & Karniadakis 2020,
Commun. Comput. Phys. 28, 2002): slow envelopes on carriers of the calibrated wave length, so that
the network learns the effect of losses on a wave, not the wave itself. Lengths are in units of the
piece, flows in units of pressure over its characteristic impedance.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch

from rippletwin.flow_sensor.estimate import FlowEstimate, estimate
from rippletwin.flow_sensor.line_response import LineFactory, LineResponse, line_response
from rippletwin.flow_sensor.spectral_inversion import LOAD_ERROR, MODEL_ERROR
from rippletwin.flow_sensor.trunk import Equations, Trunk, equations, pieces_of

COLLOCATION_POINTS = 48  # of a piece when a window is solved
FREQUENCY_MARGIN = 0.02  # relative, of trained frequencies beyond the orders': speeds vary


@dataclass(frozen=True)
class Settings:
    """Hidden `width` of a trunk; L-BFGS `steps` on `frequencies` x `points` a piece."""

    width: int = 32
    steps: int = 300
    frequencies: int = 40
    points: int = 12
    seed: int = 0


def train(
    line_at: LineFactory,
    speed_hz: float,
    bandwidth_hz: float,
    settings: Settings | None = None,
    progress: Callable[[int, float], None] | None = None,
) -> tuple[Trunk, np.ndarray]:
    """A trunk for the line of `line_at`, at orders of `speed_hz` up to `bandwidth_hz`.

    Returns it with the loss of each evaluation, of which a step takes one or more: the mean square
    of all residuals for unit waves at the pump. `progress` is called with step and loss.
    """
    settings = settings or Settings()
    highest = bandwidth_hz / speed_hz
    orders = 1 + (highest - 1) * np.linspace(0, 1, settings.frequencies) ** 2  # denser where low
    orders[0], orders[-1] = 1 - FREQUENCY_MARGIN, highest * (1 + FREQUENCY_MARGIN)
    line = line_at(speed_hz, orders)
    to_sensors = line_response(line).to_sensors
    places = 0.5 + 0.5 * np.polynomial.legendre.leggauss(settings.points)[0]
    omega = line.s.imag
    trunk = Trunk(len(pieces_of(line)[0]), (omega[0], omega[-1]), settings.width, settings.seed)
    optimiser = torch.optim.LBFGS(
        trunk.parameters(),
        max_iter=settings.steps,
        max_eval=2 * settings.steps,
        tolerance_grad=0.0,
        tolerance_change=0.0,
        history_size=50,
        line_search_fn="strong_wolfe",
    )
    history = []

    def loss():
        matrix, target = _known_states(equations(trunk, line, places), to_sensors)
        with torch.no_grad():  # at the best head the loss does not depend on it
            head = _solve(matrix, target)
        value = (matrix @ head - target).abs().square().sum(1).mean()
        optimiser.zero_grad()
        value.backward()
        history.append(value.item())
        if progress is not None:
            progress(len(history), history[-1])
        return value

    optimiser.step(loss)
    trunk.residual.fill_(loss().sqrt().item())
    return trunk, np.array(history)


def estimate_flow(
    windows: np.ndarray,
    speed_hz: float | np.ndarray,
    line_at: LineFactory,
    trunk: Trunk,
    noise: float | np.ndarray,
    bandwidth_hz: float,
    model_error: float = MODEL_ERROR,
    load_error: float | None = LOAD_ERROR,
    equation_error: float | None = None,
    of: str = "source",
) -> FlowEstimate:
    """Outlet flow of each one-revolution window, by heads on a trained `trunk`.

    Other parameters as for `spectral_inversion.estimate_flow`. `equation_error` is the error of the
    equations (relative, over a piece of line); None is the trunk's own.
    """
    missed = float(trunk.residual) if equation_error is None else equation_error

    def inversion(speed, orders, noise_power, power):
        line = line_at(speed, orders)
        places = (np.arange(COLLOCATION_POINTS) + 0.5) / COLLOCATION_POINTS
        with torch.no_grad():
            rows = equations(trunk, line, places)
        response = line_response(line, of)
        errors = np.sqrt(noise_power + (model_error**2 * power)[:, None])
        return _head_operator(rows, response, errors, power, load_error, missed)

    return estimate(windows, speed_hz, inversion, noise, bandwidth_hz)


def _known_states(rows: Equations, to_sensors: np.ndarray):
    """Training's least-squares problem: both unit waves at the pump, and what the sensors read."""
    matrix = torch.cat([rows.equations, rows.joints, rows.waves, rows.sensors], dim=1)
    target = torch.zeros(*matrix.shape[:2], 2, dtype=matrix.dtype)
    sensors = to_sensors.shape[1]
    target[:, -sensors - 2 : -sensors] = torch.eye(2, dtype=matrix.dtype)
    target[:, -sensors:] = torch.as_tensor(to_sensors)
    return matrix, target


def _solve(matrix, target):
    """Least squares, (F, unknowns, tasks)."""
    return torch.linalg.solve(matrix.mH @ matrix, matrix.mH @ target)


def _head_operator(
    rows: Equations,
    response: LineResponse,
    errors: np.ndarray,
    power: np.ndarray,
    load_error: float | None,
    equation_error: float,
):
    """What an `estimate.Inversion` returns; coefficients are solved in units of sqrt(power)."""
    scale = np.sqrt(power)[:, None]
    waves = rows.waves.numpy()
    blocks = [
        rows.sensors.numpy() * (scale / errors)[..., None],
        rows.equations.numpy() / equation_error,
        rows.joints.numpy() / equation_error,
        waves,
    ]
    if load_error is not None:
        blocks.append(rows.load.numpy() / load_error)
    q, r = np.linalg.qr(np.concatenate(blocks, axis=1))
    to_flow = response.to_flow[:, None] @ waves  # (F, 1, unknowns)
    gain = np.swapaxes(np.linalg.solve(np.swapaxes(r, 1, 2), np.swapaxes(to_flow, 1, 2)), 1, 2)
    sensors = errors.shape[1]
    matrix = (gain @ np.conj(np.swapaxes(q[:, :sensors], 1, 2)))[:, 0] * (scale / errors)
    variance = power * np.sum(np.abs(gain[:, 0]) ** 2, axis=-1)
    prior = power * np.sum(np.abs(response.to_flow) ** 2, axis=-1)
    return matrix, variance, prior
