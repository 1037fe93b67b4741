"""One revolution of each class, many times, that a network of a rig learns from.

Kinds are those of `diagnosis_trial.networks`. P and Q have one signal a class, of fixed leaks; PR,
PRA and QR draw leaks and what else is not known.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from rippletwin.diagnosis.faults.library import FAULTS
from rippletwin.diagnosis.pump_flow import (
    leak_velocity,
    simulate_healthy_pump,
    simulate_leaking_pump,
    with_fitted_pump,
)
from rippletwin.diagnosis.randomised_signals import FAULT_OF, SignalSource, severity_bins
from rippletwin.diagnosis.simulated_fault import simulate_fault
from rippletwin.harmonics import one_period, peak_amplitudes
from rippletwin.learning.architectures import CLASSES
from rippletwin.twin.twin import Twin

FIXED = {"S": 0.26, "C1": 0.26, "C2": 0.77}
"""Class -> the paper's leak on the default pump: its flow over the mean flow of one piston."""


class TaughtSignals:
    """Signals that a twin teaches at one operating point, rev/s and Pa.

    covariance   of the twin's theta, None where it is not known
    healthy      (R, S, M) consecutive revolutions of a healthy recording, Pa
    """

    def __init__(
        self,
        twin: Twin,
        covariance: np.ndarray | None,
        healthy: np.ndarray,
        speed_hz: float,
        load_pressure: float,
    ):
        self._twin, self._covariance, self._healthy = twin, covariance, healthy
        self._speed_hz, self._pressure = speed_hz, load_pressure
        rig = with_fitted_pump(twin).rig
        self._point = rig.pump, rig.fluid, 60.0 * speed_hz, load_pressure
        flow = float(simulate_healthy_pump(*self._point).flow.mean())
        velocity = float(leak_velocity(rig.pump, rig.fluid, load_pressure))
        self._unit_area = flow / rig.pump["pistons"] / velocity  # passes the flow of one piston

    def draw(self, kind: str, count: int, rng: np.random.Generator) -> np.ndarray:
        """Signals (classes, count, channels, M) of `kind`: Pa at the sensors, or the source's flow,
        m3/s, for Q and QR."""
        if kind in ("P", "Q"):
            signal = self._fixed_pressure if kind == "P" else self._fixed_flow
            once = np.array([self._one_revolution(signal(name)) for name in CLASSES])
            return np.broadcast_to(once[:, None], (len(once), count, *once.shape[1:]))
        drawn = self._source.draw(self._severities(), CLASSES, count, rng, anchored=kind == "PRA")
        return drawn.flow if kind == "QR" else drawn.pressure

    @cached_property
    def _source(self) -> SignalSource:
        """Of signals whose leaks are drawn."""
        return SignalSource(
            self._twin, self._covariance, self._healthy, self._speed_hz, self._pressure
        )

    def _fixed_pressure(self, name: str) -> np.ndarray:
        """Pressure (S, M') of a class, Pa."""
        fault, area = self._fixed_fault(name)
        return simulate_fault(self._twin, fault, area, *self._point[2:]).pressure

    def _fixed_flow(self, name: str) -> np.ndarray:
        """Flow (1, M') of a class, m3/s."""
        fault, area = self._fixed_fault(name)
        if fault is None:
            return simulate_healthy_pump(*self._point).flow[None]
        return simulate_leaking_pump(*self._point, fault, area).flow[None]

    def _fixed_fault(self, name: str):
        """The fault of a class, None where it is healthy, and its leak area, m2."""
        fault = FAULTS[FAULT_OF[name]] if name in FIXED else None
        return fault, FIXED.get(name, 0.0) * self._unit_area

    def _one_revolution(self, signal: np.ndarray) -> np.ndarray:
        """A simulated revolution (channels, M') without its mean, at the samples of a window."""
        samples = self._healthy.shape[-1]
        orders = np.arange(1, min(signal.shape[1], samples) // 2)
        return one_period(peak_amplitudes(signal)[:, orders], samples, orders)

    def _severities(self) -> dict:
        """Leak areas, m2, of each faulty class: those of `diagnose`, the cylinder's halved."""
        ends = {
            name: [
                FAULTS[fault].smallest * self._unit_area,
                FAULTS[fault].largest * self._unit_area,
            ]
            for name, fault in (("S", "slipper"), ("C", "cylinder"))
        }
        return severity_bins(ends, float(np.sqrt(np.prod(ends["C"]))))
