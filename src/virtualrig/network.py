"""Pipes and nodes in engineering terms, and their tables for the time stepper."""

from dataclasses import dataclass

import numpy as np

from virtualrig import multistep, node_elements, waves
from virtualrig.profile import steady_mode, velocity_modes
from virtualrig.spectral_element import derivative, interpolation, lobatto


@dataclass(frozen=True)
class Pipe:
    """A uniform pipe from node `start` to node `end` (SI units).

    `wave_speed` holds with the wall's fast elasticity and without air. `wall` is (relative
    compliance, retardation time) of a Kelvin-Voigt element: the shunt admittance is that of an
    elastic pipe times 1 + compliance/(1 + s time). `air` is (volume fraction at one atmosphere,
    polytropic exponent). `stiffening` is the relative growth of rho a^2 per Pa above
    `reference` Pa. `drag` adds drag * q |q| to -q_t (rough turbulent flow: f/(2 D A)). `viscosity`,
    m2/s, is the network's unless it is given: the liquid may be warmer here than elsewhere.
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
    viscosity: float | None = None


@dataclass(frozen=True)
class Node:
    """Elements between a node and the tank; names are those of the node table."""

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

    `sensors` are (pipe, distance from its start). `frequency` is the highest at which waves are
    to be resolved with `points` nodes a wavelength; `modes` the number of velocity modes of
    unsteady friction.
    """

    pipes: tuple[Pipe, ...]
    nodes: tuple[Node, ...]
    sensors: tuple[tuple[int, float], ...]
    density: float
    viscosity: float
    frequency: float = 6000.0
    points: float = 7.0
    degree: int = 5
    modes: int = 10


def element_counts(network: Network) -> list[int]:
    """Number of spectral elements of each pipe."""
    per_metre = network.frequency * network.points / network.degree
    return [max(1, int(np.ceil(p.length * per_metre / p.wave_speed))) for p in network.pipes]


def largest_step(network: Network) -> float:
    """Four fifths of the greatest stable time step, s.

    SBDF4 with upwind fluxes is stable up to 0.048, 0.035, 0.026, 0.021 of a wave's transit time
    through an element for degrees 4 to 7 (eigenvalues of a periodic pipe).
    """
    share = 0.028 * (5 / network.degree) ** 1.5
    counts = element_counts(network)
    return min(
        share * p.length / count / p.wave_speed
        for p, count in zip(network.pipes, counts, strict=True)
    )


def discretise(network: Network, dt: float) -> waves.Line:
    """The pipes divided into spectral elements, for time steps of `dt` s."""
    _, weights = lobatto(network.degree)
    counts = element_counts(network)
    last = np.cumsum(counts) - 1
    rho = network.density

    def each(value) -> np.ndarray:
        """A pipe's value (or column of values), repeated for its elements; element axis last."""
        per_pipe = np.array([value(pipe) for pipe in network.pipes], dtype=float)
        return np.ascontiguousarray(np.repeat(per_pipe, counts, axis=0).T)

    def at_nodes(values) -> np.ndarray:
        """(modes, E) repeated for the nodes of an element: (modes, n, E)."""
        return np.repeat(values[:, None], network.degree + 1, axis=1)

    width = np.repeat([p.length / c for p, c in zip(network.pipes, counts, strict=True)], counts)
    area = each(lambda p: np.pi / 4 * p.diameter**2)
    speed = each(lambda p: p.wave_speed)
    gains = 1 / (multistep.LEAD + dt * each(lambda p: _modes(network, p)[0]))
    wall, air = each(lambda p: p.wall or (0.0, 1.0)), each(lambda p: p.air or (0.0, 1.0))
    growth, drag = each(lambda p: p.stiffening), each(lambda p: p.drag)
    return waves.Line(
        derivative=derivative(lobatto(network.degree)[0]),
        lift=1 / weights[0],
        inflow=-2 / width * rho * speed**2 / area,
        push=-2 / width * area / rho,
        impedance=rho * speed / area,
        gains=at_nodes(gains),
        pushes=at_nodes(dt * gains * each(lambda p: _modes(network, p)[1])),
        walled=bool(wall[0].any()),
        wall=wall,
        uneven=np.flatnonzero((air[0] != 0) | (growth != 0) | (drag != 0)),
        air=air,
        modulus=np.array([rho * speed**2, growth, each(lambda p: p.reference)]),
        drag=drag,
        first=np.concatenate([[0], last[:-1] + 1]),
        last=last,
        start=np.array([pipe.start for pipe in network.pipes]),
        end=np.array([pipe.end for pipe in network.pipes]),
    )


