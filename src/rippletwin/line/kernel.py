"""The inner loop of the method of characteristics; see `rippletwin.line.moc` for the equations.

Per node: `forward` = p + Zc q and `backward` = p - Zc q as they leave towards a cell of length
one, half of the losses over that cell already taken off.
"""

from __future__ import annotations

import numpy as np
from numba import njit

# Views of one pipe, indexed from 0: so the compiler knows that no index wraps, and vectorises.


@njit(cache=True, error_model="numpy")
def _remember(half_u, decay, gain, bend, flow, change, last_change, memory, known):
    """Friction's memory y_k over the last step; `known` = half_u (sum e y - G q - H dq)."""
    total_gain, total_bend = gain.sum(), bend.sum()
    for i in range(len(flow)):
        known[i] = -total_gain * flow[i] - total_bend * change[i]
    for m in range(len(decay)):
        e, g, h, y = decay[m], gain[m], bend[m], memory[m]
        for i in range(len(flow)):
            new = e * y[i] + g * change[i] - h * last_change[i]
            y[i] = new
            known[i] += e * new
    for i in range(len(flow)):
        known[i] *= half_u
        last_change[i] = change[i]


@njit(cache=True, error_model="numpy")
def _meet(b, pressure, flow, change, forward, backward, known):
    """Interior nodes between two ordinary cells."""
    over = 0.5 / b
    for i in range(1, len(flow) - 2):
        up, down = forward[i - 1] - known[i], backward[i + 1] + known[i]
        pressure[i] = 0.5 * (up + down)
        new = over * (up - down)
        change[i] = new - flow[i]
        flow[i] = new


@njit(cache=True, error_model="numpy")
def _meet_viscoelastic(
    b, creep, keep, phi, rate, strain, pressure, flow, change, forward, backward, known
):
    """The same with a wall that creeps."""
    half, over = 0.5 / (1.0 + creep * phi * rate), 0.5 / b
    for i in range(1, len(flow) - 2):
        bend = keep * strain[i] + (phi - keep) * pressure[i]
        up = forward[i - 1] - known[i] + creep * rate * bend
        down = backward[i + 1] + known[i] + creep * rate * bend
        new = half * (up + down)
        strain[i] = bend + (1.0 - phi) * new
        pressure[i] = new
        new = over * (up - down)
        change[i] = new - flow[i]
        flow[i] = new


@njit(cache=True, error_model="numpy")
def _leave(carried, give, pressure, flow, strain, known, forward, backward):
    """Waves leaving every node, less half the losses of an ordinary cell."""
    if give == 0.0:
        for i in range(len(flow)):
            wave = carried * flow[i] - known[i]
            forward[i] = pressure[i] + wave
            backward[i] = pressure[i] - wave
    else:
        for i in range(len(flow)):
            wave = carried * flow[i] - known[i]
            still = pressure[i] - give * (pressure[i] - strain[i])
            forward[i] = still + wave
            backward[i] = still - wave


