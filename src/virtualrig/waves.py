"""Waves in pipes: the discontinuous Galerkin method on spectral elements.

The equations are p_t = -(rho a^2/A) q_x and q = sum of velocity modes q_k with
q_k' = -(A/rho) w_k p_x - lambda_k q_k (`virtualrig.profile`). They are solved on Lobatto nodes with
upwind (characteristic) fluxes between the elements.
Source: Hesthaven, Warburton, Nodal Discontinuous Galerkin Methods, 2008.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from virtualrig.compilation import step_function, vectorised_step_function
from virtualrig.multistep import LEAD, ahead, extrapolate, past_part
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
    walled: bool  # any wall
    wall: np.ndarray  # (2, E) relative compliance and retardation time of the wall
    uneven: np.ndarray  # elements with air, growing modulus or drag
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


class Rows(NamedTuple):
    """The line's constants and the state's fields for the time step; n nodes of E elements a row.

    N = n E. Contiguous rows are what the compiler vectorises; the fields are views of the state's.
    """

    inflow: np.ndarray  # (N,)
    push: np.ndarray  # (N,)
    relaxing: np.ndarray  # (N,) compliance over retardation time of the wall, 1/s
    pull: np.ndarray  # (N,) dt over retardation time of the wall
    gains: np.ndarray  # (K, N)
    pushes: np.ndarray  # (K, N)
    pressure: np.ndarray  # (4, N)
    modes: np.ndarray  # (K, 4, N)
    flow: np.ndarray  # (N,)
    strain: np.ndarray  # (4, N)
    pressure_rate: np.ndarray  # (4, N)
    flow_drive: np.ndarray  # (4, N)


@njit(cache=True)
def lay_in_rows(line, state, dt):
    """Rows of `line` and `state` for time steps of `dt` s."""
    n, elements = state.flow.shape
    depth, modes = state.pressure.shape[0], line.gains.shape[0]
    inflow, push = np.empty((n, elements)), np.empty((n, elements))
    relaxing, pull = np.empty((n, elements)), np.empty((n, elements))
    for i in range(n):
        inflow[i], push[i] = line.inflow, line.push
        for e in range(elements):
            relaxing[i, e] = line.wall[0, e] / line.wall[1, e]
            pull[i, e] = dt / line.wall[1, e]
    count = n * elements
    return Rows(
        inflow.reshape(count),
        push.reshape(count),
        relaxing.reshape(count),
        pull.reshape(count),
        line.gains.reshape((modes, count)),
        line.pushes.reshape((modes, count)),
        state.pressure.reshape((depth, count)),
        state.modes.reshape((modes, depth, count)),
        state.flow.reshape(count),
        state.strain.reshape((depth, count)),
        state.pressure_rate.reshape((depth, count)),
        state.flow_drive.reshape((depth, count)),
    )


@step_function
def wave_rates(line, rows, state, now, flux_p, flux_q):
    """Right-hand sides of the waves at step `now`; flux_* (2, E) are the settled end values."""
    n = state.flow.shape[0]
    p, q = state.pressure[now], state.flow
    dp, dq = state.pressure_rate[now], state.flow_drive[now]
    _differentiate(line.derivative, q, dp)
    _differentiate(line.derivative, p, dq)
    _lift(dp[0], flux_q[0], q[0], -line.lift)
    _lift(dq[0], flux_p[0], p[0], -line.lift)
    _lift(dp[n - 1], flux_q[1], q[n - 1], line.lift)
    _lift(dq[n - 1], flux_p[1], p[n - 1], line.lift)
    _scale(rows.pressure_rate[now], rows.inflow)
    _scale(rows.flow_drive[now], rows.push)
    if line.walled:
        rate, strain = rows.pressure_rate[now], rows.strain[now]
        pressure, relaxing = rows.pressure[now], rows.relaxing
        for i in range(len(rate)):
            rate[i] -= relaxing[i] * (pressure[i] - strain[i])
    if len(line.uneven) > 0:
        _uneven_rates(line, p, q, dp, dq)


@step_function
def _differentiate(derivative, values, rates):
    """rates (n, E) = derivative (n, n) times values (n, E)."""
    n = len(values)
    for i in range(n):
        rate = rates[i]
        rate[:] = 0.0
        for j in range(n):
            factor, value = derivative[i, j], values[j]
            for e in range(len(rate)):
                rate[e] += factor * value[e]


@step_function
def _lift(rate, settled, inside, lift):
    for e in range(len(rate)):
        rate[e] += lift * (settled[e] - inside[e])


@step_function
def _scale(rate, factor):
    for i in range(len(rate)):
        rate[i] *= factor[i]


@step_function
def _uneven_rates(line, p, q, dp, dq):
    """Contributions of gas, stiffening liquid and turbulent drag."""
    for e in line.uneven:
        air, growth, drag = line.air[0, e], line.modulus[1, e], line.drag[e]
        for i in range(len(p)):
            softness = 1 / (1 + growth * (p[i, e] - line.modulus[2, e]))
            if air > 0:
                absolute = max(p[i, e], 0.0) + ATMOSPHERE
                exponent = 1 / line.air[1, e]
                gas = air * exponent * (ATMOSPHERE / absolute) ** exponent / absolute
                softness += line.modulus[0, e] * gas
            dp[i, e] /= softness
            dq[i, e] -= drag * q[i, e] * abs(q[i, e])


@vectorised_step_function
def advance_waves(line, rows, ring, dt):
    """Write the fields of the next step over the oldest ones (index ring[3])."""
    last, before, older, now = ring
    p0, p1, p2, p3 = (
        rows.pressure[last], rows.pressure[before], rows.pressure[older], rows.pressure[now]
    )  # fmt: skip
    rate = rows.pressure_rate
    r0, r1, r2, r3 = rate[last], rate[before], rate[older], rate[now]
    for i in range(len(p3)):
        rise = dt * ahead(r0[i], r1[i], r2[i], r3[i])
        p3[i] = (past_part(p0[i], p1[i], p2[i], p3[i]) + rise) / LEAD
    extrapolate(rows.flow_drive, ring)
    drive, total = rows.flow_drive[now], rows.flow
    total[:] = 0.0
    for k in range(len(rows.gains)):
        gain, push, mode = rows.gains[k], rows.pushes[k], rows.modes[k]
        m0, m1, m2, m3 = mode[last], mode[before], mode[older], mode[now]
        for i in range(len(m3)):
            m3[i] = gain[i] * past_part(m0[i], m1[i], m2[i], m3[i]) + push[i] * drive[i]
        for i in range(len(m3)):
            total[i] += m3[i]
    if line.walled:
        strain, pull = rows.strain, rows.pull
        s0, s1, s2, s3 = strain[last], strain[before], strain[older], strain[now]
        for i in range(len(s3)):
            bent = past_part(s0[i], s1[i], s2[i], s3[i]) + pull[i] * p3[i]
            s3[i] = bent / (LEAD + pull[i])


@njit(cache=True)
def node_admittances(line, count):
    """Sum of 1/Z over the pipes at each of `count` nodes, m3/s/Pa."""
    total = np.zeros(count)
    for k in range(len(line.first)):
        total[line.start[k]] += 1 / line.impedance[line.first[k]]
        total[line.end[k]] += 1 / line.impedance[line.last[k]]
    return total


@vectorised_step_function
def settle_faces(line, state, now, flux_p, flux_q):
    """Solve the faces between elements.

    The ends of pipes are solved as if they were such faces, and `close_pipes` sets them after.
    """
    n, elements = state.flow.shape
    p, q, z = state.pressure[now], state.flow, line.impedance
    p_left, p_right = p[n - 1], p[0, 1:]
    q_left, q_right = q[n - 1], q[0, 1:]
    mid_p, mid_q = flux_p[1], flux_q[1]
    for e in range(elements - 1):
        mid_p[e] = 0.5 * (p_left[e] + p_right[e] + z[e] * (q_left[e] - q_right[e]))
    for e in range(elements - 1):
        mid_q[e] = 0.5 * (q_left[e] + q_right[e] + (p_left[e] - p_right[e]) / z[e])
    next_p, next_q = flux_p[0, 1:], flux_q[0, 1:]
    for e in range(elements - 1):
        next_p[e], next_q[e] = mid_p[e], mid_q[e]


@step_function
def gather_at_nodes(line, state, now, wave_in):
    """Make `wave_in` (nodes,) the sum of p/Z + q over the pipes at each node, q towards it."""
    n = state.flow.shape[0]
    p, q = state.pressure[now], state.flow
    wave_in[:] = 0.0
    for k in range(len(line.first)):
        a, b = line.first[k], line.last[k]
        wave_in[line.start[k]] += p[0, a] / line.impedance[a] - q[0, a]
        wave_in[line.end[k]] += p[n - 1, b] / line.impedance[b] + q[n - 1, b]


@step_function
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
