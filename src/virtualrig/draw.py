"""Random rigs whose effect is concealed: sheet, seal, operating points and the truth of each case.

Every number follows from the hash of the tool that is to be tried and one number given by whoever
runs the trial, so that nobody can pick cases that suit the tool.
"""

import hashlib
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from virtualrig.draw_effects import INDISTINGUISHABLE, LIBRARY, OUTSIDE, Bare, Concealed
from virtualrig.pump import Pump
from virtualrig.recorder import Point
from virtualrig.source import constant_pressure_flow

MIX = {
    "none": 0.25,
    "off": 0.10,
    "single": 0.40,
    "pair": 0.10,
    "outside": 0.10,
    "indistinguishable": 0.05,
}
"""Share of each kind of case; `off`: no effect, nominal values two to three deviations off."""

UNCERTAINTY = {
    "length": 0.01,
    "diameter": 0.03,
    "wave_speed": 0.05,
    "viscosity": 0.1,
    "load": 0.05,
    "sensor_position": 0.02,
}
SECONDS = 3.2
HIGHEST_HZ = 4000.0


@dataclass(frozen=True)
class Drawn:
    """A case before it is recorded: `sheet` goes into rig.yaml, `seal` builds the true rig."""

    sheet: dict
    seal: dict
    points: tuple[Point, ...]
    truth: dict


def generator(commit: str, number: int | str, *path: int | str) -> np.random.Generator:
    """Random numbers of one purpose: seeded by a hash of commit, number and purpose."""
    text = ":".join(map(str, (commit, number, *path)))
    return np.random.default_rng(list(hashlib.sha256(text.encode()).digest()))


def kinds(count: int, commit: str, number: int | str) -> list[tuple[str, int]]:
    """Kind of each case and its running number among its kind, in an order that says nothing.

    Shares are those of MIX to the nearest case (largest remainders). Raises ValueError for no case.
    """
    if count < 1:
        raise ValueError(f"{count} cases: at least one is needed")
    exact = {kind: share * count for kind, share in MIX.items()}
    counts = {kind: int(value) for kind, value in exact.items()}
    rest = sorted(MIX, key=lambda kind: counts[kind] - exact[kind])
    for kind in rest[: count - sum(counts.values())]:
        counts[kind] += 1
    listed = [(kind, k) for kind in MIX for k in range(counts[kind])]
    order = generator(commit, number, "order").permutation(count)
    return [listed[k] for k in order]


def draw(count: int, commit: str, number: int | str, index: int) -> Drawn:
    """Case `index` of `count`."""
    kind, running = kinds(count, commit, number)[index]
    rng = generator(commit, number, "case", index)
    sheet = _sheet(rng)
    true = _true(sheet, rng, off=kind == "off")
    points = _points(sheet, rng)
    bare = Bare(
        rng,
        true["line"]["segments"],
        len(sheet["sensors"]),
        sheet["fluid"]["density"],
        sheet["pump"]["bulk_modulus"],
        float(np.mean([_mean_flow(sheet, point) for point in points])),
        float(np.mean([point.load_pressure for point in points])),
    )
    effects, classes = _effects(kind, running, bare, generator(commit, number, "effects"))
    true["effects"] = [effect.entry for effect in effects]
    error = rng.uniform(0.01, 0.04)
    true["pump"] = _wrong_pump(sheet, points[0], error, rng)
    # a volume's compliance goes by the true pump's modulus; keep what the truth says of it
    factor = 1 + true["pump"]["relative"]["bulk_modulus"]
    for entry in true["effects"]:
        if "volume" in entry:
            entry["volume"] *= factor
    truth = {
        "kind": kind,
        "effects": [_told(effect, sheet, true) for effect in effects],
        "classes": classes,
        "segments": [
            {
                "delay": s["length"] / s["wave_speed"],
                "impedance": bare.density * s["wave_speed"] / (np.pi / 4 * s["diameter"] ** 2),
            }
            for s in true["line"]["segments"]
        ],
        "length": float(bare.length),
        "noise": true["noise"],
        "source_error": float(error),
        "points": len(points),
        "sensors": len(sheet["sensors"]),
        "seal": true,
    }
    return Drawn(sheet, true, points, truth)


