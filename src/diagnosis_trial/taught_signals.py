"""What a network of a rig learns from: signals of fixed leaks, and the range of drawn ones.

Kinds are those of `diagnosis_trial.networks`. P and Q have one signal a class, of fixed leaks; PR,
PRA and QR draw leaks and what else is not known.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rippletwin.case.model import Fluid
from rippletwin.diagnosis.faults.library import FAULT_OF, FAULTS
from rippletwin.diagnosis.pump_flow import (
    leak_velocity,
    simulate_healthy_pump,
    simulate_leaking_pump,
    with_fitted_pump,
)
from rippletwin.diagnosis.randomised_signals import severity_bins
from rippletwin.diagnosis.simulated_fault import simulate_fault
from rippletwin.harmonics import one_period, peak_amplitudes
from rippletwin.learning.architectures import CLASSES
from rippletwin.twin.twin import Twin

FIXED = {"H": 0.0, "S": 0.26, "C1": 0.26, "C2": 0.77}
"""Class -> leak of `faults.leak_area` on the default pump: its flow over the mean flow of one
piston."""


def fixed_signals(
    kind: str, twin: Twin, samples: int, speed_hz: float, load_pressure: float
) -> np.ndarray:
    """A revolution (classes, channels, M) of each class, of M `samples` and without its mean, at
    rev/s and Pa: pressure at the sensors, Pa, for the kind P, flow of the source, m3/s, for Q."""
    point = _point(twin, speed_hz, load_pressure)
    unit_area = _unit_area(*point)
    signals = []
    for name in CLASSES:
        fault = FAULTS[FAULT_OF[name]] if name in FAULT_OF else None
        area = FIXED[name] * unit_area
        if kind == "P":
            signal = simulate_fault(twin, fault, area, *point[2:]).pressure
        elif fault is None:
            signal = simulate_healthy_pump(*point).flow[None]
        else:
            signal = simulate_leaking_pump(*point, fault, area).flow[None]
        signals.append(_one_revolution(signal, samples))
    return np.array(signals)


def leak_bins(twin: Twin, speed_hz: float, load_pressure: float) -> dict[str, tuple[float, float]]:
    """Leak areas, m2, of each faulty class at rev/s and Pa: those of `diagnose`, the cylinder's
    halved."""
    unit_area = _unit_area(*_point(twin, speed_hz, load_pressure))
    ends = {
        name: [FAULTS[fault].smallest * unit_area, FAULTS[fault].largest * unit_area]
        for name, fault in (("S", "slipper"), ("C", "cylinder"))
    }
    return severity_bins(ends, float(np.sqrt(np.prod(ends["C"]))))


def _point(twin: Twin, speed_hz: float, load_pressure: float) -> tuple[dict, Fluid, float, float]:
    """The fitted pump, its fluid, r/min and Pa."""
    rig = with_fitted_pump(twin).rig
    return rig.pump, rig.fluid, 60.0 * speed_hz, load_pressure


def _unit_area(pump: Mapping, fluid: Fluid, speed_rpm: float, load_pressure: float) -> float:
    """Area, m2, of the leak that passes the mean flow of one piston."""
    flow = float(simulate_healthy_pump(pump, fluid, speed_rpm, load_pressure).flow.mean())
    return flow / pump["pistons"] / float(leak_velocity(pump, fluid, load_pressure))


def _one_revolution(signal: np.ndarray, samples: int) -> np.ndarray:
    """A simulated revolution (channels, M') without its mean, at the samples of a window."""
    orders = np.arange(1, min(signal.shape[1], samples) // 2)
    return one_period(peak_amplitudes(signal)[:, orders], samples, orders)
