"""Time stepping of pump, pipes and nodes: a semi-implicit multistep method over spectral elements.

Pipes: p_t = -(rho a^2/A) q_x, q = sum of velocity modes q_k with q_k' = -(A/rho) w_k p_x -
lambda_k q_k (virtualrig.profile), discretised in space by the discontinuous Galerkin method on
Lobatto nodes with upwind (characteristic) fluxes between elements (Hesthaven, Warburton, Nodal
Discontinuous Galerkin Methods, 2008). Time: SBDF4 (Ascher, Ruuth, Wetton, SIAM J. Numer. Anal.
32, 1995): waves explicit; friction, chambers and everything at the nodes implicit. Where pipes
meet, the outgoing characteristics of the new step and the node's elements settle the node's
pressure together, so that no volume is lost.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from virtualrig.pump import crank as stations_at
from virtualrig.pump import orifice_flow, step_chambers

# columns of the node table; flows leave the node, pressures in Pa
(
    VOLUME,  # compliance of a volume, m3/Pa
    GAS_VOLUME,  # accumulator: gas volume at GAS_PRESSURE, polytropic exponent GAS_EXPONENT
    GAS_PRESSURE,
    GAS_EXPONENT,
    LEAK,  # conductance to the tank, m3/s/Pa
    ORIFICE,  # square-law orifice to the tank, m3/s/Pa^0.5
    TANK,  # pressure behind LEAK, Pa
    ARM_INERTANCE,  # series inertance, resistance, stiffness (1/compliance) of a resonant side arm
    ARM_RESISTANCE,
    ARM_STIFFNESS,
    VALVE_GAIN,  # orifice opening 1 + y with y''/w^2 + y' VALVE_LAG + y = gain (p/VALVE_SET - 1)
    VALVE_INERTIA,  # 1/w^2, s2
    VALVE_LAG,  # s
    VALVE_SET,
    NODE_COLUMNS,
) = range(15)
# rows of a node's state: stored volume, arm flow, arm volume, valve opening, valve speed
STORED, ARM_FLOW, ARM_VOLUME, VALVE, VALVE_SPEED, NODE_STATES = range(6)


ATMOSPHERE = 1.01325e5
DEPTH = 4
LEAD = 25 / 12
"""First coefficient of BDF4."""


class Line(NamedTuple):
    """Pipes cut into E elements of n nodes; K velocity modes. Constants of the time step."""

    derivative: np.ndarray  # (n, n)
    lift: float  # 1/first quadrature weight
    inflow: np.ndarray  # (E,) -2/width rho a^2/A: pressure rate of a flow's derivative
    push: np.ndarray  # (E,) -2/width A/rho: flow rate of a pressure's derivative
    impedance: np.ndarray  # (E,) rho a/A
    gains: np.ndarray  # (K, n, E) 1/(LEAD + dt rate) of the velocity modes
    pushes: np.ndarray  # (K, n, E) dt weight gain
    special: bool  # any wall, air, growing modulus or drag
    wall: np.ndarray  # (2, E) relative compliance and retardation time of the wall
    air: np.ndarray  # (2, E) air fraction at one atmosphere and polytropic exponent
    modulus: np.ndarray  # (3, E) rho a^2, its relative growth per Pa, reference pressure
    drag: np.ndarray  # (E,) q' = ... - drag q |q|
    first: np.ndarray  # (pipes,) first element
    last: np.ndarray
    start: np.ndarray  # (pipes,) node at the start
    end: np.ndarray


class State(NamedTuple):
    """Everything that evolves, four steps deep: a ring of steps."""

    pressure: np.ndarray  # (4, n, E)
    modes: np.ndarray  # (K, 4, n, E) flow of each velocity mode
    flow: np.ndarray  # (n, E) their sum
    strain: np.ndarray  # (4, n, E) retarded wall strain, as a pressure
    pressure_rate: np.ndarray  # (4, n, E)
    flow_drive: np.ndarray  # (4, n, E)
    node_pressure: np.ndarray  # (nodes,)
    node: np.ndarray  # (4, NODE_STATES, nodes)
    chamber: np.ndarray  # (4, pistons)


@njit(cache=True, fastmath=True)
def _rates(line, state, now, flux_p, flux_q):
    """Right-hand sides of the waves at step `now`; flux_* (2, E) are the settled end values.

    Inner loops touch few arrays at a time, so that the compiler vectorises them.
    """
    n, elements = state.flow.shape
    p, q = state.pressure[now], state.flow
    dp, dq = state.pressure_rate[now], state.flow_drive[now]
    np.dot(line.derivative, q, dp)
    np.dot(line.derivative, p, dq)
    for e in range(elements):
        dp[0, e] -= line.lift * (flux_q[0, e] - q[0, e])
        dq[0, e] -= line.lift * (flux_p[0, e] - p[0, e])
        dp[n - 1, e] += line.lift * (flux_q[1, e] - q[n - 1, e])
        dq[n - 1, e] += line.lift * (flux_p[1, e] - p[n - 1, e])
    for i in range(n):
        row = dp[i]
        for e in range(elements):
            row[e] *= line.inflow[e]
        row = dq[i]
        for e in range(elements):
            row[e] *= line.push[e]
    if line.special:
        _special_rates(line, p, q, state.strain[now], dp, dq)


@njit(cache=True, fastmath=True)
def _special_rates(line, p, q, strain, dp, dq):
    """Retarded wall, gas, stiffening liquid and turbulent drag, where there are any."""
    n, elements = p.shape
    for e in range(elements):
        wall, air, growth, drag = line.wall[0, e], line.air[0, e], line.modulus[1, e], line.drag[e]
        if wall == 0 and air == 0 and growth == 0 and drag == 0:
            continue
        for i in range(n):
            dp[i, e] -= wall / line.wall[1, e] * (p[i, e] - strain[i, e])
            softness = 1 / (1 + growth * (p[i, e] - line.modulus[2, e]))
            if air > 0:
                absolute = max(p[i, e], 0.0) + ATMOSPHERE
                exponent = 1 / line.air[1, e]
                gas = air * exponent * (ATMOSPHERE / absolute) ** exponent / absolute
                softness += line.modulus[0, e] * gas
            dp[i, e] /= softness
            dq[i, e] -= drag * q[i, e] * abs(q[i, e])


@njit(cache=True, fastmath=True)
def _extrapolate(rates, ring):
    """The oldest of four (.., n, E) rates becomes their extrapolation to the next step."""
    r0, r1 = rates[ring[0]].reshape(-1), rates[ring[1]].reshape(-1)
    r2, r3 = rates[ring[2]].reshape(-1), rates[ring[3]].reshape(-1)
    for i in range(len(r3)):
        r3[i] = 4 * (r0[i] + r2[i]) - 6 * r1[i] - r3[i]


@njit(cache=True, fastmath=True)
def _remember(past, ring):
    """The oldest of four becomes what BDF4 takes from them all: LEAD x - out = dt dx/dt."""
    x0, x1 = past[ring[0]].reshape(-1), past[ring[1]].reshape(-1)
    x2, x3 = past[ring[2]].reshape(-1), past[ring[3]].reshape(-1)
    third = 1 / 3
    for i in range(len(x3)):
        x3[i] = 4 * (x0[i] + third * x2[i]) - 3 * x1[i] - 0.25 * x3[i]


@njit(cache=True, fastmath=True)
def _advance(line, state, ring, dt):
    """Fields of the next step, written over the oldest one (index ring[3])."""
    n, elements = state.flow.shape
    _extrapolate(state.pressure_rate, ring)
    _extrapolate(state.flow_drive, ring)
    _remember(state.pressure, ring)
    p = state.pressure[ring[3]].reshape(-1)
    rate = state.pressure_rate[ring[3]].reshape(-1)
    for i in range(len(p)):
        p[i] = (p[i] + dt * rate[i]) / LEAD
    drive, total = state.flow_drive[ring[3]].reshape(-1), state.flow.reshape(-1)
    total[:] = 0.0
    for k in range(line.gains.shape[0]):
        gain, push = line.gains[k].reshape(-1), line.pushes[k].reshape(-1)
        _remember(state.modes[k], ring)
        mode = state.modes[k, ring[3]].reshape(-1)
        for i in range(len(total)):
            mode[i] = gain[i] * mode[i] + push[i] * drive[i]
            total[i] += mode[i]
    if line.special:
        _remember(state.strain, ring)
        for e in range(elements):
            pull = dt / line.wall[1, e]
            for i in range(n):
                bent = state.strain[ring[3], i, e] + pull * state.pressure[ring[3], i, e]
                state.strain[ring[3], i, e] = bent / (LEAD + pull)


@njit(cache=True)
def _settle_node(table, history, state, lead, wave_in, wave_lead, guess):
    """Pressure of one node: waves (and source) in, elements out. Updates the node's states."""
    arm = table[ARM_INERTANCE] > 0
    valve = table[VALVE_GAIN] != 0
    # implicit side arm: flow = arm_0 + arm_1 p;  implicit valve: opening = open_0 + open_1 p
    arm_0 = arm_1 = open_1 = 0.0
    open_0 = 1.0
    if arm:
        inertia = table[ARM_INERTANCE] * lead + table[ARM_RESISTANCE] + table[ARM_STIFFNESS] / lead
        arm_0 = table[ARM_INERTANCE] * history[ARM_FLOW]
        arm_0 = (arm_0 - table[ARM_STIFFNESS] / lead * history[ARM_VOLUME]) / inertia
        arm_1 = 1 / inertia
    if valve:
        stiff = table[VALVE_INERTIA] * lead * lead + table[VALVE_LAG] * lead + 1
        open_0 = table[VALVE_INERTIA] * (lead * history[VALVE] + history[VALVE_SPEED])
        open_0 = (open_0 + table[VALVE_LAG] * history[VALVE] - table[VALVE_GAIN]) / stiff
        open_1 = table[VALVE_GAIN] / table[VALVE_SET] / stiff
        open_0 += 1
    p = guess
    for _ in range(50):
        stored, compliance = table[VOLUME] * p, table[VOLUME]
        if table[GAS_VOLUME] > 0:
            gas = table[GAS_VOLUME] * (table[GAS_PRESSURE] / p) ** (1 / table[GAS_EXPONENT])
            stored -= gas
            compliance += gas / (p * table[GAS_EXPONENT])
        root, slope = orifice_flow(p, 1e3)
        opening = open_0 + open_1 * p
        out = table[LEAK] * (p - table[TANK]) + table[ORIFICE] * opening * root
        out += arm_0 + arm_1 * p + lead * stored - history[STORED]
        tangent = table[LEAK] + table[ORIFICE] * (opening * slope + open_1 * root)
        tangent += arm_1 + lead * compliance + wave_lead
        change = (wave_in - wave_lead * p - out) / tangent
        p += change
        if abs(change) < 1e-3:
            break
    state[STORED] = table[VOLUME] * p
    if table[GAS_VOLUME] > 0:
        state[STORED] -= table[GAS_VOLUME] * (table[GAS_PRESSURE] / p) ** (1 / table[GAS_EXPONENT])
    state[ARM_FLOW] = arm_0 + arm_1 * p
    state[ARM_VOLUME] = (history[ARM_VOLUME] + state[ARM_FLOW]) / lead
    state[VALVE] = open_0 + open_1 * p - 1
    state[VALVE_SPEED] = lead * state[VALVE] - history[VALVE]
    return p