def _effects(
    kind: str, running: int, bare: Bare, order: np.random.Generator
) -> tuple[list[Concealed], list[list[str]]]:
    """Effects of a case and the classes declared beforehand; `order` is the same for all cases.

    Every effect of a kind has had its turn before one comes again.
    """
    level = bare.rng.uniform()
    singles = list(order.permutation(list(LIBRARY)))
    outside = list(order.permutation(list(OUTSIDE)))
    alike = list(order.permutation(len(INDISTINGUISHABLE)))
    if kind == "single":
        return [LIBRARY[singles[running % len(singles)]](bare, level)], []
    if kind == "outside":
        return [OUTSIDE[outside[running % len(outside)]](bare, level)], []
    if kind == "pair":
        names = bare.rng.choice(singles, 2, replace=False)
        # both well visible: that a weak effect hides behind a strong one is no news
        return [LIBRARY[name](bare, bare.uniform(0.5, 1.0)) for name in names], []
    if kind == "indistinguishable":
        effect, names = INDISTINGUISHABLE[alike[running % len(alike)]](bare, 0.5 + 0.5 * level)
        return [effect], [names]
    return [], []


def _told(effect: Concealed, sheet: dict, true: dict) -> dict:
    """The truth of an effect, its position also as one would find it on the drawing."""
    told = effect.to_dict()
    if effect.position is not None:
        ends = [
            np.concatenate([[0.0], np.cumsum([s["length"] for s in line["segments"]])])
            for line in (true["line"], sheet["line"])
        ]
        told["position_nominal"] = float(np.interp(effect.position, *ends))
        told["segment"] = int(np.searchsorted(ends[0][1:-1], effect.position)) + 1
    return told


def _sheet(rng: np.random.Generator) -> dict:
    """What the owner knows: a pump, two to four segments, two or three sensors."""
    count = int(rng.integers(2, 5))
    segments = [
        {
            "length": _rounded(rng.uniform(0.8, 3.5)),
            "diameter": _rounded(rng.uniform(0.011, 0.016)),
            "wave_speed": _rounded(rng.uniform(950.0, 1350.0)),
        }
        for _ in range(count)
    ]
    length = sum(segment["length"] for segment in segments)
    return {
        "fluid": {
            "density": _rounded(rng.uniform(840.0, 890.0)),
            "kinematic_viscosity": _rounded(rng.uniform(3e-5, 8e-5)),
        },
        "pump": {
            "pistons": int(rng.choice([7, 9, 9, 9])),
            "piston_diameter": _rounded(rng.uniform(0.010, 0.014)),
            "pitch_radius": _rounded(rng.uniform(0.022, 0.030)),
            "swash_angle_deg": _rounded(rng.uniform(12.0, 18.0)),
            "dead_volume": _rounded(rng.uniform(0.7e-6, 2e-6)),
            "bulk_modulus": _rounded(rng.uniform(1.1e9, 1.5e9)),
            "port_area": _rounded(rng.uniform(0.4e-4, 0.8e-4)),
            "port_opening_deg": _rounded(rng.uniform(10.0, 25.0)),
            "port_overlap_deg": _rounded(rng.uniform(1.0, 4.0)),
            "discharge_coefficient": 0.65,
            "case_leakage": _rounded(rng.uniform(1e-13, 5e-13)),
            "suction_pressure": 2e5,
        },
        "line": {"segments": segments},
        "sensors": [
            {"name": f"p{k}", "position": position}
            for k, position in enumerate(_sensors(rng, length), 1)
        ],
        "load": {"kind": "orifice"},
        "uncertainty": dict(UNCERTAINTY),
    }


def _sensors(rng: np.random.Generator, length: float) -> list[float]:
    """Two or three places at least half a metre apart, the first near the pump."""
    count = int(rng.integers(2, 4))
    while True:
        places = np.sort([rng.uniform(0.2, 0.8), *rng.uniform(0.2, length - 0.15, count - 1)])
        if np.diff(places).min() > 0.5:
            return [_rounded(place) for place in places]


