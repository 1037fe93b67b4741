"""The inner loop of the method of characteristics (see there for equations).

Per node: `forward` = p + Zc q and `backward` = p - Zc q as they leave towards a cell of length
one, half of the losses over that cell already taken off. All in one file, for Numba's cache of a
function does not see changes of another file.
"""

from __future__ import annotations

import numpy as np
from numba import njit

SHUNT, SERIES, BRANCH = range(3)  # kinds of a rung
VALVE = -1  # row of the load's valve among the filters
PASSES = 3  # on its opening
LATE = 0.501  # share of a step's end in the mean rate over it

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
def _creep(keep, follow, share, pressure, strain, lag):
    """What the wall has already yielded: b_k <- E_k b_k + follow_k p, `lag` = sum share_k b_k."""
    lag[:] = 0.0
    for m in range(len(keep)):
        e, g, c, b = keep[m], follow[m], share[m], strain[m]
        for i in range(len(pressure)):
            b[i] = e * b[i] + g * pressure[i]
            lag[i] += c * b[i]


@njit(cache=True, error_model="numpy")
def _follow_law(law, steady, pressure, held, soft, give, lag):
    """Put what a pipe stores by `law` to first order about the pressure now on `give` and `lag`.

    held (3, nodes) is, times rho a^2, the share stored, half a step times its rate, and what is
    put on `lag`. What the tangent missed in one step is made good in the next, so that nothing is
    lost. The rule is the trapezoidal one but for LATE, for that one never forgets a jump.
    """
    new, old = 0.5 / LATE, (1.0 - LATE) / LATE
    for i in range(len(lag)):
        x = (pressure[i] - steady[i]) / law[0]
        share = slope = 0.0
        for k in range(len(law) - 1, 0, -1):
            slope = slope * x + k * law[k]
            share = (share + law[k]) * x
        slope /= law[0]
        give[i] = soft + new * slope
        held[2, i] = new * (slope * pressure[i] - share + held[0, i]) + old * held[1, i]
        lag[i] += held[2, i]


@njit(cache=True, error_model="numpy")
def _hold(pressure, held, soft, give, lag):
    """What has been stored by the new pressure; `give` and `lag` without the law's part but for
    half a step's rate."""
    for i in range(len(lag)):
        rate = (give[i] - soft) * pressure[i] - held[2, i]
        held[0, i] += 2.0 * (LATE * rate + (1.0 - LATE) * held[1, i])
        held[1, i] = rate
        give[i] = soft
        lag[i] -= held[2, i] + rate


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
def _meet_yielding(b, give, lag, pressure, flow, change, forward, backward, known):
    """The same where more is stored than the elastic wall does: a wall that creeps, say."""
    over = 0.5 / b
    for i in range(1, len(flow) - 2):
        up, down = forward[i - 1] - known[i], backward[i + 1] + known[i]
        pressure[i] = 0.5 * (up + down + 2.0 * lag[i]) / (1.0 + give[i])
        new = over * (up - down)
        change[i] = new - flow[i]
        flow[i] = new


@njit(cache=True, error_model="numpy")
def _leave(carried, yields, give, lag, pressure, flow, known, forward, backward):
    """Waves leaving every node, less half the losses of an ordinary cell."""
    if not yields:
        for i in range(len(flow)):
            wave = carried * flow[i] - known[i]
            forward[i] = pressure[i] + wave
            backward[i] = pressure[i] - wave
    else:
        for i in range(len(flow)):
            wave = carried * flow[i] - known[i]
            still = pressure[i] - (give[i] * pressure[i] - lag[i])
            forward[i] = still + wave
            backward[i] = still - wave


@njit(cache=True, error_model="numpy")
def _filter(coefficients, u, state):
    """One step of a second-order section in transposed direct form II."""
    b0, b1, b2, a1, a2 = coefficients
    y = b0 * u + state[0]
    state[0] = b1 * u - a1 * y + state[1]
    state[1] = b2 * u - a2 * y


@njit(cache=True, error_model="numpy")
def _through_orifice(excess, b, coefficient):
    """x |x| with b x |x| + K x = excess: the pressure over an orifice of coefficient K."""
    size = abs(excess)
    x = 2.0 * size / (coefficient + np.sqrt(coefficient**2 + 4.0 * b * size))
    return np.sign(excess) * x * x


