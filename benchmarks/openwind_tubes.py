"""Air tubes whose input impedance openwind's finite elements calculate, and cases made of them.

openwind is another program, under the GPL. It is imported where it is used: benchmarks and tests
alone need it.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

NOMINAL_TEMPERATURE = 20.0  # degrees Celsius
NOISE = 0.01  # of the impedance
UNCERTAINTY = {"length": 0.002, "diameter": 0.0125, "wave_speed": 0.0035, "viscosity": 0.02}
"""Relative standard deviations of the data sheet: half a millimetre, a twentieth of a millimetre
and two kelvin of a narrow tube."""


@dataclass(frozen=True)
class Hole:
    """An open hole in the wall.

    position : m from the mouthpiece
    radius : m
    height : thickness of the wall, m
    """

    position: float
    radius: float
    height: float


@dataclass(frozen=True)
class Cone:
    """A conical transition, behind which the tube has another radius.

    begin, end : m from the mouthpiece
    radius : behind it, m
    """

    begin: float
    end: float
    radius: float


@dataclass(frozen=True)
class Tube:
    """A straight tube.

    length, radius : m
    end : "infinite_flanged", "unflanged" or "closed"
    losses : viscous and thermal losses at the walls, over those of a smooth wall; 0 for none
    """

    length: float
    radius: float
    holes: tuple[Hole, ...] = ()
    cone: Cone | None = None
    end: str = "infinite_flanged"
    losses: float = 1.0

    def bore(self) -> list[list]:
        """The bore as openwind takes it: begin, end, radius at either end, form."""
        cone = self.cone
        if cone is None:
            return [[0.0, self.length, self.radius, self.radius, "linear"]]
        return [
            [0.0, cone.begin, self.radius, self.radius, "linear"],
            [cone.begin, cone.end, self.radius, cone.radius, "linear"],
            [cone.end, self.length, cone.radius, cone.radius, "linear"],
        ]


def air(temperature: float = NOMINAL_TEMPERATURE) -> dict[str, float]:
    """Constants of dry air as openwind has them, SI units, at a temperature in degrees Celsius."""
    import openwind

    names = ("rho", "c", "mu", "Cp", "kappa", "gamma")
    physics = openwind.continuous.Physics(temperature, humidity=0.0)
    return dict(zip(names, map(float, physics.get_coefs(0.0, *names))))


def impedance(
    frequency_hz: np.ndarray, tube: Tube, temperature: float = NOMINAL_TEMPERATURE
) -> np.ndarray:
    """Input impedance (F,) over the tube's characteristic one, without noise."""
    import openwind

    holes = [[f"hole {k}", h.position, h.height, h.radius] for k, h in enumerate(tube.holes, 1)]
    computation = openwind.ImpedanceComputation(
        frequency_hz,
        tube.bore(),
        [["label", "position", "length", "radius"], *holes] if holes else [],
        temperature=temperature,
        humidity=0.0,
        losses=tube.losses > 0.0,
        loss_factor_alphainv=1.0 / tube.losses if tube.losses > 0.0 else 1.0,
        matching_volume=True,
        radiation_category={"entrance": "closed", "bell": tube.end, "holes": "infinite_flanged"},
    )
    result = computation.impedance
    if np.max(np.abs(result)) > 1e5:  # not yet over the characteristic one
        result = result / computation.Zc
    return result


def with_noise(impedance: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A measurement (F,) of an impedance: every value is off by NOISE."""
    noise = rng.normal(size=(2, len(impedance))) / np.sqrt(2)
    return impedance * (1 + NOISE * (noise[0] + 1j * noise[1]))


def write_case(
    folder: Path,
    frequency_hz: np.ndarray,
    runs: list[np.ndarray],
    segment: dict[str, float],
    load: str = "open",
) -> None:
    """A case with the measured impedances `runs`, each (F,), and a data sheet that knows one
    cylinder: `segment` has its length, diameter and wave_speed, `load` is the kind of its end."""
    folder.mkdir(parents=True, exist_ok=True)
    files = [f"run_{k}.txt" for k in range(1, len(runs) + 1)]
    for name, z in zip(files, runs):
        np.savetxt(folder / name, np.column_stack([frequency_hz, z.real, z.imag]))
    gas = air()
    recording = {
        "file": files[0],
        "kind": "input_impedance",
        "state": "healthy",
        "normalised": True,
        "max_frequency_hz": float(frequency_hz[-1]),
    }
    if files[1:]:
        recording["repeats"] = files[1:]
    sheet = {
        "fluid": {
            "density": gas["rho"],
            "kinematic_viscosity": gas["mu"] / gas["rho"],
            "heat_capacity_ratio": gas["gamma"],
            "prandtl": gas["mu"] * gas["Cp"] / gas["kappa"],
        },
        "line": {"segments": [segment]},
        "load": {"kind": load},
        "uncertainty": UNCERTAINTY,
        "recordings": [recording],
    }
    (folder / "rig.yaml").write_text(yaml.safe_dump(sheet))
