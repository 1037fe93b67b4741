"""Lines at shaft orders that equal pistons at even speed do not make.

The nominal pump has none, so they are no matter of fitting the line: the line as it was explained
tells what flow at the pump they come from, and whether one flow accounts for every sensor. Even
modulation of the speed makes sidebands in a fixed relation to the piston orders; what is left is
spread of the pistons.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from rippletwin.effects.speed_fluctuation import sidebands
from rippletwin.forward import Forward
from rippletwin.likelihood import cut
from rippletwin.twin import Twin

FLOOR = 0.02  # of the lines, where no orifice couples them: the line's own error and more
RELATIVE = 0.01  # of the ripple: below it the lines are no effect worth a name
SIGNIFICANCE = 1e-6
SHARE = 0.7  # of the lines' energy that modulation must explain to be the name


@dataclass(frozen=True)
class ShaftLines:
    """Lines at other orders than the pistons'.

    relative   their norm over the ripple's, both at the sensors
    p_value    of noise alone making them
    coherent   share of their energy that one flow at the pump accounts for
    name       "speed_fluctuation", "piston_spread" or None
    value      modulation of the shaft angle in rad, or spread over the mean flow, rms
    """

    relative: float
    p_value: float
    coherent: float
    name: str | None
    value: float


def shaft_lines(twin: Twin, observations: Sequence, highest_hz: float) -> ShaftLines | None:
    """Judge the periodic observations with all their orders; None where there are none."""
    pistons = twin.rig.pump.get("pistons")
    data = [cut(o, highest_hz) for o in observations if o.orders is not None]
    data = [o for o in data if np.any(np.asarray(o.orders) % pistons)]
    if not data:
        return None
    off_energy = energy = chi = explained = modulated = flows = 0.0
    count, modulation, spread = 0, [], []
    for o in data:
        orders = np.asarray(o.orders, int)
        off = orders % pistons != 0
        unit = _response(twin, o)
        variance = np.einsum("fss->sf", o.covariance).real
        power = np.mean(np.abs(o.values) ** 2, axis=0)
        weight = 1.0 / (variance + (FLOOR**2 * power)[None])
        flow = np.sum(weight * np.conj(unit) * o.values, 0) / np.sum(weight * np.abs(unit) ** 2, 0)
        left = o.values - unit * flow
        energy += np.sum(np.abs(o.values) ** 2)
        noise = np.sum(variance[:, off])
        off_energy += max(np.sum(np.abs(o.values[:, off]) ** 2) - noise, 0.0)
        chi += 2 * np.sum(np.abs(o.values[:, off]) ** 2 / variance[:, off])
        count += 2 * o.values[:, off].size
        explained += np.sum(np.abs(left[:, off]) ** 2)
        b, rest, whole = _modulation(orders, flow, unit, off)
        modulation.append(abs(b))
        modulated += rest
        flows += whole
        mean = twin.operating_point(o).mean_flow
        spread.append(float(np.sqrt(0.5 * np.sum(np.abs(flow[orders < pistons]) ** 2)) / mean))
    relative = float(np.sqrt(off_energy / energy))
    p = float(chi2.sf(chi, count))
    coherent = 1.0 - float(
        explained
        / max(
            np.sum(
                [
                    np.sum(np.abs(o.values[:, np.asarray(o.orders, int) % pistons != 0]) ** 2)
                    for o in data
                ]
            ),
            1e-300,
        )
    )
    name, value = None, 0.0
    if relative > RELATIVE and p < SIGNIFICANCE and coherent > 0.5:
        by_speed = modulated < (1.0 - SHARE) * flows
        name = "speed_fluctuation" if by_speed else "piston_spread"
        value = float(np.mean(modulation if by_speed else spread))
    return ShaftLines(relative, p, coherent, name, value)


def _response(twin: Twin, observation) -> np.ndarray:
    """Readings (S, F) for unit flow at every order, the orifice linear."""
    forward = Forward(twin, [observation])
    forward.source = np.ones_like(forward.source)
    forward._orifice = None
    return forward(twin.theta)[0]


def _modulation(orders, flow, unit, off):
    """Best modulation b, and the pressure energy at other orders with and without it taken off."""
    piston = np.where(off, 0.0, flow)
    gain = np.sum(np.abs(unit[:, off]) ** 2, axis=0)
    columns = np.stack([sidebands(orders, piston, b)[off] for b in (1.0, 1j)], axis=1)
    root = np.sqrt(gain)
    target, design = root * flow[off], root[:, None] * columns
    real = np.concatenate([design.real, design.imag])
    solution = np.linalg.lstsq(real, np.concatenate([target.real, target.imag]), rcond=None)[0]
    rest = target - design @ solution
    return complex(*solution), float(np.sum(np.abs(rest) ** 2)), float(np.sum(np.abs(target) ** 2))
