"""Errors of harmonics at a wandering speed: mean over revolutions, and regressed to the mean speed.

    python benchmarks/wander.py [--wander 0.001] [--takes 4]

The virtual rig records a line with steady friction that ends in a volume, once at a wandering speed
and once at the constant mean speed; every take has another mean speed. The errors are norms of the
difference of all piston harmonics below 4 kHz, relative to those at constant speed, at the best
shaft angle. The columns "worst" are the same for the harmonic with the largest error of the
stronger half.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import numpy as np

from rippletwin.harmonics import peak_amplitudes
from rippletwin.spectra.angular_resampling import cut_revolutions
from rippletwin.spectra.speed_regression import mean_speed, regress_to_mean_speed
from virtualrig.recorder import SAMPLING_RATE_HZ, Point, record
from virtualrig.rig import SHEET, build, read_yaml

PISTONS, HIGHEST_HZ = 9, 4000.0
FIRST_RPM, STEP_RPM = 1500.0, 17.0
SEAL = {
    "line": {
        "segments": [
            {"length": 1.7, "diameter": 0.0146, "wave_speed": 1158.0},
            {"length": 3.1, "diameter": 0.0167, "wave_speed": 1164.0},
        ]
    },
    "sensors": [0.4, 3.46],
    "effects": [{"name": "load_volume", "volume": 2.3e-5}],
    "noise": 2000.0,
    "numerics": {"frequency": 7000.0, "points": 8.0, "degree": 7, "modes": 10},
}


def flow() -> np.ndarray:
    """Flow of nine pistons over a revolution, m3/s: half sines and a backflow at each opening."""
    angle = 2 * np.pi * np.arange(4608) / 4608
    total = np.zeros_like(angle)
    for k in range(PISTONS):
        own = (angle + 2 * np.pi * k / PISTONS) % (2 * np.pi)
        total += np.where(own < np.pi, np.sin(own), 0.0)
        total -= 0.3 * np.exp(-0.5 * ((own - 0.12) / 0.02) ** 2)
    return 2.5e-4 * total / total.mean()


def harmonics(take, speed_rpm: float):
    """Mean speed (Hz), orders, their mean over revolutions and their values at the mean speed."""
    revolutions = cut_revolutions(take.pressure, SAMPLING_RATE_HZ, PISTONS, speed_rpm)
    speed = mean_speed(revolutions.speed_hz)
    orders = PISTONS * np.arange(1, int(HIGHEST_HZ / speed / PISTONS) + 1)
    spectra = peak_amplitudes(revolutions.windows)[:, :, orders]
    return (
        speed,
        orders,
        spectra.mean(0),
        regress_to_mean_speed(spectra, revolutions.speed_hz, orders)[0],
    )


def relative_errors(values, constant, orders) -> tuple[float, float]:
    """Error of all harmonics, and of the worst of the stronger half, at the best shaft angle."""
    match = np.sum(np.conj(values) * constant / np.abs(constant) ** 2, axis=0)
    grid = np.linspace(-np.pi, np.pi, 40001) / PISTONS
    angle = grid[np.argmax((np.exp(-1j * np.outer(grid, orders)) @ match).real)]
    error = values * np.exp(1j * angle * orders) - constant
    size = np.linalg.norm(constant, axis=0)
    strong = size > np.median(size)
    worst = np.max((np.linalg.norm(error, axis=0) / size)[strong])
    return float(np.linalg.norm(error) / np.linalg.norm(constant)), float(worst)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--wander", type=float, default=1e-3)
    parser.add_argument("--takes", type=int, default=4)
    arguments = parser.parse_args()
    sheet = read_yaml(SHEET)
    sheet = sheet | {"sensors": [{"name": "p1", "position": 0.4}, {"name": "p2", "position": 3.46}]}
    speed = {"error": 0.0, "wander": arguments.wander, "correlation_s": 3.0}
    rig, ripple = build(sheet, SEAL | {"speed": speed}), flow()

    def driving(speed_rpm):
        return ripple * speed_rpm / FIRST_RPM

    print("| r/min | mean of revolutions | worst | at the mean speed | worst |")
    print("|---|---|---|---|---|")
    for k in range(arguments.takes):
        point = Point("a", FIRST_RPM + k * STEP_RPM, 7.7e6, 3.2)
        taken = record(rig, point, np.random.default_rng(k), driving, 20.0, 3, marched=True)
        mean_hz, orders, plain, at_mean = harmonics(taken, point.speed_rpm)
        # the mean over the complete revolutions differs a little from that of the recording
        point = replace(point, speed_rpm=60 * mean_hz)
        constant = record(
            replace(rig, wander=0.0), point, np.random.default_rng(k), driving, 20.0, 3
        )
        constant = harmonics(constant, point.speed_rpm)[2]
        cells = [f"{x:.1%}" for v in (plain, at_mean) for x in relative_errors(v, constant, orders)]
        print("| " + " | ".join([f"{60 * mean_hz:.1f}", *cells]) + " |", flush=True)


if __name__ == "__main__":
    main()
