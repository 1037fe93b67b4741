"""Periodic steady state of a line in the frequency domain, against characteristics and openwind."""

from __future__ import annotations

from importlib.util import find_spec

import numpy as np

from rippletwin.harmonics import one_period
from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine
from rippletwin.line.frequency_domain.orifice_load import OrificeLoad
from rippletwin.line.frequency_domain.pipe_immittance import series_impedance, shunt_admittance
from rippletwin.line.time_domain.line_elements import End, Pipe, TimeDomainLine
from rippletwin.line.time_domain.method_of_characteristics import simulate, steps_a_period
from rippletwin.twin.effects.thermal_boundary_layer import thermal_factor
from speed.result import Claim, Result, Table
from speed.timing import alternate, in_words, median_ratio

OIL = {"density": 870.0, "viscosity": 3.2e-5}
PIPES = (Pipe(5.953, 0.01971, 1022.9), Pipe(1.144, 0.02307, 982.7), Pipe(1.675, 0.01486, 1308.4))
POSITIONS = (0.4167, 2.5895, 8.0)  # m from the pump
SHAFT_HZ, PISTONS = 1000 / 60, 9
MEAN_FLOW, MEAN_PRESSURE = 0.7e-3, 9.484e6  # m3/s, Pa
HIGHEST_HZ = 5000.0
SAMPLING_HZ = 51200.0
TOLERANCE = 1e-3
"""Of both methods: change of the pressure from one revolution to the next over its rms; change of
the load's pressure from one pass of the orifice to the next over its largest harmonic."""
TUBE = ((0.30, 8e-3), (0.20, 5e-3), (0.25, 7e-3))  # length and radius, m
TEMPERATURE = 20.0


def source(orders: np.ndarray) -> np.ndarray:
    """Flow harmonics (F,) of a pump with one faulty piston: all shaft orders."""
    s = 2j * np.pi * SHAFT_HZ * orders
    size = np.where(orders % PISTONS == 0, 0.05, 0.01)
    return size * MEAN_FLOW * np.exp(1j * orders) / (1 + s / 6000) ** 2


def network(orders: np.ndarray) -> FrequencyDomainLine:
    """The line at shaft `orders`, with unsteady friction and the linearised orifice."""
    s = 2j * np.pi * SHAFT_HZ * orders
    diameter = np.array([p.diameter for p in PIPES])[:, None]
    speed = np.array([p.wave_speed for p in PIPES])[:, None]
    return FrequencyDomainLine(
        s=s,
        lengths=np.array([p.length for p in PIPES]),
        series=series_impedance(s, **OIL, diameter=diameter, friction="unsteady"),
        shunt=shunt_admittance(s, density=OIL["density"], wave_speed=speed, diameter=diameter),
        source_flow=source(orders),
        load=("admittance", MEAN_FLOW / (2 * MEAN_PRESSURE) + 0 * s),
        sensor_positions=POSITIONS,
    )


def solve(orders: np.ndarray) -> np.ndarray:
    """Readings (S, F) with the orifice at full amplitude, everything calculated anew."""
    line = network(orders)
    load = OrificeLoad(
        [slice(0, len(orders))],
        orders,
        np.array([MEAN_PRESSURE]),
        np.array([MEAN_FLOW / np.sqrt(MEAN_PRESSURE)]),
    )

    def solve_load(a, b, c):
        return load.solve(a, b, c, line.load[1], 1.0, tolerance=TOLERANCE)

    return line.balance_load(solve_load).readings


def characteristics(steps: int) -> TimeDomainLine:
    """The same line in the time domain, driven by all orders that it can carry."""
    orders = np.arange(1, int(HIGHEST_HZ / SHAFT_HZ) + 1)
    return TimeDomainLine(
        list(PIPES),
        MEAN_FLOW + one_period(source(orders), steps, orders),
        1 / SHAFT_HZ,
        End("orifice", 0.0, MEAN_FLOW / np.sqrt(MEAN_PRESSURE)),
        **OIL,
        friction="unsteady",
        positions=POSITIONS,
    )


def relative(one: np.ndarray, other: np.ndarray) -> float:
    """Norm of the difference over that of the other."""
    return float(np.linalg.norm(one - other) / np.linalg.norm(other))


def tube(fluid: dict, frequency_hz: np.ndarray) -> np.ndarray:
    """Input impedance (F,) of the open air tube with both boundary layers."""
    s = 2j * np.pi * frequency_hz
    diameter = np.array([2 * radius for _, radius in TUBE])[:, None]
    pipe = {"density": fluid["rho"], "diameter": diameter}
    viscosity = fluid["mu"] / fluid["rho"]
    prandtl = fluid["mu"] * fluid["Cp"] / fluid["kappa"]
    series = series_impedance(s, viscosity=viscosity, friction="unsteady", **pipe)
    shunt = shunt_admittance(s, wave_speed=fluid["c"], **pipe)
    shunt = shunt * thermal_factor(s, viscosity, diameter, fluid["gamma"], prandtl)
    line = FrequencyDomainLine(
        s=s,
        lengths=np.array([length for length, _ in TUBE]),
        series=series,
        shunt=shunt,
        load=("open", None),
    )
    return line.input_impedance()


def openwind_tube(method: str, frequency_hz: np.ndarray):
    """The same tube in openwind; `recompute_impedance_at` leaves out what is built before."""
    import openwind

    ends = np.cumsum([0.0, *(length for length, _ in TUBE)])
    bore = [
        [float(a), float(b), radius, radius, "linear"]
        for a, b, (_, radius) in zip(ends, ends[1:], TUBE)
    ]
    return openwind.ImpedanceComputation(
        frequency_hz,
        bore,
        temperature=TEMPERATURE,
        humidity=0.0,
        losses=True,
        discontinuity_mass=False,
        radiation_category="perfectly_open",
        compute_method=method,
    )


