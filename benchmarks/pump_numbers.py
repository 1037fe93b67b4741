"""How much of a nominal ripple's error is bulk modulus and port timing.

    python benchmarks/pump_numbers.py [--pumps 12]

Pumps and their errors are drawn as for the sealed trial, from a seed of this benchmark's own, and
their ripples are computed by the virtual rig. Two numbers and the shaft angles are fitted to the
difference of true and nominal ripple at all operating points, the twin's own lumped pump saying
what each number changes.
"""

from __future__ import annotations

import argparse

import numpy as np

from rippletwin.case.model import Fluid
from rippletwin.harmonics import peak_amplitudes
from rippletwin.pump.ripple_sensitivity import ripple_change
from virtualrig.draw import draw
from virtualrig.pump import Pump
from virtualrig.source import constant_pressure_flow

HIGHEST_HZ = 4000.0
MODULUS, TIMING = 0.1, 1.0  # what a unit of each coordinate is: relative, deg


def harmonics(flow: np.ndarray, orders: np.ndarray) -> np.ndarray:
    return peak_amplitudes(flow)[orders]


def aligned(true: np.ndarray, nominal: np.ndarray, orders: np.ndarray) -> np.ndarray:
    """`true` with the shaft turned to where it is nearest to `nominal`."""
    angles = np.linspace(-0.04, 0.04, 4001)
    left = [np.linalg.norm(true * np.exp(1j * orders * t) - nominal) for t in angles]
    return true * np.exp(1j * orders * angles[int(np.argmin(left))])


def analyse(index: int) -> tuple[float, float, np.ndarray, np.ndarray]:
    """Error of the nominal ripple before and after, numbers as found and as they are."""
    drawn = draw(60, "benchmark of the pump's numbers", 0, index)
    sheet, wrong = drawn.sheet, drawn.seal["pump"]
    fluid = Fluid(sheet["fluid"]["density"], sheet["fluid"]["kinematic_viscosity"])
    nominal = Pump(**sheet["pump"])
    true = nominal.changed(wrong["relative"], wrong["timing_deg"])
    columns, errors, size = [], [], 0.0
    for k, point in enumerate(drawn.points):
        top = int(HIGHEST_HZ * 60 / point.speed_rpm)
        orders = np.arange(nominal.pistons, top + 1, nominal.pistons)
        flows = [
            constant_pressure_flow(p, fluid.density, point.speed_rpm, point.load_pressure)
            for p in (nominal, true)
        ]
        a, b = (harmonics(flow, orders) for flow in flows)
        modulus = nominal.bulk_modulus
        ends = {
            "bulk_modulus": (modulus * np.exp(MODULUS), modulus * np.exp(-MODULUS)),
            "port_timing": (TIMING, -TIMING),
        }
        own = np.zeros((len(orders), 2 + len(drawn.points)), complex)
        for j, (name, pair) in enumerate(ends.items()):
            change = ripple_change(
                sheet["pump"], fluid, point.speed_rpm, point.load_pressure, name, pair
            )
            own[:, j] = change.harmonics(orders, float(np.mean(flows[0])))[0]
        own[:, 2 + k] = 1j * orders * a
        columns.append(own)
        errors.append(aligned(b, a, orders) - a)
        size += np.linalg.norm(a) ** 2
    matrix, error = np.concatenate(columns), np.concatenate(errors)
    matrix = np.concatenate([matrix.real, matrix.imag])
    error = np.concatenate([error.real, error.imag])
    found = np.linalg.lstsq(matrix, error, rcond=None)[0]
    left = np.linalg.norm(error - matrix @ found)
    truth = np.array([wrong["relative"]["bulk_modulus"], wrong["timing_deg"]])
    before = np.linalg.norm(error) / np.sqrt(size)
    return before, left / np.sqrt(size), found[:2] * (MODULUS, TIMING), truth


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pumps", type=int, default=12)
    options = parser.parse_args()
    print("ripple's error: nominal, with both numbers | bulk modulus, port timing: found, true")
    for index in range(options.pumps):
        before, after, found, truth = analyse(index)
        print(
            f"{before:7.2%} {after:7.2%} | {found[0]:+6.1%} {truth[0]:+6.1%}   "
            f"{found[1]:+5.2f} {truth[1]:+5.2f} deg"
        )


if __name__ == "__main__":
    main()
