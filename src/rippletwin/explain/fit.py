"""Fits of twins that differ in their effects: posterior mode and evidence of each.

Two rules keep the optimiser out of wrong valleys (5 % of wave speed is two turns of phase at
5 kHz over 9 m). All operating points are fitted together and in absolute frequency, first below
800 Hz, then higher; and every candidate is fitted that way from the nominal values with the
effect in the model from the first step, because a fit without it has been bent by its absence.
What a line stores beyond proportion to the pressure, slow to work out, is left out or held on the
way and followed from the mode that this leads to.

The evidence is Laplace's (MacKay 2003, Information Theory, Inference, and Learning Algorithms,
ch. 27): all parameters of effects have proper priors N(0, 1) in their coordinates, so

    log Z = log posterior at the mode - 1/2 log det H,

with H the Hessian in the same coordinates, priors included.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rippletwin.effects import Effect, Place
from rippletwin.explain.posterior import Posterior
from rippletwin.likelihood import cut
from rippletwin.twin import Twin

LIMITS_HZ = (800.0, 1500.0, 2500.0, 4000.0)
SCALINGS = (0.0, -0.7, 0.7, -1.4, 1.4, -2.1, 2.1)
"""Of the wave speed of the longest segment and of all others, in prior standard deviations: every
pair of them is a start."""
WIDE, FAR = 400, 2.0
"""A line without effects is tried from as many wave speeds at random besides, each as many prior
standard deviations away: all other fits lean on it, and a sheet may be further off than it says."""
SPREAD = 4  # fits below a limit about which the next is begun at random, where that is asked for
FEW = 3
"""Up to so many starts all pairs of scalings are tried; with more, as for a position along the
line, all wave speeds are scaled together."""
TRIED = (8, 24)  # starts from which Levenberg-Marquardt sets out, with few and with many
KEPT = ((4, 2, 1), (8, 4, 1))  # carried on after the first, the second and every later limit
STEPS = (12, 8, 6)  # most steps below the first, second and later limits; the last may take more
LAST_STEPS = 30
CONVERGED = 1e-2  # change of minus the log posterior: evidence is judged in whole units
REFINED = 4  # of many good starts those that are followed to the end
MOST = 0.1
"""Largest model error before the last limit: more would leave the fit to its priors, and it would
never leave a wrong valley."""
REACH = 1.5  # longest step of a coordinate, in prior standard deviations

Hypothesis = tuple[tuple[Effect, Place], ...]
"""The effects that a twin has, each at its place; () is the paper's line."""


@dataclass(frozen=True)
class Fit:
    """A hypothesis fitted.

    twin         at the posterior mode
    objective    minus the log posterior there
    evidence     Laplace's log evidence, comparable between hypotheses on the same data
    covariance   (P, P) of theta
    floor, source_sd, smooth_sd   estimated relative errors (see `Posterior`)
    source_free  which of the two likelihoods
    """

    hypothesis: Hypothesis
    twin: Twin = field(repr=False)
    objective: float
    evidence: float
    covariance: np.ndarray = field(repr=False)
    floor: float
    source_sd: float
    smooth_sd: float
    source_free: bool = False

    @property
    def sd(self) -> np.ndarray:
        """(P,) posterior standard deviations in theta's coordinates."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(effect.name for effect, _ in self.hypothesis)

    def without(self, k: int) -> Hypothesis:
        """The hypothesis but for its effect k."""
        return self.hypothesis[:k] + self.hypothesis[k + 1 :]

    @property
    def label(self) -> str:
        """Effects and places in words; "" of the paper's line."""
        return " + ".join(f"{effect.name}, {place}" for effect, place in self.hypothesis)


def prepare(observations: Sequence, rig, highest_hz: float | None = None) -> list:
    """The observations as they are fitted.

    Of a periodic recording the piston orders, the only ones a healthy nominal pump makes; of a
    dense spectrum twelve frequencies a resonance of the line: a model's error has the bandwidth of
    the line's own resonances, so that closer points are no further evidence.
    """
    delay = sum(segment.length / segment.wave_speed for segment in rig.line)
    spacing = 1.0 / (24.0 * delay)
    prepared = []
    for o in observations:
        o = cut(o, highest_hz)
        if o.orders is not None:
            keep = np.asarray(o.orders) % rig.pump["pistons"] == 0
        else:
            keep = np.zeros(len(o.frequency_hz), bool)
            keep[
                np.unique(
                    np.searchsorted(
                        o.frequency_hz, np.arange(o.frequency_hz[0], o.frequency_hz[-1], spacing)
                    )
                )
            ] = True
        prepared.append(select(o, keep))
    return prepared


