"""Fits of twins that differ in their effects: posterior mode and evidence of each.

Two rules keep the optimiser out of wrong valleys (5 % of wave speed is two turns of phase at
5 kHz over 9 m). All operating points are fitted together and in absolute frequency, first below
800 Hz, then higher; and every candidate is fitted that way from the nominal values with the
effect in the model from the first step, because a fit without it has been bent by its absence.

The evidence is Laplace's (MacKay 2003, Information Theory, Inference, and Learning Algorithms,
ch. 27): all parameters of effects have proper priors N(0, 1) in their coordinates, so

    log Z = log posterior at the mode - 1/2 log det H,

with H the Hessian in the same coordinates, priors included.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rippletwin.calibrate import align
from rippletwin.effects import Effect, Place
from rippletwin.forward import Forward
from rippletwin.likelihood import Likelihood, cut
from rippletwin.twin import Twin

LIMITS_HZ = (800.0, 1500.0, 2500.0, 4000.0)
SCALINGS = (0.0, -0.7, 0.7, -1.4, 1.4, -2.1, 2.1)
"""Of the wave speed of the longest segment and of all others, in prior standard deviations: every
pair of them is a start."""
TRIED = 8  # starts from which Levenberg-Marquardt sets out, the best after aligning shaft angles
KEPT = (4, 2, 1)  # starts carried on after the first, the second and every later limit
STEPS = (8, 6, 6)  # most steps below the first, second and later limits; the last may take more
LAST_STEPS = 30
CONVERGED = 1e-2  # change of minus the log posterior: evidence is judged in whole units
STEP = 1e-5  # of the difference quotients, in prior standard deviations
REACH = 1.5  # longest step of a coordinate, in prior standard deviations

FLOOR = 0.004
"""Least relative model error. A twin of a real line is not better than this however small its
sensors' noise: harmonic means over a wandering speed, the orifice's exponent, the mesh."""

SOURCE_SD = 0.10  # largest relative error of a nominal ripple's harmonic

Hypothesis = tuple[tuple[Effect, Place], ...]
"""The effects that a twin has, each at its place; () is the paper's line."""


class FastForward(Forward):
    """The forward model with its derivatives, tuned for very many calls.

    One sweep with both unit states at the load gives the load's equation and the readings. While
    it is differentiated the orifice's nonlinear remainder is held: it is two orders below the
    linear part and moves little between the columns of a Jacobian, but costs more than the rest.
    """

    def __init__(self, twin, observations):
        super().__init__(twin, observations)
        self._held = self._remainder = None
        self._angles = {i: part for i, part in zip(self.angle_index, self.slices) if i is not None}
        self._only_pressure = all(o.kind != "input_impedance" for o in self.observations) and all(
            rows == list(range(len(twin.rig.sensors))) for rows in self.rows
        )

    def matrix(self, theta: np.ndarray) -> np.ndarray:
        """Readings of all observations side by side, (S, F); rows are the rig's sensors."""
        network = self.network(theta)
        kind, value = network.load
        if kind != "held":
            return network.readings()
        pressure, _, entry, decay = network._sweep(
            [(1.0, 0.0), (0.0, 1.0)], network.sensor_positions
        )
        a, b = entry[:, 1] + network.source_admittance * entry[:, 0]
        admittance, remainder = value
        p = (network.source_flow * decay - b * remainder) / (a + b * admittance)
        q = admittance * p + remainder
        return (pressure[:, 0] * p + pressure[:, 1] * q) / decay * network.sensor_factor

    def derivatives(self, theta: np.ndarray) -> np.ndarray:
        """d readings/d theta (P, S, F) by one-sided differences with the remainder held."""
        self.matrix(theta)
        self._held = self._remainder
        base = self.matrix(theta)
        out = np.empty((len(theta), *base.shape), complex)
        for k in range(len(theta)):
            if k in self._angles:
                # All harmonics turn together: exact, nonlinear load or not.
                part, slope = self._angles[k], self.twin.parameters[k].prior.scale
                out[k] = 0.0
                out[k][:, part] = 1j * slope * self.order[part] * base[:, part]
                continue
            moved = theta.copy()
            moved[k] += STEP
            out[k] = (self.matrix(moved) - base) / STEP
        self._held = None
        return out

    def _balance(self, network, factor):
        if network.load[0] == "state":
            return
        p, q = network.load_state()
        value = q / p
        if self._held is None:
            super()._balance(network, factor)
            p, q = network.load[1]
            self._remainder = (q - value * p) / factor
        else:
            network.load = "held", (value, self._held * factor)


