"""Whether a user's effect works: what the library's own effects are tested for, asked of a file."""

from __future__ import annotations

import numpy as np

from rippletwin.errors import InputError
from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine
from rippletwin.line.frequency_domain.pipe_immittance import series_impedance, shunt_admittance
from rippletwin.twin.effects.base import Effect, LineState, Place
from rippletwin.twin.parameters import Parameter

ELEMENTS = ("line", "segment", "position", "load", "source", "sensor")
MEDIA = ("liquid", "gas", "any")
TRIED_HZ = np.linspace(20.0, 4000.0, 60)
TRIED_PRESSURE = 1e7  # Pa, of a liquid
TRIED_COORDINATES = (0.0, -1.0, 1.0)  # of all parameters at once
ROUNDING = 1e-9  # relative, of a real part that should not be negative


def check_fields(effect: Effect) -> None:
    """Raise InputError where a field of a user's effect has no meaning."""
    if not (isinstance(effect.name, str) and effect.name.isidentifier()):
        raise _fault(effect, "name", f"{effect.name!r} is no name", "Use letters, digits and _")
    for field, known in (("element", ELEMENTS), ("medium", MEDIA)):
        value = getattr(effect, field)
        if value not in known:
            problem = f"{value!r} is not known"
            raise _fault(effect, field, problem, f"Give one of {', '.join(known)}")


def check_on_rig(effect: Effect, rig) -> None:
    """Raise InputError where a user's effect does not work on this rig.

    It is tried at its data sheet and one standard deviation to either side: its parameters must be
    `Parameter`s, what it makes of the line must be finite, and what it puts on the line passive.
    """
    if not effect.suits(rig):
        return
    for place in _run(effect, "places", effect.places, rig):
        if not isinstance(place, Place):
            raise _fault(effect, "places", f"gives {place!r}", "Give a tuple of Place")
        if place.index is None and place.element.startswith(("segment", "sensor")):
            remedy = "Give it with index, from 0, or take segment_places or sensor_places"
            raise _fault(effect, "places", f"gives {place!r} without an index", remedy)
        own = _run(effect, "parameters", effect.parameters, rig, place)
        if not all(isinstance(p, Parameter) for p in own):
            raise _fault(effect, "parameters", f"gives {own!r}", "Give a tuple of Parameter")
        names = [p.name for p in own]
        if len(set(names)) < len(names) or any("." in name for name in names):
            raise _fault(effect, "parameters", f"names {names}", "Give each a name, without a dot")
        if place.element == "position" and "position" not in names:
            remedy = "Put position_parameter(rig) first"
            raise _fault(effect, "parameters", "an effect at a position has none", remedy)
        for u in TRIED_COORDINATES:
            _try_at(effect, rig, place, {p.name: float(p.value(u)) for p in own})


def _try_at(effect: Effect, rig, place: Place, values: dict) -> None:
    line, state = _lossless_line(rig, effect.element == "load")
    _run(effect, "apply", effect.apply, line, state, values, place)
    impedance = _run(effect, "apply", line.input_impedance)
    changed = (
        line.sensor_factor,
        line.source_flow,
        line.source_admittance,
        line.source_impedance,
    )
    if not all(np.all(np.isfinite(np.asarray(x))) for x in (impedance, *changed)):
        raise _fault(effect, "apply", f"is not finite at {values}", "Correct the equation")
    if effect.element not in ("source", "sensor"):
        if np.any(impedance.real < -ROUNDING * np.abs(impedance)):
            problem = f"gives energy at {values}: the line's impedance has a negative real part"
            raise _fault(effect, "apply", problem, "Correct a sign; losses are positive")


def _lossless_line(rig, matched: bool) -> tuple[FrequencyDomainLine, LineState]:
    """The rig's line, whose losses could hide a negative one, and its state.

    matched   whether the end is a resistance; it is closed otherwise
    """
    s, fluid = 2j * np.pi * TRIED_HZ, rig.fluid
    series = [
        series_impedance(
            s,
            density=fluid.density,
            viscosity=fluid.kinematic_viscosity,
            diameter=segment.diameter,
            friction="none",
        )
        for segment in rig.line
    ]
    shunt = [
        shunt_admittance(
            s, density=fluid.density, wave_speed=segment.wave_speed, diameter=segment.diameter
        )
        for segment in rig.line
    ]
    last = rig.line[-1]
    resistance = fluid.density * last.wave_speed / last.area
    lengths = np.array([segment.length for segment in rig.line])
    line = FrequencyDomainLine(
        s=s,
        lengths=lengths,
        series=np.array(series),
        shunt=np.array(shunt),
        load=("admittance", np.full(len(s), 1.0 / resistance)) if matched else ("closed", None),
        sensor_positions=np.array([sensor.position for sensor in rig.sensors]),
    )
    state = LineState(
        density=fluid.density,
        viscosity=fluid.kinematic_viscosity,
        diameters=np.array([segment.diameter for segment in rig.line]),
        wave_speeds=np.array([segment.wave_speed for segment in rig.line]),
        lengths=lengths,
        load_resistance=resistance,
        heat_capacity_ratio=fluid.heat_capacity_ratio,
        prandtl=fluid.prandtl,
        orders=np.arange(1, len(s) + 1),
        recording=np.zeros(len(s), int),
        mean_flow=np.full(len(s), last.area),  # at a metre a second
        mean_pressure=0.0 if fluid.is_gas else TRIED_PRESSURE,
    )
    return line, state


def _run(effect: Effect, field: str, function, *arguments):
    """The result of a user's function; whatever it raises becomes an InputError."""
    try:
        return function(*arguments)
    except Exception as error:  # a user's code may raise anything
        raise _fault(effect, field, f"fails: {error!r}", "Correct it") from error


def _fault(effect: Effect, field: str, problem: str, remedy: str) -> InputError:
    return InputError(effect.file, f"EFFECT.{field}", problem, remedy)
