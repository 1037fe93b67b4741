"""How wrong the nuisance bench's mesh makes the ripple, with and without a nonlinear liquid.

    python benchmarks/bench_mesh.py [--number 1046] [--cases 60] [--each 3]

Draws the cases of a development trial and solves the first operating point of the first few of each
kind of liquid twice: on the bench's mesh, and on one with narrower elements of higher degree and
shorter time steps. Prints the largest difference at any sensor, rms below 4 kHz, over the ripple
and over the noise.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator

import numpy as np

from virtualrig.nuisance import NUMERICS, seal_at
from virtualrig.nuisance_case import NuisanceCase, draw_nuisance_case
from virtualrig.orbit import Bench
from virtualrig.population import TOLERANCE, ripple_of
from virtualrig.resolution import rms_of_harmonics, shaft_orders
from virtualrig.rig import build

FINER = {"frequency": 20000.0, "points": 8.0, "degree": 7, "modes": 14}
COMMIT = "development"


def liquid_of(case: NuisanceCase) -> str:
    """Which nonlinear liquid a case has, if any."""
    names = {entry["name"] for entry in case.rig.true["effects"]}
    return " and ".join(sorted(names & {"entrained_air", "stiffening_liquid"})) or "linear"


def first_of_each_liquid(number: int, count: int, each: int) -> Iterator[tuple[str, int, object]]:
    """(liquid, index, case) of the first `each` cases of every liquid."""
    found: dict[str, int] = {}
    for index in range(count):
        case = draw_nuisance_case(count, COMMIT, number, index)
        liquid = liquid_of(case)
        found[liquid] = found.get(liquid, 0) + 1
        if found[liquid] <= each:
            yield liquid, index, case


def harmonics(case: NuisanceCase, numerics: dict, step_divisor: int) -> np.ndarray:
    """Complex peak amplitudes (sensors, `shaft_orders`), Pa, at the first point."""
    drawn, plan = case.rig, case.rig.recordings[0]
    seal = seal_at(drawn.sheet, drawn.true, drawn.nuisance, plan.kelvin, numerics)
    bench = Bench(build(drawn.sheet, seal), step_divisor=step_divisor)
    point = plan.point
    orbit = bench.settle(point.speed_rpm, point.load_pressure, tolerance=TOLERANCE / 4)
    ripple = ripple_of(orbit, bench.rig.sensing)
    return 2 * np.fft.rfft(ripple, axis=1)[:, shaft_orders(point.speed_rpm)] / ripple.shape[1]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--number", type=int, default=1046, help="of the development trial")
    parser.add_argument("--cases", type=int, default=60, help="that the trial has")
    parser.add_argument("--each", type=int, default=3, help="cases of each liquid")
    options = parser.parse_args()
    print("| case | liquid | error over ripple | error over noise |\n|---|---|---|---|")
    for liquid, index, case in first_of_each_liquid(options.number, options.cases, options.each):
        coarse, fine = harmonics(case, NUMERICS, 1), harmonics(case, FINER, 2)
        error = rms_of_harmonics(coarse - fine)
        shares = np.max(error / rms_of_harmonics(fine)), np.max(error) / case.rig.nuisance["noise"]
        print(f"| {index} | {liquid} | {shares[0]:.2%} | {shares[1]:.2g} |", flush=True)


if __name__ == "__main__":
    main()