def _modes(network: Network, pipe: Pipe) -> tuple[np.ndarray, np.ndarray]:
    """Decay rates, 1/s, and weights (modes,) of a pipe's velocity modes; zero weights for unused
    ones.
    """
    if pipe.friction == "unsteady":
        rates, weights = velocity_modes(network.modes)
    else:
        rates, weights = steady_mode()
        if pipe.friction == "none":
            rates = 0 * rates
        if any(other.friction == "unsteady" for other in network.pipes):
            unused = network.modes - 1
            rates, weights = np.pad(rates, (0, unused)), np.pad(weights, (0, unused))
    viscosity = network.viscosity if pipe.viscosity is None else pipe.viscosity
    return rates * viscosity / (pipe.diameter / 2) ** 2, weights


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


def sensor_rows(network: Network) -> tuple[np.ndarray, np.ndarray]:
    """Element of each sensor, and the interpolation row (sensors, n) in it."""
    nodes, _ = lobatto(network.degree)
    counts = element_counts(network)
    indices, rows = [], []
    for pipe, position in network.sensors:
        share = position / network.pipes[pipe].length * counts[pipe]
        inside = min(int(share), counts[pipe] - 1)
        indices.append(sum(counts[:pipe]) + inside)
        rows.append(interpolation(nodes, 2 * (share - inside) - 1)[0])
    return np.array(indices), np.array(rows)


def state_at_rest(network: Network, line: waves.Line, pressure: float, flow: float, pistons: int):
    """A steady state: `pressure` (Pa) everywhere, `flow` (m3/s) through the pipes to the load; the
    pipe before a load without an orifice in `network` starts without flow.

    Chambers start at `pressure`; pipes that end at a node without an outlet carry no flow.
    """
    n, count = network.degree + 1, len(line.inflow)
    through = np.zeros(count)
    leaving = {pipe.start for pipe in network.pipes}
    for k, pipe in enumerate(network.pipes):
        end = network.nodes[pipe.end]
        if pipe.end in leaving or end.orifice > 0 or end.leak > 0:
            through[line.first[k] : line.last[k] + 1] = flow
    share = line.pushes / line.pushes.sum(axis=0) * through
    table = node_table(network)
    node = np.zeros((multistep.DEPTH, node_elements.NODE_STATES, len(network.nodes)))
    node[:, node_elements.STORED] = table[:, node_elements.VOLUME] * pressure
    gas = table[:, node_elements.GAS_VOLUME]
    ratio = table[:, node_elements.GAS_PRESSURE] / (pressure + node_elements.ATMOSPHERE)
    node[:, node_elements.STORED] -= gas * ratio ** (1 / table[:, node_elements.GAS_EXPONENT])
    arm = table[:, node_elements.ARM_STIFFNESS] > 0
    node[:, node_elements.ARM_VOLUME, arm] = pressure / table[arm, node_elements.ARM_STIFFNESS]
    return waves.State(
        pressure=np.full((multistep.DEPTH, n, count), pressure),
        modes=np.repeat(share[:, None], multistep.DEPTH, axis=1),
        flow=np.repeat(through[None], n, axis=0).copy(),
        strain=np.full((multistep.DEPTH, n, count), pressure),
        pressure_rate=np.zeros((multistep.DEPTH, n, count)),
        flow_drive=np.zeros((multistep.DEPTH, n, count)),
        node_pressure=np.full(len(network.nodes), pressure),
        node=node,
        chamber=np.full((multistep.DEPTH, pistons), pressure),
        chamber_pressure=np.full(pistons, pressure),
    )
