"""A volume of gas on the line: an accumulator, trapped air.

Its compliance falls with the mean pressure, that of a volume of liquid does not. A ripple of a
tenth of the mean pressure meets a stiffer gas in its crests: the compliance is nonlinear.
"""

from __future__ import annotations

import numpy as np

from rippletwin.line.frequency_domain.line_network import Insert
from rippletwin.line.frequency_domain.nonlinear_compliance import NonlinearCompliance
from rippletwin.line.time_domain.line_elements import Storage
from rippletwin.twin.effects.base import (
    Effect,
    on_line,
    position_parameter,
    position_place,
)
from rippletwin.twin.effects.lumped_elements import (
    gas_series,
    gas_volume_at,
    polytropic_parameter,
)
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import lognormal


def _series(values, mean_pressure):
    """`gas_series`, m3, of the gas at `mean_pressure`, Pa absolute."""
    exponent = values["polytropic_exponent"]
    return gas_series(gas_volume_at(values["gas_volume"], exponent, mean_pressure), exponent)


def _apply(network, state, values, place):
    position = on_line(network, values["position"])
    pressure = state.absolute_pressure_at(position)
    mean = np.broadcast_to(pressure, np.shape(network.shunt[0]))
    first, *beyond = _series(values, mean)
    network.inserts.append(Insert(position, "shunt", network.s * first / mean))
    network.nonlinear_compliances.append(
        NonlinearCompliance(position, position, 1.0, mean, np.array(beyond))
    )


def _apply_in_time(line, state, values, place):
    position = on_line(line, values["position"])
    mean = float(state.absolute_pressure_at(position))
    line.inserts.append(Storage(position, (mean, *map(float, _series(values, mean)))))


EFFECT = Effect(
    name="gas_volume",
    element="position",
    medium="liquid",
    equation="dV = V ((p_m/(p_m + p'))^(1/n) - 1), V = V_10MPa (10 MPa/p_m)^(1/n), p_m absolute; "
    "to a small ripple q1 - q2 = s V/(n p_m) p",
    source="p V^n = const; Wylie & Streeter 1993, Fluid Transients in Systems (air chamber)",
    parameters=lambda rig, place: (
        position_parameter(rig),
        Parameter("gas_volume", "m3", lognormal(3e-7 * (rig.line[0].diameter / 0.02) ** 3, 2.0)),
        polytropic_parameter(),
    ),
    places=position_place,
    apply=_apply,
    apply_in_time=_apply_in_time,
)
