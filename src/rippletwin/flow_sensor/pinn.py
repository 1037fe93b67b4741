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

The trunk is trained once, at the calibrated parameters, on the sum of these losses for known states
at the pump (whose sensor readings the twin tells). In each training step the heads are solved
exactly and only the trunk moves (variable projection; Golub & Pereyra 1973, SIAM J. Numer. Anal.
10, 413). Each uniform piece of line has shape functions of its own (Jagtap & Karniadakis 2020,
Commun. Comput. Phys. 28, 2002): slow envelopes on carriers of the calibrated wave length, so that
the network learns what losses do to a wave rather than the wave itself. Lengths are in units of the
piece, flows in units of pressure over its characteristic impedance.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import torch
from torch import nn

from rippletwin.flow_sensor.estimate import FlowEstimate, estimate
from rippletwin.flow_sensor.line import LineResponse, NetworkFactory, line_response
from rippletwin.flow_sensor.spectral import LOAD_ERROR, MODEL_ERROR
from rippletwin.line.chain import Network

COLLOCATION = 48  # points a piece when a window is solved
MARGIN = 0.02  # relative, of trained frequencies beyond the orders': the speed wanders


@dataclass(frozen=True)
class Settings:
    """Hidden `width` of a trunk; L-BFGS `steps` on `frequencies` x `points` a piece."""

    width: int = 32
    steps: int = 300
    frequencies: int = 40
    points: int = 12
    seed: int = 0


class Trunk(nn.Module):
    """Two shape functions of p and of q (in units of pressure) on each of D pieces of line.

    They are waves with learnt envelopes, the first towards the load, the second towards the pump:

        (p + r)/2 = (1 + n1) exp(-j th),    (p - r)/2 = n2/(1 + th_l) exp(-j th),    r = q |Zc|

    and the mirror image, th growing evenly along the piece to th_l, the phase that a wave turns
    there; the n are the network's, zero before training. `omega` (lowest, highest) is the range it
    is trained for, rad/s; `residual` what training attained, the root of its loss.
    """

    def __init__(self, pieces: int, omega: tuple[float, float], settings: Settings):
        super().__init__()
        self.pieces = pieces
        self.register_buffer("omega", torch.tensor(omega, dtype=torch.double))
        self.register_buffer("residual", torch.tensor(np.inf, dtype=torch.double))
        inputs, width = 3 + pieces, settings.width
        with torch.random.fork_rng():
            torch.manual_seed(settings.seed)
            self.envelope = nn.Sequential(
                nn.Linear(inputs, width),
                nn.Tanh(),
                nn.Linear(width, width),
                nn.Tanh(),
                nn.Linear(width, 8),
            ).double()
        nn.init.zeros_(self.envelope[-1].weight)
        nn.init.zeros_(self.envelope[-1].bias)

    def forward(self, piece: np.ndarray, place: np.ndarray, omega, phase):
        """Shape functions at P points and F frequencies.

        piece (P,) index, place (P,) in 0..1 along it, omega (F,) rad/s, phase (F, D) rad that a
        wave turns over each piece. Returns values and slopes (per piece length), each
        (2, F, P, 2 D) complex, p before r; those of a piece are zero on the others.
        """
        piece, place = torch.as_tensor(piece), torch.as_tensor(place)
        low, high = self.omega
        where = nn.functional.one_hot(piece, self.pieces).double()  # (P, D)
        shape = (len(omega), len(piece))
        scaled = torch.stack(
            [(omega - low) / (high - low), (omega / low).log() / (high / low).log()]
        )
        inputs = torch.cat(
            [
                (2 * place - 1).expand(shape)[..., None],
                (2 * scaled.T - 1)[:, None].expand(*shape, 2),
                where.expand(*shape, -1),
            ],
            dim=-1,
        )
        along = torch.zeros_like(inputs)
        along[..., 0] = 2.0
        learnt, slope = (
            torch.view_as_complex(x.reshape(*shape, 2, 2, 2))
            for x in torch.func.jvp(self.envelope, (inputs,), (along,))
        )  # (F, P, function, own or other direction)
        turns = phase[:, piece]
        small = torch.stack([torch.ones_like(turns), 1 / (1 + turns)], dim=-1)[:, :, None]
        own = torch.tensor([1.0, 0.0])
        learnt, slope = own + small * learnt, small * slope
        carrier = torch.polar(torch.ones_like(turns), -turns * place)
        carrier = torch.stack([carrier, carrier.conj()], dim=-1)[..., None]
        rate = 1j * torch.stack([-turns, turns], dim=-1)[..., None]
        sign = torch.tensor([1.0, -1.0])

        def fields(waves):  # (F, P, function, own/other) -> (p or r, F, P, 2 D)
            p = waves.sum(-1)
            r = (waves[..., 0] - waves[..., 1]) * sign
            return (torch.stack([p, r])[..., None, :] * where[:, :, None]).flatten(-2)

        return fields(learnt * carrier), fields((slope + rate * learnt) * carrier)


