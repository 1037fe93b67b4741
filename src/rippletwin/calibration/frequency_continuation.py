"""Continuation in frequency: the mode of a posterior that has many.

Five per cent of wave speed is two turns of phase at 5 kHz over 9 m, so the posterior of all
harmonics has many local modes. Two rules lead to the right one:

1. All operating points are fitted together and in absolute frequency, first below 800 Hz, then
   higher.
2. Every hypothesis is fitted that way from the data sheet, with its effects in the model from the
   first step. A fit without a necessary effect has biased the other parameters.

The nonlinear compliance of the line takes long to solve. During continuation it is omitted or
frozen, then frozen again at each new point. It is solved exactly only from the final mode.

Calibration and explaining run the same continuation, each over its own error model.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

import numpy as np

from rippletwin.calibration.error_model import ErrorModel
from rippletwin.calibration.fit import Fit, Hypothesis, conclude_fit
from rippletwin.calibration.levenberg_marquardt import (
    CONVERGED,
    FIRST_DAMPING,
    MIN_DAMPING,
    descend,
)
from rippletwin.calibration.likelihood import EVENNESS, Likelihood
from rippletwin.calibration.multistart import (
    FEW_STARTS,
    MAX_MODEL_ERROR_BELOW_LIMIT,
    State,
    choose_starts,
    draw_around_modes,
    select_distinct_modes,
)
from rippletwin.calibration.posterior import Posterior
from rippletwin.calibration.score_test import ScoreTest
from rippletwin.twin.twin import Twin

LIMITS_HZ = (800.0, 1500.0, 2500.0, 4000.0)
LAST_LIMIT_SHARE = 0.9  # of the highest frequency; a limit above it is no stage of its own
MODES_DRAWN_AROUND = 4  # modes below a limit around which starts of the next are drawn
STARTS_FITTED = (8, 24)  # starts of the first descents: with few starts, with many
STARTS_KEPT = ((4, 2, 1), (8, 4, 1))  # after the first, the second and every later limit
MAX_STEPS = (12, 8, 6)  # below the first, the second and every later limit but the last
MAX_LAST_STEPS = 30  # of a descent with all data
ROUGHLY_CONVERGED = 0.5  # gain of the last step of a descent that another one follows
FOLLOWED_MARGIN = 5.0
"""Of minus the log posterior: after a rough descent, starts this close to the best are followed."""
MAX_REFREEZES = 6  # times that the nonlinear compliance is frozen again
STEP_SHARES = (1.0, 0.5, 0.25)  # of the way that a frozen compliance suggests
JACOBIAN_ROUNDS = 4  # descents with the full Jacobian
ROUND_CONVERGED = 0.2  # gain of the last of them


def continuation_limits(
    observations: Sequence, limits_hz: Sequence[float] = LIMITS_HZ
) -> list[float]:
    """Upper frequencies (Hz) of the continuation for these data; the last includes all data."""
    top = max(float(o.frequency_hz[-1]) for o in observations)
    low = min(float(o.frequency_hz[min(2, len(o.frequency_hz) - 1)]) for o in observations)
    return [*(x for x in limits_hz if low <= x < LAST_LIMIT_SHARE * top), top]


Model = TypeVar("Model", bound=ErrorModel)


def fit_by_continuation(
    model: Model,
    starts: Sequence[Mapping[str, float]] = ({},),
    draws: int = 0,
    exact: bool = False,
    limits_hz: Sequence[float] = LIMITS_HZ,
    progress: Callable[[float, int, ErrorModel, np.ndarray], None] | None = None,
) -> tuple[Model, np.ndarray]:
    """The mode theta (P,) of a posterior, and the error model with its errors there.

    starts    coordinates of parameters by name; the others are those of the data sheet
    draws     starts that are drawn around each mode below a limit for the next one
    exact     whether the full Jacobian, slow to calculate, leads from the last mode on
    progress  is called after each limit: limit (Hz), number of descents, model and best theta
    """
    limits = continuation_limits(model.observations, limits_hz)
    many = len(starts) > FEW_STARTS or not model.twin.effects
    states = choose_starts(_with_frozen_compliance(model, limits[0]), starts, STARTS_FITTED[many])
    for stage, limit in enumerate(limits):
        last = stage == len(limits) - 1
        part = _with_frozen_compliance(model, limit)
        part.max_model_error = np.inf if last else MAX_MODEL_ERROR_BELOW_LIMIT
        steps, converged = MAX_STEPS[min(stage, len(MAX_STEPS) - 1)], ROUGHLY_CONVERGED
        if last:
            steps, converged = MAX_LAST_STEPS, CONVERGED
        modes = []
        for _, theta in states:
            if stage > 0:
                _freeze_compliance(part, theta)
            theta, value = descend(part, theta, steps, converged=converged)
            if stage > 0:
                theta, value = _refreeze_compliance(part, theta, value)
            modes.append((value, theta))
        states = _kept(modes, stage, last, many)
        if progress is not None:
            progress(limit, len(modes), part, states[0][1])
        if draws and not last:
            above = _with_frozen_compliance(model, limits[stage + 1])
            states = states + draw_around_modes(
                part, states[:MODES_DRAWN_AROUND], above, draws, STARTS_FITTED[many]
            )
    rounds = JACOBIAN_ROUNDS if exact else 0
    return part, _unfreeze_and_refit(part, states[0][1], rounds)


def fit_hypothesis(
    base: Twin,
    hypothesis: Hypothesis,
    observations: Sequence,
    starts: Sequence[Mapping[str, float]] = ({},),
    source_free: bool = False,
    draws: int = 0,
    plain: bool = False,
) -> Fit:
    """Fit a twin with the effects of `hypothesis` by continuation from the data sheet.

    base         twin without effects, of the rig and recordings of the observations
    starts       coordinates of effect parameters by name, one mapping a start
    source_free  whether the source is projected out
    draws        as in `fit_by_continuation`
    plain        whether the error model is that of `calibrate` instead of that of explaining
    """
    model = _error_model(base, hypothesis, observations, source_free, plain)
    model, theta = fit_by_continuation(model, starts, draws, exact=plain)
    return conclude_fit(model, hypothesis, theta)


def refine(
    base: Twin,
    hypothesis: Hypothesis,
    observations: Sequence,
    thetas: Sequence,
    source_free: bool = False,
    exact: bool = True,
    plain: bool = False,
    rough: bool = False,
) -> Fit:
    """Fit with all frequencies from good starts `thetas`, each (P,).

    Of several starts, which differ in their newest effect, the most promising are followed. One
    alone ends exactly at the mode if `exact`, even where that takes slow derivatives, and after a
    few steps if `rough`. `source_free` and `plain` are as in `fit_hypothesis`; several starts need
    the error model of explaining.
    """
    model = _error_model(base, hypothesis, observations, source_free, plain)
    thetas = [np.asarray(theta, dtype=float) for theta in thetas]
    rounds = JACOBIAN_ROUNDS if exact and len(thetas) == 1 else 0
    if len(thetas) > 1:
        assert isinstance(model, Posterior)
        thetas = _follow_best(model, ScoreTest(base, model, thetas).starts)
    else:
        model.predict(thetas[0])
        model.forward.freeze_compliance = True
    steps, converged = (MAX_STEPS[-1], ROUGHLY_CONVERGED) if rough else (MAX_LAST_STEPS, CONVERGED)
    modes = [descend(model, theta, steps, converged=converged) for theta in thetas]
    best = _best_when_solved(model, modes)
    return conclude_fit(model, hypothesis, _unfreeze_and_refit(model, best, rounds))


def _best_when_solved(model: ErrorModel, modes: Sequence[tuple[np.ndarray, float]]) -> np.ndarray:
    """The theta (P,) of the likeliest of `modes` (theta, minus the log posterior), which have a
    frozen compliance, with the compliance solved: frozen, they are of different lines."""
    if len(modes) == 1 or not model.forward.has_nonlinear_compliance:
        return min(modes, key=lambda mode: mode[1])[0]
    thetas = [theta for theta, _ in modes]
    return min(thetas, key=lambda theta: _objective_with_compliance(model, theta, own_errors=True))


def _follow_best(model: ErrorModel, thetas: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Where rough descents from several starts end, those near the best."""
    if len(thetas) == 1:
        return list(thetas)
    rough = [descend(model, theta, MAX_STEPS[-1], converged=ROUGHLY_CONVERGED) for theta in thetas]
    least = min(value for _, value in rough)
    return [theta for theta, value in rough if value <= least + FOLLOWED_MARGIN]