@njit(cache=True, error_model="numpy")
def _join(supply, slope, first, stop, kinds, filters, references, state, ends, kept, joint, load):
    """Pressures at a junction whose rungs are `first` to `stop`, in order from the pump.

    What comes from the pump's side is q = supply[0] - slope[0] p. A shunt takes b0 u + z of it,
    a series element a pressure b0 u + z, u what differs from `references`; so each rung turns
    the pair into that of its far side. What comes from the load's side, supply[1] - slope[1] p,
    meets it there, and back on the way every rung's filter moves on. `ends` (2, pipes, 2) holds
    supply and slope of the branches, which get their pressure in `joint` (pipes, 2).
    Returns the pressures on the pump's and the load's side.
    """
    s, b = supply[0], slope[0]
    for r in range(first, stop):
        kept[r, 0], kept[r, 1] = s, b
        kind = kinds[r, 0]
        if kind == BRANCH:
            s += ends[0, kinds[r, 1], 0]
            b += ends[1, kinds[r, 1], 0]
            continue
        g, past = filters[r, 0], state[r, 0] - filters[r, 0] * references[r]
        if kind == SHUNT:
            s -= past
            b += g
        else:
            s = (s - b * past) / (1.0 + b * g)
            b = b / (1.0 + b * g)
    s += supply[1]
    b += slope[1]
    law, coefficient, outside = load
    p = s / b
    if law == 1:
        p = outside
    elif law == 2:
        excess = s - b * outside
        opening = 1.0 + state[VALVE, 0]
        for _ in range(PASSES):  # the valve hardly moves within a step
            p = outside + _through_orifice(excess, b, coefficient * opening)
            opening = 1.0 + state[VALVE, 0] + filters[VALVE, 0] * (p - references[VALVE])
        _filter(filters[VALVE], p - references[VALVE], state[VALVE])
    far = p
    for r in range(stop - 1, first - 1, -1):
        kind, b0 = kinds[r, 0], filters[r, 0]
        if kind == BRANCH:
            joint[kinds[r, 1], 0] = p
            continue
        u = p - references[r]
        if kind == SERIES:
            past = state[r, 0] - b0 * references[r]
            q = (kept[r, 0] - kept[r, 1] * (p + past)) / (1.0 + kept[r, 1] * b0)
            p += b0 * q + past
            u = q - references[r]
        _filter(filters[r], u, state[r])
    return p, far


