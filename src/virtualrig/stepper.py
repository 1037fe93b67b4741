"""Time stepping of a rig: pump chambers, waves in the pipes, elements at the nodes.

Waves are explicit in time; friction, chambers and everything at the nodes are implicit
(`virtualrig.multistep`). Numba's cache of `run` does not notice changes in the modules imported
here: delete src/virtualrig/__pycache__ after one.
"""

import numpy as np
from numba import njit

from virtualrig.compilation import step_function
from virtualrig.multistep import DEPTH, LEAD, combine_past
from virtualrig.node_elements import NODE_STATES, STORED, VOLUME, settle_node
from virtualrig.pump import AIR, chamber_kinematics, compress_all, solve_chambers
from virtualrig.waves import (
    advance_waves,
    close_pipes,
    gather_at_nodes,
    lay_in_rows,
    node_admittances,
    settle_faces,
    wave_rates,
)


@njit(cache=True)
def crank_motion(turn, drift, ripple):
    """Crank angle, rad, and its rate over the set speed, of uniform rotation to `turn` rad."""
    angle, rate = turn, drift
    for term in range(len(ripple)):
        order, amplitude, shift = ripple[term]
        angle += amplitude / order * np.sin(order * turn + shift)
        rate += drift * amplitude * np.cos(order * turn + shift)
    return angle, rate


@njit(cache=True)
def tabulate_stations(chambers, ports, speed, ripple, steps, dt):
    """`stations` of `run` for steps 1 to `steps`: (steps, pistons, 4), of any revolution."""
    stations = np.empty((steps, len(chambers), 4))
    for step in range(1, steps + 1):
        angle, rate = crank_motion(speed * (step * dt), 1.0, ripple)
        chamber_kinematics(angle, speed * rate, chambers, ports, stations[step - 1])
    return stations


@njit(cache=True)
def run(line, nodes, chambers, ports, source, crank, state, stations, steps, every, dt, sensors):
    """March `steps` steps of `dt` from `state`, in which the crank angle is zero.

    `crank` is (speed in rad/s, ripple, wander). The crank angle after `step` steps is
    `speed * step * dt` plus wander plus ripple. The ripple (terms, 3) has order, relative amplitude
    of the speed, and phase of each term. The wander is (0,), or (steps // every + 1,) rad by which
    the crank leads uniform rotation at each record. `stations` is of `tabulate_stations` where the
    speed does not wander; with no rows it is computed. `source` (M,), m3/s, is a flow into node 0
    over one revolution, in proportion to the crank's speed and in addition to the pump's;
    `chambers` may be empty. `sensors` is (element, (count, n) interpolation rows). Every `every`
    steps a record is kept.

    Returns sensor pressures (count, records), flow into the line at x = 0 (records,), pressures
    of the nodes (nodes, records), and the greatest number of Newton steps that the chambers took.
    """
    count, n_nodes, pistons = sensors[1].shape[0], nodes.shape[0], chambers.shape[0]
    elements, records = state.flow.shape[1], steps // every
    recorded, outlet = np.zeros((count, records)), np.zeros(records)
    nodal = np.zeros((n_nodes, records))
    x = np.zeros(pistons + 1)
    squeezed = np.zeros((pistons, 2))
    compress_all(state.chamber_pressure, ports, squeezed)
    newton = _march(
        line, lay_in_rows(line, state, dt), nodes, chambers, ports, source, crank, state, stations,
        steps, every, dt, sensors, node_admittances(line, n_nodes),
        np.zeros((2, elements)), np.zeros((2, elements)), np.zeros(n_nodes),
        np.zeros((NODE_STATES, n_nodes)), np.zeros(pistons), x,
        np.zeros((pistons + 1, pistons + 2)), squeezed, np.zeros((pistons, 4)),
        recorded, outlet, nodal,
    )  # fmt: skip
    return recorded, outlet, nodal, newton


@step_function
def _march(
    line, flat, nodes, chambers, ports, source, crank, state, stations, steps, every, dt, sensors,
    wave_lead, flux_p, flux_q, wave_in, history, chamber_history, x, matrix, squeezed, station,
    recorded, outlet, nodal,
):  # fmt: skip
    """The steps of `run`, which has the arrays that they work in; the greatest number of Newton
    steps."""
    speed, ripple, wander = crank
    element, rows = sensors
    count, n = rows.shape
    n_nodes, pistons = nodes.shape[0], chambers.shape[0]
    lead = LEAD / dt
    stored = state.node.reshape((DEPTH, NODE_STATES * n_nodes))
    past = history.reshape(NODE_STATES * n_nodes)
    computed = len(stations) == 0
    newton = 0
    for step in range(1, steps + 1):
        ring = ((step - 1) % DEPTH, (step - 2) % DEPTH, (step - 3) % DEPTH, step % DEPTH)
        last, before, now = ring[0], ring[1], ring[3]
        advance_waves(line, flat, ring, dt)
        settle_faces(line, state, now, flux_p, flux_q)
        gather_at_nodes(line, state, now, wave_in)
        turn, drift = speed * (step * dt), 1.0
        if len(wander):
            k = (step - 1) // every
            slope = (wander[k + 1] - wander[k]) / every
            turn += wander[k] + slope * (step - k * every)
            drift += slope / (speed * dt)
        place = turn / (2 * np.pi) % 1.0 * len(source)
        low = int(place) % len(source)
        share = place - int(place)
        given = source[low] * (1 - share) + source[(low + 1) % len(source)] * share
        given *= drift
        combine_past(stored, ring)
        newest = stored[now]
        for i in range(len(past)):
            past[i] = newest[i] / dt
        if pistons > 0:
            if ports[AIR] == 0:
                for i in range(pistons):
                    x[i] = 2 * state.chamber[last, i] - state.chamber[before, i]
                compress_all(x, ports, squeezed)
            else:
                for i in range(pistons):
                    x[i] = state.chamber_pressure[i]
            combine_past(state.chamber, ring)
            for i in range(pistons):
                chamber_history[i] = state.chamber[now, i] / dt
            x[pistons] = state.node_pressure[0]
            if computed:
                angle, rate = crank_motion(turn, drift, ripple)
                chamber_kinematics(angle, speed * rate, chambers, ports, station)
            else:
                station = stations[step - 1]
            used = solve_chambers(
                station,
                chamber_history,
                lead,
                chambers,
                ports,
                wave_lead[0] + lead * nodes[0, VOLUME],
                wave_in[0] + given + history[STORED, 0],
                x,
                matrix,
                squeezed,
            )
            newton = max(newton, used)
            for i in range(pistons):
                state.chamber[now, i] = squeezed[i, 0]
                state.chamber_pressure[i] = x[i]
            state.node_pressure[0] = x[pistons]
            state.node[now, STORED, 0] = nodes[0, VOLUME] * x[pistons]
        for node in range(1 if pistons > 0 else 0, n_nodes):
            state.node_pressure[node] = settle_node(
                nodes[node], history[:, node], state.node[now, :, node], lead,
                wave_in[node] + (given if node == 0 else 0.0), wave_lead[node],
                state.node_pressure[node],
            )  # fmt: skip
        close_pipes(line, state, now, flux_p, flux_q)
        wave_rates(line, flat, state, now, flux_p, flux_q)
        if step % every == 0:
            for s in range(count):
                for i in range(n):
                    recorded[s, step // every - 1] += (
                        rows[s, i] * state.pressure[now, i, element[s]]
                    )
            outlet[step // every - 1] = flux_q[0, 0]
            for node in range(n_nodes):
                nodal[node, step // every - 1] = state.node_pressure[node]
    return newton
