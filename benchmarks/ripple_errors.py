"""By how much real flow ripples differ from those of the data sheet, and how smoothly.

    python benchmarks/ripple_errors.py [--pumps 40] [--number 1043]

Draws pumps of `virtualrig` with nuisance physics (relief grooves, free air, other dead volumes,
port areas and timing than the data sheet states) and calculates the flow of each, and that of its
data sheet, into a constant pressure at its operating points. Prints the ratio of their harmonics by
frequency, and the parameters of the error model `rippletwin.calibration.reading_errors` that make
its logarithm likeliest: size and length of the smooth part, what operating points have in common,
and what differs from harmonic to harmonic.
"""

from __future__ import annotations

import argparse
from itertools import pairwise

import numpy as np
from scipy.optimize import minimize

from rippletwin.calibration.shaft_angles import find_best_turn
from virtualrig.nuisance import true_pump
from virtualrig.nuisance_case import draw_nuisance_case
from virtualrig.pump import Pump
from virtualrig.source import constant_pressure_flow

HIGHEST_HZ = 4000.0
BANDS_HZ = (0, 300, 700, 1200, 2000, 3000, 4000)
ANGLE_SD = 0.01  # rad, of the shaft angle that is fitted to each ripple
STARTS = (np.log(0.3), np.log(1.0), 0.0, np.log(0.05))


def ripple_error(number: int, pumps: int, index: int) -> list[tuple[np.ndarray, ...]]:
    """Frequencies (F,) in Hz, shaft orders (F,) and logarithms (F,) of the true over the data
    sheet's harmonics, of each operating point of a pump; the shaft is turned to fit best."""
    case = draw_nuisance_case(pumps, "ripple errors", number, index).rig
    sheet = case.sheet["pump"]
    both = Pump(**sheet), Pump(**(sheet | true_pump(sheet, case.nuisance)))
    errors = []
    for plan in case.recordings:
        speed, pressure = plan.point.speed_rpm, plan.point.load_pressure
        count = int(HIGHEST_HZ / (both[0].pistons * speed / 60))
        orders = both[0].pistons * np.arange(1, count + 1)
        nominal, true = (
            np.fft.fft(constant_pressure_flow(p, case.sheet["fluid"]["density"], speed, pressure))
            for p in both
        )
        weighted = np.conj(nominal[orders]) * true[orders]
        turn = np.exp(-1j * orders * find_best_turn(weighted, orders)[0])
        ratio = true[orders] / nominal[orders] * turn
        logarithm = np.log(np.abs(ratio)) + 1j * np.unwrap(np.angle(ratio))
        errors.append((orders * speed / 60, orders, logarithm))
    return errors


def minus_log_likelihood(parameters: np.ndarray, pumps: list) -> float:
    """Of the logarithms of all pumps; parameters are log tau, log of the length in kHz, logit of
    the common share, log sigma."""
    tau, length, sigma = np.exp(parameters[[0, 1, 3]])
    common, total = 1.0 / (1.0 + np.exp(-parameters[2])), 0.0
    for points in pumps:
        f, orders, error = (np.concatenate(parts) for parts in zip(*points))
        point = np.repeat(np.arange(len(points)), [len(p[0]) for p in points])
        f = f / 1000.0
        kernel = 1.0 + (1.0 + np.outer(f, f)) * np.exp(
            -0.5 * np.subtract.outer(f, f) ** 2 / length**2
        )
        same = np.equal.outer(point, point)
        kernel = tau**2 * kernel * (common + (1.0 - common) * same)
        kernel += sigma**2 * np.eye(len(f)) + ANGLE_SD**2 * same * np.outer(orders, orders)
        root = np.linalg.cholesky(kernel)
        total += float(np.sum(np.abs(np.linalg.solve(root, error)) ** 2))
        total += 2.0 * float(np.sum(np.log(np.diag(root))))
    return total


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pumps", type=int, default=40)
    parser.add_argument("--number", type=int, default=1043)
    options = parser.parse_args()
    pumps = [ripple_error(options.number, options.pumps, k) for k in range(options.pumps)]
    f, _, error = (np.concatenate(parts) for parts in zip(*(p for each in pumps for p in each)))
    print("| frequency, Hz | true over stated ripple, median | 10 to 90 % | phase, median, rad |")
    print("|---|---|---|---|")
    for low, high in pairwise(BANDS_HZ):
        own = error[(f >= low) & (f < high)]
        ends = np.exp(np.quantile(own.real, [0.5, 0.1, 0.9]))
        print(
            f"| {low} to {high} | {ends[0]:.2f} | {ends[1]:.2f} to {ends[2]:.2f} |"
            f" {np.median(own.imag):+.2f} |"
        )
    found = minimize(minus_log_likelihood, STARTS, args=(pumps,), method="Nelder-Mead")
    tau, length, sigma = np.exp(found.x[[0, 1, 3]])
    print(
        f"\nlikeliest: tau {tau:.2f}, length {length:.2f} kHz, common to the operating points "
        f"{1 / (1 + np.exp(-found.x[2])):.0%}, sigma {sigma:.3f}"
    )


if __name__ == "__main__":
    main()