@njit(cache=True, fastmath=True)
def _meet(line, state, now, flux_p, flux_q, wave_in, wave_lead):
    """Settle the faces inside pipes; gather for each node its waves, sum c/Z, and their sum 1/Z."""
    n = state.flow.shape[0]
    p, q = state.pressure[now], state.flow
    wave_in[:] = 0.0
    wave_lead[:] = 0.0
    for k in range(len(line.first)):
        for e in range(line.first[k], line.last[k]):
            z = line.impedance[e]
            mid_p = 0.5 * (p[n - 1, e] + p[0, e + 1] + z * (q[n - 1, e] - q[0, e + 1]))
            mid_q = 0.5 * (q[n - 1, e] + q[0, e + 1] + (p[n - 1, e] - p[0, e + 1]) / z)
            flux_p[1, e] = flux_p[0, e + 1] = mid_p
            flux_q[1, e] = flux_q[0, e + 1] = mid_q
        a, b = line.first[k], line.last[k]
        wave_in[line.start[k]] += p[0, a] / line.impedance[a] - q[0, a]
        wave_lead[line.start[k]] += 1 / line.impedance[a]
        wave_in[line.end[k]] += p[n - 1, b] / line.impedance[b] + q[n - 1, b]
        wave_lead[line.end[k]] += 1 / line.impedance[b]


