"""What `rippletwin new` is told: numbers in units of a test bench, which become SI units.

Each number is compared with the range in which it can be in rig.yaml, and refused in the unit that
it was given in.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import PurePath

from rippletwin.case.plausibility import LIQUID
from rippletwin.cli import options
from rippletwin.line.wave_speed import YOUNGS_MODULUS

STATES = ("healthy", "unknown", "slipper", "cylinder", "cylinder_slight", "cylinder_severe")


@dataclass(frozen=True)
class BenchQuantity:
    """A number in `unit`; times `factor` it is in the SI unit of `field` of rig.yaml.

    `floor` is what it may not fall below, in `unit`; None where it must be above zero. `ceiling`
    is what it may not exceed; None for the range of `field`.
    """

    what: str
    unit: str
    factor: float = 1.0
    field: str = ""
    floor: float | None = None
    ceiling: float | None = None

    def read(self, text: object) -> float:
        """The number in SI units; raises ValueError("problem. remedy")."""
        value = options.number(str(text), self.what, self.unit, self.floor)
        if self.ceiling is not None and value > self.ceiling:
            raise ValueError(
                f"a {self.what} of {value:g} {self.unit} is implausible: up to {self.ceiling:g} "
                f"{self.unit} is possible. Give {self.unit}"
            )
        allowed = LIQUID.get(self.field)
        if allowed is None or value == 0:
            return value * self.factor
        low, high = allowed.possible
        if low <= value * self.factor <= high:
            return value * self.factor
        units = [(allowed.unit, 1.0), *allowed.units]
        usual_low, usual_high = allowed.usual
        meant = [
            f"{name} ({value * scale / self.factor:.4g} {self.unit})"
            for name, scale in units
            if name.partition(" ")[0] != self.unit and usual_low <= value * scale <= usual_high
        ]
        guess = f"; it looks like {meant[0]}" if meant else ""
        possible = f"{low / self.factor:.4g} to {high / self.factor:.4g} {self.unit}"
        raise ValueError(
            f"a {self.what} of {value:g} {self.unit} is implausible: {possible} is possible{guess}"
            f". Give {self.unit}"
        )


LENGTH = BenchQuantity("length", "mm", 1e-3, "line.segments.length")
BORE = BenchQuantity("bore", "mm", 1e-3, "line.segments.diameter")
WALL = BenchQuantity("wall", "mm", 1e-3)
WAVE_SPEED = BenchQuantity("wave speed", "m/s", 1.0, "line.segments.wave_speed")
POSITION = BenchQuantity("position", "mm", 1e-3, "line.segments.length", floor=0.0)
SPEED = BenchQuantity("speed", "r/min", 1.0, "recordings.speed_rpm")
PRESSURE = BenchQuantity("pressure", "bar", 1e5, "recordings.load_pressure")
TEMPERATURE = BenchQuantity("temperature", "°C", floor=-60.0, ceiling=200.0)
DENSITY = BenchQuantity("density", "kg/m3", 1.0, "fluid.density")
VISCOSITY = BenchQuantity("viscosity", "cSt", 1e-6, "fluid.kinematic_viscosity")
BULK_MODULUS = BenchQuantity("bulk modulus", "bar", 1e5, "pump.bulk_modulus")
FLOW = BenchQuantity("flow", "L/min", 1 / 60000)

PUMP = {
    "piston_diameter": BenchQuantity("piston diameter", "mm", 1e-3, "pump.piston_diameter"),
    "pitch_radius": BenchQuantity("pitch radius", "mm", 1e-3, "pump.pitch_radius"),
    "swash_angle_deg": BenchQuantity("swash angle", "°"),
    "dead_volume": BenchQuantity("dead volume", "cm3", 1e-6, "pump.dead_volume"),
    "port_area": BenchQuantity("port area", "mm2", 1e-6, "pump.port_area"),
    "port_opening_deg": BenchQuantity("port opening", "°"),
    "port_overlap_deg": BenchQuantity("port overlap", "°", floor=-90.0),
}
"""Numbers of the pump that a catalogue or a drawing has, by their key of rig.yaml."""


def read_segment(text: str) -> tuple:
    """(length, bore, wall, material, measured wave speed), m and m/s; None where not given."""
    form = "LENGTH,BORE,WALL[,MATERIAL] or LENGTH,BORE,SPEEDm/s"
    parts = _parts(text, form, (2, 4))
    length, bore = LENGTH.read(parts[0]), BORE.read(parts[1])
    if len(parts) > 2 and parts[2].endswith("m/s"):
        return length, bore, None, None, WAVE_SPEED.read(parts[2].removesuffix("m/s"))
    wall = WALL.read(parts[2]) if len(parts) > 2 else None
    material = parts[3] if len(parts) > 3 else "steel"
    if material not in YOUNGS_MODULUS:
        raise ValueError(
            f"{material} has no known modulus. Choose one of {', '.join(YOUNGS_MODULUS)}; for a "
            "hose give the wave speed, as 3000,20,850m/s"
        )
    return length, bore, wall, material, None


def read_sensor(text: str) -> tuple[str, float]:
    """Name, and m from the pump outlet."""
    name, position = _parts(text, "NAME,POSITION in mm", (2, 2))
    return name, POSITION.read(position)


def read_recording(text: str) -> tuple[str, str, float, float]:
    """File, state, r/min and Pa."""
    file, state, speed, pressure = _parts(text, "FILE,STATE,R/MIN,BAR", (4, 4))
    if state not in STATES:
        raise ValueError(f"{state} is no state. Choose one of {', '.join(STATES)}")
    return file, state, SPEED.read(speed), PRESSURE.read(pressure)


def labels_of(files: Sequence[str]) -> list[dict[str, str]]:
    """The label of each recording whose file's name, without folder and suffix, is another's too:
    made of its path, with its suffix where need be. Empty for the others, which need none."""
    paths = [PurePath(file) for file in files]
    labels = stems = [path.stem for path in paths]
    for name in ("stem", "name"):
        count = Counter(labels)
        labels = [
            "_".join((*path.relative_to(path.anchor).parts[:-1], getattr(path, name)))
            if count[label] > 1
            else label
            for path, label in zip(paths, labels)
        ]
    return [{} if label == stem else {"label": label} for label, stem in zip(labels, stems)]


def read_pistons(text: object) -> int:
    """The number of pistons."""
    return options.whole_number(str(text), "number of pistons", 3, 15)


def _parts(text: str, form: str, count: tuple[int, int]) -> list[str]:
    parts = [part.strip() for part in text.split(",")]
    if not count[0] <= len(parts) <= count[1] or not all(parts):
        raise ValueError(f"{text!r} is not {form}. Separate them by commas")
    return parts
