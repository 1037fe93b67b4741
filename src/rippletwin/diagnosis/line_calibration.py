"""The line that a diagnosis compares recordings through, calibrated by what it does to any flow.

A twin whose pump is not the true one bends its line where a fit to the whole ripple asks for it:
diameters and viscosity make up for a wrong flow. Nothing of that is true for a change. So the line
is fitted again to the healthy recordings with the flow at the pump free at each order: only ratios
between sensors count, and these are the line's alone (Johnston and Drew 1996, Proc. IMechE I 210,
65, on unknown sources). The healthy flow is in the anchor, where it needs no model.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from rippletwin.calibration.calibrate import calibrate
from rippletwin.calibration.likelihood import EVENNESS, Likelihood
from rippletwin.calibration.misfit import measure_misfit
from rippletwin.diagnosis.pump_flow import (
    load_pressure_of,
    rebuild,
    simulate_healthy_pump,
    with_fitted_pump,
)
from rippletwin.spectra.frequency_selection import select_fitted_frequencies
from rippletwin.twin.twin import Twin


def calibrate_line(twin: Twin, healthy: Sequence) -> Twin:
    """The twin with its line fitted to healthy periodic observations whose source is free.

    The pump keeps its numbers, and friction and effects are the twin's. It is returned as it is
    (`with_fitted_pump`) where its own line leaves no more of the ratios between sensors.
    """
    fitted = with_fitted_pump(twin)
    free = [
        replace(o, source="free", flow_ripple=o.flow_ripple or _ripple(fitted, o))
        for o in select_fitted_frequencies(healthy, fitted.rig)
    ]
    line = rebuild(fitted, fitted.rig, free)
    found = calibrate(line, free)
    before = measure_misfit(Likelihood(line, free, evenness=EVENNESS), fitted.theta)
    if not found.after.relative < before.relative:
        return fitted
    return fitted.with_(theta=found.twin.theta)


def _ripple(twin: Twin, observation):
    """The pump's own, whose mean flow settles the orifice."""
    speed_rpm = 60.0 * observation.speed_hz
    pressure = load_pressure_of(twin, observation)
    return simulate_healthy_pump(twin.rig.pump, twin.rig.fluid, speed_rpm, pressure)
