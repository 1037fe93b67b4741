"""A passive one-port without particular physics, for what is missing and not in the library.

Foster's second form: any lossless admittance is a sum of a capacitance, an inductance and series
resonators; with resistances in them, every sum of positive elements is realisable, hence passive.
A conductance, a capacitance and two resonators describe most things below 5 kHz. For a series
impedance the dual network is used.
"""

from __future__ import annotations

import numpy as np

from rippletwin.line.frequency_domain.line_network import Insert
from rippletwin.line.time_domain.line_elements import Element
from rippletwin.twin.effects.base import Effect, Place, on_line, position_parameter
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import lognormal

RESONATORS = ((500.0, "first"), (1800.0, "second"))  # prior median frequency in Hz, name


def _one_port(s, values, unit):
    """Immittance of the network, `unit` being a characteristic admittance or impedance."""
    total = values["flat"] + s * values["rising"] / (2.0 * np.pi * 1000.0)
    for _, name in RESONATORS:
        w = 2.0 * np.pi * values[f"{name}_frequency"]
        band = 2.0 * values[f"{name}_damping"] * w * s
        total = total + values[f"{name}_peak"] * band / (s**2 + band + w**2)
    return unit * total


def _apply(network, state, values, place):
    characteristic = state.density * state.wave_speeds[0] / state.area(0)
    kind = place.form
    unit = 1.0 / characteristic if kind == "shunt" else characteristic
    position = on_line(network, values["position"])
    network.inserts.append(Insert(position, kind, _one_port(network.s, values, unit)))


def _parameters(rig, place):
    parameters = [
        position_parameter(rig),
        Parameter("flat", "1", lognormal(0.03, 1.5)),
        Parameter("rising", "1", lognormal(0.1, 1.5)),
    ]
    for frequency, name in RESONATORS:
        parameters += [
            Parameter(f"{name}_peak", "1", lognormal(0.1, 1.5)),
            Parameter(f"{name}_frequency", "Hz", lognormal(frequency, 0.7)),
            Parameter(f"{name}_damping", "1", lognormal(0.2, 1.0)),
        ]
    return tuple(parameters)


def _apply_in_time(line, state, values, place):
    characteristic = state.density * state.wave_speeds[0] / state.area(0)
    unit = 1.0 / characteristic if place.form == "shunt" else characteristic
    position = on_line(line, values["position"])
    rising = unit * values["rising"] / (2.0 * np.pi * 1000.0)
    line.inserts.append(Element(position, place.form, (rising, unit * values["flat"])))
    for _, name in RESONATORS:
        w = 2.0 * np.pi * values[f"{name}_frequency"]
        band = 2.0 * values[f"{name}_damping"] * w
        peak = unit * values[f"{name}_peak"] * band
        line.inserts.append(Element(position, place.form, (peak, 0.0), (1.0, band, w**2)))


EFFECT = Effect(
    name="passive_network",
    element="position",
    medium="any",
    equation="Y Zc = g + c s/(2 pi 1 kHz) + sum_k h_k 2 zeta_k w_k s/(s^2 + 2 zeta_k w_k s "
    "+ w_k^2), or Z/Zc likewise",
    source="Foster 1924, Bell Syst. Tech. J. 3:259; Brune 1931, J. Math. Phys. 10:191 (passivity)",
    parameters=_parameters,
    places=lambda rig: (Place("position", form="shunt"), Place("position", form="series")),
    apply=_apply,
    apply_in_time=_apply_in_time,
    named=False,
)