def _error_model(
    base: Twin, hypothesis: Hypothesis, observations: Sequence, source_free: bool, plain: bool
) -> Posterior | Likelihood:
    """The error model of explaining, or the plain one of calibration."""
    twin = base.with_(effects=hypothesis)
    if plain:
        return Likelihood(twin, observations, evenness=EVENNESS)
    return Posterior(twin, observations, None, source_free)


def _kept(modes: Sequence[State], stage: int, last: bool, many: bool) -> list[State]:
    """The modes from which the next limit is begun."""
    kept = STARTS_KEPT[many]
    return select_distinct_modes(modes)[: 1 if last else kept[min(stage, len(kept) - 1)]]


def _with_frozen_compliance(model: Model, limit: float) -> Model:
    """The error model below a limit (Hz), without the nonlinear compliance of the line."""
    part = model.below(limit)
    part.forward.freeze_compliance = True
    return part


def _freeze_compliance(model: ErrorModel, theta: np.ndarray) -> None:
    """Freeze the nonlinear compliance at theta, or omit it where that fits better.

    Without it, harmonics that it makes from lower ones would be attributed to the pump.
    """
    if not model.forward.has_nonlinear_compliance:
        return
    model.forward.omit_compliance()
    without = model.objective(theta, model.predict(theta))
    if not _objective_with_compliance(model, theta) < without:
        model.forward.omit_compliance()