@dataclass(frozen=True)
class Equations:
    """Rows (F, equations, 2 D) that a head's coefficients make zero, or equal to data.

    equations and joints, load: residuals, Pa; sensors: readings, Pa; waves: (f, b) at the pump, Pa.
    """

    equations: torch.Tensor
    joints: torch.Tensor
    load: torch.Tensor
    sensors: torch.Tensor
    waves: torch.Tensor


def train(
    network: NetworkFactory,
    speed_hz: float,
    bandwidth_hz: float,
    settings: Settings | None = None,
    progress: Callable[[int, float], None] | None = None,
) -> tuple[Trunk, np.ndarray]:
    """A trunk for the line that `network` describes, at orders of `speed_hz` up to `bandwidth_hz`.

    Returns it with the loss of each step: the mean square of all residuals for unit waves at the
    pump. `progress` is called with step and loss.
    """
    settings = settings or Settings()
    highest = bandwidth_hz / speed_hz
    orders = 1 + (highest - 1) * np.linspace(0, 1, settings.frequencies) ** 2  # denser where low
    orders[0], orders[-1] = 1 - MARGIN, highest * (1 + MARGIN)
    line = network(speed_hz, orders)
    to_sensors = line_response(line).to_sensors
    places = 0.5 + 0.5 * np.polynomial.legendre.leggauss(settings.points)[0]
    omega = line.s.imag
    trunk = Trunk(len(_pieces(line)[0]), (omega[0], omega[-1]), settings)
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
        with torch.no_grad():  # at the best head the loss does not move with it
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
    network: NetworkFactory,
    trunk: Trunk,
    noise: float | np.ndarray,
    bandwidth_hz: float,
    model_error: float = MODEL_ERROR,
    load_error: float | None = LOAD_ERROR,
    equation_error: float | None = None,
    of: str = "source",
) -> FlowEstimate:
    """Outlet flow of each one-revolution window, by heads on a trained `trunk`.

    Everything else as for `spectral.estimate_flow`; `equation_error` is how far the equations may
    be missed (relative, over a piece of line); None is as far as the trunk does.
    """
    missed = float(trunk.residual) if equation_error is None else equation_error

    def inversion(speed, orders, noise_power, power):
        line = network(speed, orders)
        places = (np.arange(COLLOCATION) + 0.5) / COLLOCATION
        with torch.no_grad():
            rows = equations(trunk, line, places)
        response = line_response(line, of)
        errors = np.sqrt(noise_power + (model_error**2 * power)[:, None])
        return _head_operator(rows, response, errors, power, load_error, missed)

    return estimate(windows, speed_hz, inversion, noise, bandwidth_hz)


