"""Free air in the oil: a compressibility that falls with the pressure.

To a small ripple it is a lower wave speed, which two mean pressures tell from any other. A ripple
of a tenth of the mean pressure meets a stiffer liquid in its crests: the nonlinear compliance
couples the harmonics all along the line.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from rippletwin.case.model import ATMOSPHERE
from rippletwin.line.frequency_domain.nonlinear_compliance import NonlinearCompliance
from rippletwin.twin.effects.base import Effect, line_place
from rippletwin.twin.effects.lumped_elements import gas_series, polytropic_parameter
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import lognormal


def _series(values, mean_pressure):
    """`gas_series` of the air's share of the line's volume, `mean_pressure` in Pa absolute."""
    exponent = values["polytropic_exponent"]
    share = values["gas_fraction"] * (ATMOSPHERE / mean_pressure) ** (1.0 / exponent)
    return gas_series(share, exponent)


def _apply(network, state, values, place):
    ends = np.concatenate([[0.0], np.cumsum(network.lengths)])
    for k, (start, stop) in enumerate(pairwise(ends)):
        mean = np.broadcast_to(state.absolute_pressure_in(k), np.shape(network.shunt[k]))
        first, *beyond = _series(values, mean)
        network.shunt[k] = network.shunt[k] + state.area(k) * network.s * first / mean
        volume = state.area(k) * (stop - start)
        network.nonlinear_compliances.append(
            NonlinearCompliance(start, stop, volume, mean, np.array(beyond))
        )


def _apply_in_time(line, state, values, place):
    for k, pipe in enumerate(line.pipes):
        mean = float(state.absolute_pressure_in(k))
        line.pipes[k] = replace(pipe, law=(mean, *_series(values, mean)))


EFFECT = Effect(
    name="entrained_air",
    element="line",
    medium="liquid",
    equation="dV/V = alpha ((p_atm/p)^(1/n) - (p_atm/(p + p'))^(1/n)) beside p'/(rho a^2); to a "
    "small ripple Y' = A s (1/(rho a^2) + alpha (p_atm/p)^(1/n)/(n p))",
    source="Wylie & Streeter 1993, Fluid Transients in Systems, sec. 1.4; "
    "Merritt 1967, Hydraulic Control Systems, ch. 2",
    parameters=lambda rig, place: (
        Parameter("gas_fraction", "1", lognormal(5e-3, 1.2)),
        polytropic_parameter(),
    ),
    places=line_place,
    apply=_apply,
    apply_in_time=_apply_in_time,
    rank=1,  # walls creep under the liquid alone
)
