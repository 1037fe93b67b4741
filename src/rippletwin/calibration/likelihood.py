"""How likely observations are under a twin: noise, a relative model error, an uncertain source.

At each frequency the S sensors' values v and the prediction h make the residual e = v - h with

    E[e e^H] = C + delta^2 m I + sigma^2 h h^H,     m = (1 - g) |v|^2 + g mean_f |v|^2,

with |v|^2 the mean over sensors and mean_f that over frequencies too. C is the observation's own
covariance. delta is the relative error floor of the model, estimated; the evenness g says whether
it is relative to each harmonic (0) or to the whole ripple (1).
sigma is the relative error of the source, common to all sensors: zero for a known source,
estimated up to `twin.source_sd` for a nominal flow ripple, infinite for a free one, whose
amplitude is then projected out. Its term is built from the prediction, not from the data, so a
shrinking model gains nothing by it.

C is rotated to its eigenbasis once, which leaves the floor's term as it is; what remains is
diagonal plus one rank, and its inverse root acts as: divide by the standard deviations, then
shorten the part along the prediction by 1/sqrt(1 + sigma^2 |h|^2).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rippletwin.spectra.frequency_selection import select_below
from rippletwin.twin.forward_model import ForwardModel, characteristic_impedance, reflection

FLOORS = np.geomspace(1e-4, 2.0, 40)
SOURCE_STEPS = np.array([0.0, 0.01, 0.02, 0.05, 0.1, 0.2, 0.35, 0.5, 0.7, 1.0])


class Likelihood:
    """Whitened residuals of a twin against observations below a frequency.

    Parameters
    ----------
    twin, observations : see rippletwin.twin.twin and rippletwin.spectra.observation.
    max_frequency_hz : use nothing above it; None for all.
    floor : relative model error to begin with.
    evenness : g above.

    Columns are the frequencies of all observations side by side. With `piston_orders` the shaft
    orders that no healthy nominal pump makes are left out of periodic recordings.

    Attributes: `floor` and `source_sd` (delta and sigma of nominal sources), to be set by
    `estimate_errors`; `count`, the number of real data; `observations`, as used.
    """

    def __init__(
        self,
        twin,
        observations: Sequence,
        max_frequency_hz: float | None = None,
        floor: float = 0.1,
        piston_orders: bool = True,
        evenness: float = 0.0,
    ):
        self.twin = twin
        pistons = twin.rig.pump.get("pistons", 1) if piston_orders else 1
        self.observations = [select_below(o, max_frequency_hz, pistons) for o in observations]
        self.forward = ForwardModel(twin, self.observations)
        self.model_error, self.source_sd = floor, 0.0
        self.prior = np.array([not p.flat for p in twin.parameters])
        self._groups = [_Group(comparable(o, twin.rig), evenness) for o in self.observations]
        free = sum(g.values.shape[1] for g in self._groups if g.source == "free")
        self.count = 2 * (sum(g.values.size for g in self._groups) - free)

    def residual(self, theta: np.ndarray, prediction=None) -> np.ndarray:
        """Whitened residuals (2 N,) of unit variance, then theta where it has a prior.

        Half the sum of squares is minus the log posterior but for `log_determinant`. Complex data
        give a real and an imaginary part of variance one half each, hence the factor sqrt 2.
        """
        prediction = self.forward(theta) if prediction is None else prediction
        parts = []
        for group, h in zip(self._groups, prediction):
            r = group.whitened(h, self.model_error, self._sigma(group))[0]
            parts += [r.real.ravel(), r.imag.ravel()]
        return np.concatenate([np.sqrt(2.0) * np.concatenate(parts), theta[self.prior]])

    def objective(self, theta: np.ndarray, prediction=None) -> float:
        """Minus the log posterior at the present floor and source error, but for a constant."""
        prediction = self.forward(theta) if prediction is None else prediction
        total = 0.5 * float(np.sum(theta[self.prior] ** 2))
        for group, h in zip(self._groups, prediction):
            r, log_determinant = group.whitened(h, self.model_error, self._sigma(group))
            total += float(np.sum(np.abs(r) ** 2)) + log_determinant
        return total

    def estimate_errors(self, prediction: Sequence[np.ndarray]) -> None:
        """Set floor and source error to their most likely values given the residuals.

        Degrees of freedom taken by the parameters are made up for by scaling the sum of squares.
        """
        taken = min(np.sum(self.prior) + len(self.twin.labels), 0.5 * self.count)
        scale = self.count / (self.count - taken)
        sigmas = self.twin.source_sd * SOURCE_STEPS
        floors = FLOORS
        for _ in range(2):
            cost = np.zeros((len(floors), len(sigmas)))
            for group, h in zip(self._groups, prediction):
                cost += group.cost(h, floors, sigmas, scale)
            best, kept = np.unravel_index(np.argmin(cost), cost.shape)
            # Once more, finely, about the best floor.
            near = floors[max(best - 1, 0)], floors[min(best + 1, len(floors) - 1)]
            self.model_error, self.source_sd = float(floors[best]), float(sigmas[kept])
            floors = np.geomspace(*near, 12)

    def _sigma(self, group: _Group) -> float:
        return {"known": 0.0, "nominal": self.source_sd, "free": np.inf}[group.source]


class _Group:
    """One observation in the eigenbasis of its covariance."""

    def __init__(self, o, evenness: float = 0.0):
        variances, basis = np.linalg.eigh(o.covariance)  # (F, S), (F, S, S)
        self.source = o.source
        self.variances = np.maximum(variances, 0.0).T  # (S, F)
        self.rotation = np.conj(basis)
        self.values = self.rotate(o.values)
        power = np.mean(np.abs(o.values) ** 2, axis=0)  # (F,)
        self.power = (1.0 - evenness) * power + evenness * np.mean(power)

    def rotate(self, x: np.ndarray) -> np.ndarray:
        return np.einsum("fsk,sf->kf", self.rotation, x)

    def whitened(self, prediction, floor, sigma) -> tuple[np.ndarray, float]:
        """Whitened residual (S, F) and the log determinant of its covariance."""
        variance = self.variances + floor**2 * self.power
        sd = np.sqrt(variance)
        h = self.rotate(prediction)
        e, u = (self.values - h) / sd, h / sd
        log_determinant = float(np.sum(np.log(variance)))
        if sigma == 0.0:
            return e, log_determinant
        size = np.maximum(np.sum(np.abs(u) ** 2, axis=0), 1e-300)
        if np.isinf(sigma):
            shorten = np.ones_like(size)
            # The volume that the projection leaves: the free amplitude has a flat prior relative
            # to the prediction's own size.
            log_determinant += float(np.sum(np.log(size / np.sum(np.abs(h) ** 2, axis=0))))
        else:
            stretch = 1.0 + sigma**2 * size
            shorten = 1.0 - 1.0 / np.sqrt(stretch)
            log_determinant += float(np.sum(np.log(stretch)))
        along = np.sum(np.conj(u) * e, axis=0) / size
        return e - shorten * along * u, log_determinant

    def cost(self, prediction, floors, sigmas, scale) -> np.ndarray:
        """Minus log likelihood (len(floors), len(sigmas)), squares scaled by `scale`."""
        variance = self.variances + floors[:, None, None] ** 2 * self.power  # (D, S, F)
        h = self.rotate(prediction)
        e = self.values - h
        square = np.sum(np.abs(e) ** 2 / variance, axis=1)
        cross = np.abs(np.sum(np.conj(h) * e / variance, axis=1)) ** 2
        size = np.maximum(np.sum(np.abs(h) ** 2 / variance, axis=1), 1e-300)
        logs = np.sum(np.log(variance), axis=(1, 2))
        if self.source == "free":
            logs = logs + np.sum(np.log(size), axis=1)
            return np.repeat(
                (scale * np.sum(square - cross / size, axis=1) + logs)[:, None], len(sigmas), 1
            )
        if self.source == "known":
            sigmas = np.zeros_like(sigmas)
        stretch = 1.0 + sigmas[:, None] ** 2 * size[:, None, :]  # (D, G, F)
        along = np.sum(sigmas[:, None] ** 2 * cross[:, None, :] / stretch, axis=2)
        return (
            scale * (np.sum(square, axis=1)[:, None] - along)
            + logs[:, None]
            + np.sum(np.log(stretch), axis=2)
        )


def comparable(observation, rig):
    """The observation in the quantity that `Forward` predicts.

    An input impedance becomes a reflection coefficient (see `reflection`), its
    covariance with it: dR = 2 dz/(z + 1)^2 with z over the data sheet's rho a/A. The rest stays.
    """
    if observation.kind != "input_impedance":
        return observation
    unit = 1.0 if observation.normalised else characteristic_impedance(rig.fluid, rig.line[0])
    z = observation.values / unit
    slope = np.abs(2.0 / (z[0] + 1.0) ** 2) ** 2 / unit**2
    return replace(
        observation,
        values=reflection(z),
        covariance=observation.covariance * slope[:, None, None],
    )
