"""Periodic orbits of a rig at one operating point, and marches at a wandering speed.

At constant speed the bench settles into a motion that repeats every revolution. Where the speed
wanders the bench can march on from there at the speed of each instant, or a recording can be
composed of a few orbits, which is right where a line forgets faster than its speed changes and
no resonance is sharper than the wander is wide (docs/explanation/virtual_rig.md).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from virtualrig import pump, stepper
from virtualrig.network import largest_step, line, node_table, sensor_rows, still
from virtualrig.rig import Rig

RECORDS = 4608
"""Records a revolution; a multiple of four, the depth of the stepper's ring of states."""

_REVOLUTIONS_OF_ADJUSTING = 6


@dataclass(frozen=True)
class Orbit:
    """One revolution, at crank turns k/RECORDS, k = 0, 1, ...: what is there, before any sensor.

    `pressure` (sensors, RECORDS) Pa; `outlet_flow` (RECORDS,) m3/s into the line at x = 0;
    `outlet_pressure` (RECORDS,); `load_pressure` the mean at the load; `valve` the load's orifice
    coefficient, m3/s/Pa^0.5; `residual` the greatest change of any sensor's pressure over the last
    revolution, Pa.
    """

    speed_rpm: float
    pressure: np.ndarray
    outlet_flow: np.ndarray
    outlet_pressure: np.ndarray
    load_pressure: float
    valve: float
    residual: float
    revolutions: int


class Bench:
    """A rig ready to run: its tables, and a state that is kept from one run to the next.

    `flow` takes the pump's place where it is given: (M,), m3/s over one revolution, or a function
    of the speed in r/min that returns it. `refine` divides the time step.
    """

    def __init__(
        self,
        rig: Rig,
        faults: tuple[str, ...] = (),
        flow: np.ndarray | Callable[[float], np.ndarray] | None = None,
        refine: int = 1,
    ):
        self.rig, self.refine = rig, refine
        self.flow = np.zeros(1) if flow is None else flow
        self.largest_step = largest_step(rig.network)
        self.nodes = node_table(rig.network)
        self.sensors = sensor_rows(rig.network)
        chosen = tuple(rig.faults[kind] for kind in faults)
        self.chambers, self.ports = pump.tables(rig.pump, rig.network.density, chosen)
        if flow is not None:
            self.chambers = self.chambers[:0]
        self._ripple = np.array(rig.ripple, dtype=float).reshape(-1, 3)
        self.state = None

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
        _, dt = self._steps(speed)
        cut = line(self.rig.network, dt)
        given = self._given(speed_rpm)
        flow = 0.97 * self.rig.pump.displacement * speed_rpm / 60
        if not len(self.chambers):
            flow = given.mean()
        if self.state is None:
            pistons = len(self.chambers)
            self.state = still(self.rig.network, cut, load_pressure, flow, pistons)
        load = self.nodes[self.rig.load_node]
        load[stepper.VALVE_SET] = load_pressure
        load[stepper.ORIFICE] = valve if valve is not None else self._valve(flow, load_pressure)
        before = np.inf
        for revolution in range(1, most + 1):
            pressure, outlet, nodal = self._run(cut, given, speed, np.zeros(0), RECORDS)
            residual = np.abs(pressure - before).max()
            before = pressure
            # a given flow tells the valve at once
            adjusting = valve is None and len(self.chambers) > 0
            adjusting &= revolution <= _REVOLUTIONS_OF_ADJUSTING
            if adjusting:
                load[stepper.ORIFICE] = self._valve(outlet.mean(), load_pressure)
            elif residual < tolerance:
                return Orbit(
                    speed_rpm=speed_rpm,
                    pressure=np.roll(pressure, 1, axis=1),
                    outlet_flow=np.roll(outlet, 1),
                    outlet_pressure=np.roll(nodal[0], 1),
                    load_pressure=float(nodal[self.rig.load_node].mean()),
                    valve=float(load[stepper.ORIFICE]),
                    residual=float(residual),
                    revolutions=revolution,
                )
        raise RuntimeError(f"not periodic after {most} revolutions: still moving {residual:.0f} Pa")

    def valve(self, speed_rpm: float, load_pressure: float, tolerance: float = 20.0) -> float:
        """The orifice coefficient that gives `load_pressure`, m3/s/Pa^0.5."""
        if len(self.chambers):
            return self.settle(speed_rpm, load_pressure, tolerance=tolerance).valve
        return self._valve(self._given(speed_rpm).mean(), load_pressure)

    def march(self, speed_rpm: float, deviation: np.ndarray) -> np.ndarray:
        """Pressure (sensors, K) at the sensors' places, Pa, while the speed goes its way.

        Goes on from the orbit that was settled last, which must be that of `speed_rpm`; the valve
        stays as it was. `deviation` (K,) is the relative deviation of the speed, from one record to
        the next, RECORDS a revolution of `speed_rpm` apart.
        """
        speed = 2 * np.pi * speed_rpm / 60
        every, dt = self._steps(speed)
        ahead = np.concatenate([[0.0], np.cumsum(deviation)]) * speed * every * dt
        cut = line(self.rig.network, dt)
        return self._run(cut, self._given(speed_rpm), speed, ahead, len(deviation))[0]

    def _run(self, cut, given: np.ndarray, speed: float, ahead: np.ndarray, records: int):
        """`stepper.run` from the present state; RuntimeError where the chambers do not converge."""
        every, dt = self._steps(speed)
        pressure, outlet, nodal, newton = stepper.run(
            cut, self.nodes, self.chambers, self.ports, given, (speed, self._ripple, ahead),
            self.state, 0, every * records, every, dt, self.sensors,
        )  # fmt: skip
        if newton > pump.MOST_NEWTON_STEPS:
            raise RuntimeError("the pump's chambers did not converge; refine the time step")
        return pressure, outlet, nodal

    def _steps(self, speed: float) -> tuple[int, float]:
        """Steps from record to record at a `speed` in rad/s, and their size in s."""
        period = 2 * np.pi / speed
        every = int(np.ceil(period / RECORDS / self.largest_step)) * self.refine
        return every, period / (every * RECORDS)

    def _given(self, speed_rpm: float) -> np.ndarray:
        given = self.flow(speed_rpm) if callable(self.flow) else self.flow
        return np.asarray(given, dtype=float)

    def _valve(self, pump_flow: float, load_pressure: float) -> float:
        """Orifice coefficient that passes the pump's flow, less what leaks on the way."""
        others = np.delete(self.nodes, self.rig.load_node, axis=0)
        lost = others[:, stepper.LEAK] * (load_pressure - others[:, stepper.TANK])
        lost = lost.sum() + others[:, stepper.ORIFICE].sum() * np.sqrt(load_pressure)
        return (pump_flow - lost) / np.sqrt(load_pressure)
