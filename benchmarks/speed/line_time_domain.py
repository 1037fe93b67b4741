"""Closure of a valve on one pipe: the method of characteristics against three other programs."""

from __future__ import annotations

import json
import os
import subprocess
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from rippletwin.line.time_domain.grid import Grid
from rippletwin.line.time_domain.line_elements import End, Pipe, TimeDomainLine
from rippletwin.line.time_domain.method_of_characteristics import simulate
from speed import machine
from speed.network_programs import DIAMETER, HEAD, LENGTH, WAVE_SPEED
from speed.result import Claim, Result, Table
from speed.timing import alternate, median_ratio

NETWORK_PYTHON = "RIPPLETWIN_BENCH_NUMPY1"
"""Environment variable: the Python that has PTSNET and TSNet."""
OTHER_VERSIONS: dict[str, str] = {}
"""Versions of the programs of another Python, filled by `run`."""
WATER, GRAVITY = 998.0, 9.80665
VISCOSITY = 1e-6  # m2/s
FLOW = 0.01  # m3/s before the closure
FRONT = 4  # steps around a wave front that are left out of the comparison: they are shifted
FOOT, INCH, GALLON_A_MINUTE = 0.3048, 0.0254, 3.785411784e-3 / 60
LINE_CELLS = 450  # those of a pump's line of 9 m at 51.2 kHz


def our_line(cells: int, steps: int, friction: str) -> TimeDomainLine:
    """The pipe, its valve at the pump's end: at rest, then a step of flow.

    A period is twice as long as the comparison, with the flow back in the second half, so that its
    mean is zero and the start at rest. The equations are linear: the step of flow gives the change
    of pressure that the closure gives. The quarter of a cell avoids the exact grid, which would
    favour us.
    """
    dt = LENGTH / WAVE_SPEED / (cells + 0.25)
    flow = FLOW * np.where(np.arange(2 * steps) < steps, 1.0, -1.0)
    return TimeDomainLine(
        [Pipe(LENGTH, DIAMETER, WAVE_SPEED)],
        flow,
        2 * steps * dt,
        End("open", WATER * GRAVITY * HEAD),
        density=WATER,
        viscosity=VISCOSITY,
        friction=friction,
        positions=[0.0],
    )


