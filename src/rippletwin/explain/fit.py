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

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rippletwin.effects import Effect, Place
from rippletwin.explain.descent import CONVERGED, descend, hessian
from rippletwin.explain.posterior import Posterior
from rippletwin.explain.starts import FEW, MOST, about, first_states, promising
from rippletwin.likelihood import cut
from rippletwin.twin import Twin

LIMITS_HZ = (800.0, 1500.0, 2500.0, 4000.0)
SPREAD = 4  # fits below a limit about which the next is begun at random, where that is asked for
TRIED = (8, 24)  # starts from which Levenberg-Marquardt sets out, with few and with many
KEPT = ((4, 2, 1), (8, 4, 1))  # carried on after the first, the second and every later limit
STEPS = (12, 8, 6)  # most steps below the first, second and later limits; the last may take more
LAST_STEPS = 30
ROUGHLY = 0.5  # gain of the last step where the next limit goes on from there
HELD, SHARES = 6, (1.0, 0.5, 0.25)  # how often what is stored is held anew, at most
ROUNDS, SETTLED = 4, 0.2  # of descents with new derivatives, and what the last may still gain

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
    stores       whether the line stores something beyond proportion to the pressure
    ends         of parameters, by index: the ends of their 95 % intervals in theta's coordinates,
                 where more is known of them than the covariance (`rippletwin.explain.intervals`)
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
    stores: bool = False
    ends: Mapping[int, tuple[float, float]] = field(default_factory=dict, repr=False)

    @property
    def sd(self) -> np.ndarray:
        """(P,) posterior standard deviations in theta's coordinates."""
        return np.sqrt(np.diag(self.covariance))

    def interval(self, k: int) -> tuple[float, float]:
        """95 % interval of parameter k, in theta's coordinates."""
        reach = 1.96 * self.sd[k]
        return self.ends.get(k, (self.twin.theta[k] - reach, self.twin.theta[k] + reach))

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
    spacing = 1.0 / (24.0 * rig.delay)
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
    posterior = _without_storage(twin, observations, stages[0], source_free)
    many = len(starts) > FEW or not hypothesis
    states = first_states(posterior, starts, TRIED[many])
    for stage, limit in enumerate(stages):
        last = stage == len(stages) - 1
        posterior = _without_storage(twin, observations, limit, source_free)
        posterior.most = np.inf if last else MOST
        steps, near = STEPS[min(stage, len(STEPS) - 1)], ROUGHLY
        if last:
            steps, near = LAST_STEPS, CONVERGED
        fits = []
        for _, theta in states:
            if stage > 0:
                _hold_storage(posterior, theta)
            theta, value = descend(posterior, theta, steps, converged=near)
            if stage > 0:
                theta, value = _hold_anew(posterior, theta, value)
            fits.append((value, theta))
        kept = KEPT[many]
        states = _distinct(fits)[: 1 if last else kept[min(stage, len(kept) - 1)]]
        if draws and not last:
            above = _without_storage(twin, observations, stages[stage + 1], source_free)
            states = states + about(posterior, states[:SPREAD], above, draws, TRIED[many])
    return conclude(posterior, hypothesis, _followed(posterior, states[0][1]))


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
        thetas = promising(base, posterior, thetas)
    else:
        posterior.predict(thetas[0])
        posterior.forward.hold_storage = True
    fits = [descend(posterior, theta, LAST_STEPS) for theta in thetas]
    best = min(fits, key=lambda f: f[1])[0]
    rounds = ROUNDS if exact and len(fits) == 1 else 0
    return conclude(posterior, hypothesis, _followed(posterior, best, rounds))


def _without_storage(twin: Twin, observations, limit: float, source_free: bool) -> Posterior:
    """A posterior that knows nothing of what the line stores beyond proportion to the pressure."""
    posterior = Posterior(twin, observations, limit, source_free)
    posterior.forward.hold_storage = True
    return posterior


def _hold_storage(posterior: Posterior, theta: np.ndarray) -> None:
    """Hold what the line stores at theta, if that fits better than leaving it out: higher harmonics
    that get much of their size by way of it would else be put down to the pump."""
    if not posterior.forward.stores:
        return
    posterior.forward.leave_out_storage()
    without = posterior.objective(theta, posterior.predict(theta))
    if not _stored(posterior, theta) < without:
        posterior.forward.leave_out_storage()


def _hold_anew(posterior: Posterior, theta: np.ndarray, value: float) -> tuple[np.ndarray, float]:
    """theta and minus the log posterior with what the line stores worked out, as long as holding it
    where theta is leads to a better place. Of a way there the longest of SHARES that fits better is
    gone: what is stored changes on it."""
    if not posterior.forward.stores:
        return theta, value
    held, value = value, _stored(posterior, theta)
    if abs(value - held) < ROUGHLY:
        return theta, value  # what is stored stayed as it was held
    for _ in range(HELD):
        way = descend(posterior, theta, STEPS[0], converged=ROUGHLY)[0] - theta
        for share in SHARES:
            tried = theta + share * way
            stored = _stored(posterior, tried)
            if stored < value - ROUGHLY:
                break
        else:
            break
        theta, value = tried, stored
    return theta, value


def _stored(posterior: Posterior, theta: np.ndarray) -> float:
    """Minus the log posterior with what the line stores worked out, which is held from here on."""
    posterior.forward.hold_storage = False
    value = posterior.objective(theta, posterior.predict(theta))
    posterior.forward.hold_storage = True
    return value


def _followed(posterior: Posterior, theta: np.ndarray, rounds: int = 0) -> np.ndarray:
    """The mode near theta, where that was held: now it is followed, and in so many `rounds` at most
    by derivatives too."""
    posterior.forward.hold_storage = False
    if not posterior.forward.stores:
        return theta
    theta, value = descend(posterior, theta, LAST_STEPS)
    for _ in range(rounds if np.isfinite(value) else 0):
        posterior.follow(theta)
        last = value
        theta, value = descend(posterior, theta, LAST_STEPS)
        if last - value < SETTLED:
            break
    return theta


def conclude(posterior: Posterior, hypothesis: Hypothesis, theta: np.ndarray) -> Fit:
    """The fit at a mode: evidence and covariance."""
    prediction, twin = posterior.predict(theta), posterior.twin.with_(theta=theta)
    if not posterior.holds(prediction):
        # No start leads anywhere: the hypothesis says nothing of these data.
        unknown = np.eye(len(theta))
        return Fit(hypothesis, twin, np.inf, -np.inf, unknown, np.inf, 0.0, 0.0)
    posterior.estimate_errors(prediction, theta)
    objective = posterior.objective(theta, prediction)
    second = hessian(posterior, theta, prediction)
    log_det = np.linalg.slogdet(second)[1]
    return Fit(
        hypothesis,
        twin,
        objective,
        -objective - 0.5 * log_det,
        np.linalg.inv(second),
        posterior.floor,
        posterior.source_sd,
        posterior.smooth_sd,
        posterior.source_free,
        posterior.forward.stores,
    )


def _distinct(fits: list) -> list:
    """Best first, without those that ended where a better one did."""
    kept = []
    for candidate in sorted(fits, key=lambda f: f[0]):
        if all(np.max(np.abs(candidate[1] - k[1])) > 0.05 for k in kept):
            kept.append(candidate)
    return kept
