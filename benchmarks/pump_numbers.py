"""Which part of a nominal flow ripple's error two numbers of the pump explain.

    python benchmarks/pump_numbers.py [--pumps 12]

Pumps and their errors are drawn as for the concealed trial, from a seed of this benchmark's own.
The virtual rig computes their ripples. Bulk modulus, port timing and the shaft angles are then
fitted to the difference of true and nominal ripple at all operating points. The twin's lumped pump
gives the change that each number makes.
"""

from __future__ import annotations

import argparse

import numpy as np

from rippletwin.case.model import Fluid
from rippletwin.harmonics import peak_amplitudes
from rippletwin.pump.ripple_sensitivity import ripple_change
from virtualrig.draw import draw_case
from virtualrig.draw_rig import HIGHEST_HZ
from virtualrig.pump import Pump
from virtualrig.source import constant_pressure_flow

MODULUS_STEP, TIMING_STEP_DEG = 0.1, 1.0  # a unit of each coordinate; the modulus is relative


def aligned(true: np.ndarray, nominal: np.ndarray, orders: np.ndarray) -> np.ndarray:
    """`true` at the shaft angle at which it is nearest to `nominal`."""
    angles = np.linspace(-0.04, 0.04, 4001)
    distances = [np.linalg.norm(true * np.exp(1j * orders * t) - nominal) for t in angles]
    return true * np.exp(1j * orders * angles[int(np.argmin(distances))])


def analyse(index: int) -> tuple[float, float, np.ndarray, np.ndarray]:
    """Relative error of the nominal ripple before and after the fit, fitted and true numbers."""
    drawn = draw_case(60, "benchmark of the pump's numbers", 0, index)
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
        a, b = (peak_amplitudes(flow)[orders] for flow in flows)
        modulus = nominal.bulk_modulus
        ends = {
            "bulk_modulus": (modulus * np.exp(MODULUS_STEP), modulus * np.exp(-MODULUS_STEP)),
            "port_timing": (TIMING_STEP_DEG, -TIMING_STEP_DEG),
        }
        own = np.zeros((len(orders), 2 + len(drawn.points)), complex)
        for j, (name, pair) in enumerate(ends.items()):
            change = ripple_change(
                sheet["pump"], fluid, point.speed_rpm, point.load_pressure, name, pair
            )
            own[:, j] = change.harmonics(orders, float(np.mean(flows[0])))[1]
        own[:, 2 + k] = 1j * orders * a
        columns.append(own)
        errors.append(aligned(b, a, orders) - a)
        size += np.linalg.norm(a) ** 2
    matrix, error = np.concatenate(columns), np.concatenate(errors)
    matrix = np.concatenate([matrix.real, matrix.imag])
    error = np.concatenate([error.real, error.imag])
    fitted = np.linalg.lstsq(matrix, error, rcond=None)[0]
    after = np.linalg.norm(error - matrix @ fitted)
    truth = np.array([wrong["relative"]["bulk_modulus"], wrong["timing_deg"]])
    before = np.linalg.norm(error) / np.sqrt(size)
    return before, after / np.sqrt(size), fitted[:2] * (MODULUS_STEP, TIMING_STEP_DEG), truth


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pumps", type=int, default=12)
    options = parser.parse_args()
    print("ripple error: nominal, fitted | bulk modulus, port timing: fitted, true")
    for index in range(options.pumps):
        before, after, fitted, true = analyse(index)
        print(
            f"{before:7.2%} {after:7.2%} | {fitted[0]:+6.1%} {true[0]:+6.1%}   "
            f"{fitted[1]:+5.2f} {true[1]:+5.2f} deg"
        )


if __name__ == "__main__":
    main()
