"""A new rig.yaml as text: what is known of a rig, in SI units, with what each number means."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import yaml

from rippletwin.case.plausibility import PUMP_SIZE
from rippletwin.errors import InputError

GENERIC_PUMP = {
    "piston_diameter": (0.017, "m", "diameter of a piston"),
    "pitch_radius": (0.0335, "m", "radius of the circle of the pistons' axes"),
    "swash_angle_deg": (17, "", "angle of the swash plate at the working point"),
    "dead_volume": ("3.5e-6", "m3", "volume of a chamber at the end of delivery"),
    "port_area": ("1.2e-4", "m2", "area of a port that is fully open"),
    "port_opening_deg": (30, "", "shaft angle over which a port opens; it shapes the ripple most"),
    "port_overlap_deg": (5, "", "shaft angle about each dead centre where a chamber is shut off"),
}
"""Numbers of a pump of 42 cm3 per revolution: key -> value as written, unit, what it is."""
COMMENTS = {key: words for key, (_, _, words) in GENERIC_PUMP.items()}
UNCERTAINTY = """\
# How well the numbers above are known: relative standard deviations, sensor_position in metres.
# Calibration moves each number by some of these. Too small, and a wrong number looks like missing
# physics.
uncertainty:
  length: 0.01
  diameter: 0.03
  wave_speed: {wave_speed:g}
  viscosity: 0.1
  load: 0.05
  sensor_position: 0.005
"""
MEASURED_WAVE_SPEED, CALCULATED_WAVE_SPEED = 0.02, 0.05  # relative standard deviations


@dataclass(frozen=True)
class NewSegment:
    """A segment, m and m/s, and where its wave speed is from, in words."""

    length: float
    diameter: float
    wave_speed: float
    origin: str
    measured: bool = False


@dataclass(frozen=True)
class NewSheet:
    """What `rippletwin new` knows of a rig.

    density, viscosity  kg/m3 and m2/s, with the temperature in words
    pump                the keys of rig.yaml's `pump`; None where a number is not known
    sensors             names, and m from the pump outlet
    mean_flow           m3/s, where it is known but not the load pressure that belongs to it
    recordings          entries as rig.yaml has them
    """

    density: float
    viscosity: float
    temperature: str
    pump: Mapping[str, float | None]
    segments: Sequence[NewSegment]
    sensors: Sequence[tuple[str, float]]
    load: str
    coefficient: float | None = None
    mean_flow: float | None = None
    recordings: Sequence[Mapping] = field(default_factory=tuple)

    def text(self) -> str:
        """The commented rig.yaml."""
        return "".join(
            [
                "# A rig and its recordings in SI units: m, Pa, m3/s, kg/m3, Hz. Pressures are\n"
                "# above the atmosphere. Check it with: rippletwin check FOLDER\n\n",
                f"fluid:\n  density: {self.density:.4g}  # kg/m3 {self.temperature}\n"
                f"  kinematic_viscosity: {_decimal(self.viscosity)}  # m2/s {self.temperature}\n\n",
                f"{self._pump_text()}\n",
                "line:\n  segments:  # pump first, load last\n",
                *(_segment_text(segment) for segment in self.segments),
                "\nsensors:  # m from the pump outlet\n",
                *(f"  - {_flow(name=n, position=_number(x))}\n" for n, x in self.sensors),
                f"\n{self._load_text()}\n",
                UNCERTAINTY.format(wave_speed=self._wave_speed_uncertainty()),
                "\n# state: healthy recordings teach the twin; unknown ones are diagnosed.\n",
                "recordings:\n",
                *(f"  - {_flow(**entry)}\n" for entry in self.recordings),
            ]
        )

    @property
    def displacement(self) -> float | None:
        """What the pump displaces in one revolution, m3; None where its geometry is not known."""
        known = [self.pump.get(key) for key in ("pistons", *PUMP_SIZE)]
        if None in known:
            return None
        pistons, bore, radius, angle = known
        return pistons * math.pi / 4 * bore**2 * 2 * radius * math.tan(math.radians(angle))

    def _pump_text(self) -> str:
        """The pump's numbers; those that are not known stand as comments."""
        lines = ["pump:", f"  pistons: {self.pump['pistons']}"]
        if any(self.pump.get(key) is None for key in GENERIC_PUMP):
            lines += [
                "  # A number behind a # is not known; faults are then simulated with that of a",
                "  # generic pump of 42 cm3 per revolution, with dead_volume and port_area in",
                "  # proportion to the size of your pistons. Correct it and take the # away.",
            ]
        for key, (example, unit, words) in GENERIC_PUMP.items():
            value = self.pump.get(key)
            comment = f"{unit}, {words}" if unit else words
            sign, shown = ("# ", example) if value is None else ("", _plain(value))
            lines.append(f"  {sign}{key}: {shown}  # {comment}")
        return "\n".join(lines) + "\n"

    def _load_text(self) -> str:
        text = f"load:\n  kind: {self.load}\n"
        if self.coefficient is not None:
            text += f"  coefficient: {_decimal(self.coefficient)}  # m3/s/sqrt(Pa)\n"
        elif self.load == "orifice":
            text += "  # coefficient, m3/s/sqrt(Pa), follows from mean flow and load pressure\n"
            if self.mean_flow is not None:
                flow = _decimal(self.mean_flow)
                text += f"  # divide {flow} m3/s by the root of its load pressure, Pa\n"
        return text

    def _wave_speed_uncertainty(self) -> float:
        measured = all(segment.measured for segment in self.segments)
        return MEASURED_WAVE_SPEED if measured else CALCULATED_WAVE_SPEED


