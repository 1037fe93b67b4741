"""Periodic orbits of a rig at one operating point, and marches at a wandering speed.

At constant speed the rig settles into a motion that repeats every revolution: an orbit. If the
speed wanders, the rig can march on from an orbit at the speed of each instant. Or a recording can
be composed of a few orbits: this is right if transients decay faster than the speed changes and no
resonance is narrower than the range of the speed (docs/explanation/virtual_rig.md).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from virtualrig import node_elements, pump, stepper
from virtualrig.network import (
    discretise,
    largest_step,
    node_table,
    sensor_rows,
    state_at_rest,
)
from virtualrig.rig import Rig

RECORDS = 4608
"""Records a revolution; a multiple of four, the depth of the ring of states."""

_ADJUSTING_REVOLUTIONS = 6  # in which the valve is set again after each


@dataclass(frozen=True)
class Orbit:
    """One revolution at crank turns k/RECORDS, k = 0, 1, ..., without the sensors' responses.

    `pressure` (sensors, RECORDS) Pa; `outlet_flow` (RECORDS,) m3/s into the line at x = 0;
    `outlet_pressure` (RECORDS,); `load_pressure` the mean at the load; `valve` the load's orifice
    coefficient, m3/s/Pa^0.5.
    """

    speed_rpm: float
    pressure: np.ndarray
    outlet_flow: np.ndarray
    outlet_pressure: np.ndarray
    load_pressure: float
    valve: float


class Bench:
    """A rig ready to run: its tables, and its state, which is kept from one run to the next.

    `flow` takes the pump's place where it is given: (M,), m3/s over one revolution, or a function
    of the speed in r/min that returns it. `step_divisor` divides the stable time step.
    """

    def __init__(
        self,
        rig: Rig,
        faults: tuple[str, ...] = (),
        flow: np.ndarray | Callable[[float], np.ndarray] | None = None,
        step_divisor: int = 1,
    ):
        self.rig, self.step_divisor = rig, step_divisor
        self.flow = np.zeros(1) if flow is None else flow
        self.largest_step = largest_step(rig.network)
        self.nodes = node_table(rig.network)
        self.sensors = sensor_rows(rig.network)
        self.set_faults(tuple(rig.faults[kind] for kind in faults))
        if flow is not None:
            self.chambers = self.chambers[:0]
        self._ripple = np.array(rig.ripple, dtype=float).reshape(-1, 3)
        self.state = None

    def set_faults(self, faults: tuple) -> None:
        """Give the pump these faults (`virtualrig.faults`) and no others; the state is kept."""
        self.chambers, self.ports = pump.pump_tables(
            self.rig.pump, self.rig.network.density, faults
        )

    def settle(
        self,
        speed_rpm: float,
        load_pressure: float,
        valve: float | None = None,
        tolerance: float = 20.0,
        most: int = 200,
    ) -> Orbit:
        """Run until no pressure changes by more than `tolerance` Pa from one revolution to the
        next.

        `load_pressure` is the mean pressure at the load that the operator sets, unless the `valve`
        (orifice coefficient) is given. Raises RuntimeError where it does not settle.
        """
        speed = 2 * np.pi * speed_rpm / 60
        every, dt = self._steps(speed)
        line = discretise(self.rig.network, dt)
        given = self._given(speed_rpm)
        flow = 0.97 * self.rig.pump.displacement * speed_rpm / 60
        if not len(self.chambers):
            flow = given.mean()
        if self.state is None:
            pistons = len(self.chambers)
            self.state = state_at_rest(self.rig.network, line, load_pressure, flow, pistons)
            self.state.chamber[:] = pump.compression(load_pressure, self.ports)[0]
        load = self.nodes[self.rig.load_node]
        load[node_elements.VALVE_SET] = load_pressure
        load[node_elements.ORIFICE] = (
            valve if valve is not None else self._valve_coefficient(flow, load_pressure)
        )
        stations = stepper.tabulate_stations(
            self.chambers, self.ports, speed, self._ripple, every * RECORDS, dt
        )
        before = np.inf
        for revolution in range(1, most + 1):
            pressure, outlet, nodal = self._run(line, given, speed, np.zeros(0), RECORDS, stations)
            residual = np.abs(pressure - before).max()
            before = pressure
            # with a given flow the valve's coefficient is known from the start
            adjusting = valve is None and len(self.chambers) > 0
            adjusting &= revolution <= _ADJUSTING_REVOLUTIONS
            if adjusting:
                load[node_elements.ORIFICE] = self._valve_coefficient(outlet.mean(), load_pressure)
            elif residual < tolerance:
                return Orbit(
                    speed_rpm=speed_rpm,
                    pressure=np.roll(pressure, 1, axis=1),
                    outlet_flow=np.roll(outlet, 1),
                    outlet_pressure=np.roll(nodal[0], 1),
                    load_pressure=float(nodal[self.rig.load_node].mean()),
                    valve=float(load[node_elements.ORIFICE]),
                )
        raise RuntimeError(f"not periodic after {most} revolutions: still moving {residual:.0f} Pa")

    def valve_for(self, speed_rpm: float, load_pressure: float, tolerance: float = 20.0) -> float:
        """The orifice coefficient that gives `load_pressure` (Pa), m3/s/Pa^0.5.

        With a pump the rig is run to find it.
        """
        if len(self.chambers):
            return self.settle(speed_rpm, load_pressure, tolerance=tolerance).valve
        return self._valve_coefficient(self._given(speed_rpm).mean(), load_pressure)

    def march(self, speed_rpm: float, deviation: np.ndarray) -> np.ndarray:
        """Pressure (sensors, K) at the sensors' positions, Pa, at a varying speed.

        Continues from the orbit that was settled last, which must be that of `speed_rpm`, with the
        same valve. `deviation` (K,) is the relative deviation of the speed between records, of
        which there are RECORDS a revolution of `speed_rpm`.
        """
        speed = 2 * np.pi * speed_rpm / 60
        every, dt = self._steps(speed)
        ahead = np.concatenate([[0.0], np.cumsum(deviation)]) * speed * every * dt
        line = discretise(self.rig.network, dt)
        computed = np.zeros((0, len(self.chambers), 4))
        return self._run(line, self._given(speed_rpm), speed, ahead, len(deviation), computed)[0]

    def _run(
        self, line, given: np.ndarray, speed: float, ahead: np.ndarray, records: int, stations
    ):
        """`stepper.run` from the present state; RuntimeError where the chambers do not converge."""
        every, dt = self._steps(speed)
        pressure, outlet, nodal, newton = stepper.run(
            line, self.nodes, self.chambers, self.ports, given, (speed, self._ripple, ahead),
            self.state, stations, every * records, every, dt, self.sensors,
        )  # fmt: skip
        if newton > pump.MOST_NEWTON_STEPS:
            raise RuntimeError("the pump's chambers did not converge; shorten the time step")
        return pressure, outlet, nodal

    def _steps(self, speed: float) -> tuple[int, float]:
        """Steps from record to record at a `speed` in rad/s, and their size in s."""
        period = 2 * np.pi / speed
        every = int(np.ceil(period / RECORDS / self.largest_step)) * self.step_divisor
        return every, period / (every * RECORDS)

    def _given(self, speed_rpm: float) -> np.ndarray:
        given = self.flow(speed_rpm) if callable(self.flow) else self.flow
        return np.asarray(given, dtype=float)

    def _valve_coefficient(self, pump_flow: float, load_pressure: float) -> float:
        """Orifice coefficient, m3/s/Pa^0.5, that passes the pump's flow less the line's leakage."""
        others = np.delete(self.nodes, self.rig.load_node, axis=0)
        lost = others[:, node_elements.LEAK] * (load_pressure - others[:, node_elements.TANK])
        lost = lost.sum() + others[:, node_elements.ORIFICE].sum() * np.sqrt(load_pressure)
        return (pump_flow - lost) / np.sqrt(load_pressure)
