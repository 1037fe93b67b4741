"""The chambers' equations and their solution in time.

For the absolute pressure p of each chamber, with volume V and flows q (Edge & Darling 1989, J. Dyn.
Sys. Meas. Control 111, 307; here without the oil's inertia in the ports):

    V dc/dt = -dV/dt - q_delivery + q_suction - q_leak,    c(p) = p/B - x p0/p

so that dc = dp/B_eff with 1/B_eff = 1/B + x p0/p^2: liquid of bulk modulus B with the volume
fraction x of air at pressure p0, compressed isothermally (Merritt 1967, Hydraulic Control
Systems, ch. 2). Air keeps p positive where a closed chamber would pull the liquid apart.

Flows through ports and leaks are turbulent orifices, linear within `SMOOTHING` of no drop. That
makes the equations stiff (rates near 1e7 1/s), so each step is a two-stage diagonally implicit
Runge-Kutta step, second order and L-stable (Alexander 1977, SIAM J. Numer. Anal. 14, 1006). In
each stage the chambers and the outlet, p_outlet = c_plus + impedance * q, are one Newton problem:
coupling them one after the other loses flow.
"""

from __future__ import annotations

import numpy as np
from numba import njit

from rippletwin.case.model import ATMOSPHERE
from rippletwin.line.compilation import uncounted

SMOOTHING = 1e3  # Pa, the drop below which an orifice is linear
GAMMA = 1.0 - np.sqrt(0.5)  # share of a step at its first stage
NEWTON_TOLERANCE = 1e-11  # of a Newton step, relative to the largest pressure
TANGENT_STEPS = 10  # Newton steps with the true slopes; then steeper ones, see `orifice_flow`
MAX_NEWTON = 80


@uncounted
def compression(p, bulk_modulus, air):
    """c(p), and dc/dp in 1/Pa, of liquid with the volume fraction `air` of free air; `p` in Pa
    absolute, `bulk_modulus` in Pa."""
    gas = air * ATMOSPHERE / p
    return p / bulk_modulus - gas, 1.0 / bulk_modulus + gas / p


@uncounted
def orifice_flow(conductance, drop, tangency):
    """Flow through a smoothed orifice, m3/s, and a slope, m3/(Pa s), at a pressure `drop`, Pa;
    `conductance` = Cd A sqrt(2/rho), m3/s/sqrt(Pa).

    The slope is the tangent's for `tangency` 1 and the chord's from the origin for 0. On a square
    root Newton's method alternates between +drop and -drop; a slope in between converges.
    """
    square = drop * drop + SMOOTHING * SMOOTHING
    root = 1.0 / np.sqrt(np.sqrt(square))
    return conductance * drop * root, conductance * root * (
        1.0 - 0.5 * tangency * drop * drop / square
    )


