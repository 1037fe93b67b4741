"""The twin: a rig with uncertain parameters, which predicts what the sensors read.

The parameter vector theta is in the coordinates of `parameters`: 0 is the data sheet
and every prior is N(0, 1). Its entries, in this order (segments and recordings count from 1):

    wave_speed[i], diameter[i], length[i]   of each segment, with the priors of `uncertainty`
    position[NAME]                          of each sensor
    viscosity                               kinematic
    load                                    factor on the orifice's coefficient or on the measured
                                            load impedance; absent for other loads
    reflection[k]                           Schur parameters of an unknown load
    gain[NAME], phase[NAME]                 of each sensor that is not calibrated
    bulk_modulus, port_timing, ...          of the pump, where `uncertain_pump` says so
    angle[LABEL]                            shaft angle at a recording's first sample, rad; no prior
    state[LABEL]                            factor on all wave speeds while a recording was made,
                                            where `changing_state` says so
    viscosity_slope                         relative change of the viscosity over that of these
                                            wave speeds, about the mean of the recordings
    LABEL.NAME                              parameters of the effects, with their own priors

An effect at its place is a pair (effect, place) of `rippletwin.twin.effects`; its LABEL is
"name@place", as in "viscoelastic_wall@segment 2".
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from rippletwin.case.model import FlowRipple, Rig, Sensor
from rippletwin.line.frequency_domain.pipe_immittance import FRICTION_LAWS
from rippletwin.spectra.corrected_ripple import CorrectedRipple
from rippletwin.twin import parameters as coordinates
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.nominal_ripples import NominalRipples
from rippletwin.twin.operating_point import (
    OperatingCondition,
    OperatingPoint,
    operating_point,
)
from rippletwin.twin.parameters import (
    angle_parameter,
    effect_parameters,
    gain_parameters,
    line_parameters,
    load_parameters,
    pump_parameters,
    state_parameters,
)
from rippletwin.twin.priors import Priors

SOURCE_SD = 0.05
"""Largest relative standard deviation of a nominal flow ripple's harmonics."""


class Arrays(NamedTuple):
    """The line at one theta, in SI units: segments (n,), sensors (S,); kinematic viscosity and load
    factor are scalars. A forward model may have the viscosity (..., F) of each recording.

    `reflection` has the Schur parameters of an unknown load, each (..., 1); `gains` (S, ..., 1) is
    what uncalibrated sensors read over the pressure.
    """

    wave_speeds: np.ndarray
    diameters: np.ndarray
    lengths: np.ndarray
    positions: np.ndarray
    viscosity: np.ndarray | float
    load: float
    reflection: tuple = ()
    gains: np.ndarray | float = 1.0


