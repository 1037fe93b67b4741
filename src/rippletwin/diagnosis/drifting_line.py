"""What the sensors read for unit flow at the pump while the line's state drifts a little.

Between two recordings the oil warms by a degree or two and the load is set anew: wave speeds change
by half a per cent, which at 4 kHz turns the phase by a radian on nine metres of line. So nothing is
compared before the line has been brought to the state of the recording.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rippletwin.case.model import FlowRipple
from rippletwin.diagnosis.pump_flow import rebuild
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.twin import Twin

DRIFTS = {"wave_speed": 0.005, "load": 0.02, "viscosity": 0.07}
"""What drifts, and its relative standard deviation from one recording to another: wave speed and
viscosity by 1.7 K at 0.3 and 4 % a kelvin (Gholizadeh, Burton and Schoenau 2011; ASTM D341)."""
STEP = 1e-3  # of the difference quotients, in standard deviations


class DriftingLine:
    """The twin's line at the operating point of an observation, at all of its shaft orders.

    `ripple` is the pump's: its chambers are beside the flow, its mean flow settles the orifice.
    """

    def __init__(self, twin: Twin, observation, ripple: FlowRipple):
        self.twin = twin = _free_to_drift(twin)
        point = replace(observation, flow_ripple=ripple, source="nominal")
        self._forward = ForwardModel(twin, [point])
        self._moved = {name: _indices(twin, name) for name in DRIFTS}

    @property
    def drifts(self) -> tuple[str, ...]:
        """What can drift on this line; `response` takes them in this order."""
        return tuple(name for name, indices in self._moved.items() if indices)

    def reset_orifice(self, drift: np.ndarray, gained: float) -> np.ndarray:
        """`drift` (D,) with an orifice set anew, which holds the load pressure where the mean flow
        changes by the share `gained`, below zero for a leak."""
        if "load" not in self.drifts or not self.twin.rig.load.passes_flow:
            return drift
        share = np.log1p(max(gained, -0.9)) / DRIFTS["load"]
        return drift + share * np.equal(self.drifts, "load")

    def response(
        self, drift: np.ndarray | None = None, theta: np.ndarray | None = None
    ) -> np.ndarray:
        """Readings (S, F), Pa s/m3, for unit flow; `drift` (D,) in standard deviations, from the
        coordinates `theta` (P,), by default the twin's own."""
        return self._forward.unit_response(self._theta(drift, theta))[0]

    def slopes(self, drift: np.ndarray) -> np.ndarray:
        """Derivatives (D, S, F), Pa s/m3, of `response` by the standard deviations `drift` (D,)."""
        base = self.response(drift)
        moved = [self.response(drift + STEP * e) for e in np.eye(len(drift))]
        return (np.array(moved).reshape(len(drift), *base.shape) - base) / STEP

    def _theta(self, drift: np.ndarray | None, theta: np.ndarray | None = None) -> np.ndarray:
        theta = (self.twin.theta if theta is None else theta).copy()
        for name, amount in zip(self.drifts, () if drift is None else drift):
            for k in self._moved[name]:
                prior = self.twin.parameters[k].prior
                value = prior.value(theta[k]) * np.exp(DRIFTS[name] * amount)
                theta[k] = prior.coordinate(value)
        return theta


def _free_to_drift(twin: Twin) -> Twin:
    """The twin with a width for the priors of what drifts: what the data sheet calls exact can be
    another state of the line in another recording."""
    exact = {name: sd for name, sd in DRIFTS.items() if _is_exact(twin, name)}
    if not exact:
        return twin
    rig = replace(twin.rig, uncertainty=replace(twin.rig.uncertainty, **exact))
    theta = twin.theta.copy()
    theta[[k for name in exact for k in _indices(twin, name)]] = 0.0
    return rebuild(twin, rig, theta=theta)


def _is_exact(twin: Twin, name: str) -> bool:
    """Whether a twin has parameters of this name, and their priors have no width."""
    indices = _indices(twin, name)
    return bool(indices) and not any(twin.parameters[k].prior.scale for k in indices)


def _indices(twin: Twin, name: str) -> list[int]:
    """Where a twin's theta has the parameters of a name, those of all segments."""
    return [k for k, p in enumerate(twin.parameters) if p.name.split("[")[0] == name]
