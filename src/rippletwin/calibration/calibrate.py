"""Calibration: the twin's parameters from healthy recordings (inverse transient analysis).

The fit maximises the posterior of `likelihood` by Levenberg-Marquardt steps. Five per
cent of wave speed is more than a full turn of phase at the upper harmonics, so a fit of everything
from nominal values ends in a wrong valley. Hence

* all observations together and in absolute frequency: first below 800 Hz, then 1.5, 2.5, 4 kHz
  and what is left;
* from several scalings of the wave speeds, of the longest segment's and of the others' together,
  the best of them carried on;
* the shaft angle of each recording first sought on a grid over a full turn of its lowest order;
* the model's error floor estimated as the fit goes: large at first, which evens out the valleys.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from rippletwin.calibration.likelihood import Likelihood
from rippletwin.calibration.misfit import Misfit, misfit
from rippletwin.twin.twin import Twin

LIMITS_HZ = (800.0, 1500.0, 2500.0, 4000.0)
SCALINGS = (0.0, -0.8, 0.8, -1.6, 1.6, -2.4, 2.4)  # in prior standard deviations
TRIED = 8  # starts that are fitted below the first limit, the likeliest after alignment
KEPT = (4, 2, 1)  # starts carried on after the first, second and every later limit

EVENNESS = 0.5
"""Of the error floor (see `likelihood`). Where physics is missing, the weak upper harmonics are
wholly wrong; a floor relative to each would let them weigh as much as the strong lower ones."""

UNDETERMINED = 0.7  # posterior over prior standard deviation above which data say little
IMPLAUSIBLE = 3.0  # prior standard deviations
BAD_FIT = 0.1  # relative misfit after calibration

STEP = 1e-5  # of the difference quotients, in prior standard deviations
MAX_STEPS = 40
CONVERGED = 1e-3  # change of minus the log posterior


@dataclass(frozen=True)
class Settings:
    """Limits (Hz) of the continuation and scalings of the wave speeds (prior standard deviations)
    to start from; data above `max_frequency_hz` are not used."""

    limits_hz: tuple[float, ...] = LIMITS_HZ
    scalings: tuple[float, ...] = SCALINGS
    max_frequency_hz: float | None = None


DEFAULTS = Settings()


@dataclass(frozen=True)
class Calibration:
    """A calibrated twin and how well it is known.

    twin        with `theta` at the posterior mode
    nominal     the twin it set out from, its shaft angles aligned with the recordings
    covariance  (P, P) of theta (Laplace: inverse Hessian of minus the log posterior)
    floor, source_sd   estimated relative errors of the model and of nominal sources
    objective   minus the log posterior at the mode
    before, after      misfits of `nominal` and of `twin`
    warnings    in plain words
    """

    twin: Twin
    nominal: Twin
    covariance: np.ndarray
    model_error: float
    source_sd: float
    objective: float
    before: Misfit
    after: Misfit
    warnings: tuple[str, ...] = field(default=())

    @property
    def sd(self) -> np.ndarray:
        """(P,) posterior standard deviations in theta's coordinates: 1 is the prior's."""
        return np.sqrt(np.diag(self.covariance))


def calibrate(
    twin: Twin,
    observations: Sequence,
    settings: Settings = DEFAULTS,
    progress: Callable[[str], None] | None = None,
) -> Calibration:
    """Fit all parameters of `twin` to `observations`; deterministic.

    `progress` is told of each limit in words. Raises ValueError without observations.
    """
    if not observations:
        raise ValueError("calibration needs at least one observation")
    limits = limits_of(observations, settings)
    states = _starts(
        Likelihood(twin, observations, limits[0], evenness=EVENNESS), settings.scalings
    )
    for stage, limit in enumerate(limits):
        likelihood = Likelihood(twin, observations, limit, evenness=EVENNESS)
        fits = []
        for _, theta in states:
            theta, value = fit(likelihood, theta)
            fits.append((value, theta))
        fits.sort(key=lambda f: f[0])
        states = _distinct(fits)[: KEPT[min(stage, len(KEPT) - 1)]]
        if progress is not None:
            left = misfit(likelihood, states[0][1]).relative
            progress(f"below {limit:.0f} Hz: {len(fits)} starts, best misfit {left:.2%}")
    return conclude(likelihood, states[0][1], limits[0])


def limits_of(observations: Sequence, settings: Settings) -> list[float]:
    """Upper frequencies (Hz) of the continuation, the last one being all the data."""
    top = max(float(o.frequency_hz[-1]) for o in observations)
    if settings.max_frequency_hz is not None:
        top = min(top, settings.max_frequency_hz)
    return [*(x for x in settings.limits_hz if x < top), top]


def conclude(likelihood: Likelihood, theta: np.ndarray, lowest_hz: float) -> Calibration:
    """What is known at a mode theta; the nominal twin's shaft angles are sought below a limit."""
    twin, prediction = likelihood.twin, likelihood.forward(theta)
    likelihood.estimate_errors(prediction)
    covariance = laplace(likelihood, theta)
    nominal = align(Likelihood(twin, likelihood.observations, lowest_hz), twin.theta)
    fitted, after = twin.with_(theta=theta), misfit(likelihood, theta)
    return Calibration(
        twin=fitted,
        nominal=twin.with_(theta=nominal),
        covariance=covariance,
        model_error=likelihood.model_error,
        source_sd=likelihood.source_sd,
        objective=likelihood.objective(theta, prediction),
        before=misfit(likelihood, nominal),
        after=after,
        warnings=_warnings(fitted, covariance, after),
    )


