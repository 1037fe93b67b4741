"""Fits of twins that differ in their effects: posterior mode and evidence of each.

Two rules keep the optimiser out of wrong valleys (5 % of wave speed is two turns of phase at
5 kHz over 9 m). All operating points are fitted together and in absolute frequency, first below
800 Hz, then higher; and every candidate is fitted that way from the nominal values with the
effect in the model from the first step, because a fit without it has been bent by its absence.
What a line stores beyond proportion to the pressure, slow to work out, is left out or held on the
way, held anew where that has led, and followed from the mode that this leads to.

The evidence is Laplace's (MacKay 2003, Information Theory, Inference, and Learning Algorithms,
ch. 27): all parameters of effects have proper priors N(0, 1) in their coordinates, so

    log Z = log posterior at the mode - 1/2 log det H,

with H the Hessian in the same coordinates, priors included.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rippletwin.calibration.fit import Fit, Hypothesis, laplace_fit
from rippletwin.calibration.levenberg_marquardt import CONVERGED, descend
from rippletwin.calibration.multistart import (
    FEW_STARTS,
    MAX_MODEL_ERROR_BELOW_LIMIT,
    draw_around_modes,
    first_starts,
    select_by_score_test,
)
from rippletwin.calibration.posterior import Posterior
from rippletwin.twin.twin import Twin

LIMITS_HZ = (800.0, 1500.0, 2500.0, 4000.0)
MODES_DRAWN_AROUND = (
    4  # fits below a limit about which the next is begun at random, where that is asked for
)
STARTS_FITTED = (8, 24)  # starts from which Levenberg-Marquardt sets out, with few and with many
STARTS_KEPT = ((4, 2, 1), (8, 4, 1))  # carried on after the first, the second and every later limit
MAX_STEPS = (
    12,
    8,
    6,
)  # most steps below the first, second and later limits; the last may take more
MAX_LAST_STEPS = 30
ROUGHLY_CONVERGED = 0.5  # gain of the last step where the next limit goes on from there
MAX_REFREEZES, STEP_SHARES = 6, (1.0, 0.5, 0.25)  # how often what is stored is held anew, at most
JACOBIAN_ROUNDS, ROUND_CONVERGED = (
    4,
    0.2,
)  # of descents with new derivatives, and what the last may still gain


def continuation_limits(observations: Sequence) -> list[float]:
    """Upper frequencies (Hz) of the continuation for these data."""
    top = max(float(o.frequency_hz[-1]) for o in observations)
    low = min(float(o.frequency_hz[min(2, len(o.frequency_hz) - 1)]) for o in observations)
    return [*(x for x in LIMITS_HZ if low <= x < 0.9 * top), top]


def fit_hypothesis(
    base: Twin,
    hypothesis: Hypothesis,
    observations: Sequence,
    starts: Sequence[dict[str, float]] = ({},),
    source_free: bool = False,
    draws: int = 0,
) -> Fit:
    """Fit by continuation from the nominal values, from several starts.

    `base` is a twin without effects of the right rig and recordings. Each of `starts` gives
    coordinates of effect parameters by name; each is tried with the scalings of the wave speeds.
    With `draws` every limit is also begun from that many draws about each fit below the last one.
    """
    twin = base.with_(effects=hypothesis)
    stages = continuation_limits(observations)
    posterior = _posterior_with_frozen_compliance(twin, observations, stages[0], source_free)
    many = len(starts) > FEW_STARTS or not hypothesis
    states = first_starts(posterior, starts, STARTS_FITTED[many])
    for stage, limit in enumerate(stages):
        last = stage == len(stages) - 1
        posterior = _posterior_with_frozen_compliance(twin, observations, limit, source_free)
        posterior.max_model_error = np.inf if last else MAX_MODEL_ERROR_BELOW_LIMIT
        steps, near = MAX_STEPS[min(stage, len(MAX_STEPS) - 1)], ROUGHLY_CONVERGED
        if last:
            steps, near = MAX_LAST_STEPS, CONVERGED
        fits = []
        for _, theta in states:
            if stage > 0:
                _freeze_compliance(posterior, theta)
            theta, value = descend(posterior, theta, steps, converged=near)
            if stage > 0:
                theta, value = _refreeze_compliance(posterior, theta, value)
            fits.append((value, theta))
        kept = STARTS_KEPT[many]
        states = distinct_modes(fits)[: 1 if last else kept[min(stage, len(kept) - 1)]]
        if draws and not last:
            above = _posterior_with_frozen_compliance(
                twin, observations, stages[stage + 1], source_free
            )
            states = states + draw_around_modes(
                posterior, states[:MODES_DRAWN_AROUND], above, draws, STARTS_FITTED[many]
            )
    return laplace_fit(posterior, hypothesis, _unfreeze_and_refit(posterior, states[0][1]))


def refine(
    base: Twin,
    hypothesis: Hypothesis,
    observations,
    thetas: Sequence,
    source_free: bool = False,
    exact: bool = True,
) -> Fit:
    """Fit on all frequencies from starts theta (P,), where good ones are known: one alone, or many
    that differ in their newest effect. One alone ends `exact`ly at the mode, if that is asked for,
    even where it takes derivatives of what the line stores, slow to work out."""
    twin = base.with_(effects=hypothesis)
    posterior = Posterior(twin, observations, None, source_free)
    thetas = [np.asarray(theta, dtype=float) for theta in thetas]
    if len(thetas) > 1:
        thetas = select_by_score_test(base, posterior, thetas)
    else:
        posterior.predict(thetas[0])
        posterior.forward.freeze_compliance = True
    fits = [descend(posterior, theta, MAX_LAST_STEPS) for theta in thetas]
    best = min(fits, key=lambda f: f[1])[0]
    rounds = JACOBIAN_ROUNDS if exact and len(fits) == 1 else 0
    return laplace_fit(posterior, hypothesis, _unfreeze_and_refit(posterior, best, rounds))


def _posterior_with_frozen_compliance(
    twin: Twin, observations, limit: float, source_free: bool
) -> Posterior:
    """A posterior that knows nothing of what the line stores beyond proportion to the pressure."""
    posterior = Posterior(twin, observations, limit, source_free)
    posterior.forward.freeze_compliance = True
    return posterior


def _freeze_compliance(posterior: Posterior, theta: np.ndarray) -> None:
    """Hold what the line stores at theta, if that fits better than leaving it out: higher harmonics
    that get much of their size by way of it would else be put down to the pump."""
    if not posterior.forward.has_nonlinear_compliance:
        return
    posterior.forward.omit_compliance()
    without = posterior.objective(theta, posterior.predict(theta))
    if not _objective_with_compliance(posterior, theta) < without:
        posterior.forward.omit_compliance()


def _refreeze_compliance(
    posterior: Posterior, theta: np.ndarray, value: float
) -> tuple[np.ndarray, float]:
    """theta and minus the log posterior with what the line stores worked out, as long as holding it
    where theta is leads to a better place. Of a way there the longest of SHARES that fits better is
    gone: what is stored changes on it."""
    if not posterior.forward.has_nonlinear_compliance:
        return theta, value
    held, value = value, _objective_with_compliance(posterior, theta)
    if abs(value - held) < ROUGHLY_CONVERGED:
        return theta, value  # what is stored stayed as it was held
    for _ in range(MAX_REFREEZES):
        way = descend(posterior, theta, MAX_STEPS[0], converged=ROUGHLY_CONVERGED)[0] - theta
        for share in STEP_SHARES:
            tried = theta + share * way
            stored = _objective_with_compliance(posterior, tried)
            if stored < value - ROUGHLY_CONVERGED:
                break
        else:
            break
        theta, value = tried, stored
    return theta, value


def _objective_with_compliance(posterior: Posterior, theta: np.ndarray) -> float:
    """Minus the log posterior with what the line stores worked out, which is held from here on."""
    posterior.forward.freeze_compliance = False
    value = posterior.objective(theta, posterior.predict(theta))
    posterior.forward.freeze_compliance = True
    return value


def _unfreeze_and_refit(posterior: Posterior, theta: np.ndarray, rounds: int = 0) -> np.ndarray:
    """The mode near theta, where that was held: now it is followed, and in so many `rounds` at most
    by derivatives too."""
    posterior.forward.freeze_compliance = False
    if not posterior.forward.has_nonlinear_compliance:
        return theta
    theta, value = descend(posterior, theta, MAX_LAST_STEPS)
    for _ in range(rounds if np.isfinite(value) else 0):
        posterior.use_full_jacobian(theta)
        last = value
        theta, value = descend(posterior, theta, MAX_LAST_STEPS)
        if last - value < ROUND_CONVERGED:
            break
    return theta


def distinct_modes(fits: list) -> list:
    """Best first, without those that ended where a better one did."""
    kept = []
    for candidate in sorted(fits, key=lambda f: f[0]):
        if all(np.max(np.abs(candidate[1] - k[1])) > 0.05 for k in kept):
            kept.append(candidate)
    return kept