class Posterior(Likelihood):
    """`Likelihood` with a least floor, and on request blind to the source.

    With `source_free` the amplitude and phase of the source are free at every frequency (projected
    out) though its nominal ripple still drives the orifice: effects at the pump cannot show then.
    """

    def __init__(self, twin, observations, max_frequency_hz=None, floor=0.1, source_free=False):
        super().__init__(twin, observations, max_frequency_hz, floor)
        self.forward = FastForward(twin, self.observations)
        self.source_free = source_free
        if source_free:
            for group in self._groups:
                if group.source == "nominal":
                    group.source = "free"
            free = sum(g.values.shape[1] for g in self._groups if g.source == "free")
            self.count = 2 * (sum(g.values.size for g in self._groups) - free)

    def estimate_errors(self, prediction):
        if self.count > 0:
            super().estimate_errors(prediction)
        self.floor = max(self.floor, FLOOR)

    def linearise(self, theta, prediction):
        """Residual (N,) and its Jacobian (N, P) by one-sided differences."""
        r = self.residual(theta, prediction)
        if self.forward._only_pressure:
            slopes = self.forward.derivatives(theta)
            moved = [
                h + STEP * slopes[:, :, part] for h, part in zip(prediction, self.forward.slices)
            ]
        else:
            columns = [self.forward(theta + STEP * e) for e in np.eye(len(theta))]
            moved = [np.stack(parts) for parts in zip(*columns)]
        rows = []
        for group, h in zip(self._groups, moved):
            w = whiten(group, h, self.floor, self._sigma(group)).reshape(len(theta), -1)
            rows += [w.real, w.imag]
        jacobian = np.zeros((len(r), len(theta)))
        count = len(r) - int(np.sum(self.prior))
        jacobian[:count] = (np.sqrt(2.0) * np.concatenate(rows, axis=1) - r[:count]).T / STEP
        jacobian[count:] = np.eye(len(theta))[self.prior]
        return r, jacobian


def whiten(group, prediction: np.ndarray, floor: float, sigma: float) -> np.ndarray:
    """Whitened residuals (B, S, F) of B predictions: `likelihood` without the determinant."""
    sd = np.sqrt(group.variances + floor**2 * group.power)
    h = np.einsum("fsk,bsf->bkf", group.rotation, prediction)
    e, u = (group.values - h) / sd, h / sd
    if sigma == 0.0:
        return e
    size = np.maximum(np.sum(np.abs(u) ** 2, axis=1, keepdims=True), 1e-300)
    shorten = 1.0 if np.isinf(sigma) else 1.0 - 1.0 / np.sqrt(1.0 + sigma**2 * size)
    along = np.sum(np.conj(u) * e, axis=1, keepdims=True) / size
    return e - shorten * along * u


