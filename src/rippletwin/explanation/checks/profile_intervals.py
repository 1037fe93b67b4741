"""Profile intervals: how well are the parameters of an explanation known?

The curvature at a posterior mode describes its surroundings only. A side branch somewhat shorter
and wider may fit equally well beyond a ridge, and an estimated model error makes the tails heavier
than those of a normal distribution. So each parameter of an effect is fixed ever further from its
mode, and everything else is refitted, with the errors estimated again. The interval ends where
minus the log posterior has risen by half the 95 % quantile of chi-squared with one degree of
freedom, and stays above (Venzon and Moolgavkar 1988, Appl. Statist. 37:87).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri

from rippletwin.calibration.fit import HALF_INTERVAL, Fit
from rippletwin.calibration.levenberg_marquardt import descend
from rippletwin.calibration.posterior import Posterior
from rippletwin.explanation.fit_jobs import FitJob, FromTheta, Workers
from rippletwin.twin.twin import Twin

INTERVAL_RISE = 0.5 * float(chdtri(1, 0.05))  # of minus the log posterior at an interval's end
MAX_RISE = 4.0 * INTERVAL_RISE  # at which a profile ends
PROFILE_DISTANCES = (1.5, 2.5, 4.0, 6.0)  # from the mode, in standard deviations by the curvature
PROFILE_STEPS = 8  # Levenberg-Marquardt steps per point; each starts from the last point
BETTER_MODE_GAIN = 0.5  # log posterior by which a point of a profile belongs to a better mode
MAX_MODE_CHANGES = 2  # better modes that a profile finds and that are taken


@dataclass(frozen=True, eq=False)
class ProfileJob:
    """The profile of one parameter of a fit in one direction.

    index                parameter that is fixed
    side                 -1 or 1
    jacobian_correction  (P, S, F) contribution of the nonlinear compliance to the Jacobian at the
                         mode; None for a line without
    """

    fit: Fit
    index: int
    side: int
    jacobian_correction: np.ndarray | None = None


class ProfileTrace(NamedTuple):
    """Result of a `ProfileJob`.

    end    coordinate at which the interval ends; where the fits fail before that, at least where
           the curvature at the mode puts it
    value  least minus log posterior on the profile
    theta  (P,) where that is
    """

    end: float
    value: float
    theta: np.ndarray


def add_profile_intervals(
    workers: Workers, best: Fit, max_mode_changes: int = MAX_MODE_CHANGES
) -> Fit:
    """`best` with the interval ends of its effects' parameters.

    If a profile finds a better mode, that mode is fitted and takes the place of `best`.

    max_mode_changes   how often it may
    """
    indices = sorted({k for _, _, own in own_parameter_indices(best.twin) for k in own})
    correction = _jacobian_correction(workers, best) if best.has_nonlinear_compliance else None
    jobs = [ProfileJob(best, k, side, correction) for k in indices for side in (-1, 1)]
    traces = workers.map(trace_profile, jobs)
    lowest = min(traces, key=lambda trace: trace.value, default=None)
    is_better = lowest is not None and lowest.value < best.objective - BETTER_MODE_GAIN
    if is_better and max_mode_changes > 0:
        (better,) = workers.fit([FitJob(best.hypothesis, FromTheta(lowest.theta))])
        # A fit that fails from there, with an infinite objective, is none.
        if better.objective < best.objective:
            return add_profile_intervals(workers, better, max_mode_changes - 1)
    pairs = zip(traces[::2], traces[1::2])
    ends = {k: (low.end, high.end) for k, (low, high) in zip(indices, pairs)}
    return replace(best, interval_ends=ends)


def _jacobian_correction(workers: Workers, fit: Fit) -> np.ndarray:
    """Contribution of the nonlinear compliance to the Jacobian at the mode, for all profiles."""
    posterior = Posterior(fit.twin, workers.observations, None, fit.source_free)
    posterior.use_full_jacobian(fit.twin.theta)
    return posterior.forward.jacobian_correction


def trace_profile(base: Twin, observations: Sequence, job: ProfileJob) -> ProfileTrace:
    """Run a job: fix the parameter ever further from its mode and refit everything else."""
    fit, k, side = job.fit, job.index, job.side
    posterior = Posterior(fit.twin, observations, None, fit.source_free)
    posterior.forward.jacobian_correction = job.jacobian_correction
    posterior.estimate_errors(posterior.predict(fit.twin.theta), fit.twin.theta)
    sd = fit.sd[k]
    ridge = fit.covariance[:, k] / sd  # change of all parameters when this one moves by one sd
    theta, last, values, thetas = fit.twin.theta, 0.0, [fit.objective], [fit.twin.theta]
    for distance in PROFILE_DISTANCES:
        start = theta + side * (distance - last) * ridge
        # First keep the previous error estimates: re-estimated at the start, they would attribute
        # the misfit that is not yet removed to the source and stop the descent.
        theta, _ = descend(posterior, start, PROFILE_STEPS, fixed=[k], errors=False)
        theta, value = descend(posterior, theta, PROFILE_STEPS, fixed=[k])
        if not np.isfinite(value):
            break
        last = distance
        values.append(value)
        thetas.append(theta)
        if value - min(values) > MAX_RISE:
            break
    lowest = int(np.argmin(values))
    rises = np.array(values) - values[0]
    end = interpolate_crossing((0.0, *PROFILE_DISTANCES), rises)
    if not np.isfinite(value) and rises[-1] < INTERVAL_RISE:
        end = max(end, HALF_INTERVAL)  # no prediction beyond: the profile says nothing
    return ProfileTrace(float(fit.twin.theta[k] + side * end * sd), values[lowest], thetas[lowest])


def interpolate_crossing(distances: Sequence[float], rises: np.ndarray) -> float:
    """The last of `distances` (N,) at which `rises` (N,) cross INTERVAL_RISE; the last of all if
    they do not.

    The square root of the rise is interpolated linearly: for a parabola that is exact.
    """
    roots = np.sqrt(np.maximum(rises, 0.0))
    below = int(np.flatnonzero(rises < INTERVAL_RISE)[-1])
    if below == len(rises) - 1:
        return distances[below]
    share = (np.sqrt(INTERVAL_RISE) - roots[below]) / (roots[below + 1] - roots[below])
    return distances[below] + share * (distances[below + 1] - distances[below])


def own_parameter_indices(twin: Twin) -> list[tuple]:
    """(effect, place, indices of its parameters) of every effect.

    An effect without parameters acts through the viscosity, whose index it gets.
    """
    entries = []
    for effect, place in twin.effects:
        label = f"{effect.name}@{place}"
        own = [k for k, p in enumerate(twin.parameters) if p.place == label]
        entries.append((effect, place, own or [twin.index["viscosity"]]))
    return entries


def effect_intervals(fit: Fit) -> list[dict]:
    """Each effect with its place, and its parameters' values and 95 % intervals in SI units."""
    twin, entries = fit.twin, []
    for effect, place, own in own_parameter_indices(twin):
        parameters = {}
        for k in own:
            name = twin.parameters[k].name.split(".")[-1]
            name = "kinematic_viscosity" if name == "viscosity" else name
            value, ends, unit = _value_and_interval(fit, k)
            parameters[name] = {"value": value, "ci95": ends, "unit": unit}
        entries.append({"effect": effect, "place": place, "parameters": parameters})
    return entries


