"""What an explanation's parameters are, and how well they are known.

The curvature at a posterior mode says how the posterior falls next to it and no further. A side
branch somewhat shorter and wider, or a volume further down the line, may do as well beyond a ridge
that the curvature knows nothing of, and a model error that is estimated along with the parameters
makes the tails heavier than a normal distribution's. So each parameter of an effect is held ever
further off its mode, all else refitted and the errors estimated anew: the interval ends where minus
the log posterior has risen by half the 95 % quantile of chi-squared with one degree of freedom, and
stays above that (Venzon and Moolgavkar 1988, Appl. Statist. 37:87).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.levenberg_marquardt import descend
from rippletwin.calibration.posterior import Posterior
from rippletwin.explanation.fit_jobs import Workers
from rippletwin.twin.twin import Twin

INTERVAL_RISE = 0.5 * float(chdtri(1, 0.05))
MAX_RISE = 4.0 * INTERVAL_RISE  # nothing is sought further out
PROFILE_DISTANCES = (1.5, 2.5, 4.0, 6.0)  # standard deviations by the curvature
PROFILE_STEPS = 8  # of a descent with one parameter held; it starts from the last
BETTER_MODE_GAIN = 0.5  # a mode that is lower by as much is another
MAX_MODE_CHANGES = 3  # followed, one after the other


class ProfileTrace(NamedTuple):
    """From the mode in one direction of one parameter.

    end     coordinate at which the interval ends
    value   least minus log posterior on the way, at `theta` (P,)
    """

    end: float
    value: float
    theta: np.ndarray


def add_profile_intervals(pool: Workers, best: Fit, modes: int = MAX_MODE_CHANGES) -> Fit:
    """`best` with the ends of its effects' intervals, or of the better mode that a walk came to."""
    held = sorted({k for _, _, own in own_parameter_indices(best.twin) for k in own})
    common = {
        "fit": best,
        "missed": _compliance_correction(pool, best) if best.has_nonlinear_compliance else None,
    }
    jobs = [{**common, "held": k, "side": side} for k in held for side in (-1, 1)]
    walks = pool.map(trace_profile, jobs)
    lowest = min(walks, key=lambda w: w.value, default=None)
    if lowest is not None and lowest.value < best.objective - BETTER_MODE_GAIN and modes > 1:
        better = pool.fit([{"hypothesis": best.hypothesis, "theta": lowest.theta}])[0]
        return add_profile_intervals(pool, better, modes - 1)
    sides = zip(walks[::2], walks[1::2])
    return replace(
        best, interval_ends={k: (low.end, high.end) for k, (low, high) in zip(held, sides)}
    )


def _compliance_correction(pool: Workers, fit: Fit) -> np.ndarray:
    """What derivatives at the mode must know of what the line stores; the same for all walks."""
    posterior = Posterior(fit.twin, pool.observations, None, fit.source_free)
    posterior.use_full_jacobian(fit.twin.theta)
    return posterior.forward.jacobian_correction


def trace_profile(base: Twin, observations: Sequence, job: dict) -> ProfileTrace:
    """Hold the parameter with the index `held` of `fit` further and further to one `side`."""
    fit, k, side = job["fit"], job["held"], job["side"]
    posterior = Posterior(fit.twin, observations, None, fit.source_free)
    posterior.forward.jacobian_correction = job.get("missed")  # none where the line stores nothing
    posterior.estimate_errors(posterior.predict(fit.twin.theta), fit.twin.theta)
    sd = fit.sd[k]
    along = fit.covariance[:, k] / sd  # what all else does where this one moves by its deviation
    theta, last, values, thetas = fit.twin.theta, 0.0, [fit.objective], [fit.twin.theta]
    for distance in PROFILE_DISTANCES:
        start = theta + side * (distance - last) * along
        # First with the errors of the last place: judged by where it starts, a descent would take
        # what the others have yet to make good for an error of the source, and rest there.
        theta, _ = descend(posterior, start, PROFILE_STEPS, fixed=[k], errors=False)
        theta, value = descend(posterior, theta, PROFILE_STEPS, fixed=[k])
        if not np.isfinite(value):
            break
        last = distance
        values.append(value)
        thetas.append(theta)
        if value - min(values) > MAX_RISE:
            break
    least = int(np.argmin(values))
    end = interpolate_crossing((0.0, *PROFILE_DISTANCES), np.array(values) - values[0])
    return ProfileTrace(float(fit.twin.theta[k] + side * end * sd), values[least], thetas[least])


def interpolate_crossing(distances: Sequence[float], rises: np.ndarray) -> float:
    """The last distance at which `rises` pass RISE, their root being a straight line between two;
    the last of all where they do not."""
    roots = np.sqrt(np.maximum(rises, 0.0))
    goal = np.sqrt(INTERVAL_RISE)
    below = int(np.flatnonzero(rises < INTERVAL_RISE)[-1])
    if below == len(rises) - 1:
        return distances[below]
    share = (goal - roots[below]) / (roots[below + 1] - roots[below])
    return distances[below] + share * (distances[below + 1] - distances[below])


def own_parameter_indices(twin: Twin) -> list[tuple]:
    """(effect, place, indices of its parameters) of every effect.

    An effect without parameters of its own works through the fluid's viscosity, which stands in.
    """
    found = []
    for effect, place in twin.effects:
        label = f"{effect.name}@{place}"
        own = [k for k, p in enumerate(twin.parameters) if p.place == label]
        found.append((effect, place, own or [twin.index["viscosity"]]))
    return found


def effect_intervals(fit: Fit) -> list[dict]:
    """Each effect with its place and its parameters' values and 95 % intervals."""
    twin, found = fit.twin, []
    for effect, place, own in own_parameter_indices(twin):
        parameters = {}
        for k in own:
            p = twin.parameters[k]
            ends = sorted(float(p.value(u)) for u in fit.interval(k))
            name = p.name.split(".")[-1]
            name = "kinematic_viscosity" if name == "viscosity" else name
            value = float(p.value(twin.theta[k]))
            parameters[name] = {"value": value, "ci95": ends, "unit": p.unit}
        found.append({"effect": effect, "place": place, "parameters": parameters})
    return found


def pump_numbers(fit: Fit) -> dict[str, dict]:
    """The pump's numbers by name with data sheet's value and 95 % interval; empty where the twin
    takes the sheet's."""
    found = {}
    for k, p in enumerate(fit.twin.parameters):
        if p.place == "pump":
            ends = sorted(float(p.value(u)) for u in fit.interval(k))
            value = float(p.value(fit.twin.theta[k]))
            found[p.name] = {"value": value, "sheet": p.nominal, "ci95": ends, "unit": p.unit}
    return found
