"""Parameters with priors, in the coordinates in which every prior is N(0, 1).

Fits work in coordinates u: u = 0 is the data sheet, |u| is the pull on the prior in standard
deviations, and minus the logarithm of the prior density is u^2/2 plus a constant. A parameter
without a prior (`flat`) has a scale instead, and no pull.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rippletwin.case.model import Rig
from rippletwin.twin.priors import Prior, lognormal, normal


@dataclass(frozen=True)
class Parameter:
    """One unknown of a twin or of an effect.

    name   unique in a twin, e.g. "wave_speed[2]" (segments count from 1)
    unit   SI
    prior  u -> value
    scan   coordinates u from which a fit starts, each of them: there are several where the
           posterior has several local modes along this parameter
    place  what it belongs to: "segment 2", "sensor p1", "load", "recording 1", an effect's label
    flat   no prior: `prior` is only the fit's coordinate
    """

    name: str
    unit: str
    prior: Prior
    scan: tuple[float, ...] = (0.0,)
    place: str = ""
    flat: bool = False

    @property
    def nominal(self) -> float:
        """Value at u = 0."""
        return float(self.prior.value(0.0))

    def value(self, u: float) -> float:
        """Value in `unit` at coordinate u."""
        return self.prior.value(u)

    def value_sd(self, u: float, u_sd: float) -> float:
        """Standard deviation in `unit` of a coordinate known as u +- u_sd (first order)."""
        h = 1e-4
        return abs(float(self.value(u + h) - self.value(u - h))) / (2 * h) * u_sd


def values(parameters: Sequence[Parameter], u: np.ndarray) -> dict[str, float]:
    """Values by name at coordinates u (P,)."""
    return {p.name: float(p.value(x)) for p, x in zip(parameters, u, strict=True)}


def coordinates(parameters: Sequence[Parameter], by_name: Mapping[str, float]) -> np.ndarray:
    """Coordinates (P,) of values by name; a parameter that is not named stays at u = 0."""
    return np.array(
        [
            float(p.prior.coordinate(by_name[p.name])) if p.name in by_name else 0.0
            for p in parameters
        ]
    )


GUESSED_LOAD_SD = 1.0  # relative, of the load where its mean flow is guessed (`operating_point`)
BULK_MODULUS_SD = 0.1  # relative, of the liquid in the chambers: air and heat lower it
PORT_TIMING_SD = 1.0  # deg, of the port plate's angle to the swash plate
ANGLE_SCALE = 0.01  # rad of shaft angle a coordinate: a few degrees of phase at the 9th harmonic


def line_parameters(rig: Rig, guessed_load: bool) -> list[Parameter]:
    """Wave speeds, diameters, lengths, sensors' positions, viscosity, and the load's factor."""
    sheet = rig.uncertainty
    relative = (
        ("wave_speed", sheet.wave_speed, "m/s"),
        ("diameter", sheet.diameter, "m"),
        ("length", sheet.length, "m"),
    )
    out = [
        Parameter(f"{name}[{k}]", unit, lognormal(getattr(segment, name), sd), place=f"segment {k}")
        for name, sd, unit in relative
        for k, segment in enumerate(rig.line, 1)
    ]
    out += [
        Parameter(
            f"position[{s.name}]",
            "m",
            normal(s.position, sheet.sensor_position),
            place=f"sensor {s.name}",
        )
        for s in rig.sensors
    ]
    viscosity = lognormal(rig.fluid.kinematic_viscosity, sheet.viscosity)
    out.append(Parameter("viscosity", "m2/s", viscosity, place="fluid"))
    if rig.load.kind in ("orifice", "impedance"):
        sd = GUESSED_LOAD_SD if guessed_load else sheet.load
        out.append(Parameter("load", "", lognormal(1.0, sd), place="load"))
    return out


def pump_parameters(rig: Rig) -> list[Parameter]:
    """Bulk modulus and port timing of a pump whose geometry is known."""
    from rippletwin.pump.geometry import Geometry

    geometry = Geometry.from_dict(rig.pump)
    modulus = lognormal(geometry.bulk_modulus, BULK_MODULUS_SD)
    timing = normal(geometry.port_timing_deg, PORT_TIMING_SD)
    return [
        Parameter("bulk_modulus", "Pa", modulus, place="pump"),
        Parameter("port_timing", "deg", timing, place="pump"),
    ]


def angle_parameter(label: str) -> Parameter:
    """Shaft angle at the first sample of the recording `label`; only the data determine it."""
    prior, place = normal(0.0, ANGLE_SCALE), f"recording {label}"
    return Parameter(f"angle[{label}]", "rad", prior, place=place, flat=True)


def effect_parameters(effects: Sequence, own: Sequence[Sequence[Parameter]]) -> list[Parameter]:
    """All parameters of (effect, place) pairs, `own` being each pair's, named after the pair.

    Raises ValueError where an effect occurs twice at a place.
    """
    labels = [f"{effect.name}@{place}" for effect, place in effects]
    if len(set(labels)) < len(labels):
        raise ValueError(f"an effect can be at a place once, not {labels}")
    return [
        replace(p, name=f"{label}.{p.name}", place=label)
        for label, parameters in zip(labels, own)
        for p in parameters
    ]