def equations(trunk: Trunk, network: Network, places: np.ndarray) -> Equations:
    """The rows of `Equations` at the frequencies of `network`, `places` (C,) of 0..1 a piece."""
    starts, segments = _pieces(network)
    lengths, count = np.diff([*starts, network.length]), len(starts)
    series, shunt = network.series[segments], network.shunt[segments]  # (D, F)
    zc = np.abs(np.sqrt(series / shunt))
    omega = torch.as_tensor(network.s.imag)
    phase = torch.as_tensor((np.sqrt(series * shunt).imag * lengths[:, None]).T)

    def shapes(piece, place):
        return trunk(piece, place, omega, phase)

    # inside: l dp/dx + (l Z'/|Zc|) r and l dr/dx + (l Y' |Zc|) p
    piece = np.repeat(np.arange(count), len(places))
    (p, r), (dp, dr) = shapes(piece, np.tile(places, count))
    series = _column((lengths[:, None] * series / zc)[piece])
    shunt = _column((lengths[:, None] * shunt * zc)[piece])
    inside = torch.cat([dp + series * r, dr + shunt * p], dim=1) / np.sqrt(len(piece))

    # [p, q] at the pieces' ends, each (F, 2, 2 D)
    piece = np.arange(count)
    first, last = (_pressure_and_flow(shapes(piece, np.full(count, end)), zc) for end in (0.0, 1.0))
    joints = [torch.zeros(len(omega), 0, 2 * count, dtype=p.dtype)]
    for k in range(count - 1):
        gap = last[k] - _joint(network, starts[k + 1]) @ first[k + 1]
        joints.append(torch.stack([gap[:, 0], _row(zc[k]) * gap[:, 1]], dim=1))

    at_load = _joint(network, network.length) @ _state(network.load_state(), len(omega))
    p_load, r_load = at_load[:, 0], _row(zc[-1]) * at_load[:, 1]  # (F, 1)
    scale = (p_load.abs().square() + r_load.abs().square()).sqrt()
    p, r = last[-1][:, 0], _row(zc[-1]) * last[-1][:, 1]
    load = ((r_load * p - p_load * r) / scale)[:, None]

    # waves on the source's side of what stands at x = 0, as in LineResponse
    source = _joint(network, 0.0) @ first[0]
    p, r = source[:, 0], _row(zc[0]) * source[:, 1]
    waves = torch.stack([p + r, p - r], dim=1) / 2

    positions = np.asarray(network.sensor_positions)
    piece = np.maximum(np.searchsorted(starts, positions, side="left") - 1, 0)  # pump's side
    (p, _), _ = shapes(piece, (positions - starts[piece]) / lengths[piece])
    factor = np.broadcast_to(network.sensor_factor, (len(positions), len(omega)))
    return Equations(inside, torch.cat(joints, dim=1), load, p * _column(factor), waves)


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


def _pieces(network: Network) -> tuple[np.ndarray, np.ndarray]:
    """Start (D,) in m and segment (D,) of the uniform pieces between segments and inserts."""
    edges = np.concatenate([[0.0], np.cumsum(network.lengths)])
    inside = [x for x, _, _ in network.inserts if 0.0 < x < network.length]
    starts = np.unique(np.concatenate([edges[:-1], inside]))
    return starts, np.searchsorted(edges, starts, side="right") - 1


def _joint(network: Network, x: float) -> torch.Tensor:
    """Matrix J (F, 2, 2) with [p, q] before = J [p, q] behind the lumped elements at `x`."""
    matrix = np.zeros((len(network.s), 2, 2), complex)
    matrix[:] = np.eye(2)
    for position, kind, value in network.inserts:
        if position == x:
            element = np.zeros_like(matrix)
            element[:] = np.eye(2)
            element[:, 1, 0] = value if kind == "shunt" else 0.0
            element[:, 0, 1] = value if kind == "series" else 0.0
            matrix = matrix @ element
    return torch.as_tensor(matrix)


def _state(state, size: int) -> torch.Tensor:
    """The load's (p, q) as (F, 2, 1)."""
    p, q = (np.broadcast_to(np.asarray(value, complex), (size,)) for value in state)
    return torch.as_tensor(np.stack([p, q], axis=1)[..., None])


def _pressure_and_flow(shapes, impedance: np.ndarray) -> list[torch.Tensor]:
    """[p, q] (F, 2, 2 D) at one point a piece, from the trunk's answer and |Zc| (D, F)."""
    (p, r), _ = shapes
    q = r / torch.as_tensor(impedance.T)[..., None]
    return list(torch.stack([p, q], dim=2).unbind(1))


def _row(values: np.ndarray) -> torch.Tensor:
    """(F,) numpy to (F, 1), to multiply rows of one point."""
    return torch.as_tensor(values)[:, None]


def _column(values: np.ndarray) -> torch.Tensor:
    """(P, F) numpy to (F, P, 1), to multiply rows of points."""
    return torch.as_tensor(np.ascontiguousarray(values.T))[..., None]
