"""The pump in a state that the networks know by name: healthy, one fault, or several at once."""

from __future__ import annotations

from collections.abc import Mapping

from rippletwin.case.model import Rig, Segment
from rippletwin.errors import InputError
from rippletwin.pump.faults import Cylinder, Slipper
from rippletwin.pump.outlets import ConstantPressure, Pipe
from rippletwin.pump.simulation import PumpRipple, simulate

FAULT_KINDS: dict[str, type[Slipper] | type[Cylinder]] = {
    "S": Slipper,
    "C1": Cylinder,
    "C2": Cylinder,
}
"""Name of a fault -> its leakage path; C1 and C2 are one fault in two severities."""


def faults_of(leak_area: Mapping[str, float]) -> list[Slipper | Cylinder]:
    """The faults with these leaks (m2), all from the same piston on; none for a healthy pump.

    leak_area : name of the fault (of `FAULT_KINDS`) -> area. Raises KeyError for another name.
    """
    return [FAULT_KINDS[name](area) for name, area in leak_area.items()]


def simulate_state(
    rig: Rig,
    speed_rpm: float,
    load_pressure: float,
    pipe_length: float,
    leak_area: Mapping[str, float],
    samples: int,
) -> tuple[PumpRipple, PumpRipple]:
    """One revolution of `samples` points of the pump: coupled to a pipe, and as a flow source.

    The pipe is as wide as the rig's first segment, `pipe_length` (m) long and carries the rig's
    sensors; the orifice at its end holds the healthy pump at `load_pressure` (Pa, gauge) against
    the rig's back pressure. A faulty pump meets this orifice, so its mean pressure is lower. The
    second ripple is the flow into a constant pressure, which with the capacitance of the chambers
    can drive any line.
    Raises InputError for a sensor beyond the pipe's end.
    """
    _require_sensors_in_pipe(rig, pipe_length)

    def ripple(outlet, faults=None) -> PumpRipple:
        return simulate(rig.pump, rig.fluid, speed_rpm, outlet, faults, samples)

    first = rig.line[0]
    pipe = Segment(pipe_length, first.diameter, first.wave_speed)
    positions = tuple(sensor.position for sensor in rig.sensors)
    behind = rig.load.back_pressure
    faults = faults_of(leak_area)
    in_pipe = ripple(Pipe(pipe, positions, load_pressure=load_pressure, back_pressure=behind))
    if faults:
        orifice = in_pipe.orifice
        in_pipe = ripple(Pipe(pipe, positions, orifice=orifice, back_pressure=behind), faults)
    return in_pipe, ripple(ConstantPressure(load_pressure), faults)


def _require_sensors_in_pipe(rig: Rig, pipe_length: float) -> None:
    """Raises InputError if the pipe of the fault data ends before a sensor."""
    last = max(rig.sensors, key=lambda sensor: sensor.position)
    if pipe_length < last.position:
        raise InputError(
            "config",
            "faults.pipe_length",
            f"{pipe_length} m ends before sensor {last.name} at {last.position} m",
            f"Give at least {last.position}",
        )
