"""Calibration in the paper's form: one objective for each sensor, by NSGA-II (Deb et al. 2002).

The objective of a sensor is the squared norm of measured minus predicted ripple over that of the
measured ripple. By Parseval's theorem the harmonics give what the time signals would. Parameters
lie in a box around the data sheet and have no priors. The shaft angles are not searched: they are
aligned for each candidate, which makes the box smaller at no loss.

The population passes through the frequency limits of the default fit, for the same reason. The
compromise is the member of the Pareto set with the least sum of objectives.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from rippletwin.calibration.calibrate import (
    DEFAULTS,
    Calibration,
    Settings,
    conclude,
)
from rippletwin.calibration.frequency_continuation import continuation_limits
from rippletwin.calibration.likelihood import EVENNESS, Likelihood
from rippletwin.calibration.misfit import readings_by_sensor, relative_misfit
from rippletwin.calibration.shaft_angles import align_shaft_angles
from rippletwin.spectra.frequency_selection import check_load_table, check_sources
from rippletwin.twin.twin import Twin

BOX = 3.0  # half the width of the box, prior standard deviations


@dataclass(frozen=True)
class ParetoSet:
    """Members that no other dominates, the compromise first.

    theta         (K, P)
    objectives    (K, S)
    calibration   that of the compromise, comparable with that of the default fit
    """

    theta: np.ndarray
    objectives: np.ndarray
    calibration: Calibration


def calibrate_pareto(
    twin: Twin,
    observations: Sequence,
    settings: Settings = DEFAULTS,
    population: int = 60,
    generations: int = 100,
    seed: int = 0,
    progress: Callable[[str], None] | None = None,
) -> ParetoSet:
    """The Pareto set of the sensors' misfits; deterministic for a seed.

    population    members
    generations   for each frequency limit
    progress      is called with a sentence after each limit

    Raises ValueError without observations, InputError as `check_sources` and `check_load_table`.
    """
    from pymoo.algorithms.moo.nsga2 import NSGA2
    from pymoo.core.problem import ElementwiseProblem
    from pymoo.optimize import minimize

    if not observations:
        raise ValueError("calibration needs at least one observation")
    check_sources(observations)
    whole = Likelihood(twin, observations, settings.max_frequency_hz, evenness=EVENNESS)
    check_load_table(whole.observations, twin.rig)
    limits = continuation_limits(whole.observations, settings.limits_hz)
    searched = np.array([not p.flat for p in twin.parameters])

    class Ripple(ElementwiseProblem):
        def __init__(self, likelihood):
            self.likelihood = likelihood
            sensors = len(sensor_misfits(likelihood, twin.theta))
            super().__init__(n_var=int(searched.sum()), n_obj=sensors, xl=-BOX, xu=BOX)

        def whole(self, x):
            theta = twin.theta.copy()
            theta[searched] = x
            return align_shaft_angles(self.likelihood, theta, between=True)[1]

        def _evaluate(self, x, out, *args, **kwargs):
            out["F"] = sensor_misfits(self.likelihood, self.whole(x))

    rng = np.random.default_rng(seed)
    members = np.clip(rng.standard_normal((population, searched.sum())), -BOX, BOX)
    members[0] = twin.theta[searched]
    for stage, limit in enumerate(limits):
        problem = Ripple(whole.below(limit))
        result = minimize(
            problem,
            NSGA2(pop_size=population, sampling=members),
            ("n_gen", generations),
            seed=seed + stage,
        )
        members = result.pop.get("X")
        if progress is not None:
            best = np.atleast_2d(result.F)
            progress(f"below {limit:.0f} Hz: {len(best)} members, {best.min(0)}")
    # of a single objective there is one best member, without an axis of members
    found, objectives = np.atleast_2d(result.X), np.atleast_2d(result.F)
    order = np.argsort(np.sum(objectives, axis=1))
    theta = np.array([problem.whole(x) for x in found[order]])
    return ParetoSet(theta, objectives[order], conclude(problem.likelihood, theta[0], settings))


def sensor_misfits(likelihood: Likelihood, theta: np.ndarray) -> np.ndarray:
    """Squared relative misfit (S,) of each sensor at theta (P,), and of input impedances where
    there are any, all observations together; a free source has its most likely amplitude."""
    readings = readings_by_sensor(likelihood, theta).values()
    return np.array([relative_misfit(*each) for each in readings]) ** 2
