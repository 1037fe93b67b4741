"""Is anything missing at all? Three alarms, and drift within a recording.

Refitting hides what is missing, so a good fit proves nothing. The alarms are the misfit left after
refitting, the pull of the parameters on their priors (where an absorbed effect shows), and the
disagreement of parameters fitted to each operating point alone. What decides is the evidence that
the best effect of the whole library adds (`rippletwin.explain.thresholds.ACCEPT`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from rippletwin.explain import residuals
from rippletwin.explain.describe import posterior_of
from rippletwin.explain.fit import Fit, select
from rippletwin.explain.posterior import FLOOR, Posterior

MISFIT = 3.0 * FLOOR  # relative model error above which a fit is bad
PULL = 4.0  # prior standard deviations
DISAGREEMENT = 4.0  # standard deviations between two operating points
SIGNIFICANCE = 1e-3
PASSAGES = 100.0  # of the line that a wave makes in a sharp resonance, whose phase the speed turns


@dataclass(frozen=True)
class Alarms:
    """What each alarm reads, and whether it rings.

    misfit         relative model error left in the base fit
    pull           largest |coordinate| of a parameter with a prior, and whose
    disagreement   largest difference between operating points, in standard deviations, and whose
    drift          p-value that early and late windows are one state, and of which recording
    """

    misfit: float
    pull: tuple[float, str]
    disagreement: tuple[float, str]
    drift: tuple[float, str]

    @property
    def ringing(self) -> tuple[str, ...]:
        """Names of the alarms that ring."""
        rings = {
            "misfit": self.misfit > MISFIT,
            "pull": self.pull[0] > PULL,
            "disagreement": self.disagreement[0] > DISAGREEMENT,
            "drift": self.drift[0] < SIGNIFICANCE,
        }
        return tuple(name for name, rung in rings.items() if rung)


def pull(fit: Fit) -> tuple[float, str]:
    """Largest pull of a line parameter on its prior, and the parameter's name."""
    pulls = [
        (abs(float(u)), p.name)
        for p, u in zip(fit.twin.parameters, fit.twin.theta)
        if not p.flat and "@" not in p.name
    ]
    return max(pulls, default=(0.0, ""))


def strain(fit: Fit) -> float:
    """Largest pull of an effect's own parameter on its prior. Where along the line it sits is no
    strain: one place is as likely as another."""
    pulls = [
        abs(float(u))
        for p, u in zip(fit.twin.parameters, fit.twin.theta)
        if "@" in p.name and p.prior.kind != "uniform"
    ]
    return max(pulls, default=0.0)


def disagreement(fits: Sequence[Fit]) -> tuple[float, str]:
    """Largest difference of a line parameter between fits to single operating points.

    Two posteriors of one parameter share its prior: the variance of their difference is that of
    both less what the prior gave both, which is held positive.
    """
    worst = (0.0, "")
    for i, a in enumerate(fits):
        for b in fits[i + 1 :]:
            for p in a.twin.parameters:
                if p.flat or "@" in p.name or p.name not in b.twin.index:
                    continue
                k, m = a.twin.index[p.name], b.twin.index[p.name]
                va, vb = a.covariance[k, k], b.covariance[m, m]
                variance = va * max(1.0 - va, 0.0) + vb * max(1.0 - vb, 0.0) + 1e-4
                z = abs(a.twin.theta[k] - b.twin.theta[m]) / np.sqrt(variance)
                worst = max(worst, (float(z), p.name))
    return worst


def drift(early: Sequence, late: Sequence, delay: float) -> tuple[float, str]:
    """Smallest p-value, over recordings, that two parts of it agree, and the recording's label.

    The shaft angle between the parts is free, the covariances are the parts' own, and a relative
    error is allowed: half the model's floor, and what another mean speed does to the phase of the
    passages of the line that a sharp resonance is made of. Corrected for the number of recordings.
    """
    worst = (1.0, "")
    for a, b in zip(early, late):
        if a.orders is None:
            continue
        a, b = common(a, b)
        gap, variance = difference(a, b, delay)
        statistic = 2.0 * np.sum(np.abs(gap) ** 2 / variance)
        p = chdtrc(2 * a.values.size - 1, statistic)
        worst = min(worst, (min(1.0, float(p) * len(early)), a.label))
    return worst


def common(a, b) -> tuple:
    """Two periodic observations at the orders that both have."""
    return tuple(
        select(x, np.isin(np.asarray(x.orders), np.asarray(other.orders)))
        for x, other in ((a, b), (b, a))
    )


