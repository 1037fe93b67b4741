"""The inner loop of the method of characteristics; `method_of_characteristics` has the equations.

At each node `forward` = p + Zc q and `backward` = p - Zc q leave towards a cell of length one, with
half of the losses over that cell already subtracted. All compiled functions are in this file:
Numba's cache of a function does not notice changes of another file.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rippletwin.line.compilation import uncounted

SHUNT, SERIES, BRANCH, STORAGE = range(4)  # kinds of a rung
VALVE = -1  # row of the load's valve among the filters
VALVE_PASSES = 3  # of its opening, which hardly changes within a step
NEW_RATE_SHARE = 0.501  # of the new rate in the mean over a step; 1/2 would keep a jump for ever

# Written into the function that calls them: passing tuples of arrays takes longer than the work.
INLINED = njit(cache=True, error_model="numpy", inline="always")

# Functions of one pipe take views that start at its first node: the compiler then knows that no
# index wraps, and vectorises.


@njit(cache=True, error_model="numpy")
def _update_friction(half_u, decay, gain, push, flow, change, memory, first, known):
    """Friction's memory z_k after the last step; `known` = half_u (sum_k z_k - G q).

    The pipe's part of `memory` is at its nodes from `first` on. Rows are cut out one by one: of a
    cut through all rows the compiler would not know that a row is contiguous.
    """
    stop = first + len(flow)
    total_gain = gain.sum()
    for i in range(len(flow)):
        known[i] = -total_gain * flow[i]
    for m in range(0, len(decay), 2):
        _add_two_terms(
            decay[m], push[m], decay[m + 1], push[m + 1], change,
            memory[m, first:stop], memory[m + 1, first:stop], known,
        )  # fmt: skip
    for i in range(len(flow)):
        known[i] *= half_u


@njit(cache=True, error_model="numpy")
def _add_two_terms(e_1, d_1, e_2, d_2, change, z_1, z_2, known):
    """z <- e z + d dq of two terms, added to `known`."""
    for i in range(len(known)):
        new_1, new_2 = e_1 * z_1[i] + d_1 * change[i], e_2 * z_2[i] + d_2 * change[i]
        z_1[i], z_2[i] = new_1, new_2
        known[i] += new_1 + new_2


@njit(cache=True, error_model="numpy")
def _update_wall(keep, follow, share, pressure, strain, lag):
    """Retarded strain of the wall: b_k <- E_k b_k + follow_k p, `lag` = sum share_k b_k."""
    lag[:] = 0.0
    for m in range(len(keep)):
        e, g, c, b = keep[m], follow[m], share[m], strain[m]
        for i in range(len(pressure)):
            b[i] = e * b[i] + g * pressure[i]
            lag[i] += c * b[i]


@INLINED
def evaluate_law(law, x):
    """(sum_k c_k x^k, its slope in x) of a nonlinear compliance; `law` is (P, c_1, c_2 ...)."""
    value = slope = 0.0
    for k in range(len(law) - 1, 0, -1):
        slope = slope * x + k * law[k]
        value = (value + law[k]) * x
    return value, slope


@njit(cache=True, error_model="numpy")
def _linearise_law(law, steady, pressure, stored, soft, give, lag):
    """Linearise the storage law at the present pressure: add its slope to `give`, its offset to
    `lag`.

    The tangent's error in one step is corrected in the next, so that no volume is lost. The rule is
    trapezoidal but for NEW_RATE_SHARE.
    """
    new, old = 0.5 / NEW_RATE_SHARE, (1.0 - NEW_RATE_SHARE) / NEW_RATE_SHARE
    for i in range(len(lag)):
        share, slope = evaluate_law(law, (pressure[i] - steady[i]) / law[0])
        slope /= law[0]
        give[i] = soft + new * slope
        stored[2, i] = new * (slope * pressure[i] - share + stored[0, i]) + old * stored[1, i]
        lag[i] += stored[2, i]


@njit(cache=True, error_model="numpy")
def _update_stored(pressure, stored, soft, give, lag):
    """Store what the new pressure adds, and take the law's part out of `give` and `lag` but for
    half a step's rate."""
    for i in range(len(lag)):
        rate = (give[i] - soft) * pressure[i] - stored[2, i]
        stored[0, i] += 2.0 * (NEW_RATE_SHARE * rate + (1.0 - NEW_RATE_SHARE) * stored[1, i])
        stored[1, i] = rate
        give[i] = soft
        lag[i] -= stored[2, i] + rate