class Twin:
    """Nominal rig, friction law, effects and the recordings' shaft angles.

    Parameters
    ----------
    rig : the data sheet.
    observations : those whose shaft angle is unknown get an angle parameter; None for none.
    friction : "none", "steady" (the paper) or "unsteady".
    effects : physics beyond that, applied in order.
    source_sd : largest relative standard deviation of a nominal ripple's harmonics.
    theta : coordinates of the twin's own values, (P,); nominal by default.
    guessed_load : whether the orifice's coefficient is only guessed; by default it is where an
        observation has neither a flow ripple nor a coefficient from which the mean flow follows.
    absolute_gains : whether the gain of the first sensor is a parameter too, where gains are; by
        default where an observation's source is not free.
    uncertain_pump : whether numbers of the pump are parameters. They can be only where recordings
        have a nominal source and the data sheet gives the pump's geometry, from which the lumped
        model calculates how they change the ripple.
    changing_state : whether the line's temperature differs between recordings, where there are two
        or more.
    reference : labels of the recordings at whose mean state the viscosity is the parameter's; None
        for all.
    ripple : the pump's flow ripple as recordings correct it, for simulations; predictions of
        observations, which a fit compares with them, take the nominal ripple.

    Raises ValueError for an unknown friction, a theta of the wrong length, two recordings of one
    label and an effect twice at a place.
    """

    def __init__(
        self,
        rig: Rig,
        observations: Sequence = (),
        friction: str = "steady",
        effects: Sequence = (),
        source_sd: float = SOURCE_SD,
        theta: np.ndarray | None = None,
        guessed_load: bool | None = None,
        absolute_gains: bool | None = None,
        uncertain_pump: bool = False,
        changing_state: bool = False,
        reference: Sequence[str] | None = None,
        ripple: CorrectedRipple | None = None,
    ):
        if friction not in FRICTION_LAWS:
            raise ValueError(f"friction must be one of {FRICTION_LAWS}, not {friction!r}")
        self.rig, self.friction, self.effects = rig, friction, tuple(effects)
        self.source_sd, self.ripple = source_sd, ripple
        self.labels = tuple(
            o.label for o in observations if o.kind == "periodic" and o.source != "free"
        )
        if len(set(self.labels)) < len(self.labels):
            raise ValueError(f"recordings need labels of their own, not {self.labels}")
        if guessed_load is None:
            guessed_load = rig.load.passes_flow and any(
                o.source != "nominal" and o.flow_ripple is None for o in observations
            )
        self.guessed_load = bool(guessed_load)
        self.absolute_gains = bool(self.labels) if absolute_gains is None else absolute_gains
        self.uncertain_pump = bool(uncertain_pump and self.labels and len(rig.pump) > 1)
        self.changing_state = bool(changing_state and len(self.labels) > 1)
        self.reference = reference
        self._effect_parameters = [effect.parameters(rig, place) for effect, place in self.effects]
        self.parameters = (
            *line_parameters(rig),
            *load_parameters(rig, self.guessed_load),
            *gain_parameters(rig, self.absolute_gains),
            *(pump_parameters(rig) if self.uncertain_pump else ()),
            *(angle_parameter(label) for label in self.labels),
            *(state_parameters(self.labels) if self.changing_state else ()),
            *effect_parameters(self.effects, self._effect_parameters),
        )
        self.index = {p.name: k for k, p in enumerate(self.parameters)}
        counts = [len(own) for own in self._effect_parameters]
        ends = len(self.parameters) - sum(counts) + np.cumsum([0, *counts])
        self._own = [slice(int(a), int(b)) for a, b in pairwise(ends)]
        self._applied = sorted(range(len(self.effects)), key=lambda k: self.effects[k][0].rank)
        self._line_priors = Priors([p.prior for p in line_parameters(rig)])
        self._reflection = [
            k for k, p in enumerate(self.parameters) if p.name.startswith("reflection[")
        ]
        self.theta = np.zeros(len(self.parameters)) if theta is None else np.asarray(theta, float)
        if self.theta.shape != (len(self.parameters),):
            raise ValueError(f"theta must have {len(self.parameters)} entries")
        # Shared by copies with other effects: ripples, and the changes that `FlowSource` keeps.
        self._ripples = NominalRipples(rig)
        self.kept_changes: dict = {}

    # parameters and their values

    def values(self, theta: np.ndarray | None = None) -> dict[str, float]:
        """Physical values by name, SI units, at `theta` (P,), by default the twin's own."""
        return coordinates.values(self.parameters, self.theta if theta is None else theta)

    def arrays(self, theta: np.ndarray) -> Arrays:
        """The line's numbers at `theta` (P,) as arrays, SI units."""
        n = len(self.rig.line)
        k = 3 * n + len(self.rig.sensors)
        u = self._line_priors.value(theta[: k + 1])
        a, d, lengths = u[: 3 * n].reshape(3, n)
        # A sensor stays on the line however the fit stretches it.
        x = np.clip(u[3 * n : k], 0.0, np.sum(lengths))
        ends = self.reflection(theta), self.gains(theta)
        return Arrays(a, d, lengths, x, u[k], self.load_factor(theta), *ends)

    def reflection(self, u: np.ndarray) -> tuple[np.ndarray, ...]:
        """Schur parameters of an unknown load, each (..., 1), at coordinates u (P, ...)."""
        return tuple(
            np.asarray(self.parameters[k].value(u[k]))[..., None] for k in self._reflection
        )

    def gains(self, u: np.ndarray) -> np.ndarray | float:
        """What each sensor reads over the pressure, (S, ..., 1), at coordinates u (P, ...); 1 where
        all are calibrated."""
        if not self.rig.uncertainty.sensor_gain:
            return 1.0

        def value(name, otherwise):
            k = self.index.get(name)
            return otherwise + 0.0 * u[0] if k is None else self.parameters[k].value(u[k])

        names = [sensor.name for sensor in self.rig.sensors]
        gain = np.array([value(f"gain[{name}]", 1.0) for name in names])
        phase = np.array([value(f"phase[{name}]", 0.0) for name in names])
        return (gain * np.exp(1j * phase))[..., None]

    def load_factor(self, theta: np.ndarray) -> float:
        """Factor on the load's coefficient at `theta` (P,); 1 where it is no parameter."""
        k = self.index.get("load")
        return 1.0 if k is None else self.parameters[k].value(theta[k])

    def effect_values(self, theta: np.ndarray) -> list[tuple]:
        """(effect, place, values by name in SI units) of each effect at `theta` (P,)."""
        return [self._values_of(k, theta) for k in range(len(self.effects))]

    def applied_effects(self, theta: np.ndarray) -> list[tuple]:
        """`effect_values` in the order in which a line takes them (`Effect.rank`)."""
        return [self._values_of(k, theta) for k in self._applied]

    def last_applied(self, theta: np.ndarray) -> tuple:
        """The last of `applied_effects`."""
        return self._values_of(self._applied[-1], theta)

    @property
    def last_parameters(self) -> slice:
        """Where theta has the parameters of the effect that a line takes last."""
        return self._own[self._applied[-1]]

    def _values_of(self, k: int, theta: np.ndarray) -> tuple:
        """(effect, place, values by name in SI units) of effect k at `theta` (P,)."""
        own = zip(self._effect_parameters[k], theta[self._own[k]])
        return (*self.effects[k], {p.name: p.prior.value(u) for p, u in own})

    @property
    def friction_law(self) -> str:
        """Friction law of the line with its effects."""
        return next((e.friction for e, _ in self.effects if e.friction), self.friction)

    # predictions

    def predict(self, observations: Sequence, theta: np.ndarray | None = None) -> list[np.ndarray]:
        """What the sensors read in each observation: list of (S, F) complex, see `ForwardModel`.

        For many calls with the same observations make one `ForwardModel` and keep it. Warns where
        no steady state was found.
        """
        forward = ForwardModel(self, observations)
        predicted = forward(self.theta if theta is None else np.asarray(theta))
        if not forward.solved:
            labels = ", ".join(o.label or "an operating point" for o in forward.observations)
            text = f"{labels}: no steady state was found; the last iterate is returned"
            warnings.warn(text, RuntimeWarning, stacklevel=2)
        return predicted

    def operating_point(self, observation) -> OperatingPoint:
        """Mean pressure and flow, orifice coefficient and source of an observation or an
        `OperatingCondition`. Raises InputError for an orifice without a mean pressure above its
        back pressure, and where the pump has no load pressure to be simulated against, or delivers
        nothing."""
        ripple = None
        if observation.kind == "periodic" and observation.source != "free":
            ripple = self._ripples.of(observation)
        return operating_point(self.rig, observation, ripple, self.guessed_load)

    def respond(
        self,
        ripple: FlowRipple,
        speed_hz: float,
        load_pressure: float,
        orders: np.ndarray,
    ) -> np.ndarray:
        """Sensors' pressure harmonics (S, F), Pa, at shaft `orders` (F,) for any flow ripple, at
        shaft angle 0.

        `speed_hz` in rev/s, `load_pressure` the mean before the load, Pa.

        This is how the ripple of a faulty pump is propagated in the frequency domain. Where the
        data sheet gives no orifice coefficient, it follows from the mean flow of `ripple`.
        """
        condition = OperatingCondition.at_orders(orders, speed_hz, load_pressure, ripple)
        return self.predict([condition])[0]

    # copies

    def with_(self, **changes) -> Twin:
        """A copy with other friction, effects, source_sd, ripple or theta; if effects change, theta
        is nominal and so is the ripple."""
        state = {
            "friction": self.friction,
            "effects": self.effects,
            "source_sd": self.source_sd,
            "guessed_load": self.guessed_load,
            "absolute_gains": self.absolute_gains,
            "uncertain_pump": self.uncertain_pump,
            "changing_state": self.changing_state,
            "reference": self.reference,
            "theta": None if "effects" in changes else self.theta,
            "ripple": None if "effects" in changes else self.ripple,
        }
        labels = [OperatingCondition(label) for label in self.labels]
        twin = Twin(self.rig, labels, **{**state, **changes})
        twin._ripples = self._ripples
        # The parameters' indices belong to it, and effects come last.
        if twin.uncertain_pump == self.uncertain_pump:
            twin.kept_changes = self.kept_changes
        return twin

    def fitted_pump(self) -> dict:
        """The data sheet's pump, keys as in rig.yaml, with the fitted values of its parameters."""
        from rippletwin.pump.ripple_sensitivity import KEYS

        values, pump = self.values(), dict(self.rig.pump)
        fitted = (p.name for p in self.parameters if p.place == "pump")
        return pump | {KEYS[name]: values[name] for name in fitted}

    def calibrated_rig(self) -> Rig:
        """The rig with the twin's own values, for the method of characteristics.

        The load factor goes into the orifice's coefficient where the data sheet gives one.
        """
        v = self.arrays(self.theta)
        line = tuple(
            replace(s, length=float(length), diameter=float(d), wave_speed=float(a))
            for s, length, d, a in zip(self.rig.line, v.lengths, v.diameters, v.wave_speeds)
        )
        sensors = tuple(Sensor(s.name, float(x)) for s, x in zip(self.rig.sensors, v.positions))
        load = self.rig.load
        if load.coefficient is not None:
            load = replace(load, coefficient=load.coefficient * v.load)
        fluid = replace(self.rig.fluid, kinematic_viscosity=float(v.viscosity))
        return replace(self.rig, line=line, sensors=sensors, load=load, fluid=fluid)
