"""Time stepping of a rig: pump chambers, waves in the pipes, elements at the nodes.

Waves are explicit in time; friction, chambers and everything at the nodes are implicit
(`virtualrig.multistep`). Numba's cache of `run` does not notice changes in the modules imported
here: delete src/virtualrig/__pycache__ after one.
"""

import numpy as np
from numba import njit

from virtualrig.multistep import DEPTH, LEAD, combine_past
from virtualrig.node_elements import NODE_STATES, STORED, VOLUME, settle_node
from virtualrig.pump import AIR, chamber_kinematics, compression, step_chambers
from virtualrig.waves import advance_waves, close_pipes, gather_at_nodes, wave_rates


@njit(cache=True)
def run(line, nodes, chambers, ports, source, crank, state, phase, steps, every, dt, sensors):
    """March `steps` steps of `dt` from `state`, whose newest step is number `phase`.

    `crank` is (speed in rad/s, ripple, wander). The crank angle is `speed * phase * dt` plus wander
    plus ripple. The ripple (terms, 3) has order, relative amplitude of the speed, and phase of each
    term. The wander is (0,), or (steps // every + 1,) rad by which the crank leads uniform rotation
    at each record. `source` (M,), m3/s, is a flow into node 0 over one revolution, in proportion to
    the crank's speed and in addition to the pump's; `chambers` may be empty. `sensors` is
    (element, (count, n) interpolation rows). Every `every` steps a record is kept.

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
        advance_waves(line, state, ring, dt)
        phase += 1
        gather_at_nodes(line, state, now, flux_p, flux_q, wave_in, wave_lead)
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
        combine_past(state.node, ring)
        for s in range(NODE_STATES):
            for node in range(n_nodes):
                history[s, node] = state.node[now, s, node] / dt
        if pistons > 0:
            if ports[AIR] == 0:
                for i in range(pistons):
                    x[i] = 2 * state.chamber[last, i] - state.chamber[before, i]
            else:
                x[:pistons] = state.chamber_pressure
            combine_past(state.chamber, ring)
            for i in range(pistons):
                chamber_history[i] = state.chamber[now, i] / dt
            x[pistons] = state.node_pressure[0]
            chamber_kinematics(angle, speed * rate, chambers, ports, stations)
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
                state.chamber[now, i] = compression(x[i], ports)[0]
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
        wave_rates(line, state, now, flux_p, flux_q)
        if step % every == 0:
            for s in range(count):
                for i in range(n):
                    recorded[s, step // every - 1] += (
                        rows[s, i] * state.pressure[now, i, element[s]]
                    )
            outlet[step // every - 1] = flux_q[0, 0]
            nodal[:, step // every - 1] = state.node_pressure
    return recorded, outlet, nodal, newton