@INLINED
def _is_rigid(k, pipes):
    """Whether pipe k stores by its elastic wall alone. Then only its waves are kept."""
    return pipes.parameters[k, 3] == 0.0 and not pipes.laws[k, 0] > 0.0


@njit(cache=True, error_model="numpy")
def _pass_waves(share, forward, backward, next_forward, next_backward):
    """The waves that leave interior nodes of a rigid pipe without unsteady friction.

    They are p +- c q of p = (up + down)/2, q = (up - down)/(2 b) with c = `share` b. Pressure and
    flow are not kept, for they follow from the waves: see `_read_flow`.
    """
    most, least = 0.5 * (1.0 + share), 0.5 * (1.0 - share)
    for i in range(1, len(forward) - 2):
        up, down = forward[i - 1], backward[i + 1]
        next_forward[i] = most * up + least * down
        next_backward[i] = least * up + most * down


@njit(cache=True, error_model="numpy")
def _pass_remembered(share, known, forward, backward, next_forward, next_backward):
    """The same with unsteady friction: at the end of the cell before a node and at the beginning of
    that behind it the waves lose `known`. Five arrays are as many as a loop is vectorised with."""
    most, least = 0.5 * (1.0 + share), 0.5 * (1.0 - share)
    for i in range(1, len(forward) - 2):
        up, down, loss = forward[i - 1], backward[i + 1], (1.0 + share) * known[i]
        next_forward[i] = most * up + least * down - loss
        next_backward[i] = least * up + most * down + loss


@njit(cache=True, error_model="numpy")
def _read_flow(carried, forward, backward, known, flow, change):
    """Flow of a rigid pipe's interior nodes from the waves that leave them, and its change."""
    over = 1.0 / carried
    for i in range(1, len(known) - 2):
        new = over * (0.5 * (forward[i] - backward[i]) + known[i])
        change[i] = new - flow[i]
        flow[i] = new


@njit(cache=True, error_model="numpy")
def _solve_yielding_nodes(b, give, lag, pressure, flow, change, forward, backward, known):
    """The same where more is stored than by the elastic wall."""
    over = 0.5 / b
    for i in range(1, len(flow) - 2):
        up, down = forward[i - 1] - known[i], backward[i + 1] + known[i]
        pressure[i] = 0.5 * (up + down + 2.0 * lag[i]) / (1.0 + give[i])
        new = over * (up - down)
        change[i] = new - flow[i]
        flow[i] = new


@njit(cache=True, error_model="numpy")
def _update_waves(carried, give, lag, pressure, flow, known, forward, backward):
    """Waves that leave every node of a yielding pipe, less half the losses of an ordinary cell."""
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
def linearise_storage(law, filter_, u, state):
    """Set a storage's next step, q = b0 u + z, to the tangent of its law at the deviation `u`, Pa.

    state[1] is what has been stored, and what the present rate adds in the old rate's share of the
    step. The tangent's error in one step is corrected in the next.
    """
    volume, slope = evaluate_law(law, u / law[0])
    over = 1.0 / (NEW_RATE_SHARE * filter_[1])
    filter_[0] = over * slope / law[0]
    state[0] = over * (volume - state[1]) - filter_[0] * u


@njit(cache=True, error_model="numpy")
def _orifice_drop(excess, b, coefficient):
    """x |x| with b x |x| + K x = excess: the pressure over an orifice of coefficient K."""
    size = abs(excess)
    x = 2.0 * size / (coefficient + np.sqrt(coefficient**2 + 4.0 * b * size))
    return np.sign(excess) * x * x