def _true(sheet: dict, rng: np.random.Generator, off: bool) -> dict:
    """True line, liquid and sensors: off the sheet by its uncertainty, or by two to three of it.

    Where values are `off`, wave speeds, diameters and viscosity are; lengths can be measured again.
    """

    def deviation(far: bool) -> float:
        if far:
            return rng.uniform(2.0, 3.0) * rng.choice([-1.0, 1.0])
        return float(np.clip(rng.standard_normal(), -2.0, 2.0))

    def moved(value: float, key: str, far: bool = False) -> float:
        return float(value * np.exp(UNCERTAINTY[key] * deviation(far)))

    segments = [
        {
            "length": moved(s["length"], "length"),
            "diameter": moved(s["diameter"], "diameter", off),
            "wave_speed": moved(s["wave_speed"], "wave_speed", off),
        }
        for s in sheet["line"]["segments"]
    ]
    length = sum(segment["length"] for segment in segments)
    places = [
        sensor["position"] + UNCERTAINTY["sensor_position"] * deviation(False)
        for sensor in sheet["sensors"]
    ]
    fluid = sheet["fluid"]
    return {
        "fluid": fluid
        | {"kinematic_viscosity": moved(fluid["kinematic_viscosity"], "viscosity", off)},
        "line": {"segments": segments},
        "sensors": [float(np.clip(place, 0.05, length - 0.05)) for place in places],
        "noise": float(0.5e3 * 8.0 ** rng.uniform()),
        # every other drive holds its speed to the last revolution
        "speed": {
            "error": 0.001,
            "wander": float(rng.choice([0.0, rng.uniform(2e-4, 1e-3)])),
            "correlation_s": 3.0,
        },
        "load_pressure_error": 0.003,
    }


def _points(sheet: dict, rng: np.random.Generator) -> tuple[Point, ...]:
    """One to three operating points that differ in speed and pressure."""
    count = int(rng.integers(1, 4))
    speeds = rng.permutation([750.0, 1000.0, 1250.0, 1500.0])[:count] + rng.integers(-9, 10) * 10.0
    pressures = rng.permutation([5e6, 8e6, 11e6, 14e6])[:count] + rng.integers(-10, 11) * 1e5
    return tuple(
        Point(f"healthy_{k}", float(speed), float(pressure), SECONDS)
        for k, (speed, pressure) in enumerate(zip(speeds, pressures, strict=True))
    )


def _mean_flow(sheet: dict, point: Point) -> float:
    return Pump(**sheet["pump"]).displacement * point.speed_rpm / 60


def _wrong_pump(sheet: dict, point: Point, error: float, rng: np.random.Generator) -> dict:
    """How the true pump differs from the sheet's: a ripple wrong by `error`, smoothly.

    Bulk modulus and port timing are off, in a random proportion, by as much as makes the piston
    harmonics of the flow ripple below HIGHEST_HZ differ by `error` of their norm, the shaft angle
    being free.
    """
    pump, density = Pump(**sheet["pump"]), sheet["fluid"]["density"]
    towards = rng.uniform(0, 2 * np.pi)
    modulus, timing = np.cos(towards), np.sin(towards)

    def changes(scale: float) -> dict:
        return {
            "relative": {"bulk_modulus": float(0.1 * scale * modulus)},
            "timing_deg": float(scale * timing),
        }

    def flow(**kwargs) -> np.ndarray:
        changed = pump.changed(kwargs["relative"], kwargs["timing_deg"]) if kwargs else pump
        return constant_pressure_flow(changed, density, point.speed_rpm, point.load_pressure)

    nominal = flow()

    def excess(log_scale: float) -> float:
        made = difference(flow(**changes(np.exp(log_scale))), nominal, pump.pistons, point)
        return float(np.log(made / error))

    low, high = np.log(1e-3), np.log(4.0)
    if excess(high) < 0:
        return changes(4.0)
    return changes(float(np.exp(brentq(excess, low, high, xtol=0.02))))


def difference(wave: np.ndarray, other: np.ndarray, pistons: int, point: Point) -> float:
    """Relative difference of two ripples' (..., N) piston harmonics, shaft angle free."""
    top = int(HIGHEST_HZ / (point.speed_rpm / 60 * pistons))
    a, b = (np.fft.rfft(x)[..., pistons : top * pistons + 1 : pistons] for x in (wave, other))
    order = np.arange(1, top + 1)
    turned = (b * np.exp(-2j * np.pi * t * order) for t in np.linspace(-0.02, 0.02, 801))
    return float(min(np.linalg.norm(a - x) for x in turned) / np.linalg.norm(b))


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")
