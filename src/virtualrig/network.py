"""Pipes and nodes in engineering terms, and the numbers the time stepper makes of them."""

from dataclasses import dataclass, field

import numpy as np

from virtualrig import stepper
from virtualrig.profile import steady_mode, velocity_modes
from virtualrig.spectral_element import derivative, interpolation, lobatto


@dataclass(frozen=True)
class Pipe:
    """A uniform pipe from node `start` to node `end` (SI units).

    `wave_speed` holds with the wall's fast elasticity and without air. `wall` is (relative compliance,
    retardation time) of a Kelvin-Voigt element: the shunt admittance is that of an elastic pipe times
    1 + compliance/(1 + s time). `air` is (volume fraction at one atmosphere, polytropic exponent).
    `stiffening` is the relative growth of rho a^2 per Pa above `reference` Pa. `drag` adds
    drag * q |q| to -q_t (rough turbulent flow: f/(2 D A)).
    """

    length: float
    diameter: float
    wave_speed: float
    start: int
    end: int
    friction: str = "unsteady"
    wall: tuple[float, float] | None = None
    air: tuple[float, float] | None = None
    stiffening: float = 0.0
    reference: float = 0.0
    drag: float = 0.0


@dataclass(frozen=True)
class Node:
    """Elements between a node and the tank; names are those of the stepper's node table."""

    volume: float = 0.0
    gas_volume: float = 0.0
    gas_pressure: float = 1.0
    gas_exponent: float = 1.4
    leak: float = 0.0
    orifice: float = 0.0
    tank: float = 0.0
    arm_inertance: float = 0.0
    arm_resistance: float = 0.0
    arm_stiffness: float = 0.0
    valve_gain: float = 0.0
    valve_inertia: float = 0.0
    valve_lag: float = 0.0
    valve_set: float = 1.0


@dataclass(frozen=True)
class Network:
    """Pipes between nodes, filled with one liquid. Node 0 is the pump's outlet.

    `sensors` are (pipe, distance from its start). `frequency` is the highest at which waves are to be
    resolved with `points` nodes a wavelength; `modes` the number of velocity modes of unsteady friction.
    """

    pipes: tuple[Pipe, ...]
    nodes: tuple[Node, ...]
    sensors: tuple[tuple[int, float], ...]
    density: float
    viscosity: float
    frequency: float = 6000.0
    points: float = 8.0
    degree: int = 5
    modes: int = 8
    _cache: dict = field(default_factory=dict, repr=False, compare=False)


def line(network: Network) -> tuple[stepper.Line, float]:
    """The pipes cut into spectral elements, and the greatest stable time step, s."""
    nodes, weights = lobatto(network.degree)
    per_element = {name: [] for name in ("slope", "stiffness", "mobility", "impedance", "drag")}
    rates, shares, wall, air, modulus, first, last = [], [], [], [], [], [], []
    largest_step, at = np.inf, 0
    rho, nu = network.density, network.viscosity
    for pipe in network.pipes:
        area = np.pi / 4 * pipe.diameter**2
        wanted = pipe.length * network.frequency * network.points / pipe.wave_speed
        count = max(1, int(np.ceil(wanted / network.degree)))
        width = pipe.length / count
        # SBDF3's limit for degree 5 with upwind fluxes is 0.046 widths; other degrees scale roughly
        largest_step = min(
            largest_step, 0.04 * (5 / network.degree) ** 1.6 * width / pipe.wave_speed
        )
        first.append(at)
        at += count
        last.append(at - 1)
        values = {
            "slope": 2 / width,
            "stiffness": rho * pipe.wave_speed**2 / area,
            "mobility": area / rho,
            "impedance": rho * pipe.wave_speed / area,
            "drag": pipe.drag,
        }
        for name, value in values.items():
            per_element[name] += [value] * count
        rate, share = steady_mode()
        if pipe.friction == "unsteady":
            rate, share = velocity_modes(network.modes)
        elif pipe.friction == "none":
            rate = 0 * rate
        padding = network.modes - len(rate)
        rate = np.pad(rate * nu / (pipe.diameter / 2) ** 2, (0, padding), constant_values=1.0)
        rates += [rate] * count
        shares += [np.pad(share, (0, padding))] * count
        wall += [pipe.wall or (0.0, 1.0)] * count
        air += [pipe.air or (0.0, 1.0)] * count
        modulus += [(rho * pipe.wave_speed**2, pipe.stiffening, pipe.reference)] * count
    keep = max(int(np.any(np.array(shares) > 0, axis=0).sum()), 1)
    array = {name: np.array(values) for name, values in per_element.items()}
    return (
        stepper.Line(
            derivative=derivative(nodes),
            lift=1 / weights[0],
            rates=np.ascontiguousarray(np.array(rates).T[:keep]),
            weights=np.ascontiguousarray(np.array(shares).T[:keep]),
            wall=np.array(wall, dtype=float).T.copy(),
            air=np.array(air, dtype=float).T.copy(),
            modulus=np.array(modulus).T.copy(),
            first=np.array(first),
            last=np.array(last),
            start=np.array([pipe.start for pipe in network.pipes]),
            end=np.array([pipe.end for pipe in network.pipes]),
            **array,
        ),
        largest_step,
    )