@INLINED
def _solve_junction(supply, slope, first, stop, junctions, state, ends, kept, joint, load):
    """Pressures at a junction whose rungs are `first` to `stop`, in order from the pump.

    From the pump's side comes q = supply[0] - slope[0] p. A shunt takes b0 u + z of it, a series
    element a pressure b0 u + z, u being the deviation from `references`; so each rung transforms
    the pair into that of its far side. There it meets supply[1] - slope[1] p from the load's side.
    On the way back every rung's filter is updated. `ends` (2, pipes, 2) holds supply and slope of
    the branches, which get their pressure in `joint` (pipes, 2). `kept` (rungs, 3) has supply,
    slope and pressure on the pump's side of each rung.
    Returns the pressures on the pump's and the load's side.
    """
    kinds, filters, references = junctions.kinds, junctions.filters, junctions.references
    s, b = supply[0], slope[0]
    for r in range(first, stop):
        kept[r, 0], kept[r, 1] = s, b
        kind = kinds[r, 0]
        if kind == BRANCH:
            s += ends[0, kinds[r, 1], 0]
            b += ends[1, kinds[r, 1], 0]
            continue
        g, past = filters[r, 0], state[r, 0] - filters[r, 0] * references[r]
        if kind == SERIES:
            s = (s - b * past) / (1.0 + b * g)
            b = b / (1.0 + b * g)
        else:
            s -= past
            b += g
    s += supply[1]
    b += slope[1]
    law, coefficient, outside = load
    p = s / b
    if law == 1:
        p = outside
    elif law == 2:
        excess = s - b * outside
        opening = 1.0 + state[VALVE, 0]
        for _ in range(VALVE_PASSES):
            p = outside + _orifice_drop(excess, b, coefficient * opening)
            opening = 1.0 + state[VALVE, 0] + filters[VALVE, 0] * (p - references[VALVE])
        _filter(filters[VALVE], p - references[VALVE], state[VALVE])
    far = p
    for r in range(stop - 1, first - 1, -1):
        kind, b0 = kinds[r, 0], filters[r, 0]
        if kind == BRANCH:
            joint[kinds[r, 1], 0] = kept[r, 2] = p
            continue
        u = p - references[r]
        if kind == SERIES:
            past = state[r, 0] - b0 * references[r]
            q = (kept[r, 0] - kept[r, 1] * (p + past)) / (1.0 + kept[r, 1] * b0)
            p += b0 * q + past
            u = q - references[r]
        kept[r, 2] = p
        if kind == STORAGE:
            state[r, 1] += filters[r, 1] * (b0 * u + state[r, 0])
            linearise_storage(junctions.storages[kinds[r, 1]], filters[r], u, state[r])
        else:
            _filter(filters[r], u, state[r])
    return p, far