def select(observation, keep: np.ndarray):
    """The observation at the frequencies of a mask."""
    return replace(
        observation,
        frequency_hz=observation.frequency_hz[keep],
        orders=None if observation.orders is None else observation.orders[keep],
        values=observation.values[:, keep],
        covariance=observation.covariance[keep],
    )


def limits(observations: Sequence) -> list[float]:
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
    stages = limits(observations)
    posterior = Posterior(twin, observations, stages[0], source_free)
    posterior.forward.hold_storage = True
    many = len(starts) > FEW or not hypothesis
    states = _first_states(posterior, starts, TRIED[many])
    for stage, limit in enumerate(stages):
        last = stage == len(stages) - 1
        posterior = Posterior(twin, observations, limit, source_free)
        posterior.forward.hold_storage = True
        posterior.most = np.inf if last else MOST
        fits = []
        for _, theta in states:
            steps = LAST_STEPS if last else STEPS[min(stage, len(STEPS) - 1)]
            theta, value = descend(posterior, theta, steps)
            fits.append((value, theta))
        kept = KEPT[many]
        states = _distinct(fits)[: 1 if last else kept[min(stage, len(kept) - 1)]]
        if draws and not last:
            above = Posterior(twin, observations, stages[stage + 1], source_free)
            above.forward.hold_storage = True
            states = states + _about(posterior, states[:SPREAD], above, draws, TRIED[many])
    return conclude(posterior, hypothesis, _followed(posterior, states[0][1]))


def _about(posterior: Posterior, states, above: Posterior, draws: int, tried: int) -> list:
    """(misfit, theta) to go on from: of `draws` about each of the `states` the `tried` that are
    best `above` the limit.

    A few harmonics at two sensors leave a line much freedom, and from the likeliest of the lines
    that they allow no way may lead to the one that higher harmonics demand.
    """
    rng, found = np.random.default_rng(0), []
    for _, theta in states:
        prediction = posterior.predict(theta)
        posterior.estimate_errors(prediction, theta)
        posterior.floor = MOST  # as far as a line may be off that is not yet the right one
        root = np.linalg.inv(np.linalg.cholesky(_hessian(posterior, theta, prediction))).T
        spread = root @ rng.normal(size=(len(theta), draws))
        found += [align(above, theta + step) for step in spread.T]
    return sorted(found, key=lambda g: g[0])[:tried]


def _first_states(posterior: Posterior, starts, tried: int) -> list:
    """(misfit, theta) to set out from, `tried`: the best of each start, then the best overall."""
    twin = posterior.twin
    delays = [segment.length / segment.wave_speed for segment in twin.rig.line]
    longest = int(np.argmax(delays))
    speeds = [twin.index[f"wave_speed[{k + 1}]"] for k in range(len(delays))]
    # Every pair, or, where there are many starts already, all wave speeds together.
    pairs = [(a, b) for a in SCALINGS for b in SCALINGS]
    if len(delays) == 1 or len(starts) > FEW:
        pairs = [(a, a) for a in SCALINGS]
    groups = []
    for start in starts:
        thetas = np.zeros((len(twin.parameters), len(pairs)))
        for name, u in start.items():
            thetas[twin.index[name]] = u
        thetas[speeds] = [b for _, b in pairs]
        thetas[speeds[longest]] = [a for a, _ in pairs]
        if not twin.effects:
            anywhere = np.zeros((len(twin.parameters), WIDE))
            anywhere[speeds] = FAR * np.random.default_rng(0).normal(size=(len(speeds), WIDE))
            thetas = np.concatenate([thetas, anywhere], axis=1)
        aligned = [align(posterior, theta) for theta in thetas.T]
        groups.append(sorted(aligned, key=lambda g: g[0]))
    first = [group[0] for group in groups]
    rest = sorted((g for group in groups for g in group[1:]), key=lambda g: g[0])
    return sorted(first, key=lambda g: g[0])[:tried] + rest[: max(tried - len(first), 0)]


def align(posterior: Posterior, theta: np.ndarray) -> tuple[float, np.ndarray]:
    """Relative misfit, and theta with each recording's shaft angle where its prediction fits best.

    The angle turns order k by k times itself; the grid covers one turn of the orders' greatest
    common divisor.
    """
    theta, twin = np.array(theta), posterior.twin
    prediction = posterior.predict(theta)
    square = np.sum(np.abs(prediction) ** 2 + np.abs(posterior.values) ** 2, axis=0)
    match = np.sum(np.conj(prediction) * posterior.values, axis=0)
    misfit = 0.0
    for o, part in zip(posterior.observations, posterior.forward.slices):
        weighted = match[part] / posterior.power[part]
        free = np.sum(np.abs(weighted))
        index = twin.index.get(f"angle[{o.label}]")
        if index is not None and not posterior.source_free:
            order = np.gcd.reduce(np.asarray(o.orders, int))
            orders = np.asarray(o.orders) / order
            grid = 2 * np.pi * np.arange(int(16 * orders[-1])) / int(16 * orders[-1])
            likeness = (np.exp(-1j * np.outer(grid, orders)) @ weighted).real
            turn = grid[np.argmax(likeness)] / order
            free = np.max(likeness)
            parameter = twin.parameters[index]
            angle = parameter.value(theta[index]) + turn
            angle = (angle + np.pi / order) % (2 * np.pi / order) - np.pi / order
            theta[index] = parameter.prior.coordinate(angle)
        misfit += float(np.sum(square[part] / posterior.power[part]) - 2 * free)
    return misfit / posterior.values.size, theta