def write_new_sheet(sheet: NewSheet, folder: str | Path) -> Path:
    """Write `folder`/rig.yaml and an empty folder for recordings; returns the path of rig.yaml.

    Raises
    ------
    InputError : there is a rig.yaml already, or it cannot be written.
    """
    path = Path(folder) / "rig.yaml"
    try:
        (path.parent / "recordings").mkdir(parents=True, exist_ok=True)
        _write_whole(path, sheet.text())
    except FileExistsError as error:
        there = path.is_file()
        problem = "is there already" if there else f"{folder} is no folder"
        remedy = "Edit it, or name another folder: nothing is overwritten"
        raise InputError(path, "case", problem, remedy) from error
    except OSError as error:
        raise InputError(
            path, "case", f"cannot be written ({error.strerror})", "Name a folder of your own"
        ) from error
    return path


def _write_whole(path: Path, text: str) -> None:
    """Write a file whole or not at all; raises FileExistsError where there is one."""
    scratch = path.with_name(f".{os.getpid()}.{path.name}")
    try:
        with open(scratch, "w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        try:
            os.link(scratch, path)
        except FileExistsError:
            raise
        except OSError:  # a file system without links
            if path.exists():
                raise FileExistsError(path) from None
            os.replace(scratch, path)
    finally:
        scratch.unlink(missing_ok=True)


def _segment_text(segment: NewSegment) -> str:
    numbers = {
        "length": _number(segment.length),
        "diameter": _number(segment.diameter),
        "wave_speed": _number(segment.wave_speed, 4),
    }
    return f"    - {_flow(**numbers)}  # {segment.origin}\n"


def _flow(**entry) -> str:
    """A mapping on one line."""
    return yaml.safe_dump(
        dict(entry), default_flow_style=True, sort_keys=False, width=10**6, allow_unicode=True
    ).strip()


def _number(value: float, digits: int = 6) -> float | int:
    """A number with few digits; a whole one without a decimal point."""
    rounded = float(f"{value:.{digits}g}")
    return int(rounded) if rounded.is_integer() else rounded


def _plain(value: float) -> str:
    """A number as YAML reads it, with a power of ten where it is small."""
    return str(_number(value)) if value == 0 or abs(value) >= 1e-3 else _decimal(value)


def _decimal(value: float) -> str:
    """A small number as YAML reads it: with a point before the exponent."""
    return f"{value:.3e}"