@INLINED
def _solve_inside(k, pipes, state, waves, leaving, known, lag, give, ends):
    """New state between the ends of pipe k, and in `ends` what the pipe brings to its junctions:
    q = +-(supply - slope p). Of a rigid pipe also the waves `leaving` its interior nodes."""
    first, last = pipes.offsets[k], pipes.offsets[k + 1] - 1
    near, theta = last - 1, pipes.thetas[k]
    zc, half_r, half_u, soft = pipes.parameters[k]
    gain = pipes.gains[k].sum()
    b, b_long = zc + half_r + half_u * gain, zc + theta * (half_r + half_u * gain)
    here = slice(first, last + 1)
    pressure, flow, change = state.pressure, state.flow, state.change
    forward, backward = waves
    if half_u > 0.0:
        _update_friction(
            half_u, pipes.decays[k], pipes.gains[k], pipes.pushes[k], flow[here], change[here],
            state.memory, first, known[here],
        )  # fmt: skip
    nonlinear = pipes.laws[k, 0] > 0.0
    if _is_rigid(k, pipes):
        carried = zc - half_r - half_u * gain
        before, after = (forward[here], backward[here]), (leaving[0][here], leaving[1][here])
        if half_u > 0.0:
            _pass_remembered(carried / b, known[here], *before, *after)
            _read_flow(carried, *after, known[here], flow[here], change[here])
        else:
            _pass_waves(carried / b, *before, *after)
    else:
        _update_wall(
            pipes.keep[k], pipes.follow[k], pipes.share[k], pressure[here],
            state.strain[:, here], lag[here],
        )  # fmt: skip
        if nonlinear:
            _linearise_law(
                pipes.laws[k], state.steady[here], pressure[here], state.stored[:, here], soft,
                give[here], lag[here],
            )  # fmt: skip
        _solve_yielding_nodes(
            b, give[here], lag[here], pressure[here], flow[here], change[here], forward[here],
            backward[here], known[here],
        )  # fmt: skip

    # Waves through the last cell, theta steps old.
    to_end = to_near = 0.0
    for age in range(4):
        to_end += pipes.taps[k, age] * state.history[k, 0, age]
        to_near += pipes.taps[k, age] * state.history[k, 1, age]
    # The node between an ordinary cell and the long one.
    give_long = theta * give[near]
    up = forward[near - 1] - known[near] + lag[near]
    down = to_near + theta * (known[near] + lag[near])
    new = (b_long * up + b * down) / (b_long * (1.0 + give[near]) + b * (1.0 + give_long))
    pressure[near] = new
    new = (up - (1.0 + give[near]) * new) / b
    change[near] = new - flow[near]
    flow[near] = new

    ends[0, k, 0] = (backward[first + 1] + known[first] + lag[first]) / b
    ends[1, k, 0] = (1.0 + give[first]) / b
    ends[0, k, 1] = (to_end - theta * (known[last] - lag[last])) / b_long
    ends[1, k, 1] = (1.0 + theta * give[last]) / b_long


@INLINED
def _solve_ends(k, pipes, state, leaving, known, lag, give, ends, joint):
    """New state at the ends of pipe k from the pressures at its junctions, and the waves `leaving`
    its nodes; those of a rigid pipe's interior nodes are there already."""
    first, last = pipes.offsets[k], pipes.offsets[k + 1] - 1
    near, theta = last - 1, pipes.thetas[k]
    zc, half_r, half_u, soft = pipes.parameters[k]
    here = slice(first, last + 1)
    pressure, flow, change, history = state.pressure, state.flow, state.change, state.history
    for side, i in ((0, first), (1, last)):
        pressure[i] = joint[k, side]
        sign = 1.0 if side == 0 else -1.0
        new = sign * (ends[1, k, side] * pressure[i] - ends[0, k, side])
        change[i] = new - flow[i]
        flow[i] = new

    # Friction now is half_r q + half_u sum y_k, sum y_k from `known`.
    total = half_r + half_u * pipes.gains[k].sum()
    nonlinear = pipes.laws[k, 0] > 0.0
    if nonlinear:
        _update_stored(pressure[here], state.stored[:, here], soft, give[here], lag[here])
    if not _is_rigid(k, pipes):
        _update_waves(
            zc - total, give[here], lag[here], pressure[here], flow[here], known[here],
            leaving[0][here], leaving[1][here],
        )  # fmt: skip
    else:
        for i in (first, near, last):
            wave = (zc - total) * flow[i] - known[i]
            leaving[0][i], leaving[1][i] = pressure[i] + wave, pressure[i] - wave
    for age in range(3, 0, -1):
        history[k, 0, age] = history[k, 0, age - 1]
        history[k, 1, age] = history[k, 1, age - 1]
    for side, i in ((0, near), (1, last)):
        wave, loss = zc * flow[i], theta * (known[i] + total * flow[i])
        yielded = theta * (give[i] * pressure[i] - lag[i])
        sign = 1.0 if side == 0 else -1.0
        history[k, side, 0] = pressure[i] + sign * (wave - loss) - yielded


