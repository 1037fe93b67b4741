"""A hypothesis on a recording, the parts of what it predicts, and the sizes of their errors."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rippletwin.diagnosis.faults.base import Fault


@dataclass(frozen=True)
class Hypothesis:
    """State, leak areas (m2) and pistons of its faults, shaft angle (rad), drift in sds (D,).

    Pistons count in pitches from the anchor's; `turn` is the angle by which the recording's shaft
    is ahead of the anchor's.
    """

    state: tuple[Fault, ...]
    areas: tuple[float, ...]
    pistons: tuple[int, ...]
    turn: float
    drift: np.ndarray

    def beside(self, k: int) -> tuple[float, ...]:
        """Areas, m2, of the other leaks than number k."""
        return self.areas[:k] + self.areas[k + 1 :]


@dataclass(frozen=True)
class Parts:
    """A prediction, Pa, all turned by the shaft angle.

    healthy   (S, F) what the healthy pump would make
    drifted   (S, F) share of it that the drift of the line has made
    leaks     (K, S, F) what each leak adds
    slopes    (D, S, F) derivatives of the reading by the drift
    repeats   (H, S, F) what the changes of flow between healthy recordings make
    pump      (P, S, F) what one standard deviation of each of the pump's numbers makes of them
    spread    (F,) power, Pa2, that the leaks would make if their flow were the same at all orders
    measured  the measured change over that by leaks, or the most that errors grow by
    explained (F,) power, Pa2, of the measured change that the leaks explain, if of the right size
    """

    healthy: np.ndarray
    drifted: np.ndarray
    leaks: np.ndarray
    slopes: np.ndarray
    repeats: np.ndarray
    pump: np.ndarray
    spread: np.ndarray
    measured: float
    explained: np.ndarray

    @cached_property
    def change(self) -> np.ndarray:
        """What all leaks add (S, F), Pa."""
        return self.leaks.sum(axis=0)


@dataclass(frozen=True)
class Errors:
    """Errors of a prediction: `scatter`, relative, of the healthy ripple, and `change` of what
    changes in it along the response to a flow, over what the twin's own misfit of the healthy
    ripple leads to expect; `across` is the same across the response."""

    scatter: float
    change: float
    across: float = 1.0


def coherence(error: np.ndarray) -> np.ndarray:
    """Share of a predicted change that is to be expected, 1/(1 + e^2) for a relative error e, any
    shape, of the prediction (Carroll, Ruppert, Stefanski and Crainiceanu 2006, Measurement Error in
    Nonlinear Models, section 4.1). The rest of its power is error: where the twin knows nothing, a
    change says nothing of its size."""
    return 1.0 / (1.0 + error**2)
