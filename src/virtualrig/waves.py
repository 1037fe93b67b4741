"""Waves in pipes: the discontinuous Galerkin method on spectral elements.

The equations are p_t = -(rho a^2/A) q_x and q = sum of velocity modes q_k with
q_k' = -(A/rho) w_k p_x - lambda_k q_k (`virtualrig.profile`). They are solved on Lobatto nodes with
upwind (characteristic) fluxes between the elements.
Source: Hesthaven, Warburton, Nodal Discontinuous Galerkin Methods, 2008.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from virtualrig.multistep import LEAD, combine_past, extrapolate
from virtualrig.node_elements import ATMOSPHERE


class Line(NamedTuple):
    """Pipes divided into E elements of n nodes; K velocity modes. Constants of the time step."""

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
    """The evolving state; fields with a leading 4 are rings of steps (`virtualrig.multistep`)."""

    pressure: np.ndarray  # (4, n, E)
    modes: np.ndarray  # (K, 4, n, E) flow of each velocity mode
    flow: np.ndarray  # (n, E) their sum
    strain: np.ndarray  # (4, n, E) retarded wall strain, as a pressure
    pressure_rate: np.ndarray  # (4, n, E)
    flow_drive: np.ndarray  # (4, n, E)
    node_pressure: np.ndarray  # (nodes,)
    node: np.ndarray  # (4, NODE_STATES, nodes)
    chamber: np.ndarray  # (4, pistons) compression, see `virtualrig.pump`
    chamber_pressure: np.ndarray  # (pistons,)


@njit(cache=True)
def wave_rates(line, state, now, flux_p, flux_q):
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


@njit(cache=True)
def _special_rates(line, p, q, strain, dp, dq):
    """Contributions of retarded wall, gas, stiffening liquid and turbulent drag."""
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


@njit(cache=True)
def advance_waves(line, state, ring, dt):
    """Write the fields of the next step over the oldest ones (index ring[3])."""
    n, elements = state.flow.shape
    extrapolate(state.pressure_rate, ring)
    extrapolate(state.flow_drive, ring)
    combine_past(state.pressure, ring)
    p = state.pressure[ring[3]].reshape(-1)
    rate = state.pressure_rate[ring[3]].reshape(-1)
    for i in range(len(p)):
        p[i] = (p[i] + dt * rate[i]) / LEAD
    drive, total = state.flow_drive[ring[3]].reshape(-1), state.flow.reshape(-1)
    total[:] = 0.0
    for k in range(line.gains.shape[0]):
        gain, push = line.gains[k].reshape(-1), line.pushes[k].reshape(-1)
        combine_past(state.modes[k], ring)
        mode = state.modes[k, ring[3]].reshape(-1)
        for i in range(len(total)):
            mode[i] = gain[i] * mode[i] + push[i] * drive[i]
            total[i] += mode[i]
    if line.special:
        combine_past(state.strain, ring)
        for e in range(elements):
            pull = dt / line.wall[1, e]
            for i in range(n):
                bent = state.strain[ring[3], i, e] + pull * state.pressure[ring[3], i, e]
                state.strain[ring[3], i, e] = bent / (LEAD + pull)


@njit(cache=True)
def gather_at_nodes(line, state, now, flux_p, flux_q, wave_in, wave_lead):
    """Solve the faces between elements, and sum over the pipes at each node.

    `wave_in` (nodes,) becomes the sum of p/Z + q, with q towards the node, and `wave_lead`
    (nodes,) that of 1/Z.
    """
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


@njit(cache=True)
def close_pipes(line, state, now, flux_p, flux_q):
    """Set the values at the ends of the pipes by the pressures of the nodes."""
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
