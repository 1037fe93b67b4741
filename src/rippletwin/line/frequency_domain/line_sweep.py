"""The sweep of `FrequencyDomainLine` from the load to the pump, compiled.

A plan (N, 3) lists its steps: what is done, to which segment, insert, position or outflow, and over
what distance.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rippletwin.line.compilation import uncounted

SAME_DISTANCE = 1e-12
"""Relative difference up to which a walk takes the factor of the walk before: the cells of a
nonlinear compliance are evenly spaced to rounding."""
ENTER, WALK, RECORD, SHUNT, SERIES, OUTFLOW = range(6)


@njit(cache=True)
def order_steps(lengths, at, what, index):
    """The plan (N, 3) of steps from the load to the pump; empty if one lies outside the line.

    lengths   (n,) of the segments, m
    at        (M,) positions of the steps, m
    what      (M,) what each does: RECORD, SHUNT, SERIES or OUTFLOW
    index     (M,) to which insert, position or outflow
    """
    starts = np.cumsum(lengths) - lengths
    here = np.sum(lengths)
    order = np.argsort(-at, kind="mergesort")  # stable: steps at one place keep their order
    plan = np.zeros((2 * len(at) + 2 * len(lengths) + 2, 3))
    if len(at) and (at[order[0]] > here * (1 + 1e-12) or at[order[-1]] < 0.0):
        return plan[:0]
    k = len(lengths) - 1
    plan[0, 0], plan[0, 1], n = ENTER, k, 1
    for m in range(len(at) + 1):
        x = at[order[m]] if m < len(at) else 0.0
        while k > 0 and x < starts[k]:
            plan[n, 0], plan[n, 1], plan[n, 2] = WALK, k, here - starts[k]
            here = starts[k]
            k -= 1
            plan[n + 1, 0], plan[n + 1, 1] = ENTER, k
            n += 2
        plan[n, 0], plan[n, 1], plan[n, 2] = WALK, k, max(here - x, 0.0)
        here, n = min(x, here), n + 1
        if m < len(at):
            step = what[order[m]]
            plan[n, 0], plan[n, 1] = step, index[order[m]]
            n += 1
    return plan[:n]


@njit(cache=True, error_model="numpy")
def sweep_line(series, shunt, plan, values, load, outflow, stops):
    """Follow `plan` (N, 3) at every frequency for every load state; see
    `FrequencyDomainLine.sweep`.

    series, shunt   (n, F) impedance and admittance per metre, Pa s/m4 and m2/(Pa s)
    values          (I, F) of the inserts, Pa s/m3 in series, m3/(Pa s) as a shunt
    load            (m, 2, F) pressure and flow at the load
    outflow         (K, F) prescribed outflows, m3/s
    stops           number of positions that are recorded
    """
    states, count = load.shape[0], load.shape[2]
    pressure = np.empty((stops, states, count), np.complex128)
    flow = np.empty((stops, states, count), np.complex128)
    entry = np.empty((states, 2, count), np.complex128)
    total = np.empty(count, np.complex128)
    at_step = np.empty((4, states), np.complex128)  # p, q and the waves f and b of each state
    factors = np.empty(len(plan), np.complex128)
    _sweep_frequencies(
        series, shunt, plan, values, load, outflow, at_step[0], at_step[1], at_step[2], at_step[3],
        factors, pressure, flow, entry, total,
    )  # fmt: skip
    return pressure, flow, entry, total


@uncounted
def _take_root(z):
    """Square root of a complex number, its real part not negative. Quicker than NumPy's, which
    provides for squares that overflow."""
    size = np.sqrt(z.real**2 + z.imag**2)
    larger = np.sqrt(0.5 * (size + abs(z.real)))
    lesser = 0.5 * abs(z.imag) / larger
    re, im = (larger, lesser) if z.real >= 0.0 else (lesser, larger)
    return complex(re, im if z.imag >= 0.0 else -im)


@uncounted
def _sweep_frequencies(
    series, shunt, plan, values, load, outflow, p, q, f, b, factors, pressure, flow, entry, total
):
    """The sweep of `sweep_line`, which makes the arrays that are filled or worked in."""
    states = len(p)
    for i in range(len(total)):
        for m in range(states):
            p[m], q[m] = load[m, 0, i], load[m, 1, i]
        gamma = zc = yc = 0j
        distance, factor, square = 0.0, 1.0 + 0j, 1.0 + 0j
        behind = 1.0 + 0j  # the factors taken out so far
        for n in range(len(plan)):
            what, index = int(plan[n, 0]), int(plan[n, 1])
            if what == ENTER:
                distance = 0.0  # of the last walk
                gamma = _take_root(series[index, i] * shunt[index, i])
                over = gamma.conjugate() / (gamma.real**2 + gamma.imag**2)
                zc, yc = series[index, i] * over, shunt[index, i] * over  # on gamma's branch
                for m in range(states):
                    zq = zc * q[m]
                    f[m], b[m] = 0.5 * (p[m] + zq), 0.5 * (p[m] - zq)
            elif what == WALK:
                if plan[n, 2] == 0.0:
                    factors[n] = 1.0
                    continue
                if abs(plan[n, 2] - distance) > SAME_DISTANCE * distance:
                    distance = plan[n, 2]
                    factor = np.exp(-gamma * distance)
                    square = factor * factor
                factors[n] = factor
                behind *= factor
                for m in range(states):
                    b[m] *= square
                    p[m], q[m] = f[m] + b[m], (f[m] - b[m]) * yc
            elif what == OUTFLOW:
                flow_out = outflow[index, i] * behind
                m = states - 1
                q[m] += flow_out
                f[m] += 0.5 * zc * flow_out
                b[m] -= 0.5 * zc * flow_out
            elif what == SHUNT:
                for m in range(states):
                    flow_out = values[index, i] * p[m]
                    q[m] += flow_out
                    f[m] += 0.5 * zc * flow_out
                    b[m] -= 0.5 * zc * flow_out
            elif what == SERIES:
                for m in range(states):
                    drop = 0.5 * values[index, i] * q[m]
                    p[m] += 2.0 * drop
                    f[m] += drop
                    b[m] += drop
            else:
                for m in range(states):
                    pressure[index, m, i], flow[index, m, i] = p[m], q[m]
        for m in range(states):
            entry[m, 0, i], entry[m, 1, i] = p[m], q[m]
        # Back down from the pump, each place gets the decay between it and the pump.
        decay = 1.0 + 0j
        for n in range(len(plan) - 1, -1, -1):
            what, index = int(plan[n, 0]), int(plan[n, 1])
            if what == WALK:
                decay *= factors[n]
            elif what == RECORD:
                for m in range(states):
                    pressure[index, m, i] *= decay
                    flow[index, m, i] *= decay
        total[i] = decay
