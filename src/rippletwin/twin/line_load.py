"""The load at the end of the line: linear for a small ripple, an orifice also at full amplitude."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from rippletwin.case.model import Rig
from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine, LoadBalance
from rippletwin.line.frequency_domain.orifice_load import OrificeLoad
from rippletwin.twin.operating_point import OperatingPoint
from rippletwin.twin.unknown_load import unknown_impedance

if TYPE_CHECKING:
    from rippletwin.twin.twin import Arrays


class LineLoad:
    """The load in observations whose frequencies are side by side in `slices`.

    frequency_hz   (F,) of all observations
    points         operating point of each; one with a ripple is periodic
    orders         (F,) shaft orders

    Attribute `orifice` balances the harmonics of periodic observations at full amplitude; it is
    None for another load, and where no observation is periodic.
    """

    def __init__(
        self,
        rig: Rig,
        frequency_hz: np.ndarray,
        points: Sequence[OperatingPoint],
        slices: Sequence[slice],
        orders: np.ndarray,
    ):
        load = rig.load
        self._rig, self._s = rig, 2j * np.pi * frequency_hz
        self._points, self._sizes = points, [part.stop - part.start for part in slices]
        self._measured = None
        if load.kind == "impedance":
            self._measured = _interpolate(frequency_hz, load.frequency_hz, load.impedance)
        periodic = [r for r, point in enumerate(points) if point.ripple is not None]
        self.orifice = None
        if load.kind == "orifice" and periodic:
            self.orifice = OrificeLoad(
                [slices[r] for r in periodic],
                orders,
                np.array([points[r].load_pressure for r in periodic]) - load.back_pressure,
                np.array([points[r].coefficient for r in periodic]),
                load.passes_flow,
            )

    def linear_relation(self, v: Arrays) -> tuple:
        """Kind and value of `FrequencyDomainLine.load` for a small ripple, with `v` of
        `Twin.arrays`: an admittance (F,) in m3/(Pa s), an impedance (F,) in Pa s/m3, or None."""
        kind = self._rig.load.kind
        if kind == "orifice":
            return "admittance", self.orifice_admittance(v.load)
        if kind == "impedance":
            return "impedance", v.load * self._measured
        if kind == "unknown":
            return "impedance", unknown_impedance(self._s, v, self._rig.fluid.density)
        return kind, None

    def orifice_admittance(self, factor: float) -> np.ndarray:
        """dq/dp of the orifice at the mean pressures, (F,) m3/(Pa s), with `factor` times the
        nominal coefficient."""
        return factor * self._nominal_orifice

    @cached_property
    def _nominal_orifice(self) -> np.ndarray:
        """`orifice_admittance` of the nominal coefficient."""
        coefficient, pressure = (
            np.repeat(np.asarray(values, dtype=float), self._sizes)
            for values in zip(*((p.coefficient, p.load_pressure) for p in self._points))
        )
        return coefficient / (2 * np.sqrt(pressure - self._rig.load.back_pressure))

    @property
    def solved(self) -> bool:
        """Whether the last balance of the orifice is a steady state; True without an orifice."""
        return self.orifice is None or self.orifice.solved

    def balance(self, network: FrequencyDomainLine, factor: float) -> LoadBalance:
        """State at the load of `network`, as the function of `make_solver` finds it, and readings
        with it."""
        return network.balance_load(self.make_solver(network, factor))

    def make_solver(
        self, network: FrequencyDomainLine, factor: float, **accuracy: float
    ) -> Callable:
        """The function (a, b, c) -> (p, q) at the load of `network`, where a p + b q = c.

        An orifice's linear part is the load of `network`, with what effects made of it; `factor`
        multiplies its coefficient; `accuracy` is the tolerance of `OrificeLoad.solve`.
        """
        p, q = network.load_state()

        def solve_load(a, b, c):
            if self.orifice is not None:
                return self.orifice.solve(a, b, c, q / p, factor, network.opening, **accuracy)
            scale = c / (a * p + b * q)
            return scale * p, scale * q

        return solve_load


def _interpolate(at: np.ndarray, frequency_hz: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Complex values (N,) at frequency_hz (N,), at the frequencies `at` (F,)."""
    # What is fitted lies within the table (`check_load_table`). Harmonics that a nonlinear
    # compliance adds above, and shaft orders between and below the pistons', keep its ends.
    return np.interp(at, frequency_hz, values.real) + 1j * np.interp(at, frequency_hz, values.imag)
