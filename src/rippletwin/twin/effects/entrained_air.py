"""Free air in the oil: a compressibility that falls with the pressure.

To a small ripple it is a lower wave speed, which two mean pressures tell from any other. A ripple
of a tenth of the mean pressure meets a stiffer liquid in its crests: the nonlinear compliance
couples the harmonics all along the line.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.special import binom

from rippletwin.case.model import ATMOSPHERE
from rippletwin.line.frequency_domain.nonlinear_compliance import NonlinearCompliance
from rippletwin.twin.effects.base import Effect, line_place
from rippletwin.twin.effects.lumped_elements import polytropic_parameter
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import lognormal

SERIES_TERMS = 6  # in x = p/mean; the next is 1e-3 of the second at x = 0.3


def gas_series(gas_fraction, exponent, mean_pressure):
    """[c_1, c_2 ...] of the volume share sum_k c_k x^k by which free air is compressed where the
    pressure is x times the mean p above it: of -alpha (p_atm/p)^(1/n) ((1 + x)^(-1/n) - 1).

    `gas_fraction` alpha is by volume at the atmosphere's pressure, `exponent` n the polytropic one,
    `mean_pressure` in Pa absolute.
    """
    share = gas_fraction * (ATMOSPHERE / mean_pressure) ** (1.0 / exponent)
    return [-share * binom(-1.0 / exponent, k) for k in range(1, SERIES_TERMS + 1)]


def _apply(network, state, values, place):
    for k in range(len(state.diameters)):
        mean = np.broadcast_to(state.absolute_pressure_in(k), np.shape(network.shunt[k]))
        first, *beyond = gas_series(values["gas_fraction"], values["polytropic_exponent"], mean)
        network.shunt[k] = network.shunt[k] + state.area(k) * network.s * first / mean
        network.nonlinear_compliances.append(
            NonlinearCompliance(k, state.area(k), mean, np.array(beyond))
        )


def _apply_in_time(line, state, values, place):
    for k, pipe in enumerate(line.pipes):
        mean = float(state.absolute_pressure_in(k))
        series = gas_series(values["gas_fraction"], values["polytropic_exponent"], mean)
        line.pipes[k] = replace(pipe, law=(mean, *series))


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