@uncounted
def _eliminate(matrix, rhs):
    """Solve in place. Rows are diagonally dominant by construction, so there is no pivoting."""
    n = len(rhs)
    for i in range(n):
        for j in range(i + 1, n):
            if matrix[j, i] != 0.0:
                factor = matrix[j, i] / matrix[i, i]
                for k in range(i + 1, n):
                    matrix[j, k] -= factor * matrix[i, k]
                rhs[j] -= factor * rhs[i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            rhs[i] -= matrix[i, k] * rhs[k]
        rhs[i] /= matrix[i, i]


@uncounted
def solve_stage(
    p, rate, target, step, tables, pump, case_leak, cross_leak, c_plus, impedance, matrix, rhs
):
    """Pressures that satisfy c(p) = target + step * dc/dt at one instant.

    p          (n + 1,) first guess, overwritten: n chambers, then the outlet, Pa
    rate       (n,) overwritten by dc/dt, 1/s
    target     (n,) known part of c
    step       GAMMA times the time step, s
    tables     (4, n) volume m3, dV/dt m3/s, delivery and suction conductance, of each chamber
    pump       (bulk modulus, air fraction, laminar leakage m3/s/Pa, suction pressure)
    case_leak  (n,) conductance from each chamber to the case
    cross_leak (n,) conductance from each chamber to the next
    matrix, rhs   (n + 1, n + 1), (n + 1,) room for Newton's linear system
    Returns the outlet flow, m3/s; nan where Newton's method does not converge.
    """
    n = len(target)
    bulk_modulus, air, laminar, suction_pressure = pump
    for iteration in range(MAX_NEWTON):
        tangency = 1.0 if iteration < TANGENT_STEPS else 2.0 / 3.0
        matrix[:] = 0.0
        delivered = 0.0
        slopes = 0.0
        for k in range(n):
            rate[k] = -tables[1, k]
        for k in range(n):
            q, slope = orifice_flow(tables[2, k], p[k] - p[n], tangency)
            delivered += q
            slopes += slope
            inflow = -q
            matrix[k, k] += slope
            matrix[k, n] = -slope
            matrix[n, k] = -impedance * slope
            q, slope = orifice_flow(tables[3, k], p[k] - suction_pressure, tangency)
            inflow -= q
            matrix[k, k] += slope
            q, slope = orifice_flow(case_leak[k], p[k] - suction_pressure, tangency)
            inflow -= q + laminar * (p[k] - suction_pressure)
            matrix[k, k] += slope + laminar
            rate[k] += inflow
            if cross_leak[k] > 0.0:
                m = (k + 1) % n
                q, slope = orifice_flow(cross_leak[k], p[k] - p[m], tangency)
                rate[k] -= q
                rate[m] += q
                matrix[k, k] += slope
                matrix[m, m] += slope
                matrix[k, m] -= slope
                matrix[m, k] -= slope
        for k in range(n):
            rate[k] /= tables[0, k]
            for m in range(n + 1):
                matrix[k, m] *= step / tables[0, k]
            c, slope = compression(p[k], bulk_modulus, air)
            matrix[k, k] += slope
            rhs[k] = target[k] + step * rate[k] - c
        matrix[n, n] = 1.0 + impedance * slopes
        rhs[n] = c_plus + impedance * delivered - p[n]
        _eliminate(matrix, rhs)
        largest = highest = total = 0.0
        for k in range(n + 1):
            new = p[k] + rhs[k]
            if air > 0.0 and new < 0.2 * p[k]:
                new = 0.2 * p[k]  # c(p) is defined for positive p only
            largest = max(largest, abs(new - p[k]))
            p[k] = new
            highest = max(highest, abs(new))
            total += new
        if largest <= NEWTON_TOLERANCE * highest and np.isfinite(total):  # `max` passes over nan
            return delivered
    return np.nan


@njit(cache=True, error_model="numpy")
def simulate_revolution(
    p,
    tables,
    stage_tables,
    step,
    pump,
    case_leak,
    cross_leak,
    line,
    line_p,
    line_q,
    sensors,
    outlet,
):
    """One revolution of K steps, from the state `p` and the line's, both overwritten.

    All pressures are absolute.

    p             (n + 1,) pressures of the chambers and the outlet, Pa
    tables        (K, 4, n) at the end of each step, as for `solve_stage`
    stage_tables  (K, 4, n) at its first stage
    line          (Zc, half the friction of a cell Pa s/m3, K_v of the orifice, pressure behind it)
    line_p/_q     (cells + 1,) state of the line, empty where the outlet's pressure is given
    sensors       (S, 5): first of four neighbouring nodes, and their weights
    outlet        (K,) the outlet's pressure at the end of each step, Pa; empty with a line
    Returns flow (K,), m3/s, pressures (K, n + 1) and sensor pressures (K, S), Pa, each at a step's
    end.
    """
    steps, _, n = tables.shape
    flow = np.empty(steps)
    pressures = np.empty((steps, n + 1))
    readings = np.empty((steps, len(sensors)))
    work = np.empty((4, n))
    _take_steps(
        p, tables, stage_tables, step, pump, case_leak, cross_leak, line, line_p, line_q, sensors,
        outlet, flow, pressures, readings, work[0], work[1], work[2], work[3],
        np.empty((n + 1, n + 1)), np.empty(n + 1), np.empty_like(line_p), np.empty_like(line_q),
    )  # fmt: skip
    return flow, pressures, readings


@uncounted
def _take_steps(
    p, tables, stage_tables, step, pump, case_leak, cross_leak, line, line_p, line_q, sensors,
    outlet, flow, pressures, readings, rate, second, content, target, matrix, rhs, new_p, new_q,
):  # fmt: skip
    """The steps of `simulate_revolution`, which makes the arrays that are filled or worked in."""
    n = len(rate)
    zc, half, k_v, behind = line
    cells = len(line_p) - 1
    piped = cells > 0
    impedance = zc + half if piped else 0.0
    c_old = line_p[0] - impedance * line_q[0] if piped else outlet[len(flow) - 1]
    for i in range(len(flow)):
        # C- characteristic arriving at the pump (Wylie & Streeter 1993, ch. 3)
        c_new = line_p[1] - (zc - half) * line_q[1] if piped else outlet[i]
        for k in range(n):
            content[k], _ = compression(p[k], pump[0], pump[1])
        # With twice its curvature at the stage, a pressure that is given leaves the flow of a wide
        # port, which is its derivative, right to second order at the end of the step.
        bend = 0.0 if piped else outlet[(i + 1) % len(flow)] - 2.0 * c_new + c_old
        c_stage = c_old + GAMMA * (c_new - c_old + (GAMMA - 0.5) * bend)
        first = solve_stage(
            p, rate, content, GAMMA * step, stage_tables[i], pump, case_leak, cross_leak,
            c_stage, impedance, matrix, rhs,
        )  # fmt: skip
        for k in range(n):
            target[k] = content[k] + (1.0 - GAMMA) * step * rate[k]
        flow[i] = solve_stage(
            p, second, target, GAMMA * step, tables[i], pump, case_leak, cross_leak,
            c_new, impedance, matrix, rhs,
        )  # fmt: skip
        if np.isnan(first):
            flow[i] = np.nan
        c_old = c_new
        for k in range(n + 1):
            pressures[i, k] = p[k]
        if piped:
            new_p[0], new_q[0] = p[n], flow[i]
            for j in range(1, cells):
                forward = line_p[j - 1] + (zc - half) * line_q[j - 1]
                backward = line_p[j + 1] - (zc - half) * line_q[j + 1]
                new_p[j] = 0.5 * (forward + backward)
                new_q[j] = 0.5 * (forward - backward) / (zc + half)
            # orifice q = K_v sqrt(p - behind) met by the C+ characteristic, on which
            # p = forward - (zc + half) q
            forward = line_p[cells - 1] + (zc - half) * line_q[cells - 1]
            b = (zc + half) * k_v
            root = 0.5 * (np.sqrt(b * b + 4.0 * max(forward - behind, 0.0)) - b)
            new_p[cells], new_q[cells] = behind + root * root, k_v * root
            for j in range(cells + 1):
                line_p[j], line_q[j] = new_p[j], new_q[j]
        for j in range(len(sensors)):
            first_node = int(sensors[j, 0])
            readings[i, j] = 0.0
            for m in range(4):
                readings[i, j] += sensors[j, 1 + m] * line_p[first_node + m]