def fit(likelihood: Likelihood, theta: np.ndarray, max_steps: int = MAX_STEPS):
    """Posterior mode from a start: theta (P,) and minus the log posterior there.

    Levenberg-Marquardt on the whitened residuals; after each step the error floor is estimated
    anew, so the objective falls by both. Sets `likelihood.model_error` and `.source_sd`.
    """
    prediction = likelihood.forward(theta)
    likelihood.estimate_errors(prediction)
    value = likelihood.objective(theta, prediction)
    damping = 1e-2
    for _ in range(max_steps):
        r, jacobian = linearise(likelihood, theta, prediction)
        gradient, hessian = jacobian.T @ r, jacobian.T @ jacobian
        scale = np.maximum(np.diag(hessian), 1e-9)
        while True:
            step = -np.linalg.solve(hessian + np.diag(damping * scale), gradient)
            new = theta + step
            prediction_new = likelihood.forward(new)
            value_new = likelihood.objective(new, prediction_new)
            if value_new < value:
                break
            damping *= 5.0
            if damping > 1e8:
                return theta, value
        damping = max(damping / 8.0, 1e-9)
        theta, prediction = new, prediction_new
        likelihood.estimate_errors(prediction)
        last, value = value, min(value_new, likelihood.objective(theta, prediction))
        if last - value < CONVERGED:
            break
    return theta, value


def linearise(likelihood: Likelihood, theta: np.ndarray, prediction=None):
    """Residual (N,) and its Jacobian (N, P) by one-sided differences."""
    r = likelihood.residual(theta, prediction)
    jacobian = np.empty((len(r), len(theta)))
    for k in range(len(theta)):
        moved = theta.copy()
        moved[k] += STEP
        jacobian[:, k] = (likelihood.residual(moved) - r) / STEP
    return r, jacobian


def laplace(likelihood: Likelihood, theta: np.ndarray) -> np.ndarray:
    """Covariance (P, P) at the mode; a flat parameter without influence gets a huge variance."""
    jacobian = linearise(likelihood, theta)[1]
    hessian = jacobian.T @ jacobian
    return np.linalg.inv(hessian + 1e-12 * np.eye(len(theta)))


def align(likelihood: Likelihood, theta: np.ndarray) -> np.ndarray:
    """theta with each recording's shaft angle where its prediction is most like it.

    The angle turns order k by k times itself; the grid covers one turn of the orders' greatest
    common divisor, finely enough for the highest order used.
    """
    theta = np.array(theta, dtype=float)
    twin = likelihood.twin
    for o, h in zip(likelihood.observations, likelihood.forward(theta)):
        index = twin.index.get(f"angle[{o.label}]")
        if index is None:
            continue
        orders = np.asarray(o.orders)
        turn = 2 * np.pi / np.gcd.reduce(orders.astype(int))
        grid = turn * np.arange(int(16 * orders.max() * turn / (2 * np.pi)) + 1)
        grid = grid / len(grid)
        match = np.sum(np.conj(h) * o.values, axis=0)
        likeness = (np.exp(-1j * np.outer(grid, orders)) @ match).real
        best = int(np.argmax(likeness))
        before, peak, after = likeness[[best - 1, best, (best + 1) % len(grid)]]
        curvature = before - 2 * peak + after
        between = 0.5 * (before - after) / curvature if curvature else 0.0  # of the parabola
        angle = twin.parameters[index].value(theta[index]) + grid[best] + between * grid[1]
        angle = (angle + turn / 2) % turn - turn / 2
        theta[index] = twin.parameters[index].prior.coordinate(angle)
    return theta


def _starts(likelihood: Likelihood, scalings: Sequence[float]) -> list:
    """(objective, theta) of the TRIED likeliest starts, their shaft angles aligned."""
    twin = likelihood.twin
    delays = [segment.delay for segment in twin.rig.line]
    speeds = [twin.index[f"wave_speed[{k + 1}]"] for k in range(len(delays))]
    longest = speeds[int(np.argmax(delays))]
    starts = []
    for scale, others in product(scalings, scalings if len(delays) > 1 else (0.0,)):
        theta = twin.theta.copy()
        theta[speeds] += others
        theta[longest] = twin.theta[longest] + scale
        theta = align(likelihood, theta)
        prediction = likelihood.forward(theta)
        likelihood.estimate_errors(prediction)
        starts.append((likelihood.objective(theta, prediction), theta))
    return sorted(starts, key=lambda s: s[0])[:TRIED]


def _distinct(fits: list) -> list:
    """Fits in order, without those that ended where a better one did."""
    kept = []
    for candidate in fits:
        if all(np.max(np.abs(candidate[1] - k[1])) > 0.05 for k in kept):
            kept.append(candidate)
    return kept


def _warnings(twin: Twin, covariance: np.ndarray, after: Misfit) -> tuple[str, ...]:
    out = []
    if after.relative > BAD_FIT:
        out.append(
            f"bad fit: {100 * after.relative:.0f} % of what was measured is left over after "
            "calibration; the model lacks physics, or the data sheet is wrong"
        )
    sd = np.sqrt(np.diag(covariance))
    for p, u, s in zip(twin.parameters, twin.theta, sd):
        value, value_sd = float(p.value(u)), p.value_sd(u, s)
        if p.flat:
            if p.unit == "rad" and value_sd > 0.1:
                out.append(f"{p.name} is not determined by the data")
            continue
        if p.prior.scale == 0.0:
            continue  # taken for exact
        if abs(u) > IMPLAUSIBLE:
            out.append(
                f"{p.name} is implausible: {value:.4g} {p.unit} is {abs(u):.1f} standard "
                f"deviations from the data sheet's {p.nominal:.4g} {p.unit}"
            )
        if s > UNDETERMINED:
            out.append(
                f"{p.name} is not determined by the data: known to {value_sd:.2g} {p.unit}, "
                f"{100 * s:.0f} % of what the data sheet already says"
            )
    return tuple(out)
