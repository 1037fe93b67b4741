"""The result of diagnosing one recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from rippletwin.diagnosis.anchor import Anchor
from rippletwin.diagnosis.evidence import StateEvidence
from rippletwin.diagnosis.faults.library import state_name
from rippletwin.diagnosis.observation_model import ObservationModel
from rippletwin.diagnosis.unlike import Unlikeness

SURE_OF_PISTON = 0.95  # probability from which a piston is said


@dataclass(frozen=True)
class Severity:
    """Leak area of a fault, m2: median and 95 % interval."""

    value: float
    low: float
    high: float


@dataclass(frozen=True)
class Diagnosis:
    """What a recording says about the pump.

    log_posterior   log probability of each state by its name; that the recording is like none of
                    them is another question, which `unlikeness` answers
    best            evidence of the most probable state
    expected_gain   what one more step of the pump's fit promises to add to the log posterior
    """

    label: str
    log_posterior: Mapping[str, float]
    best: StateEvidence = field(repr=False)
    unlikeness: Unlikeness
    anchor: Anchor = field(repr=False)
    model: ObservationModel = field(repr=False)
    expected_gain: float = 0.0

    @property
    def probabilities(self) -> dict[str, float]:
        """Of each state by its name."""
        return {name: float(np.exp(value)) for name, value in self.log_posterior.items()}

    @property
    def log_odds(self) -> float:
        """Log odds of all other states together against the healthy one; they also rank what is so
        sure that its probability is 0 or 1."""
        return odds_against_healthy(self.log_posterior)

    @property
    def state(self) -> str:
        """The most probable state's name, or "unlike"."""
        return "unlike" if self.unlikeness.unlike else state_name(self.best.state)

    @property
    def severities(self) -> dict[str, Severity]:
        """Of each fault of the state; none where the recording is unlike all of them."""
        if self.unlikeness.unlike:
            return {}
        return {name: Severity(*density.interval) for name, density in self.best.areas.items()}

    @property
    def pistons(self) -> dict[str, int]:
        """Of each fault whose piston can be told, that piston: how many others begin their delivery
        between the recording's first sample and it."""
        if self.unlikeness.unlike:
            return {}
        return {
            name: int(np.argmax(chances))
            for name, chances in self.best.pistons.items()
            if np.max(chances) > SURE_OF_PISTON
        }

    @property
    def piston(self) -> int | None:
        """The piston of all faults of the state; None where it is not known or not one."""
        faulty = {fault.name for fault in self.best.state if fault.one_piston}
        told = self.pistons
        return next(iter(told.values())) if set(told) == faulty and _one(told) else None


def odds_against_healthy(log_probabilities: Mapping[str, float]) -> float:
    """Log odds of all other states together against the healthy one, of log probabilities by the
    name of the state."""
    healthy = state_name(())
    faulty = [value for name, value in log_probabilities.items() if name != healthy]
    return float(np.logaddexp.reduce(faulty) - log_probabilities[healthy])


def _one(pistons: Mapping[str, int]) -> bool:
    return len(set(pistons.values())) == 1