@njit(cache=True, error_model="numpy")
def advance(
    source,
    nodes,
    dt,
    offsets,
    thetas,
    taps,
    links,
    parameters,
    decays,
    gains,
    bends,
    capacitance,
    conductance,
    load,
    pressure,
    flow,
    forward,
    backward,
    strain,
    memory,
    change,
    last_change,
    history,
    shunt_flow,
):
    """One period of `source` (M,); the state arrays are changed in place.

    Returns pressure and flow (len(nodes), M).
    """
    pipes, junctions, steps = len(thetas), len(capacitance), len(source)
    kind, load_junction, coefficient, load_pressure, constant = load
    unsteady = parameters[0, 2] > 0.0
    seen_p, seen_q = np.empty((len(nodes), steps)), np.empty((len(nodes), steps))
    known = np.zeros(
        len(pressure)
    )  # (u/2)(sum e_k y_k - G q - H dq): friction of the past at the new point
    supply, slope = np.empty(junctions), np.empty(junctions)
    joint, last_joint = np.empty(junctions), np.empty(junctions)
    for k in range(pipes):
        last_joint[links[k, 0]] = pressure[offsets[k]]
        last_joint[links[k, 1]] = pressure[offsets[k + 1] - 1]

    for n in range(steps):
        for j in range(junctions):
            rigid = 2.0 * capacitance[j] / dt
            supply[j] = rigid * last_joint[j] + shunt_flow[j]
            slope[j] = conductance[j] + rigid
        supply[0] += source[n]
        supply[load_junction] -= constant

        for k in range(pipes):
            first, last = offsets[k], offsets[k + 1] - 1
            near, theta = last - 1, thetas[k]
            zc, half_r, half_u, creep = parameters[k, :4]
            keep, phi, rate = parameters[k, 4:]
            gain = gains[k].sum()
            b = zc + half_r + half_u * gain
            w = creep * phi * rate

            here = slice(first, last + 1)
            if unsteady:
                _remember(
                    half_u,
                    decays[k],
                    gains[k],
                    bends[k],
                    flow[here],
                    change[here],
                    last_change[here],
                    memory[:, here],
                    known[here],
                )

            # Waves through the last cell, theta steps old.
            to_end = to_near = 0.0
            for age in range(4):
                to_end += taps[k, age] * history[k, 0, age]
                to_near += taps[k, age] * history[k, 1, age]

            state = pressure[here], flow[here], change[here]
            waves = forward[here], backward[here], known[here]
            if creep == 0.0:
                _meet(b, *state, *waves)
            else:
                _meet_viscoelastic(b, creep, keep, phi, rate, strain[here], *state, *waves)

            # The node between an ordinary cell and the long one.
            b_long, w_long = zc + theta * (half_r + half_u * gain), theta * w
            bend = keep * strain[near] + (phi - keep) * pressure[near]
            past = -creep * rate * bend
            up = forward[near - 1] - known[near] - past
            down = to_near + theta * (known[near] - past)
            new = (b_long * up + b * down) / (b_long * (1.0 + w) + b * (1.0 + w_long))
            strain[near] = bend + (1.0 - phi) * new
            pressure[near] = new
            new = (up - (1.0 + w) * new) / b
            change[near] = new - flow[near]
            flow[near] = new

            # What each end brings to its junction: q = +-(supply - slope p).
            past = -creep * rate * (keep * strain[first] + (phi - keep) * pressure[first])
            supply[links[k, 0]] += (backward[first + 1] + known[first] - past) / b
            slope[links[k, 0]] += (1.0 + w) / b
            past = -creep * rate * (keep * strain[last] + (phi - keep) * pressure[last])
            supply[links[k, 1]] += (to_end - theta * (known[last] + past)) / b_long
            slope[links[k, 1]] += (1.0 + w_long) / b_long

        for j in range(junctions):
            joint[j] = supply[j] / slope[j]
            if j == load_junction:
                if kind == 1:
                    joint[j] = load_pressure
                elif kind == 2:
                    # slope x^2 + K x = excess with x = sqrt(p - p0)
                    excess = supply[j] - slope[j] * load_pressure
                    size = abs(excess)
                    root = np.sqrt(coefficient**2 + 4.0 * slope[j] * size)
                    x = 2.0 * size / (coefficient + root)
                    joint[j] = load_pressure + np.sign(excess) * x * x
            rigid = 2.0 * capacitance[j] / dt
            shunt_flow[j] = rigid * (joint[j] - last_joint[j]) - shunt_flow[j]
            last_joint[j] = joint[j]

        for k in range(pipes):
            first, last = offsets[k], offsets[k + 1] - 1
            near, theta = last - 1, thetas[k]
            zc, half_r, half_u, creep = parameters[k, :4]
            keep, phi, rate = parameters[k, 4:]
            gain = gains[k].sum()
            b = zc + half_r + half_u * gain
            w = creep * phi * rate
            b_long, w_long = zc + theta * (half_r + half_u * gain), theta * w

            bend = keep * strain[first] + (phi - keep) * pressure[first]
            arriving = backward[first + 1] + known[first] + creep * rate * bend
            pressure[first] = joint[links[k, 0]]
            strain[first] = bend + (1.0 - phi) * pressure[first]
            new = ((1.0 + w) * pressure[first] - arriving) / b
            change[first] = new - flow[first]
            flow[first] = new

            to_end = 0.0
            for age in range(4):
                to_end += taps[k, age] * history[k, 0, age]
            bend = keep * strain[last] + (phi - keep) * pressure[last]
            arriving = to_end - theta * (known[last] - creep * rate * bend)
            pressure[last] = joint[links[k, 1]]
            strain[last] = bend + (1.0 - phi) * pressure[last]
            new = (arriving - (1.0 + w_long) * pressure[last]) / b_long
            change[last] = new - flow[last]
            flow[last] = new

            # Friction now: half_r q + half_u sum y_k, sum y_k from `known`.
            total = half_r + half_u * gain
            here = slice(first, last + 1)
            _leave(
                zc - total,
                creep * rate,
                pressure[here],
                flow[here],
                strain[here],
                known[here],
                forward[here],
                backward[here],
            )

            for age in range(3, 0, -1):
                history[k, 0, age] = history[k, 0, age - 1]
                history[k, 1, age] = history[k, 1, age - 1]
            for side, i in ((0, near), (1, last)):
                wave, loss = zc * flow[i], theta * (known[i] + total * flow[i])
                give = theta * creep * rate * (pressure[i] - strain[i])
                sign = 1.0 if side == 0 else -1.0
                history[k, side, 0] = pressure[i] + sign * (wave - loss) - give

        for j in range(len(nodes)):
            seen_p[j, n], seen_q[j, n] = pressure[nodes[j]], flow[nodes[j]]
    return seen_p, seen_q
