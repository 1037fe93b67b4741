"""Flow ripples of the data sheet's pump, as the shaft of a recording delivers them."""

from __future__ import annotations

from rippletwin.case.model import FlowRipple, Rig
from rippletwin.errors import InputError
from rippletwin.harmonics import modulate_ripple


class NominalRipples:
    """The nominal ripples of a rig's recordings, each made once for a twin and its copies."""

    def __init__(self, rig: Rig):
        self._rig = rig
        self._made: dict = {}

    def of(self, observation) -> FlowRipple:
        """The stated ripple of a periodic observation, or that of the lumped pump model at its
        speed and load pressure, with the modulation of its shaft."""
        even = observation.flow_ripple or self._simulated(observation)
        if not observation.modulation:
            return even
        key = id(even), observation.modulation
        if key not in self._made:  # with the even one, whose id stays its own
            self._made[key] = even, modulate_ripple(even, observation.modulation)
        return self._made[key][1]

    def _simulated(self, observation) -> FlowRipple:
        if observation.load_pressure is None:
            raise InputError(
                "rig.yaml",
                f"load_pressure of {observation.label}",
                "missing: the pump is simulated against it",
                "Give the mean gauge pressure at the load, Pa",
            )
        key = observation.speed_hz, observation.load_pressure
        if key not in self._made:
            from rippletwin.pump.outlets import ConstantPressure
            from rippletwin.pump.simulation import simulate

            made = simulate(
                self._rig.pump,
                self._rig.fluid,
                60.0 * observation.speed_hz,
                ConstantPressure(observation.load_pressure),
            )
            if not made.flow.mean() > 0.0:
                raise InputError(
                    "rig.yaml",
                    "pump",
                    f"this pump delivers nothing at {60.0 * observation.speed_hz:.4g} r/min and "
                    f"{observation.load_pressure / 1e5:.4g} bar, as of {observation.label}",
                    "Correct its numbers, the speed or the load pressure",
                )
            self._made[key] = made
        return self._made[key]