def _refreeze_compliance(
    model: ErrorModel, theta: np.ndarray, value: float
) -> tuple[np.ndarray, float]:
    """theta and minus the log posterior after descents, the compliance frozen anew at each theta.

    value   minus the log posterior with the compliance frozen earlier

    The compliance changes along a descent. So only the longest of STEP_SHARES of its way that fits
    better with the compliance solved is taken.
    """
    if not model.forward.has_nonlinear_compliance:
        return theta, value
    frozen, value = value, _objective_with_compliance(model, theta)
    if abs(value - frozen) < ROUGHLY_CONVERGED:
        return theta, value  # the compliance is still the frozen one
    for _ in range(MAX_REFREEZES):
        way = descend(model, theta, MAX_STEPS[0], converged=ROUGHLY_CONVERGED)[0] - theta
        for share in STEP_SHARES:
            tried = theta + share * way
            solved = _objective_with_compliance(model, tried)
            if solved < value - ROUGHLY_CONVERGED:
                break
        else:
            break
        theta, value = tried, solved
    return theta, value


def _objective_with_compliance(
    model: ErrorModel, theta: np.ndarray, own_errors: bool = False
) -> float:
    """Minus the log posterior with the compliance solved, which is frozen from here on; with the
    likeliest errors there if `own_errors`, else with those that the model has."""
    model.forward.freeze_compliance = False
    prediction = model.predict(theta)
    if own_errors:
        model.estimate_errors(prediction, theta)
    value = model.objective(theta, prediction)
    model.forward.freeze_compliance = True
    return value


def _unfreeze_and_refit(model: ErrorModel, theta: np.ndarray, rounds: int = 0) -> np.ndarray:
    """The mode near theta with the compliance solved at each step.

    rounds   most descents that follow with the full Jacobian, where the error model needs it
    """
    model.forward.freeze_compliance = False
    damping = FIRST_DAMPING
    if model.forward.has_nonlinear_compliance:
        theta, value = descend(model, theta, MAX_LAST_STEPS)
    elif rounds and model.needs_full_jacobian:
        value = model.objective(theta, model.predict(theta))
        damping = MIN_DAMPING  # damped steps gain nothing in ill-conditioned directions
    else:
        return theta
    for _ in range(rounds if np.isfinite(value) else 0):
        model.use_full_jacobian(theta)
        last = value
        theta, value = descend(model, theta, MAX_LAST_STEPS, damping=damping)
        if last - value < ROUND_CONVERGED:
            break
    return theta