def node_table(network: Network) -> np.ndarray:
    """(nodes, NODE_COLUMNS) for the stepper."""
    return np.array(
        [
            [
                node.volume, node.gas_volume, node.gas_pressure, node.gas_exponent, node.leak,
                node.orifice, node.tank, node.arm_inertance, node.arm_resistance,
                node.arm_stiffness, node.valve_gain, node.valve_inertia, node.valve_lag,
                node.valve_set,
            ]
            for node in network.nodes
        ],
        dtype=float,
    )  # fmt: skip


def sensor_rows(network: Network, cut: stepper.Line) -> tuple[np.ndarray, np.ndarray]:
    """Element of each sensor, and the interpolation row (sensors, n) in it."""
    nodes, _ = lobatto(network.degree)
    elements, rows = [], []
    for pipe, position in network.sensors:
        count = cut.last[pipe] - cut.first[pipe] + 1
        share = position / network.pipes[pipe].length * count
        inside = min(int(share), count - 1)
        elements.append(cut.first[pipe] + inside)
        rows.append(interpolation(nodes, 2 * (share - inside) - 1)[0])
    return np.array(elements), np.array(rows)


def still(network: Network, cut: stepper.Line, pressure: float, flow: float, pistons: int):
    """A state at rest in time: `pressure` everywhere, `flow` through the pipes that lead to the load.

    Chambers start at `pressure`; dead-end pipes (whose end node has no way out) carry no flow.
    """
    n, count = network.degree + 1, len(cut.slope)
    modes = cut.rates.shape[0]
    through = np.zeros(count)
    leaving = {pipe.start for pipe in network.pipes}
    for k, pipe in enumerate(network.pipes):
        end = network.nodes[pipe.end]
        if pipe.end in leaving or end.orifice > 0 or end.leak > 0:
            through[cut.first[k] : cut.last[k] + 1] = flow
    # steady shares of the modes: weight/rate
    share = cut.weights / np.where(cut.rates > 0, cut.rates, 1.0)
    share = share / share.sum(axis=0) * through
    table = node_table(network)
    node = np.zeros((3, stepper.NODE_STATES, len(network.nodes)))
    node[:, stepper.STORED] = table[:, stepper.VOLUME] * pressure
    gas = table[:, stepper.GAS_VOLUME]
    exponent = 1 / table[:, stepper.GAS_EXPONENT]
    node[:, stepper.STORED] -= gas * (table[:, stepper.GAS_PRESSURE] / pressure) ** exponent
    arm = table[:, stepper.ARM_STIFFNESS] > 0
    node[:, stepper.ARM_VOLUME, arm] = pressure / table[arm, stepper.ARM_STIFFNESS]
    return stepper.State(
        pressure=np.full((3, n, count), pressure),
        modes=np.repeat(np.repeat(share[None, :, None], n, axis=2), 3, axis=0).copy(),
        flow=np.repeat(through[None], n, axis=0).copy(),
        strain=np.full((3, n, count), pressure),
        pressure_rate=np.zeros((3, n, count)),
        flow_drive=np.zeros((3, n, count)),
        node_pressure=np.full(len(network.nodes), pressure),
        node=node,
        chamber=np.full((3, pistons), pressure),
    )