def refine(
    base: Twin, hypothesis: Hypothesis, observations, thetas: Sequence, source_free=False
) -> Fit:
    """Fit on all frequencies from starts theta (P,), where good ones are known."""
    twin = base.with_(effects=hypothesis)
    posterior = Posterior(twin, observations, None, source_free)
    thetas = [np.asarray(theta, dtype=float) for theta in thetas]
    posterior.predict(thetas[-1])  # the weakest: nearest to the fit that they set out from
    posterior.forward.hold_storage = True
    if len(thetas) > 2:
        tried = [descend(posterior, theta, STEPS[-1]) for theta in thetas]
        thetas = [theta for theta, _ in sorted(tried, key=lambda t: t[1])[:REFINED]]
    fits = [descend(posterior, theta, LAST_STEPS) for theta in thetas]
    best = min(fits, key=lambda f: f[1])[0]
    return conclude(posterior, hypothesis, _followed(posterior, best))


def _followed(posterior: Posterior, theta: np.ndarray) -> np.ndarray:
    """The mode near theta, where what the line stores beyond proportion was held: it followed."""
    posterior.forward.hold_storage = False
    return descend(posterior, theta, LAST_STEPS)[0] if posterior.forward.stores else theta


def conclude(posterior: Posterior, hypothesis: Hypothesis, theta: np.ndarray) -> Fit:
    """The fit at a mode: evidence and covariance."""
    prediction = posterior.predict(theta)
    posterior.estimate_errors(prediction, theta)
    objective = posterior.objective(theta, prediction)
    hessian = _hessian(posterior, theta, prediction)
    log_det = np.linalg.slogdet(hessian)[1]
    return Fit(
        hypothesis,
        posterior.twin.with_(theta=theta),
        objective,
        -objective - 0.5 * log_det,
        np.linalg.inv(hessian),
        posterior.floor,
        posterior.source_sd,
        posterior.smooth_sd,
        posterior.source_free,
    )


def _hessian(posterior: Posterior, theta: np.ndarray, prediction: np.ndarray) -> np.ndarray:
    """Of minus the log posterior (P, P), to first order in the prediction."""
    jacobian = posterior.linearise(theta, prediction)[1]
    hessian = jacobian.T @ jacobian
    # Shaft angles have no prior. Blind to the source they have no say either, hence the 1.
    flat = ~posterior.prior
    hessian[flat, flat] += 1.0 if posterior.source_free else 1e-9
    return hessian


def descend(posterior: Posterior, theta: np.ndarray, max_steps: int):
    """Levenberg-Marquardt: theta (P,) and minus the log posterior; sets the posterior's errors."""
    prediction = posterior.predict(theta)
    posterior.estimate_errors(prediction, theta)
    value = posterior.objective(theta, prediction)
    damping = 1e-2
    for _ in range(max_steps):
        r, jacobian = posterior.linearise(theta, prediction)
        gradient, hessian = jacobian.T @ r, jacobian.T @ jacobian
        scale = np.maximum(np.diag(hessian), 1e-6)
        accepted = False
        while damping < 1e6:
            step = -np.linalg.solve(hessian + np.diag(damping * scale), gradient)
            step = np.clip(step, -REACH, REACH)
            new = theta + step
            new_prediction = posterior.predict(new)
            new_value = posterior.objective(new, new_prediction)
            if new_value < value:
                accepted = True
                break
            damping *= 6.0
        if not accepted:
            break
        damping = max(damping / 8.0, 1e-9)
        theta, prediction = new, new_prediction
        posterior.estimate_errors(prediction, theta)
        last, value = value, min(new_value, posterior.objective(theta, prediction))
        if last - value < CONVERGED:
            break
    return theta, value


def _distinct(fits: list) -> list:
    """Best first, without those that ended where a better one did."""
    kept = []
    for candidate in sorted(fits, key=lambda f: f[0]):
        if all(np.max(np.abs(candidate[1] - k[1])) > 0.05 for k in kept):
            kept.append(candidate)
    return kept
