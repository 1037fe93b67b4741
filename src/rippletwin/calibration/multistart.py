"""Starts of fits: scaled wave speeds, draws around the modes of lower harmonics, a score test."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from rippletwin.calibration.error_model import ErrorModel
from rippletwin.calibration.laplace import hessian
from rippletwin.calibration.posterior import Posterior
from rippletwin.calibration.shaft_angles import align_shaft_angles
from rippletwin.twin.twin import Twin

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
MAX_FOLLOWED, MAX_CORRELATION = 4, 0.7
"""Most starts that the score test selects, and the correlation of the changes that two of them
make in the prediction above which they count as one."""
MAX_MODEL_ERROR_BELOW_LIMIT = 0.1
"""Largest model error before the last frequency limit. With a larger one the priors decide, and
the fit never leaves a wrong local mode."""

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
        aligned = [align_shaft_angles(model, theta) for theta in thetas.T]
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
        root = np.linalg.inv(np.linalg.cholesky(hessian(model, theta, prediction))).T
        spread = root @ rng.normal(size=(len(theta), draws))
        states += [align_shaft_angles(above, theta + step) for step in spread.T]
    return sorted(states, key=lambda g: g[0])[:count]


def distinct_modes(modes: Sequence[State], distance: float = 0.05) -> list[State]:
    """Modes in order, the best first, without those that ended near a better one.

    distance   largest difference of a coordinate, in prior standard deviations
    """
    kept = []
    for mode in sorted(modes, key=lambda m: m[0]):
        if all(np.max(np.abs(mode[1] - k[1])) > distance for k in kept):
            kept.append(mode)
    return kept


def select_by_score_test(
    base: Twin, posterior: Posterior, thetas: Sequence[np.ndarray]
) -> tuple[list[np.ndarray], float]:
    """At most MAX_FOLLOWED of the starts `thetas` of the newest effect, the most promising first,
    and what the objective loses at most, to first order, if the effect is added at the first.

    The score of a start is what the objective loses, to first order, on the way from the prediction
    without the effect to that of the start, everything else refitted: a score test (Rao 1948, Math.
    Proc. Cambridge Philos. Soc. 44:50). From here on `posterior` freezes the nonlinear compliance
    as it is without the effect.
    """
    twin = posterior.twin
    without = base.with_(effects=twin.effects[:-1])
    theta = np.array([thetas[0][twin.index[p.name]] for p in without.parameters])
    own = Posterior(without, posterior.observations, None, posterior.source_free)
    own.predict(theta)
    posterior.forward.hold_as(own.forward)
    own.forward.freeze_compliance = True
    prediction = own.predict(theta)
    own.estimate_errors(prediction, theta)
    ways = np.array([posterior.predict(start) for start in thetas]) - prediction
    ways = np.where(np.isfinite(ways), ways, 0.0)  # an infinite prediction is no start
    r, jacobian = own.linearise(theta, prediction, ways)
    jacobian, ways = jacobian[:, : len(theta)], jacobian[:, len(theta) :]
    both = np.linalg.lstsq(jacobian, np.column_stack([r, ways]), rcond=None)[0]
    r, ways = r - jacobian @ both[:, 0], ways - jacobian @ both[:, 1:]
    ways = ways / np.maximum(np.linalg.norm(ways, axis=0), 1e-300)
    kept = []
    for k in np.argsort(ways.T @ r):
        if len(kept) < MAX_FOLLOWED and np.all(
            np.abs(ways[:, kept].T @ ways[:, k]) < MAX_CORRELATION
        ):
            kept.append(k)
    # Along its own parameters the effect can go on from there: the score test of all of them.
    start = thetas[kept[0]]
    own_slopes = posterior.slopes(start, posterior.predict(start))[len(theta) :]
    freed = own.linearise(theta, prediction, own_slopes)[1]
    freed = np.column_stack([freed[:, len(theta) :], ways[:, kept[0]]])
    freed = freed - jacobian @ np.linalg.lstsq(jacobian, freed, rcond=None)[0]
    found = np.linalg.lstsq(freed, r, rcond=1e-9)[0]
    return [thetas[k] for k in kept], 0.5 * float(np.sum((freed @ found) ** 2))