def difference(a, b, delay: float) -> tuple[np.ndarray, np.ndarray]:
    """b less a (S, F), their shaft angle aligned, and the variance that `drift` allows for."""
    orders = np.asarray(a.orders, float)
    power = np.mean(np.abs(a.values) ** 2, axis=0)
    variance = np.einsum("fss->sf", a.covariance + b.covariance).real
    speed = abs(a.speed_hz / b.speed_hz - 1.0)
    phase = 2 * np.pi * a.frequency_hz * PASSAGES * delay * speed
    variance = variance + ((0.5 * FLOOR) ** 2 + phase**2) * power
    match = np.sum(np.conj(a.values) * b.values / variance, axis=0)
    # The angle: first coarsely, from the strongest order, then refined by the phase slope.
    grid = np.linspace(-np.pi, np.pi, 4001) / np.gcd.reduce(np.asarray(a.orders, int))
    angle = grid[np.argmax((np.exp(-1j * np.outer(grid, orders)) @ match).real)]
    for _ in range(3):
        turned = match * np.exp(-1j * angle * orders)
        angle += np.sum(orders * turned.imag) / max(np.sum(orders**2 * np.abs(turned)), 1e-300)
    return b.values * np.exp(-1j * angle * orders) - a.values, variance


def p_value(gain: float, tried: int) -> float:
    """Bound on the chance of so much evidence from `tried` effects without any: Markov's inequality
    on the Bayes factor, whose mean is 1 under the base, summed over the library."""
    return float(min(1.0, tried * np.exp(-min(gain, 700.0))))


def bands(fit: Fit, observations: Sequence) -> list[list[float]]:
    """Frequency bands (Hz) in which the fit's whitened residual stands out."""
    posterior, r = _whitened(fit, observations)
    frequency = [o.frequency_hz for o in posterior.observations]
    spacing = max(float(np.median(np.diff(f))) for f in frequency if len(f) > 1)
    return residuals.bands(np.concatenate(frequency), np.mean(np.abs(r) ** 2, axis=0), spacing)


def conditions(fit: Fit, observations: Sequence) -> list[int]:
    """Indices of the operating points at which the fit's residual stands out."""
    posterior, r = _whitened(fit, observations)
    sizes = [float(np.mean(np.abs(r[:, part]) ** 2)) for part in posterior.forward.slices]
    return [k for k, size in enumerate(sizes) if size > 4.0]


def crank_angles(fit: Fit, observations: Sequence, samples: int = 360) -> list[list[float]]:
    """Shaft angles (deg, within a piston's pitch) where the residual's ripple is concentrated,
    of periodic recordings on the common shaft angle."""
    posterior = _posterior(fit, observations)
    prediction = posterior.predict(fit.twin.theta)
    waves, pitch = [], None
    for o, part in zip(posterior.observations, posterior.forward.slices):
        if o.orders is None:
            continue
        index = fit.twin.index.get(f"angle[{o.label}]")
        turn = 0.0 if index is None else fit.twin.parameters[index].value(fit.twin.theta[index])
        orders = np.asarray(o.orders, float)
        pitch = 2 * np.pi / np.gcd.reduce(np.asarray(o.orders, int))
        residual = (o.values - prediction[:, part]) * np.exp(-1j * turn * orders)
        wave = residual @ np.exp(1j * np.outer(orders, pitch * np.arange(samples) / samples))
        waves.append(wave / np.linalg.norm(o.values))
    return residuals.angles(np.concatenate(waves), float(np.rad2deg(pitch))) if waves else []


def residual_map(fit: Fit, observations: Sequence) -> list[np.ndarray]:
    """|whitened residual| (S, F) of each observation, unit where the fit is as good as believed."""
    posterior, r = _whitened(fit, observations)
    return [np.abs(r[:, part]) for part in posterior.forward.slices]


def interior_test(observations: Sequence, fit: Fit) -> list[np.ndarray]:
    """Relative misfit (F,) of p2 from p1 and p3 alone in each observation of three sensors.

    p2 = [sinh g(L - x) p1 + sinh g x p3]/sinh g L holds whatever source and load are (between two
    sensors of one segment; through several, the same relation of their transfer matrices):

        p2 = A p1 + B p3,  A = T23_12/T13_12,  B = T12_12/T13_12,

    T_ij being the matrix from sensor i to j. Empty where there are fewer sensors.
    """
    if len(fit.twin.rig.sensors) < 3:
        return []
    posterior = _posterior(fit, observations)
    network = posterior.forward.network(fit.twin.theta)
    first, middle, last = np.sort(network.sensor_positions)[[0, 1, -1]]
    rows = np.argsort(network.sensor_positions)[[0, 1, -1]]
    whole = network.transfer(first, last)[:, 0, 1]
    near, far = network.transfer(first, middle)[:, 0, 1], network.transfer(middle, last)[:, 0, 1]
    factor = np.broadcast_to(network.sensor_factor, posterior.values.shape)
    p1, p2, p3 = (posterior.values / factor)[rows]
    error = np.abs(p2 - (far * p1 + near * p3) / whole) / np.sqrt(posterior.power)
    return [error[part] for part in posterior.forward.slices]


def _posterior(fit: Fit, observations: Sequence) -> Posterior:
    return posterior_of(fit, observations, FLOOR)


def _whitened(fit: Fit, observations: Sequence):
    posterior = _posterior(fit, observations)
    return posterior, posterior.whitened(posterior.predict(fit.twin.theta))[0]
