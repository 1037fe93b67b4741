"""Costs of solving the line: exact periodic solution against the method of characteristics.

    python benchmarks/line_speed.py

Times are processor seconds of one thread, the best of several. On a shared machine only ratios
within one run are meaningful.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

from rippletwin.harmonics import one_period
from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine
from rippletwin.line.frequency_domain.pipe_immittance import series_impedance, shunt_admittance
from rippletwin.line.time_domain.line_elements import End, TimeDomainLine
from rippletwin.line.time_domain.method_of_characteristics import simulate

TESTS = Path(__file__).resolve().parents[1] / "tests"
sys.path[:0] = [str(TESTS / "reference"), str(TESTS / "helpers")]

from harmonic_balance import balance_orifice  # noqa: E402
from paper_line import DENSITY, MEAN_FLOW, MEAN_PRESSURE, PIPES, VISCOSITY  # noqa: E402
from paper_rig import SENSORS  # noqa: E402

POSITIONS = (*SENSORS, 8.0)
SHAFT_HZ, PISTONS = 1000 / 60, 9
STEPS = 3072  # a revolution: 51.2 kHz


def best(task, repeats: int) -> float:
    """Least processor time of `repeats` calls, s, after one that compiles."""
    task()
    times = []
    for _ in range(repeats):
        start = time.process_time()
        task()
        times.append(time.process_time() - start)
    return min(times)


def network(orders: np.ndarray, friction: str = "unsteady") -> FrequencyDomainLine:
    """The paper's line with a nine-piston ripple at shaft `orders`."""
    s = 2j * np.pi * SHAFT_HZ * orders
    diameter = np.array([p.diameter for p in PIPES])[:, None]
    speed = np.array([p.wave_speed for p in PIPES])[:, None]
    flow = 0.05 * MEAN_FLOW * np.exp(1j * orders) / (1 + s / 6000) ** 2 * (orders % PISTONS == 0)
    return FrequencyDomainLine(
        s=s,
        lengths=np.array([p.length for p in PIPES]),
        series=series_impedance(
            s, density=DENSITY, viscosity=VISCOSITY, diameter=diameter, friction=friction
        ),
        shunt=shunt_admittance(s, density=DENSITY, wave_speed=speed, diameter=diameter),
        source_flow=flow,
        load=("admittance", MEAN_FLOW / (2 * MEAN_PRESSURE) + 0 * s),
        sensor_positions=POSITIONS,
    )


def solve(orders: np.ndarray) -> None:
    """Solve the whole line: friction, orifice and sensors."""
    net = network(orders)
    balance_orifice(net, mean_pressure=MEAN_PRESSURE, mean_flow=MEAN_FLOW, orders=orders)
    net.readings()


def revolution(friction: str, steps: int, periods: int = 1):
    """`periods` revolutions of the method of characteristics, or until it is periodic."""
    orders = np.arange(1, STEPS // 2)
    line = TimeDomainLine(
        PIPES,
        MEAN_FLOW + one_period(network(orders).source_flow, steps, orders),
        1 / SHAFT_HZ,
        End("orifice", 0.0, MEAN_FLOW / np.sqrt(MEAN_PRESSURE)),
        density=DENSITY,
        viscosity=VISCOSITY,
        friction=friction,
        positions=POSITIONS,
    )
    return simulate(line, periods=periods, tolerance=1e-4)


def main() -> None:
    argparse.ArgumentParser(description=__doc__.splitlines()[0]).parse_args()
    piston, shaft = PISTONS * np.arange(1, 35), np.arange(1, STEPS // 2 + 1)
    eighty = network(np.arange(1, 81) * PISTONS)
    print("frequency domain, ms")
    for name, task in (
        ("sensors of a given network, 80 frequencies", eighty.readings),
        ("network and sensors, 80 frequencies", lambda: network(piston[0] * shaft[:80]).readings()),
        ("whole solution with orifice, 34 piston orders", lambda: solve(piston)),
        ("whole solution with orifice, 1536 shaft orders", lambda: solve(shaft)),
    ):
        print(f"  {name:50s}{1e3 * best(task, 50):10.3f}")
    exact = best(lambda: solve(shaft), 50)
    print("method of characteristics: node-steps a second, and time over the 1536-order solution")
    for friction in ("steady", "unsteady"):
        for steps in (STEPS, 4 * STEPS):
            nodes = sum(p.length / p.wave_speed for p in PIPES) * SHAFT_HZ * steps
            one = best(lambda f=friction, n=steps: revolution(f, n), 3)
            run = revolution(friction, steps, periods=60)
            print(
                f"  {friction:9s}{steps * SHAFT_HZ / 1e3:6.1f} kHz {nodes * steps / one:10.2e} 1/s"
                f"   {run.periods:3d} revolutions to change {run.change:.0e}"
                f"   {run.periods * one / exact:8.0f} times"
            )


if __name__ == "__main__":
    main()