def pump_intervals(fit: Fit) -> dict[str, dict]:
    """The pump's parameters by name: value, data sheet's value ("sheet") and 95 % interval.

    Empty for a twin without pump parameters.
    """
    parameters = {}
    for k, p in enumerate(fit.twin.parameters):
        if p.place == "pump":
            value, ends, unit = _value_and_interval(fit, k)
            parameters[p.name] = {"value": value, "sheet": p.nominal, "ci95": ends, "unit": unit}
    return parameters


def sensor_intervals(fit: Fit) -> dict[str, dict]:
    """Gain and phase of every uncalibrated sensor by its name: value and 95 % interval.

    Empty where all are calibrated. A sensor that is left out is the one that the others refer to.
    """
    sensors: dict[str, dict] = {}
    for k, p in enumerate(fit.twin.parameters):
        kind, _, name = p.name.removesuffix("]").partition("[")
        if kind in ("gain", "phase") and p.place == f"sensor {name}":
            value, ends, unit = _value_and_interval(fit, k)
            sensors.setdefault(name, {})[kind] = {"value": value, "ci95": ends, "unit": unit}
    return sensors


def _value_and_interval(fit: Fit, k: int) -> tuple[float, list[float], str]:
    """Value, 95 % interval and unit of parameter k."""
    p = fit.twin.parameters[k]
    ends = sorted(float(p.value(u)) for u in fit.interval(k))
    return float(p.value(fit.twin.theta[k])), ends, p.unit
