"""What a further effect promises before it is fitted: a score test.

The score of a start is what the objective loses, to first order, on the way from the prediction
without the effect to that of the start, everything else refitted (Rao 1948, Math. Proc. Cambridge
Philos. Soc. 44:50).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rippletwin.calibration.posterior import Posterior
from rippletwin.twin.twin import Twin

MAX_FOLLOWED, MAX_CORRELATION = 4, 0.7
"""Most starts that the score test selects, and the correlation of the changes that two of them
make in the prediction above which they count as one."""


class ScoreTest:
    """Score test of the newest effect of a posterior's twin.

    base, thetas   the twin without effects, and the starts (P,) of the newest effect
    starts         at most MAX_FOLLOWED of them, the most promising first
    residual       (N,) whitened readings less the prediction without the effect, the line refitted
    count_without  number of the parameters without the effect, which come first in a start

    From here on `posterior` freezes the nonlinear compliance as it is without the effect.
    """

    def __init__(self, base: Twin, posterior: Posterior, thetas: Sequence[np.ndarray]):
        twin = posterior.twin
        without = base.with_(effects=twin.effects[:-1])
        theta = np.array([thetas[0][twin.index[p.name]] for p in without.parameters])
        own = Posterior(without, posterior.observations, None, posterior.source_free)
        own.predict(theta)
        own.forward.freeze_compliance = True
        prediction = own.predict(theta)
        posterior.forward.hold_as(own.forward)
        own.estimate_errors(prediction, theta)
        held = own.predict_held(theta)
        ways = np.array([posterior.predict_held(start) for start in thetas]) - held
        ways = np.where(np.isfinite(ways), ways, 0.0)  # an infinite prediction is no start
        r, jacobian = own.linearise(theta, prediction, ways)
        self._jacobian, ways = jacobian[:, : len(theta)], jacobian[:, len(theta) :]
        both = self._without_refit(np.column_stack([r, ways]))
        self.residual, ways = both[:, 0], both[:, 1:]
        ways = ways / np.maximum(np.linalg.norm(ways, axis=0), 1e-300)
        kept: list[int] = []
        for k in np.argsort(ways.T @ self.residual):
            if len(kept) < MAX_FOLLOWED and np.all(
                np.abs(ways[:, kept].T @ ways[:, k]) < MAX_CORRELATION
            ):
                kept.append(k)
        self.starts = [thetas[k] for k in kept]
        self._ways, self.count_without = ways[:, kept], len(theta)
        self._posterior, self._own, self._at = posterior, own, (theta, prediction)

    def gain(self) -> float:
        """What the objective loses at most, to first order, if the effect is added at the first
        start."""
        directions = self.directions(0)
        found = np.linalg.lstsq(directions, self.residual, rcond=1e-9)[0]
        return 0.5 * float(np.sum((directions @ found) ** 2))

    def directions(self, k: int) -> np.ndarray:
        """Changes (N, D) of the whitened readings, the line refitted, that the effect makes on the
        way to start k and, from there, along its own parameters."""
        (theta, prediction), start = self._at, self.starts[k]
        slopes = self._posterior.slopes(start, self._posterior.predict(start))[len(theta) :]
        freed = self._own.linearise(theta, prediction, slopes)[1][:, len(theta) :]
        return self._without_refit(np.column_stack([freed, self._ways[:, k]]))

    def _without_refit(self, columns: np.ndarray) -> np.ndarray:
        """What is left of columns (N, K) where the line without the effect is refitted."""
        return columns - self._jacobian @ np.linalg.lstsq(self._jacobian, columns, rcond=None)[0]
