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
from rippletwin.twin.priors import Prior, bounded, lognormal, normal
from rippletwin.twin.unknown_load import REFLECTION_SDS


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
    stated whether the data sheet says something of it, so that a pull speaks against the sheet
    """

    name: str
    unit: str
    prior: Prior
    scan: tuple[float, ...] = (0.0,)
    place: str = ""
    flat: bool = False
    stated: bool = True

    @property
    def nominal(self) -> float:
        """Value in `unit` at u = 0."""
        return float(self.prior.value(0.0))

    def value(self, u: float) -> float:
        """Value in `unit` at coordinate u."""
        return self.prior.value(u)

    @property
    def is_sheet_number(self) -> bool:
        """Whether the data sheet states its tolerance."""
        return self.name.partition("[")[0] in SHEET_NUMBERS

    def stated_pull(self, u: float, tolerance_scale: float) -> float:
        """Distance from the data sheet in standard deviations as stated, of a coordinate of a prior
        that has `tolerance_scale` times the sheet's tolerances."""
        return u * tolerance_scale if self.is_sheet_number else u

    def value_sd(self, u: float, u_sd: float) -> float:
        """Standard deviation in `unit` of a coordinate known as u +- u_sd (first order)."""
        h = 1e-4
        return abs(float(self.value(u + h) - self.value(u - h))) / (2 * h) * u_sd


def values(parameters: Sequence[Parameter], u: np.ndarray) -> dict[str, float]:
    """Values by name, each in its parameter's unit, at coordinates u (P,)."""
    return {p.name: float(p.value(x)) for p, x in zip(parameters, u, strict=True)}


def coordinates(parameters: Sequence[Parameter], by_name: Mapping[str, float]) -> np.ndarray:
    """Coordinates (P,) of values by name; a parameter that is not named stays at u = 0."""
    return np.array(
        [
            float(p.prior.coordinate(by_name[p.name])) if p.name in by_name else 0.0
            for p in parameters
        ]
    )


SHEET_NUMBERS = ("wave_speed", "diameter", "length", "position", "viscosity", "load")
"""Parameters, without their index, whose tolerance the data sheet states."""
GUESSED_LOAD_SD = 1.0  # relative, of the load where its mean flow is guessed (`operating_point`)
PORT_TIMING_SD = 1.0  # deg, of the port plate's angle to the swash plate
PUMP_SDS = {
    "bulk_modulus": 0.1,  # of the liquid in the chambers: air and heat lower it
    "dead_volume": 0.15,  # cavities of pistons and ports are not on the drawing of the stroke
    "discharge_coefficient": 0.1,  # with the ports' area, of which it is a factor
    "port_opening": 0.3,  # relief grooves and edges
    "port_overlap": 0.7,
    "air_fraction": 1.0,
    "case_leakage": 0.7,  # the cube of clearances
}
"""Relative standard deviations of the pump's numbers about the data sheet. Sources of the orders of
magnitude: docs/diagnosis_trial.md, nuisance physics."""
PUMP_UNITS = {"bulk_modulus": "Pa", "dead_volume": "m3", "case_leakage": "m3/(Pa s)"}
ANGLE_SCALE = 0.01  # rad of shaft angle a coordinate: a few degrees of phase at the 9th harmonic


def load_parameters(rig: Rig, guessed_load: bool) -> list[Parameter]:
    """The load's factor, or the Schur parameters of an unknown one (`unknown_load`)."""
    if rig.load.kind in ("orifice", "impedance"):
        sd = GUESSED_LOAD_SD if guessed_load else rig.uncertainty.load
        return [Parameter("load", "", lognormal(1.0, sd), place="load")]
    if rig.load.kind == "unknown":
        return [
            Parameter(f"reflection[{k}]", "1", bounded(sd), place="load", stated=False)
            for k, sd in enumerate(REFLECTION_SDS)
        ]
    return []


def gain_parameters(rig: Rig, absolute: bool) -> list[Parameter]:
    """Logarithm of the gain and phase of each sensor whose sensitivity is not calibrated.

    Without a known source only ratios show: then (`absolute` False) the first sensor is right.
    """
    sd = rig.uncertainty.sensor_gain
    sensors = rig.sensors if absolute else rig.sensors[1:]
    return [
        Parameter(f"{name}[{s.name}]", unit, prior, place=f"sensor {s.name}")
        for name, unit, prior in (
            ("gain", "1", lognormal(1.0, sd)),
            ("phase", "rad", normal(0.0, sd)),
        )
        for s in sensors
        if sd > 0.0
    ]


def line_parameters(rig: Rig) -> list[Parameter]:
    """Wave speeds, diameters, lengths, sensors' positions and viscosity."""
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
    return out


def pump_parameters(rig: Rig) -> list[Parameter]:
    """Uncertain numbers of a pump whose geometry is known; one that the data sheet says to be zero
    is none."""
    from rippletwin.pump.geometry import Geometry
    from rippletwin.pump.ripple_sensitivity import KEYS

    geometry, parameters = Geometry.from_dict(rig.pump), []
    for name, key in KEYS.items():
        nominal = getattr(geometry, key)
        if name == "port_timing":
            prior = normal(nominal, PORT_TIMING_SD)
        elif nominal != 0.0:  # an overlap may be negative
            prior = lognormal(nominal, PUMP_SDS[name])
        else:
            continue
        unit = "deg" if key.endswith("_deg") else PUMP_UNITS.get(name, "1")
        parameters.append(Parameter(name, unit, prior, place="pump"))
    return parameters


RECORDING_STATE_SD = 0.005
"""Relative, of all wave speeds between recordings: they fall by 0.3 % a kelvin (Gholizadeh, Burton
and Schoenau 2011, Int. J. Fluid Power 12(3):5), and a line is not at one temperature for long."""


VISCOSITY_SLOPE = 15.0, 0.3
"""Relative change of the viscosity over that of the wave speeds where the temperature changes:
median and relative standard deviation. Of mineral oils between 30 and 60 degrees Celsius the
viscosity falls by 3.5 to 5.5 % a kelvin (ASTM D341, ISO VG 32 to 68), the wave speed by 0.2 to
0.35 % (Gholizadeh, Burton and Schoenau 2011)."""


def state_parameter(label: str) -> Parameter:
    """Factor on all wave speeds while a recording was made, about their common value."""
    prior = lognormal(1.0, RECORDING_STATE_SD)
    return Parameter(f"state[{label}]", "1", prior, place=f"recording {label}")


def state_parameters(labels: Sequence[str]) -> list[Parameter]:
    """The state of each recording, and how much the viscosity changes with it."""
    slope = Parameter(
        "viscosity_slope", "1", lognormal(*VISCOSITY_SLOPE), place="fluid", stated=False
    )
    return [*map(state_parameter, labels), slope]


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