@njit(cache=True, fastmath=True)
def _close(line, state, now, flux_p, flux_q):
    """Values at the ends of the pipes that follow from the settled node pressures."""
    n = state.flow.shape[0]
    p, q = state.pressure[now], state.flow
    for k in range(len(line.first)):
        a, b = line.first[k], line.last[k]
        settled = state.node_pressure[line.start[k]]
        flux_p[0, a] = settled
        flux_q[0, a] = q[0, a] + (settled - p[0, a]) / line.impedance[a]
        settled = state.node_pressure[line.end[k]]
        flux_p[1, b] = settled
        flux_q[1, b] = q[n - 1, b] + (p[n - 1, b] - settled) / line.impedance[b]


@njit(cache=True)
def run(line, nodes, chambers, ports, source, crank, state, phase, steps, every, dt, sensors):
    """March `steps` steps of `dt` from `state`, whose newest step is number `phase`.

    The crank stands at `speed * phase * dt` plus its wander and its ripple; `crank` is (speed in
    rad/s, ripple, wander), the ripple (terms, 3) being order, relative amplitude of speed and
    phase, the wander (0,) or (steps // every + 1,) how far in rad the crank is ahead of even
    turning at every record. `source` (M,) is a flow into node 0 over one revolution, added to that
    of the pump, as strong as the crank is fast; `chambers` may be empty. `sensors` is (element,
    (count, n) interpolation rows). Every `every` steps a record is kept.

    Returns sensor pressures (count, records), flow into the line at x = 0 (records,), pressures
    of the nodes (nodes, records), and the greatest number of Newton steps that the chambers took.
    """
    speed, ripple, wander = crank
    element, rows = sensors
    count, n = rows.shape
    elements = state.flow.shape[1]
    n_nodes, pistons = nodes.shape[0], chambers.shape[0]
    lead = LEAD / dt
    recorded = np.zeros((count, steps // every))
    outlet = np.zeros(steps // every)
    nodal = np.zeros((n_nodes, steps // every))
    flux_p, flux_q = np.zeros((2, elements)), np.zeros((2, elements))
    wave_in, wave_lead = np.zeros(n_nodes), np.zeros(n_nodes)
    history = np.zeros((NODE_STATES, n_nodes))
    chamber_history = np.zeros(pistons)
    x = np.zeros(pistons + 1)
    matrix = np.zeros((pistons + 1, pistons + 2))
    stations = np.zeros((pistons, 4))
    newton = 0
    for step in range(1, steps + 1):
        ring = (phase % DEPTH, (phase - 1) % DEPTH, (phase - 2) % DEPTH, (phase - 3) % DEPTH)
        last, before, now = ring[0], ring[1], ring[3]
        _advance(line, state, ring, dt)
        phase += 1
        _meet(line, state, now, flux_p, flux_q, wave_in, wave_lead)
        turn, drift = speed * (phase * dt), 1.0
        if len(wander):
            k = (step - 1) // every
            slope = (wander[k + 1] - wander[k]) / every
            turn += wander[k] + slope * (step - k * every)
            drift += slope / (speed * dt)
        angle, rate = turn, drift
        for term in range(len(ripple)):
            order, amplitude, shift = ripple[term]
            angle += amplitude / order * np.sin(order * turn + shift)
            rate += drift * amplitude * np.cos(order * turn + shift)
        place = turn / (2 * np.pi) % 1.0 * len(source)
        low = int(place) % len(source)
        share = place - int(place)
        given = source[low] * (1 - share) + source[(low + 1) % len(source)] * share
        given *= drift
        _remember(state.node, ring)
        for s in range(NODE_STATES):
            for node in range(n_nodes):
                history[s, node] = state.node[now, s, node] / dt
        if pistons > 0:
            for i in range(pistons):
                x[i] = 2 * state.chamber[last, i] - state.chamber[before, i]
            _remember(state.chamber, ring)
            for i in range(pistons):
                chamber_history[i] = state.chamber[now, i] / dt
            x[pistons] = state.node_pressure[0]
            stations_at(angle, speed * rate, chambers, ports, stations)
            used = step_chambers(
                stations,
                chamber_history,
                lead,
                chambers,
                ports,
                wave_lead[0] + lead * nodes[0, VOLUME],
                wave_in[0] + given + history[STORED, 0],
                x,
                matrix,
            )
            newton = max(newton, used)
            for i in range(pistons):
                state.chamber[now, i] = x[i]
            state.node_pressure[0] = x[pistons]
            state.node[now, STORED, 0] = nodes[0, VOLUME] * x[pistons]
        for node in range(1 if pistons > 0 else 0, n_nodes):
            state.node_pressure[node] = _settle_node(
                nodes[node], history[:, node], state.node[now, :, node], lead,
                wave_in[node] + (given if node == 0 else 0.0), wave_lead[node],
                state.node_pressure[node],
            )  # fmt: skip
        _close(line, state, now, flux_p, flux_q)
        _rates(line, state, now, flux_p, flux_q)
        if step % every == 0:
            for s in range(count):
                for i in range(n):
                    recorded[s, step // every - 1] += (
                        rows[s, i] * state.pressure[now, i, element[s]]
                    )
            outlet[step // every - 1] = flux_q[0, 0]
            nodal[:, step // every - 1] = state.node_pressure
    return recorded, outlet, nodal, newton