@njit(cache=True, error_model="numpy")
def advance(
    source,
    nodes,
    main,
    offsets,
    thetas,
    taps,
    parameters,
    decays,
    gains,
    bends,
    keep,
    follow,
    share,
    laws,
    rungs,
    kinds,
    filters,
    references,
    load,
    pressure,
    flow,
    forward,
    backward,
    strain,
    steady,
    held,
    memory,
    change,
    last_change,
    history,
    state,
):
    """One period of `source` (M,); the state arrays are changed in place.

    Pipes 0 to `main` are the line, the rest branches. Returns pressure and flow (len(nodes), M).
    """
    pipes, steps = len(thetas), len(source)
    law, coefficient, outside, constant, conductance = load
    seen_p, seen_q = np.empty((len(nodes), steps)), np.empty((len(nodes), steps))
    # (u/2)(sum e_k y_k - G q - H dq): friction of the past at the new point
    known, lag, give = np.zeros((3, len(pressure)))
    for k in range(pipes):
        give[offsets[k] : offsets[k + 1]] = parameters[k, 3]
    ends = np.zeros((2, pipes, 2))  # supply and slope that a pipe brings to the joint at each end
    joint = np.empty((pipes, 2))
    supply, slope, kept = np.empty(2), np.empty(2), np.empty((len(kinds), 2))

    for n in range(steps):
        for k in range(pipes):
            first, last = offsets[k], offsets[k + 1] - 1
            near, theta = last - 1, thetas[k]
            zc, half_r, half_u, soft = parameters[k]
            gain = gains[k].sum()
            b = zc + half_r + half_u * gain

            here = slice(first, last + 1)
            if half_u > 0.0:
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

            now = pressure[here], flow[here], change[here]
            waves = forward[here], backward[here], known[here]
            lawful = laws[k, 0] > 0.0
            if soft == 0.0 and not lawful:
                _meet(b, *now, *waves)
            else:
                _creep(keep[k], follow[k], share[k], pressure[here], strain[:, here], lag[here])
                if lawful:
                    more = held[:, here], soft, give[here], lag[here]
                    _follow_law(laws[k], steady[here], pressure[here], *more)
                _meet_yielding(b, give[here], lag[here], *now, *waves)

            # The node between an ordinary cell and the long one.
            b_long, give_long = zc + theta * (half_r + half_u * gain), theta * give[near]
            up = forward[near - 1] - known[near] + lag[near]
            down = to_near + theta * (known[near] + lag[near])
            new = (b_long * up + b * down) / (b_long * (1.0 + give[near]) + b * (1.0 + give_long))
            pressure[near] = new
            new = (up - (1.0 + give[near]) * new) / b
            change[near] = new - flow[near]
            flow[near] = new

            # What each end brings to its junction: q = +-(supply - slope p).
            ends[0, k, 0] = (backward[first + 1] + known[first] + lag[first]) / b
            ends[1, k, 0] = (1.0 + give[first]) / b
            ends[0, k, 1] = (to_end - theta * (known[last] - lag[last])) / b_long
            ends[1, k, 1] = (1.0 + theta * give[last]) / b_long

        for j in range(main + 1):
            supply[:], slope[:] = 0.0, 0.0
            if j == 0:
                supply[0] = source[n]
            else:
                supply[0], slope[0] = ends[0, j - 1, 1], ends[1, j - 1, 1]
            if j == main:
                supply[1], slope[1] = -constant, conductance
            else:
                supply[1], slope[1] = ends[0, j, 0], ends[1, j, 0]
            far_end = (law if j == main else 0, coefficient, outside)
            span = rungs[j], rungs[j + 1], kinds, filters, references, state
            before, after = _join(supply, slope, *span, ends, kept, joint, far_end)
            if j > 0:
                joint[j - 1, 1] = before
            if j < main:
                joint[j, 0] = after
        for k in range(main, pipes):
            joint[k, 1] = ends[0, k, 1] / ends[1, k, 1]  # closed

        for k in range(pipes):
            first, last = offsets[k], offsets[k + 1] - 1
            near, theta = last - 1, thetas[k]
            zc, half_r, half_u, soft = parameters[k]
            gain = gains[k].sum()
            b = zc + half_r + half_u * gain
            b_long = zc + theta * (half_r + half_u * gain)

            arriving = backward[first + 1] + known[first] + lag[first]
            pressure[first] = joint[k, 0]
            new = ((1.0 + give[first]) * pressure[first] - arriving) / b
            change[first] = new - flow[first]
            flow[first] = new

            to_end = 0.0
            for age in range(4):
                to_end += taps[k, age] * history[k, 0, age]
            arriving = to_end - theta * (known[last] - lag[last])
            pressure[last] = joint[k, 1]
            new = (arriving - (1.0 + theta * give[last]) * pressure[last]) / b_long
            change[last] = new - flow[last]
            flow[last] = new

            # Friction now: half_r q + half_u sum y_k, sum y_k from `known`.
            total = half_r + half_u * gain
            here = slice(first, last + 1)
            lawful = laws[k, 0] > 0.0
            if lawful:
                _hold(pressure[here], held[:, here], soft, give[here], lag[here])
            _leave(
                zc - total,
                soft != 0.0 or lawful,
                give[here],
                lag[here],
                pressure[here],
                flow[here],
                known[here],
                forward[here],
                backward[here],
            )

            for age in range(3, 0, -1):
                history[k, 0, age] = history[k, 0, age - 1]
                history[k, 1, age] = history[k, 1, age - 1]
            for side, i in ((0, near), (1, last)):
                wave, loss = zc * flow[i], theta * (known[i] + total * flow[i])
                yielded = theta * (give[i] * pressure[i] - lag[i])
                sign = 1.0 if side == 0 else -1.0
                history[k, side, 0] = pressure[i] + sign * (wave - loss) - yielded

        for j in range(len(nodes)):
            seen_p[j, n], seen_q[j, n] = pressure[nodes[j]], flow[nodes[j]]
    return seen_p, seen_q
