"""A leak from the line to atmosphere or tank."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rippletwin.case.model import ATMOSPHERE
from rippletwin.line.frequency_domain.line_network import Insert
from rippletwin.line.time_domain.line_elements import Element
from rippletwin.twin.effects.base import (
    Effect,
    characteristic_admittance,
    on_line,
    position_parameter,
    position_place,
)
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import lognormal, uniform

MAX_DRAWN_SHARE = 0.5  # of the mean flow: more is no leak
REFERENCE_PRESSURE = 1e7  # Pa, at which the conductance is stated


def leak_conductance(conductance, pressure_exponent, pressure):
    """dq/dp, m3/(Pa s), of a leak to the atmosphere from `pressure` (Pa); `conductance` is that at
    10 MPa. It takes the load's mean pressure, wherever the leak is. All broadcast."""
    # Spectra may come without a mean pressure: then it is as at one atmosphere.
    relative = np.maximum(pressure, ATMOSPHERE) / REFERENCE_PRESSURE
    return conductance * relative ** (-pressure_exponent)


def drawn_share(values, state):
    """Share of the nominal mean flow that the leak draws, so that it does not pass the orifice.

    q = integral of G dp = G p/(1 - m). The orifice's coefficient is calculated from mean flow and
    load pressure; without this share its slope dq/dp = q/(2 p) would be too large in proportion.
    Zero where the coefficient is given.
    """
    if not state.load_passes_flow:
        return 0.0
    exponent, pressure = values["pressure_exponent"], state.mean_pressure
    slope = leak_conductance(values["conductance"], exponent, pressure)
    return np.minimum(slope * pressure / (1.0 - exponent) / state.mean_flow, MAX_DRAWN_SHARE)


def _apply(network, state, values, place):
    conductance = leak_conductance(
        values["conductance"], values["pressure_exponent"], state.mean_pressure
    )
    network.inserts.append(
        Insert(on_line(network, values["position"]), "shunt", conductance + 0.0 * network.s)
    )
    kind, value = network.load
    if kind == "admittance":
        network.load = kind, value * (1.0 - drawn_share(values, state))


def _parameters(rig, place):
    unit = characteristic_admittance(rig)
    return (
        position_parameter(rig),
        Parameter("conductance", "m3/(Pa s)", lognormal(0.1 * unit, 1.2)),
        Parameter("pressure_exponent", "1", uniform(0.0, 0.5)),
    )


def _apply_in_time(line, state, values, place):
    conductance = leak_conductance(
        values["conductance"], values["pressure_exponent"], state.mean_pressure
    )
    line.inserts.append(Element(on_line(line, values["position"]), "shunt", (conductance,)))
    # An element responds to deviations from the steady state: the mean draw leaves the source flow.
    share = float(drawn_share(values, state))
    line.end = replace(line.end, coefficient=line.end.coefficient * (1.0 - share))
    line.flow = line.flow - share * line.mean_flow
    line.mean_flow *= 1.0 - share


EFFECT = Effect(
    name="leak",
    element="position",
    medium="any",
    equation="q1 - q2 = G p, G = dq/dp = G_10MPa (p/10 MPa)^-m; "
    "m = 0 for a laminar gap, 1/2 for an orifice",
    source="Covas, Ramos & de Almeida 2005, J. Hydraul. Eng. 131:1106, eq. 7 (orifice leak)",
    parameters=_parameters,
    places=position_place,
    apply=_apply,
    apply_in_time=_apply_in_time,
    limits=(("source_impedance", "leakage"),),
)
