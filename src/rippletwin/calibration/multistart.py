"""Where fits set out from: scaled wave speeds, draws about lower harmonics' fits, a score test."""

from __future__ import annotations

import numpy as np

from rippletwin.calibration.levenberg_marquardt import hessian
from rippletwin.calibration.posterior import Posterior
from rippletwin.twin.twin import Twin

SCALINGS = (0.0, -0.7, 0.7, -1.4, 1.4, -2.1, 2.1)
"""Of the wave speed of the longest segment and of all others, in prior standard deviations: every
pair of them is a start."""
RANDOM_STARTS, RANDOM_START_SD = 400, 2.0
"""A line without effects is tried from as many wave speeds at random besides, each as many prior
standard deviations away: all other fits lean on it, and a sheet may be further off than it says."""
FEW_STARTS = 3
"""Up to so many starts all pairs of scalings are tried; with more, as for a position along the
line, all wave speeds are scaled together."""
MAX_FOLLOWED, MAX_CORRELATION = 4, 0.7
"""How many of the starts about a good fit are followed, and the correlation of what two of them do
above which they are one."""
ANGLES_PER_TURN = 16  # in a turn of the highest order
MAX_MODEL_ERROR_BELOW_LIMIT = 0.1
"""Largest model error before the last limit: more would leave the fit to its priors, and it would
never leave a wrong valley."""


def first_starts(posterior: Posterior, starts, tried: int) -> list:
    """(misfit, theta) to set out from, `tried`: the best of each start, then the best overall."""
    twin = posterior.twin
    delays = [segment.delay for segment in twin.rig.line]
    longest = int(np.argmax(delays))
    speeds = [twin.index[f"wave_speed[{k + 1}]"] for k in range(len(delays))]
    # Every pair, or, where there are many starts already, all wave speeds together.
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
        aligned = [align_shaft_angles(posterior, theta) for theta in thetas.T]
        groups.append(sorted(aligned, key=lambda g: g[0]))
    first = [group[0] for group in groups]
    rest = sorted((g for group in groups for g in group[1:]), key=lambda g: g[0])
    return sorted(first, key=lambda g: g[0])[:tried] + rest[: max(tried - len(first), 0)]


def draw_around_modes(
    posterior: Posterior, states, above: Posterior, draws: int, tried: int
) -> list:
    """(misfit, theta) to go on from: of `draws` about each of the `states` the `tried` that are
    best `above` the limit.

    A few harmonics at two sensors leave a line much freedom, and from the likeliest of the lines
    that they allow no way may lead to the one that higher harmonics demand.
    """
    rng, found = np.random.default_rng(0), []
    for _, theta in states:
        prediction = posterior.predict(theta)
        posterior.estimate_errors(prediction, theta)
        posterior.model_error = (
            MAX_MODEL_ERROR_BELOW_LIMIT  # as far as a line may be off that is not yet the right one
        )
        root = np.linalg.inv(np.linalg.cholesky(hessian(posterior, theta, prediction))).T
        spread = root @ rng.normal(size=(len(theta), draws))
        found += [align_shaft_angles(above, theta + step) for step in spread.T]
    return sorted(found, key=lambda g: g[0])[:tried]


def align_shaft_angles(posterior: Posterior, theta: np.ndarray) -> tuple[float, np.ndarray]:
    """Relative misfit, and theta with each recording's shaft angle where its prediction fits best.

    The angle turns order k by k times itself; the grid covers one turn of the orders' greatest
    common divisor.
    """
    theta, twin = np.array(theta), posterior.twin
    prediction = posterior.predict(theta)
    if not np.all(np.isfinite(prediction)):
        return np.inf, theta
    square = np.sum(np.abs(prediction) ** 2 + np.abs(posterior.values) ** 2, axis=0)
    match = np.sum(np.conj(prediction) * posterior.values, axis=0)
    misfit = 0.0
    for o, part in zip(posterior.observations, posterior.forward.slices):
        weighted = match[part] / posterior.power[part]
        free = np.sum(np.abs(weighted))
        index = twin.index.get(f"angle[{o.label}]")
        if index is not None and not posterior.source_free:
            orders = np.asarray(o.orders, int)
            order = np.gcd.reduce(orders)
            lines = np.zeros(ANGLES_PER_TURN * orders[-1] // order, complex)
            lines[orders // order] = weighted
            likeness = np.fft.fft(lines).real
            turn = 2 * np.pi * np.argmax(likeness) / (len(lines) * order)
            free = np.max(likeness)
            parameter = twin.parameters[index]
            angle = parameter.value(theta[index]) + turn
            angle = (angle + np.pi / order) % (2 * np.pi / order) - np.pi / order
            theta[index] = parameter.prior.coordinate(angle)
        misfit += float(np.sum(square[part] / posterior.power[part]) - 2 * free)
    return misfit / posterior.values.size, theta


def select_by_score_test(base: Twin, posterior: Posterior, thetas: list) -> list:
    """The PROMISING starts whose newest effect promises most, best first; what the line stores
    beyond proportion is held from here on as it is without that effect.

    Promised is what the objective loses to first order on the way from the prediction without the
    effect through that of the start, everything else refitted: a score test (Rao 1948,
    Math. Proc. Cambridge Philos. Soc. 44:50).
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
    ways = np.where(np.isfinite(ways), ways, 0.0)  # to where it is infinite there is none
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
    return [thetas[k] for k in kept]
