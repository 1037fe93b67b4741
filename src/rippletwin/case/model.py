"""What a user gives: the rig and its recordings, as frozen dataclasses named as in rig.yaml.

Units are SI; pressures are gauge pressures.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np

STATE_CODES = {
    "healthy": "H",
    "slipper": "S",
    "cylinder": "C",
    "cylinder_slight": "C1",
    "cylinder_severe": "C2",
    "unknown": None,
}
"""State labels of rig.yaml and the class they stand for; None is a state nobody knows."""


ATMOSPHERE = 101325.0
"""Standard atmosphere, Pa. Every pressure of a case, a twin and a pump is a gauge pressure, above
it; a gas goes by the absolute one."""
SMALLEST_MEAN = 1e-6  # of the largest flow; a smaller mean is rounding
ROUNDED_ANGLE = 0.01  # of a step: as much off an even grid are angles that a file rounds


def absolute(gauge):
    """Absolute pressure, Pa, of a gauge pressure of any shape."""
    return gauge + ATMOSPHERE


@dataclass(frozen=True)
class Fluid:
    """Density (kg/m3), kinematic viscosity (m2/s); a gas also has gamma = cp/cv and Prandtl."""

    density: float
    kinematic_viscosity: float
    heat_capacity_ratio: float | None = None
    prandtl: float | None = None

    @property
    def is_gas(self) -> bool:
        return self.heat_capacity_ratio is not None


@dataclass(frozen=True)
class Segment:
    """A uniform pipe: length (m), inner diameter (m), wave speed (m/s), temperature (K)."""

    length: float
    diameter: float
    wave_speed: float
    temperature: float | None = None

    @property
    def area(self) -> float:
        return np.pi * self.diameter**2 / 4

    @property
    def delay(self) -> float:
        """Travel time of a wave through the segment, s."""
        return self.length / self.wave_speed


@dataclass(frozen=True)
class Sensor:
    """A pressure sensor and its distance from the pump outlet (m)."""

    name: str
    position: float


@dataclass(frozen=True)
class Load:
    """What closes the line: orifice, open, closed, anechoic, impedance (measured, from a file), or
    unknown (any passive end, which fits determine).

    `coefficient` is K_v of the orifice law q = K_v sqrt(p - back_pressure), m3/s/sqrt(Pa); None
    leaves it to the twin, which takes it from mean flow and load pressure. A measured impedance is
    `impedance` (F,) complex, Pa s/m3, at `frequency_hz` (F,).
    """

    kind: str
    coefficient: float | None = None
    back_pressure: float = 0.0
    frequency_hz: np.ndarray | None = None
    impedance: np.ndarray | None = None

    @property
    def passes_flow(self) -> bool:
        """Whether it is an orifice whose coefficient has to come from the mean flow."""
        return self.kind == "orifice" and self.coefficient is None


@dataclass(frozen=True)
class Uncertainty:
    """Standard deviations of the data sheet: relative, except `sensor_position` in metres.

    `sensor_gain` is that of each sensor's complex sensitivity: relative, and in rad of its phase.
    """

    length: float = 0.01
    diameter: float = 0.03
    wave_speed: float = 0.05
    viscosity: float = 0.1
    load: float = 0.05
    sensor_position: float = 0.02
    sensor_gain: float = 0.0


@dataclass(frozen=True)
class FlowRipple:
    """Flow into the line over one revolution: flow (M,), m3/s, at angle_deg (M,), ascending.

    `pressure_mean` is the mean outlet pressure (Pa) at which it was computed, where that is known.
    `modulation` b, rad: the shaft that delivers it leads uniform rotation by Re(b exp(j t)) rad.
    """

    angle_deg: np.ndarray
    flow: np.ndarray
    pressure_mean: float | None = None
    modulation: complex = 0.0

    @property
    def highest_order(self) -> int:
        """The highest shaft order that the angles resolve: more than two of them, on average, lie
        in its period."""
        return (len(self.angle_deg) - 1) // 2

    def on_even_angles(self) -> tuple[np.ndarray, np.ndarray]:
        """Evenly spaced angles, degrees, and the flow at them, m3/s: its own where they are even,
        else those of a periodic cubic spline at four times as many angles."""
        angle, flow = (np.asarray(x, float) for x in (self.angle_deg, self.flow))
        count = len(flow)
        even = angle[0] + 360.0 * np.arange(count) / count
        if np.max(np.abs(angle - even)) <= ROUNDED_ANGLE * 360.0 / count:
            return even, flow
        from scipy.interpolate import CubicSpline  # few cases need it

        around, closed = np.append(angle, angle[0] + 360.0), np.append(flow, flow[0])
        even = angle[0] + 360.0 * np.arange(4 * count) / (4 * count)
        return even, CubicSpline(around, closed, bc_type="periodic")(even)

    @cached_property
    def mean(self) -> float:
        """Mean flow over the revolution, m3/s, however the angles are spaced."""
        return float(np.mean(self.on_even_angles()[1]))

    @property
    def stated_mean(self) -> float | None:
        """The same; None where it is rounding, because the mean was taken out."""
        is_rounding = abs(self.mean) < SMALLEST_MEAN * np.max(np.abs(self.flow))
        return None if is_rounding else self.mean

    @cached_property
    def known_harmonics(self) -> dict[bytes, np.ndarray]:
        """Harmonics calculated before, by their orders (`rippletwin.harmonics.flow_harmonics`)."""
        return {}

    def source_admittance(self, s: np.ndarray) -> np.ndarray:
        """Admittance (F,), m3/s/Pa, beside this flow: none, a given ripple is an ideal source."""
        return np.zeros(np.shape(s), complex)


@dataclass(frozen=True)
class Recording:
    """One entry of rig.yaml's `recordings`, read and checked.

    Periodic and random recordings carry `pressure` (S, N), Pa; spectrum and input_impedance carry
    `frequency_hz` (F,) and `spectra` (repeats, S, F) complex: Pa, or Pa s/m3 (`normalised`: in
    units of the first segment's characteristic impedance). Only `min_frequency_hz` to
    `max_frequency_hz` is used in fits. What does not apply is None.
    """

    file: Path
    kind: str
    state: str
    label: str
    speed_rpm: float | None = None
    load_pressure: float | None = None
    sampling_rate_hz: float | None = None
    pressure: np.ndarray | None = None
    flow_ripple: FlowRipple | None = None
    frequency_hz: np.ndarray | None = None
    spectra: np.ndarray | None = None
    relative_error: float | None = None
    normalised: bool = False
    min_frequency_hz: float | None = None
    max_frequency_hz: float | None = None

    @property
    def state_code(self) -> str | None:
        """H, S, C, C1 or C2; None where the state is unknown."""
        return STATE_CODES[self.state]


@dataclass(frozen=True)
class Rig:
    """The test bench; `pump` holds the keys of rig.yaml's pump (pistons, and geometry if given).

    `displacement`, m3 per revolution, follows from flow ripples that recordings state; None without
    one. `uncertainty` is `tolerance_scale` times what the data sheet states.
    """

    fluid: Fluid
    pump: dict
    line: tuple[Segment, ...]
    sensors: tuple[Sensor, ...]
    load: Load
    uncertainty: Uncertainty = Uncertainty()
    displacement: float | None = None
    tolerance_scale: float = 1.0

    @property
    def length(self) -> float:
        """Length of the whole line, m."""
        return sum(segment.length for segment in self.line)

    @property
    def delay(self) -> float:
        """Time of a wave from the pump to the load, s."""
        return sum(segment.delay for segment in self.line)


@dataclass(frozen=True)
class Case:
    """A folder with a rig and its recordings; `warnings` are in plain words, one line each."""

    folder: Path
    rig: Rig
    recordings: tuple[Recording, ...]
    warnings: tuple[str, ...] = ()

    @property
    def healthy(self) -> list[Recording]:
        """The recordings that calibration and explanation use."""
        return [recording for recording in self.recordings if recording.state == "healthy"]
