"""Starts of fits: scaled wave speeds, draws around the modes of lower harmonics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from rippletwin.calibration.error_model import ErrorModel
from rippletwin.calibration.laplace import gradient_and_hessian
from rippletwin.calibration.shaft_angles import align_shaft_angles

SCALINGS = (0.0, -0.7, 0.7, -1.4, 1.4, -2.1, 2.1)
"""Of the wave speed of the longest segment and of those of all others, in prior standard
deviations. Every pair of them is a start."""
RANDOM_STARTS, RANDOM_START_SD = 400, 2.0
"""A line without effects has as many starts besides, with all wave speeds drawn from normal
distributions of RANDOM_START_SD prior standard deviations. All other fits begin from this one, and
a data sheet may be further off than it says."""
FEW_STARTS = 3
"""With more starts than this, as for a position along the line, all wave speeds are scaled
together: pairs of scalings would be too many."""
MAX_MODEL_ERROR_BELOW_LIMIT = 0.1
"""Largest model error before the last frequency limit. With a larger one the priors decide, and
the fit never leaves a wrong local mode."""
SAME_MODE = 0.05  # largest difference of a coordinate, in prior standard deviations

State = tuple[float, np.ndarray]
"""Misfit, or minus the log posterior, and theta (P,)."""


def choose_starts(
    model: ErrorModel, starts: Sequence[Mapping[str, float]], count: int
) -> list[State]:
    """The `count` starts with the least misfits; each of `starts` is represented.

    starts   coordinates of parameters by name; all others are those of the data sheet

    Each is combined with all scalings of the wave speeds, and with random wave speeds where the
    twin has no effects. Shaft angles are aligned.
    """
    twin = model.twin
    delays = [segment.delay for segment in twin.rig.line]
    longest = int(np.argmax(delays))
    speeds = [twin.index[f"wave_speed[{k + 1}]"] for k in range(len(delays))]
    pairs = [(a, b) for a in SCALINGS for b in SCALINGS]
    if len(delays) == 1 or len(starts) > FEW_STARTS:
        pairs = [(a, a) for a in SCALINGS]
    groups = []
    for start in starts:
        thetas = np.zeros((len(twin.parameters), len(pairs)))
        for name, u in start.items():
            thetas[twin.index[name]] = u
        thetas[speeds] = [b for _, b in pairs]
        thetas[speeds[longest]] = [a for a, _ in pairs]
        if not twin.effects:
            anywhere = np.zeros((len(twin.parameters), RANDOM_STARTS))
            anywhere[speeds] = RANDOM_START_SD * np.random.default_rng(0).normal(
                size=(len(speeds), RANDOM_STARTS)
            )
            thetas = np.concatenate([thetas, anywhere], axis=1)
        predictions = model.predict_speeds(thetas.T)
        aligned = [
            align_shaft_angles(model, theta, prediction=prediction)
            for theta, prediction in zip(thetas.T, predictions)
        ]
        groups.append(sorted(aligned, key=lambda g: g[0]))
    first = [group[0] for group in groups]
    rest = sorted((g for group in groups for g in group[1:]), key=lambda g: g[0])
    return sorted(first, key=lambda g: g[0])[:count] + rest[: max(count - len(first), 0)]


def draw_around_modes(
    model: ErrorModel, modes: Sequence[State], above: ErrorModel, draws: int, count: int
) -> list[State]:
    """Of `draws` around each of the `modes` of `model` the `count` that fit best `above` the limit.

    A few harmonics at two sensors leave a line much freedom. From the likeliest of the lines that
    they allow, a descent may not reach the one that higher harmonics demand.
    """
    rng, states = np.random.default_rng(0), []
    for _, theta in modes:
        prediction = model.predict(theta)
        model.estimate_errors(prediction, theta)
        model.model_error = MAX_MODEL_ERROR_BELOW_LIMIT  # the line is not yet the right one
        root = np.linalg.inv(
            np.linalg.cholesky(gradient_and_hessian(model, theta, prediction)[1])
        ).T
        spread = root @ rng.normal(size=(len(theta), draws))
        states += [align_shaft_angles(above, theta + step) for step in spread.T]
    return sorted(states, key=lambda g: g[0])[:count]


def select_distinct_modes(modes: Sequence[State]) -> list[State]:
    """Modes in order, the best first, without those that ended near a better one."""
    kept: list = []
    for mode in sorted(modes, key=lambda m: m[0]):
        if all(np.max(np.abs(mode[1] - k[1])) > SAME_MODE for k in kept):
            kept.append(mode)
    return kept
