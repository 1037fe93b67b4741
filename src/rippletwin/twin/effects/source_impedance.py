"""A pump that is no ideal flow source: outlet volume and leakage are parallel to its flow."""

from __future__ import annotations

import numpy as np

from rippletwin.line.time_domain.line_elements import Element, inertance
from rippletwin.twin.effects.base import Effect, Place, characteristic_admittance
from rippletwin.twin.effects.lumped_elements import volume_compliance
from rippletwin.twin.parameters import Parameter
from rippletwin.twin.priors import lognormal

VOLUME_SD = 0.7
"""Standard deviation of the logarithm of the pump's own volume over its displacement. The chambers
open to delivery have 0.4 to 0.75 of the displacement on the average, with dead volumes of 0.3 to 1
of a stroke; the passages to the outlet have about as much again."""
FORMS = ("leakage", "volume", "volume and passage")  # each has what the one before has, and more


def _places(rig):
    forms = FORMS if rig.displacement is None else FORMS[1:]
    return tuple(Place("source", form=form) for form in forms)


def _is_left_out(rig, place):
    """Whether the pump's volume is surely missing: a stated flow goes into a constant pressure, and
    leaves out the chambers. Those of a pump that is simulated respond to the line."""
    return rig.displacement is not None and place.form == "volume"


def _apply(network, state, values, place):
    admittance = values["conductance"] + network.s * _compliance(state, values, place)
    network.source_admittance = network.source_admittance + admittance
    if place.form == "volume and passage":
        network.source_impedance = network.source_impedance + network.s * values["inertance"]


def _compliance(state, values, place):
    """Of the outlet volume, m3/Pa; zero for a pump that only leaks."""
    if place.form == "leakage":
        return 0.0
    return volume_compliance(values["volume"], state.density, state.wave_speeds[0])


def _parameters(rig, place):
    first = rig.line[0]
    area = 0.25 * np.pi * first.diameter**2
    volume = Parameter("volume", "m3", _volume_prior(rig))
    leakage = Parameter(
        "conductance", "m3/(Pa s)", lognormal(0.01 * characteristic_admittance(rig), 1.5)
    )
    passage = Parameter("inertance", "Pa s2/m3", lognormal(0.1 * rig.fluid.density / area, 1.0))
    own = {"leakage": (leakage,), "volume": (volume, leakage)}
    return own.get(place.form, (volume, leakage, passage))


def _volume_prior(rig):
    """Of a pump that is known by its flow ripple, all of its volume; of a simulated one, whose
    chambers respond to the line, or an unknown one, any volume that suits the bore."""
    if rig.displacement is not None:
        return lognormal(rig.displacement, VOLUME_SD)
    return lognormal(1e-4 * (rig.line[0].diameter / 0.02) ** 3, 1.2)


def _apply_in_time(line, state, values, place):
    compliance = _compliance(state, values, place)
    line.source.append(Element(0.0, "shunt", (compliance, values["conductance"])))
    if place.form == "volume and passage":
        line.passage.append(inertance(0.0, values["inertance"]))


EFFECT = Effect(
    name="source_impedance",
    element="source",
    medium="any",
    equation="q(0) = Q - (s V/(rho a^2) + G) p_pump, p_pump = p(0) + s I q(0)",
    source="Edge & Johnston 1990, Proc. IMechE 204(I):33 (source impedance of pumps, "
    "leakage, lumped volume and passage)",
    parameters=_parameters,
    places=_places,
    apply=_apply,
    apply_in_time=_apply_in_time,
    certain=_is_left_out,
    usual=_is_left_out,
)