@njit(cache=True, error_model="numpy")
def advance(source, nodes, pipes, junctions, state):
    """One period of the flow `source` (M,), m3/s, at the pump; `state` is changed in place.

    `pipes`, `junctions` and `state` are the tuples of `kernel_arrays`. Returns pressure and flow
    (len(nodes), M) at `nodes`, of which ~r is the pump's side of rung r.
    """
    count, size = len(pipes.thetas), len(state.pressure)
    seen = np.empty((2, len(nodes), len(source)))
    # (u/2)(sum z_k - G q): friction of the past at the new point. Rows of one array would not do:
    # the compiler does not know that a row is contiguous, and vectorises no loop over it.
    known, lag, give = np.zeros(size), np.zeros(size), np.zeros(size)
    ends = np.zeros((2, count, 2))  # supply and slope that a pipe brings to the joint at each end
    carried = np.zeros(count)  # c of the waves p +- (c q - known) in rigid pipes
    for k in range(count):
        give[pipes.offsets[k] : pipes.offsets[k + 1]] = pipes.parameters[k, 3]
        if _is_rigid(k, pipes):
            zc, half_r, half_u, _ = pipes.parameters[k]
            carried[k] = zc - half_r - half_u * pipes.gains[k].sum()
    homes = np.searchsorted(pipes.offsets, nodes, side="right") - 1  # the pipes of `nodes`
    leaving = np.empty_like(state.forward), np.empty_like(state.backward)
    _take_steps(
        source, nodes, homes, pipes, junctions, state, leaving, known, lag, give, ends, carried,
        np.empty((count, 2)), np.empty((2, 2)), np.empty((len(junctions.kinds), 3)), seen,
    )  # fmt: skip
    if len(source) % 2:  # the waves that left last are not in the state's arrays
        state.forward[:], state.backward[:] = leaving
    for k in range(count):
        if carried[k] > 0.0:
            here = slice(pipes.offsets[k], pipes.offsets[k + 1])
            state.pressure[here] = 0.5 * (state.forward[here] + state.backward[here])
            state.flow[here] = 0.5 * (state.forward[here] - state.backward[here]) + known[here]
            state.flow[here] /= carried[k]
    return seen[0], seen[1]


@uncounted
def _take_steps(
    source, nodes, homes, pipes, junctions, state, leaving, known, lag, give, ends, carried,
    joint, meeting, kept, seen,
):  # fmt: skip
    """The steps of `advance`, which has the arrays that they work in. An odd number of steps ends
    with the last waves in `leaving`."""
    count, main = len(pipes.thetas), pipes.main
    law, coefficient, outside, constant, conductance = junctions.load
    waves, supply, slope = (state.forward, state.backward), meeting[0], meeting[1]
    for n in range(len(source)):
        for k in range(count):
            _solve_inside(k, pipes, state, waves, leaving, known, lag, give, ends)
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
            before, after = _solve_junction(
                supply, slope, junctions.rungs[j], junctions.rungs[j + 1], junctions,
                state.filter_states, ends, kept, joint, far_end,
            )  # fmt: skip
            if j > 0:
                joint[j - 1, 1] = before
            if j < main:
                joint[j, 0] = after
        for k in range(main, count):
            joint[k, 1] = ends[0, k, 1] / ends[1, k, 1]  # a branch's closed end
        for k in range(count):
            _solve_ends(k, pipes, state, leaving, known, lag, give, ends, joint)
        waves, leaving = leaving, waves
        for j in range(len(nodes)):
            i, k = nodes[j], homes[j]
            if i < 0:
                supplied, sloping, pressure = kept[~i]
                seen[0, j, n], seen[1, j, n] = pressure, supplied - sloping * pressure
                continue
            seen[0, j, n], seen[1, j, n] = state.pressure[i], state.flow[i]
            if carried[k] > 0.0:
                seen[0, j, n] = 0.5 * (waves[0][i] + waves[1][i])
                seen[1, j, n] = (0.5 * (waves[0][i] - waves[1][i]) + known[i]) / carried[k]
