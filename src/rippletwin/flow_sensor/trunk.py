"""The trunk of the physics-informed flow sensor and the line's equations on it, see `pinn`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from torch import nn

from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine


class Trunk(nn.Module):
    """Two shape functions of p and of q (in units of pressure) on each of D pieces of line.

    They are waves with learnt envelopes, the first towards the load, the second towards the pump:

        (p + r)/2 = (1 + n1) exp(-j th),    (p - r)/2 = n2/(1 + th_l) exp(-j th),    r = q |Zc|

    and the mirror image, th growing evenly along the piece to th_l, the phase that a wave turns
    there; the n are the network's, zero before training. `omega` (lowest, highest) is the range it
    is trained for, rad/s; `residual` what training attained, the root of its loss.
    """

    omega: torch.Tensor
    residual: torch.Tensor

    def __init__(self, pieces: int, omega: tuple[float, float], width: int, seed: int):
        super().__init__()
        self.pieces = pieces
        self.register_buffer("omega", torch.tensor(omega, dtype=torch.double))
        self.register_buffer("residual", torch.tensor(np.inf, dtype=torch.double))
        inputs = 3 + pieces
        with torch.random.fork_rng():
            torch.manual_seed(seed)
            self.envelope = nn.Sequential(
                nn.Linear(inputs, width),
                nn.Tanh(),
                nn.Linear(width, width),
                nn.Tanh(),
                last := nn.Linear(width, 8),
            ).double()
        nn.init.zeros_(last.weight)
        nn.init.zeros_(last.bias)

    def forward(self, piece, place, omega, phase):
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


def equations(trunk: Trunk, line: FrequencyDomainLine, places: np.ndarray) -> Equations:
    """The rows of `Equations` at the frequencies of `line`, `places` (C,) of 0..1 a piece."""
    starts, segments = pieces_of(line)
    lengths, count = np.diff([*starts, line.length]), len(starts)
    series, shunt = line.series[segments], line.shunt[segments]  # (D, F)
    zc = np.abs(np.sqrt(series / shunt))
    omega = torch.as_tensor(line.s.imag)
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
        gap = last[k] - _joint(line, starts[k + 1]) @ first[k + 1]
        joints.append(torch.stack([gap[:, 0], _row(zc[k]) * gap[:, 1]], dim=1))

    at_load = _joint(line, line.length) @ _state(line.load_state(), len(omega))
    p_load, r_load = at_load[:, 0], _row(zc[-1]) * at_load[:, 1]  # (F, 1)
    scale = (p_load.abs().square() + r_load.abs().square()).sqrt()
    p, r = last[-1][:, 0], _row(zc[-1]) * last[-1][:, 1]
    load = ((r_load * p - p_load * r) / scale)[:, None]

    # waves at the source, before its passage and the elements at x = 0, as in LineResponse
    source = _joint(line, 0.0) @ first[0]
    p = source[:, 0] + _row(_whole(line.source_impedance, len(omega))) * source[:, 1]
    r = _row(zc[0]) * source[:, 1]
    waves = torch.stack([p + r, p - r], dim=1) / 2

    positions = np.asarray(line.sensor_positions)
    piece = np.maximum(np.searchsorted(starts, positions, side="left") - 1, 0)  # pump's side
    (p, _), _ = shapes(piece, (positions - starts[piece]) / lengths[piece])
    factor = np.broadcast_to(line.sensor_factor, (len(positions), len(omega)))
    return Equations(inside, torch.cat(joints, dim=1), load, p * _column(factor), waves)


def pieces_of(line: FrequencyDomainLine) -> tuple[np.ndarray, np.ndarray]:
    """Start (D,) in m and segment (D,) of the uniform pieces between segments and inserts."""
    edges = np.concatenate([[0.0], np.cumsum(line.lengths)])
    inside = [x for x, _, _ in line.inserts if 0.0 < x < line.length]
    starts = np.unique(np.concatenate([edges[:-1], inside]))
    return starts, np.searchsorted(edges, starts, side="right") - 1


def _joint(line: FrequencyDomainLine, x: float) -> torch.Tensor:
    """Matrix J (F, 2, 2) with [p, q] before = J [p, q] behind the lumped elements at `x`."""
    matrix = np.zeros((len(line.s), 2, 2), complex)
    matrix[:] = np.eye(2)
    for position, kind, value in line.inserts:
        if position == x:
            element = np.zeros_like(matrix)
            element[:] = np.eye(2)
            element[:, 1, 0] = value if kind == "shunt" else 0.0
            element[:, 0, 1] = value if kind == "series" else 0.0
            matrix = matrix @ element
    return torch.as_tensor(matrix)


def _state(state, size: int) -> torch.Tensor:
    """The load's (p, q) as (F, 2, 1)."""
    p, q = (_whole(value, size) for value in state)
    return torch.as_tensor(np.stack([p, q], axis=1)[..., None])


def _whole(value, size: int) -> np.ndarray:
    """A scalar or (F,) as (F,)."""
    return np.array(np.broadcast_to(np.asarray(value, complex), (size,)))


def _pressure_and_flow(shapes, impedance: np.ndarray) -> list[torch.Tensor]:
    """[p, q] (F, 2, 2 D) at one point a piece, from the trunk's shapes and |Zc| (D, F)."""
    (p, r), _ = shapes
    q = r / torch.as_tensor(impedance.T)[..., None]
    return list(torch.stack([p, q], dim=2).unbind(1))


def _row(values: np.ndarray) -> torch.Tensor:
    """(F,) numpy to (F, 1), to multiply rows of one point."""
    return torch.as_tensor(values)[:, None]


def _column(values: np.ndarray) -> torch.Tensor:
    """(P, F) numpy to (F, P, 1), to multiply rows of points."""
    return torch.as_tensor(np.ascontiguousarray(values.T))[..., None]