def openwind_air() -> dict:
    """Constants of air as openwind has them."""
    import openwind

    names = ("rho", "c", "mu", "Cp", "kappa", "gamma")
    physics = openwind.continuous.Physics(TEMPERATURE, humidity=0.0)
    return dict(zip(names, map(float, physics.get_coefs(0.0, *names))))


def run(quick: bool = False) -> Result:
    """Time and agreement of both comparisons."""
    rounds = 1 if quick else 7
    least = int(SAMPLING_HZ / SHAFT_HZ) // (4 if quick else 1)
    steps = steps_a_period(PIPES, 1 / SHAFT_HZ, least)
    below = np.arange(1, int(HIGHEST_HZ / SHAFT_HZ) + 1)
    line = characteristics(steps)
    transient = simulate(line, 60, TOLERANCE)
    exact = solve(below)
    times = alternate(
        {
            "frequency": lambda: solve(below),
            "pistons": lambda: solve(below[PISTONS - 1 :: PISTONS]),
            "time": lambda: simulate(line, 60, TOLERANCE),
        },
        rounds,
    )
    middle = {name: float(np.median(values)) for name, values in times.items()}
    agreement = relative(transient.harmonics(below), exact)
    claims = [
        Claim(
            "time of characteristics over that of the frequency domain",
            median_ratio(times["time"], times["frequency"]),
            100.0,
            note="both methods are this tool's",
        ),
        Claim("difference of the readings below 5 kHz", 100 * agreement, 0.5, "%", False),
    ]
    rows = [
        [f"frequency domain, {len(below)} shaft orders", in_words(middle["frequency"]), "1"],
        [
            f"frequency domain, {len(below) // PISTONS} piston orders",
            in_words(middle["pistons"]),
            f"{middle['pistons'] / middle['frequency']:.2g}",
        ],
        [
            f"characteristics, {steps} steps a revolution, {transient.periods} revolutions",
            in_words(middle["time"]),
            f"{middle['time'] / middle['frequency']:.0f}",
        ],
    ]
    tables = [Table("Line with orifice", ["method", "time", "over the first"], rows)]
    notes = []
    if find_spec("openwind"):
        more, table = compare_tube(rounds, quick)
        claims += more
        tables.append(table)
    else:
        notes.append("openwind is not installed.")
    return Result(
        point=2,
        title="Periodic steady state and impedance",
        what=[
            "A line of three segments with unsteady friction and an orifice at full amplitude is "
            f"driven by a faulty pump's flow up to {HIGHEST_HZ:.0f} Hz. Characteristics start from "
            f"the steady flow and end when a revolution changes the pressure by less than "
            f"{TOLERANCE:g} of its rms; the orifice's passes end when one changes the pressure as "
            "little.",
            "The tube is three air-filled cylinders with viscous and thermal boundary layers, open "
            "at the end. openwind's time is that of its solution alone; ours has everything in it.",
        ],
        claims=claims,
        tables=tables,
        bound=bound(below, middle["frequency"]),
        notes=notes,
    )


def compare_tube(rounds: int, quick: bool) -> tuple[list[Claim], Table]:
    """Claims and table of the impedance of a tube."""
    frequency = np.linspace(20.0, 5000.0, 100 if quick else 1000)
    air = openwind_air()
    ours = tube(air, frequency)
    tasks = {"rippletwin": lambda: tube(air, frequency)}
    off = {}
    for method in ("TMM", "FEM"):
        solver = openwind_tube(method, frequency)
        theirs = solver.impedance
        off[method] = relative(ours, theirs)
        tasks[method] = lambda solver=solver: solver.recompute_impedance_at(frequency)
    times = alternate(tasks, rounds)
    words = {"TMM": "transfer matrices", "FEM": "finite elements"}
    claims = [
        Claim(f"impedance of a tube: difference from openwind's {words[m]}", v, 1e-3, "", False)
        for m, v in off.items()
    ] + [
        Claim(
            f"impedance of a tube: time of openwind's {words[m]} over ours",
            median_ratio(times[m], times["rippletwin"]),
            None,
        )
        for m in off
    ]
    rows = [["rippletwin", in_words(np.median(times["rippletwin"])), ""]] + [
        [f"openwind, {words[m]}", in_words(np.median(times[m])), f"{off[m]:.1e}"] for m in off
    ]
    caption = f"Input impedance of a tube at {len(frequency)} frequencies"
    return claims, Table(caption, ["program", "time", "difference"], rows)


def bound(orders: np.ndarray, seconds: float) -> list[str]:
    """Which share of the time the parts of the solution take that cannot be left out."""
    s = 2j * np.pi * SHAFT_HZ * orders
    diameter = np.array([p.diameter for p in PIPES])[:, None]
    line = network(orders)
    parts = alternate(
        {
            "friction": lambda: series_impedance(s, **OIL, diameter=diameter),
            "sweep": lambda: line.balance_load(lambda a, b, c: (c / a, 0.0 * b)),
        },
        5,
    )
    friction, sweep = (float(np.median(parts[name])) for name in ("friction", "sweep"))
    return [
        f"Of {in_words(seconds)} for {len(orders)} frequencies, friction (a continued fraction at "
        f"each frequency and segment) takes {100 * friction / seconds:.0f} %, the sweep along the "
        f"line {100 * sweep / seconds:.0f} %, and the orifice (a transform each way and pass) "
        "the rest."
    ]