def our_steps(cells: int, steps: int, friction: str):
    """A task that makes `steps` steps; what is built before is not timed, as with the peers."""
    grid = Grid(our_line(cells, steps // 2, friction))
    nodes = np.array([0], dtype=np.int64)
    return lambda: grid.advance(nodes)


def rthym(cells: int, steps: int):
    """The pipe in rthym-moc, as (task, flow before in m3/s, wave speed in m/s)."""
    import rthym_moc

    wave_speed = 4000 * FOOT  # the program's own for a rigid pipe
    dt = LENGTH / wave_speed / cells
    solver = rthym_moc.MOCSolver()
    for name, kind in (("source", "PressureBoundary"), ("end", "Junction")):
        node = rthym_moc.NodeInput()
        node.id, node.type, node.head, node.demand = name, kind, HEAD / FOOT, 0.0
        solver.add_node(node)
    pipe = rthym_moc.PipeInput()
    pipe.id, pipe.from_node, pipe.to_node = "pipe", "source", "end"
    pipe.length, pipe.diameter, pipe.roughness = LENGTH / FOOT, DIAMETER / INCH, 140.0
    pipe.flow_gpm = FLOW / GALLON_A_MINUTE
    solver.add_pipe(pipe)

    def run():
        return solver.run(
            total_time=steps * dt, dt=dt, p_vapor_psi=-1e6, usf_tau=dt, k_bru=0.0
        )  # friction steady

    return run, FLOW, wave_speed


def network_program(name: str, cells: int, steps: int) -> dict | None:
    """The result of a program that needs NumPy 1, None where its Python is not given."""
    python = os.environ.get(NETWORK_PYTHON)
    if not python:
        return None
    script = Path(__file__).with_name("network_programs.py")
    done = subprocess.run(
        [python, str(script), name, str(cells), str(steps)], capture_output=True, text=True
    )
    if done.returncode:
        raise RuntimeError(f"{name}: {done.stderr[-2000:]}")
    return json.loads(done.stdout)


def rise(pressure: np.ndarray, speed: float, flow: float, steady: float) -> np.ndarray:
    """Rise over that of Joukowsky's for heads in m."""
    return (np.asarray(pressure) - steady) / (speed * flow / (0.25 * np.pi * DIAMETER**2) / GRAVITY)


def difference(one: np.ndarray, other: np.ndarray, cells: int) -> float:
    """Root mean square difference of two rises, from the step after the closure, away from the
    fronts, which come after every 2 `cells` steps."""
    count = min(len(one), len(other))
    phase = np.arange(count) % (2 * cells)
    away = (phase > FRONT) & (phase < 2 * cells - FRONT)
    return float(np.sqrt(np.mean((one[:count] - other[:count])[away] ** 2)))


def run(quick: bool = False) -> Result:
    """Speed and agreement of the programs that are there."""
    cells, steps, rounds = (50, 400, 2) if quick else (LINE_CELLS, 8 * LINE_CELLS, 9)
    transient = simulate(our_line(cells, steps // 2, "steady"), periods=1)
    ours = transient.pressure[0, : steps // 2] / (WATER * GRAVITY)
    own_rise = rise(ours, WAVE_SPEED, FLOW, HEAD)
    rows, notes, agreement = [], [], []
    tasks = {
        "steady": our_steps(cells, steps, "steady"),
        "unsteady": our_steps(cells, steps, "unsteady"),
    }
    if find_spec("rthym_moc"):
        task, flow, speed = rthym(cells, steps)
        tasks["rthym-moc"] = task
        out = task()
        head = np.array(out["node_head"]["end"]) * FOOT
        agreement.append(("rthym-moc", difference(own_rise, rise(head, speed, flow, HEAD), cells)))
    else:
        notes.append("rthym-moc is not installed.")
    rates = {name: cells * steps / t for name, t in alternate(tasks, rounds).items()}
    small = (25, 100) if quick else (200, 800)
    for name, size in (("ptsnet", (cells, steps)), ("tsnet", small)):
        taken = [network_program(name, *size) for _ in range(1 if quick else 3)]
        if taken[0] is None:
            notes.append(f"{name} was not run: {NETWORK_PYTHON} names no Python that has it.")
            continue
        rates[name] = np.array([size[0] * size[1] / each["seconds"] for each in taken])
        found = taken[0]
        OTHER_VERSIONS[name] = found["version"]
        head = rise(found["head"], found["wave_speed"], found["flow"], HEAD)[1:]
        same = simulate(our_line(size[0], size[1], "steady"), periods=1).pressure[0, : size[1]]
        own = rise(same / (WATER * GRAVITY), WAVE_SPEED, FLOW, HEAD)
        agreement.append((name, difference(own, head, size[0])))
    steady = np.median(rates["steady"])
    limits = {friction: memory_limit(cells, friction) for friction in ARRAYS}
    for name, values in rates.items():
        label = f"rippletwin, {name} friction" if name in ("steady", "unsteady") else name
        differs = dict(agreement).get(name)
        rows.append(
            [
                label,
                f"{np.median(values):.2g}",
                f"{np.median(values) / steady:.3g}",
                "" if differs is None else f"{100 * differs:.2f} %",
            ]
        )
    worst = max((value for _, value in agreement), default=None)
    return Result(
        point=1,
        title="Line in the time domain",
        what=[
            f"A valve closes on one pipe of {cells} cells, which is the size of a pump's line of "
            f"9 m at 51.2 kHz, for {steps} steps; TSNet, the slowest, has {small[0]} cells and "
            f"{small[1]} steps. Time is that of the steps alone, without what is built before. "
            "PTSNET and TSNet run in processes of their own.",
            "The answers are compared as the rise of pressure at the valve over Joukowsky's, "
            "away from the wave fronts. The others round the wave speed to the grid and have "
            "turbulent friction; friction is small here.",
        ],
        claims=[
            Claim(
                "node-steps a second, steady friction, over rthym-moc",
                median_ratio(rates["steady"], rates["rthym-moc"]) if "rthym-moc" in rates else None,
                1.5,
            ),
            Claim(
                "node-steps a second, unsteady friction, over rthym-moc with steady friction",
                median_ratio(rates["unsteady"], rates["rthym-moc"])
                if "rthym-moc" in rates
                else None,
                None,
            ),
            Claim(
                "unsteady friction (ten terms) over steady friction",
                median_ratio(rates["unsteady"], rates["steady"]),
                0.4,
                note=f"bounded by memory bandwidth to {limits['unsteady'] / steady:.2g} times",
            ),
            Claim(
                "largest difference of the answers, of the Joukowsky rise",
                None if worst is None else 100 * worst,
                1.0,
                "%",
                at_least=False,
            ),
        ],
        tables=[
            Table(
                "Speed on one line",
                ["program", "node-steps a second", "over ours, steady", "difference of the answer"],
                rows,
            )
        ],
        bound=describe_bounds(limits, {name: float(np.median(rates[name])) for name in limits}),
        notes=notes,
    )


ARRAYS = {"steady": 4, "unsteady": 4 + 20 + 6}
"""Arrays of 8 bytes that a step must read or write at each node: two waves; with unsteady friction
also ten states, the flow, its change, and what friction remembers."""


def memory_limit(cells: int, friction: str) -> float:
    """Node-steps a second at which the caches move the arrays of so many cells."""
    size = 8 * ARRAYS[friction]
    return machine.copy_rate(cells * size // 2) / size


def describe_bounds(limits: dict[str, float], rates: dict[str, float]) -> list[str]:
    """How near the steps are to the rate at which the caches move their arrays."""
    sentences = []
    for friction, limit in limits.items():
        size = 8 * ARRAYS[friction]
        sentences.append(
            f"With {friction} friction a step moves at least {size} bytes a node. Copying "
            f"arrays of the same size moves {limit * size / 1e9:.0f} GB/s, which bounds the steps "
            f"to {limit:.2g} node-steps a second; {rates[friction] / limit:.0%} of that is reached."
        )
    return sentences
