"""The arrays of a discretised line as the kernel of the method of characteristics takes them.

P pipes (those of the line first, then branches), n nodes of all pipes one after the other, R rungs
of all junctions, T recursion terms of friction, K terms of a yielding wall.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class PipeArrays(NamedTuple):
    """Constants of the pipes.

    main        number of pipes of the line; the others are branches
    offsets     (P + 1,) first node of each pipe
    thetas      (P,) length of its last cell in steps, [2, 3)
    taps        (P, 4) weights of the last four waves that enter it
    parameters  (P, 4) Zc and r/2, Pa s/m3; u/2, Pa s/m3; sum_k share_k phi_k of the wall
    decays, gains, pushes  (P, T) recursion of unsteady friction: see `Grid`
    keep, follow, share    (P, K) recursion of a yielding wall: b <- keep b + follow p
    laws        (P, 1 + L) P in Pa and rho a^2 c_k of the nonlinear compliance; P = 0 without one
    """

    main: int
    offsets: np.ndarray
    thetas: np.ndarray
    taps: np.ndarray
    parameters: np.ndarray
    decays: np.ndarray
    gains: np.ndarray
    pushes: np.ndarray
    keep: np.ndarray
    follow: np.ndarray
    share: np.ndarray
    laws: np.ndarray


class JunctionArrays(NamedTuple):
    """Constants of the junctions and of the load.

    rungs       (junctions + 1,) first rung of each
    kinds       (R, 2) SHUNT, SERIES, BRANCH or STORAGE; a branch's pipe, a storage's row in
                `storages`
    filters     (R + 1, 5) b0, b1, b2, a1, a2 of each rung's element; the last is the load's valve.
                Of a storage b0 is the tangent at its last pressure, which is changed in place, and
                b1 the time step
    storages    (N, 1 + L) P in Pa and c_k, m3, of each storage; one row of zeros without any
    references  (R + 1,) steady pressure or flow from which an element's input is measured
    load        (law, coefficient, pressure behind it, constant flow, conductance), law 0 linear,
                1 open, 2 orifice
    """

    rungs: np.ndarray
    kinds: np.ndarray
    filters: np.ndarray
    storages: np.ndarray
    references: np.ndarray
    load: tuple


class StateArrays(NamedTuple):
    """The state, changed in place.

    pressure, flow      (n,) Pa, m3/s
    forward, backward   (n,) p + Zc q and p - Zc q that leave each node, less half a cell's losses
    strain              (K, n) states of a yielding wall
    steady              (n,) Pa, from which a nonlinear compliance measures the pressure
    stored              (3, n) of the nonlinear compliance, times rho a^2: share stored, half a step
                        times its rate, and what it adds to the wall's lag
    memory              (T, n) states of unsteady friction
    change              (n,) of the flow over the last step, where friction has a memory
    history             (P, 2, 4) last four waves into the long cell, towards the load and the pump
    filter_states       (R + 1, 2)
    """

    pressure: np.ndarray
    flow: np.ndarray
    forward: np.ndarray
    backward: np.ndarray
    strain: np.ndarray
    steady: np.ndarray
    stored: np.ndarray
    memory: np.ndarray
    change: np.ndarray
    history: np.ndarray
    filter_states: np.ndarray