@dataclass(frozen=True)
class Fit:
    """A hypothesis fitted.

    twin         at the posterior mode
    objective    minus the log posterior there
    evidence     Laplace's log evidence, comparable between hypotheses on the same data
    covariance   (P, P) of theta
    floor, source_sd   estimated relative errors
    source_free  which of the two likelihoods
    """

    hypothesis: Hypothesis
    twin: Twin = field(repr=False)
    objective: float
    evidence: float
    covariance: np.ndarray = field(repr=False)
    floor: float
    source_sd: float
    source_free: bool = False

    @property
    def sd(self) -> np.ndarray:
        """(P,) posterior standard deviations in theta's coordinates."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(effect.name for effect, _ in self.hypothesis)


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
) -> Fit:
    """Fit by continuation from the nominal values, from several starts.

    `base` is a twin without effects of the right rig and recordings. Each of `starts` gives
    coordinates of effect parameters by name; each is tried with the scalings of the wave speeds.
    """
    twin = base.with_(effects=hypothesis)
    stages = limits(observations)
    posterior = Posterior(twin, observations, stages[0], source_free=source_free)
    states = _first_states(posterior, starts)
    for stage, limit in enumerate(stages):
        last = stage == len(stages) - 1
        posterior = Posterior(twin, observations, limit, source_free=source_free)
        fits = []
        for _, theta, floor in states:
            posterior.floor = floor
            steps = LAST_STEPS if last else STEPS[min(stage, len(STEPS) - 1)]
            theta, value = descend(posterior, theta, steps)
            fits.append((value, theta, posterior.floor))
        states = _distinct(fits)[: 1 if last else KEPT[min(stage, len(KEPT) - 1)]]
    value, theta, posterior.floor = states[0]
    return conclude(posterior, hypothesis, theta)


def _first_states(posterior: Posterior, starts) -> list:
    """(objective, theta, floor) to set out from: the best of each start, then the best overall."""
    twin = posterior.twin
    delays = [segment.length / segment.wave_speed for segment in twin.rig.line]
    longest = int(np.argmax(delays))
    speeds = [twin.index[f"wave_speed[{k + 1}]"] for k in range(len(delays))]
    # Every pair, or, where there are many starts already, all wave speeds together.
    pairs = [(a, b) for a in SCALINGS for b in SCALINGS]
    if len(delays) == 1 or len(starts) > 2:
        pairs = [(a, a) for a in SCALINGS]
    groups = []
    for start in starts:
        group = []
        for scale, other in pairs:
            theta = np.zeros(len(twin.parameters))
            for name, u in start.items():
                theta[twin.index[name]] = u
            theta[speeds] = other
            theta[speeds[longest]] = scale
            theta = align(posterior, theta)
            prediction = posterior.forward(theta)
            posterior.estimate_errors(prediction)
            group.append((posterior.objective(theta, prediction), theta, posterior.floor))
        groups.append(sorted(group, key=lambda g: g[0]))
    first = [group[0] for group in groups]
    rest = sorted((g for group in groups for g in group[1:]), key=lambda g: g[0])
    return sorted(first, key=lambda g: g[0])[:TRIED] + rest[: max(TRIED - len(first), 0)]


def refine(base: Twin, hypothesis: Hypothesis, observations, theta, source_free=False) -> Fit:
    """Fit on all frequencies from one start theta (P,), where a good one is known."""
    twin = base.with_(effects=hypothesis)
    posterior = Posterior(twin, observations, source_free=source_free)
    return conclude(posterior, hypothesis, descend(posterior, theta, LAST_STEPS)[0])


def conclude(posterior: Posterior, hypothesis: Hypothesis, theta: np.ndarray) -> Fit:
    """The fit at a mode: evidence and covariance."""
    prediction = posterior.forward(theta)
    posterior.estimate_errors(prediction)
    objective = posterior.objective(theta, prediction)
    jacobian = posterior.linearise(theta, prediction)[1]
    hessian = jacobian.T @ jacobian
    # Shaft angles have no prior. Blind to the source they have no say either, hence the 1.
    flat = ~posterior.prior
    hessian[flat, flat] += 1.0 if posterior.source_free else 1e-9
    log_det = np.linalg.slogdet(hessian)[1]
    return Fit(
        hypothesis,
        posterior.twin.with_(theta=theta),
        objective,
        -objective - 0.5 * log_det,
        np.linalg.inv(hessian),
        posterior.floor,
        posterior.source_sd,
        posterior.source_free,
    )


def descend(posterior: Posterior, theta: np.ndarray, max_steps: int):
    """Levenberg-Marquardt: theta (P,) and minus the log posterior; sets the posterior's errors."""
    prediction = posterior.forward(theta)
    posterior.estimate_errors(prediction)
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
            new_prediction = posterior.forward(new)
            new_value = posterior.objective(new, new_prediction)
            if new_value < value:
                accepted = True
                break
            damping *= 6.0
        if not accepted:
            break
        damping = max(damping / 8.0, 1e-9)
        theta, prediction = new, new_prediction
        posterior.estimate_errors(prediction)
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
