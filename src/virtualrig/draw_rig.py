"""Random rigs for concealed cases: data sheet, true values, operating points, wrong pump."""

import numpy as np
from scipy.optimize import brentq

from virtualrig.pump import Pump
from virtualrig.recorder import Point
from virtualrig.source import constant_pressure_flow

UNCERTAINTY = {
    "length": 0.01,
    "diameter": 0.03,
    "wave_speed": 0.05,
    "viscosity": 0.1,
    "load": 0.05,
    "sensor_position": 0.02,
}
"""Standard deviations that rig.yaml states: relative, of sensor positions in m."""

RECORDING_S = 3.2
HIGHEST_HZ = 4000.0  # of the harmonics that count in comparisons
COARSE_TURNS = 16  # shaft angles tried in a period of the highest of these harmonics
FINE_TURNS = 401  # and between the neighbours of the best of them


def draw_data_sheet(rng: np.random.Generator) -> dict:
    """What the rig's owner knows, laid out as rig.yaml: a pump, two to four segments, sensors."""
    count = int(rng.integers(2, 5))
    segments = [
        {
            "length": _four_digits(rng.uniform(0.8, 3.5)),
            "diameter": _four_digits(rng.uniform(0.011, 0.016)),
            "wave_speed": _four_digits(rng.uniform(950.0, 1350.0)),
        }
        for _ in range(count)
    ]
    length = sum(segment["length"] for segment in segments)
    return {
        "fluid": {
            "density": _four_digits(rng.uniform(840.0, 890.0)),
            "kinematic_viscosity": _four_digits(rng.uniform(3e-5, 8e-5)),
        },
        "pump": {
            "pistons": int(rng.choice([7, 9, 9, 9])),
            "piston_diameter": _four_digits(rng.uniform(0.010, 0.014)),
            "pitch_radius": _four_digits(rng.uniform(0.022, 0.030)),
            "swash_angle_deg": _four_digits(rng.uniform(12.0, 18.0)),
            "dead_volume": _four_digits(rng.uniform(0.7e-6, 2e-6)),
            "bulk_modulus": _four_digits(rng.uniform(1.1e9, 1.5e9)),
            "port_area": _four_digits(rng.uniform(0.4e-4, 0.8e-4)),
            "port_opening_deg": _four_digits(rng.uniform(10.0, 25.0)),
            "port_overlap_deg": _four_digits(rng.uniform(1.0, 4.0)),
            "discharge_coefficient": 0.65,
            "case_leakage": _four_digits(rng.uniform(1e-13, 5e-13)),
            "suction_pressure": 2e5,
        },
        "line": {"segments": segments},
        "sensors": [
            {"name": f"p{k}", "position": position}
            for k, position in enumerate(_draw_sensors(rng, length), 1)
        ],
        "load": {"kind": "orifice"},
        "uncertainty": dict(UNCERTAINTY),
    }


def _draw_sensors(rng: np.random.Generator, length: float) -> list[float]:
    """Two or three positions (m) at least half a metre apart, the first near the pump."""
    count = int(rng.integers(2, 4))
    while True:
        places = np.sort([rng.uniform(0.2, 0.8), *rng.uniform(0.2, length - 0.15, count - 1)])
        if np.diff(places).min() > 0.5:
            return [_four_digits(place) for place in places]


def draw_true_rig(sheet: dict, rng: np.random.Generator, off: bool) -> dict:
    """True line, liquid and sensors, laid out as the seal.

    Values deviate from the data sheet by its standard deviations, cut off at two. If `off`, wave
    speeds, diameters and viscosity deviate by two to three; lengths can be measured and do not.
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
        # every other drive keeps an exactly constant speed
        "speed": {
            "error": 0.001,
            "wander": float(rng.choice([0.0, rng.uniform(2e-4, 1e-3)])),
            "correlation_s": 3.0,
        },
        "load_pressure_error": 0.003,
    }


def draw_operating_points(rng: np.random.Generator) -> tuple[Point, ...]:
    """One to three operating points that differ in speed and pressure."""
    count = int(rng.integers(1, 4))
    speeds = rng.permutation([750.0, 1000.0, 1250.0, 1500.0])[:count] + rng.integers(-9, 10) * 10.0
    pressures = rng.permutation([5e6, 8e6, 11e6, 14e6])[:count] + rng.integers(-10, 11) * 1e5
    return tuple(
        Point(f"healthy_{k}", float(speed), float(pressure), RECORDING_S)
        for k, (speed, pressure) in enumerate(zip(speeds, pressures, strict=True))
    )


def mean_flow(sheet: dict, point: Point) -> float:
    """Displaced flow of the data sheet's pump, m3/s."""
    return Pump(**sheet["pump"]).displacement * point.speed_rpm / 60


def draw_wrong_pump(sheet: dict, point: Point, error: float, rng: np.random.Generator) -> dict:
    """How the true pump differs from the data sheet's, laid out as the seal's `pump`.

    Bulk modulus and port timing deviate in a random proportion, by so much that the flow ripples
    differ by `error` (`ripple_difference`), or four times 10 % and one degree if that is less.
    """
    pump, density = Pump(**sheet["pump"]), sheet["fluid"]["density"]
    direction = rng.uniform(0, 2 * np.pi)
    modulus, timing = np.cos(direction), np.sin(direction)

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
        changed = flow(**changes(np.exp(log_scale)))
        return float(np.log(ripple_difference(changed, nominal, pump.pistons, point) / error))

    low, high = np.log(1e-3), np.log(4.0)
    if excess(high) < 0:
        return changes(4.0)
    return changes(float(np.exp(brentq(excess, low, high, xtol=0.02))))


def ripple_difference(wave: np.ndarray, other: np.ndarray, pistons: int, point: Point) -> float:
    """Norm of the difference of two ripples (..., N), over that of `other`.

    Of their piston harmonics below HIGHEST_HZ, at the shaft angle that makes it least, of a whole
    pitch of the pistons.
    """
    top = int(HIGHEST_HZ / (point.speed_rpm / 60 * pistons))
    a, b = (np.fft.rfft(x)[..., pistons : top * pistons + 1 : pistons] for x in (wave, other))
    order = np.arange(1, top + 1)
    alike = np.sum((a * b.conj()).reshape(-1, top), axis=0)

    def best(turns: np.ndarray) -> float:
        """The one of `turns`, in pitches, by which `other` is most like `wave`."""
        return turns[np.argmax((np.exp(2j * np.pi * np.outer(turns, order)) @ alike).real)]

    coarse = best(np.linspace(-0.5, 0.5, COARSE_TURNS * top, endpoint=False))
    step = 1.0 / (COARSE_TURNS * top)
    turn = best(coarse + step * np.linspace(-1.0, 1.0, FINE_TURNS))
    return float(np.linalg.norm(a - b * np.exp(-2j * np.pi * turn * order)) / np.linalg.norm(b))


def _four_digits(value: float) -> float:
    return float(f"{value:.4g}")
