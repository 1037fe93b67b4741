"""How probable each state is: likelihoods integrated over leak areas, shaft angle and errors.

For every state the best candidate of the screen is followed to its mode (shaft angle, drift of the
line, areas, relative errors), the likelihood is integrated over the areas about it, and the other
pistons and shaft angles count by their scores in the screen.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from scipy.special import logsumexp

from rippletwin.diagnosis.faults.base import Fault
from rippletwin.diagnosis.hypothesis import Errors, Hypothesis
from rippletwin.diagnosis.integration import Density, explore
from rippletwin.diagnosis.observation_model import ObservationModel
from rippletwin.diagnosis.screening import Candidate, Screen

LIMITS_HZ = (1000.0, 2000.0, np.inf)  # up to which angle and drift are followed, in turn
ROUNDS = 2  # of following and searching the areas
SCATTERS = np.geomspace(0.002, 0.05, 6)
CHANGES = np.geomspace(0.25, 4.0, 5)


@dataclass(frozen=True)
class ErrorPrior:
    """Lognormal priors of the two `Errors`: medians, and sds of their logarithms."""

    scatter: float = 0.005
    change: float = 1.0
    scatter_sd: float = 0.5
    change_sd: float = 0.6

    def log_weights(self) -> np.ndarray:
        """Log probabilities (A, B) on the grid of A SCATTERS and B CHANGES."""
        a = -0.5 * (np.log(SCATTERS / self.scatter) / self.scatter_sd) ** 2
        return (a - logsumexp(a))[:, None] + self.log_weights_of_change()

    def log_weights_of_change(self) -> np.ndarray:
        """Log probabilities (B,) of the B CHANGES."""
        b = -0.5 * (np.log(CHANGES / self.change) / self.change_sd) ** 2
        return b - logsumexp(b)


@dataclass(frozen=True)
class StateEvidence:
    """A state's log evidence, the hypothesis at its mode with its errors, the density over the
    logarithm of each fault's area, whether the smallest and the largest area that were tried cut it
    off, and the probability (pistons,) of each of its pistons."""

    state: tuple[Fault, ...]
    log_evidence: float
    mode: Hypothesis
    errors: Errors
    areas: Mapping[str, Density] = field(repr=False)
    cut_off: Mapping[str, tuple[bool, bool]]
    pistons: Mapping[str, np.ndarray] = field(repr=False)


def weigh_states(
    model: ObservationModel, states: Sequence[tuple[Fault, ...]], prior: ErrorPrior
) -> list[StateEvidence]:
    """The evidence of each state; two faults that cannot be together, for the priors of their areas
    are too far apart, have none."""
    screen = Screen(model)
    ranked = {}
    for state in states:
        if not state:
            ranked[state] = screen.screen_healthy()
        elif len(state) == 1:
            ranked[state] = screen.screen_one(state[0])
        else:
            ranked[state] = screen.screen_two(ranked[state[:1]], ranked[state[1:]])
    return [_weigh(model, candidates, prior) for candidates in ranked.values() if candidates]


def compare_healthy(model: ObservationModel, prior: ErrorPrior) -> tuple[float, np.ndarray]:
    """Relative scatter that a recording known to be healthy shows against its anchor, and the
    change (F,) of the pump's flow from there, m3/s, as the anchor's shaft stands."""
    mode = _hypothesis(Screen(model).screen_healthy()[0], np.zeros(len(model.line.drifts)))
    mode = model.fit_turn_and_drift(mode, Errors(prior.scatter, prior.change), LIMITS_HZ)
    return _best_errors(model, mode, prior)[0].scatter, model.change_of_flow(mode)


def _weigh(
    model: ObservationModel, candidates: Sequence[Candidate], prior: ErrorPrior
) -> StateEvidence:
    errors = Errors(prior.scatter, prior.change)
    candidates, mode = _at_best_pitch(model, candidates, errors)
    best = candidates[0]
    for _ in range(ROUNDS):
        mode = model.fit_turn_and_drift(mode, errors, LIMITS_HZ)
        mode = _at_best_areas(model, mode, errors)
        errors, _ = _best_errors(model, mode, prior)
    mode = model.fit_turn_and_drift(mode, errors, LIMITS_HZ[-1:])
    errors, over_errors = _best_errors(model, mode, prior)
    over_areas, areas = _over_areas(model, mode, errors, prior)
    scores = np.array([c.score for c in candidates])
    places = logsumexp(scores - best.score) - _log_places(model, best.state)
    log_evidence = over_errors + over_areas + places
    chances = np.exp(scores - logsumexp(scores))
    pistons = {
        fault.name: _piston_chances(model, candidates, chances, k)
        for k, fault in enumerate(best.state)
        if fault.one_piston
    }
    cut_off = {name: density.cut_off for name, density in areas.items()}
    # A twin that errs by so much about a change errs by as much about its size.
    areas = {name: density.widen(model.usual_error) for name, density in areas.items()}
    return StateEvidence(best.state, float(log_evidence), mode, errors, areas, cut_off, pistons)


def _at_best_pitch(
    model: ObservationModel, candidates: Sequence[Candidate], errors: Errors
) -> tuple[list[Candidate], Hypothesis]:
    """The candidates, the best first, and the best as a hypothesis. The screen forgives the healthy
    orders beside the pistons' so much that it can miss the pitch: the best candidate of each is
    scored again by the likelihood, with the drift of the first."""
    first = candidates[0]
    mode = _hypothesis(first, np.zeros(len(model.line.drifts)))
    drift = model.fit_turn_and_drift(mode, errors, LIMITS_HZ).drift
    scored: dict[int, float] = {}  # what to add to the scores of a pitch
    pitches = [
        round((c.turn - first.turn) * model.pistons / (2.0 * np.pi)) % model.pistons
        for c in candidates
    ]
    for pitch, candidate in zip(pitches, candidates):  # the best of a pitch comes first
        if pitch not in scored:
            exact = model.evaluate(_hypothesis(candidate, drift), errors).log_likelihood
            scored[pitch] = exact - candidate.score
    again = [replace(c, score=c.score + scored[pitch]) for pitch, c in zip(pitches, candidates)]
    again.sort(key=lambda c: c.score, reverse=True)
    return again, _hypothesis(again[0], drift)


def _hypothesis(candidate: Candidate, drift: np.ndarray) -> Hypothesis:
    c = candidate
    return Hypothesis(c.state, c.areas, c.pistons, c.turn, drift)


def _log_places(model: ObservationModel, state: Sequence[Fault]) -> float:
    """Log of the number of equally probable pistons and pitches of the shaft angle."""
    return np.log(model.pistons) * (1 + sum(fault.one_piston for fault in state))


def _at_best_areas(model: ObservationModel, mode: Hypothesis, errors: Errors) -> Hypothesis:
    def likelihood(hypothesis: Hypothesis) -> float:
        return model.evaluate(hypothesis, errors).log_likelihood

    for k in range(len(mode.state)):
        found = _explore_area(model, mode, k, likelihood)
        mode = _with_area(mode, k, found.nodes[np.argmax(found.log_density)])
    return mode


def _best_errors(model, mode: Hypothesis, prior: ErrorPrior) -> tuple[Errors, float]:
    """Most likely errors on the grid, and the log likelihood integrated over them."""
    weights = prior.log_weights()
    grid = [Errors(s, c) for s in SCATTERS for c in CHANGES]
    values = weights + model.log_likelihoods(mode, grid).reshape(weights.shape)
    at = np.unravel_index(np.argmax(values), values.shape)
    return Errors(float(SCATTERS[at[0]]), float(CHANGES[at[1]])), float(logsumexp(values))


def _over_areas(
    model: ObservationModel, mode: Hypothesis, errors: Errors, prior: ErrorPrior
) -> tuple[float, dict[str, Density]]:
    """Log of the likelihood's mean over the prior of the areas, over the likelihood at the mode,
    and each area's own density: how wrong the twin may be decides how well an area is known.

    Two areas are taken as independent about the mode. What ties them is mostly that either change
    may be relatively wrong, which each density has in it.
    """
    likelihood = partial(_over_changes, model, errors=errors, prior=prior)
    at_mode = likelihood(mode)
    densities = {
        fault.name: _explore_area(model, mode, k, likelihood) for k, fault in enumerate(mode.state)
    }
    if not densities:
        return 0.0, densities
    integral = sum(density.log_integral - at_mode for density in densities.values())
    return float(integral) - model.log_prior_size(mode.state), densities


def _over_changes(model, hypothesis: Hypothesis, errors: Errors, prior: ErrorPrior) -> float:
    """Log likelihood integrated over the errors of a change."""
    each = model.log_likelihoods(hypothesis, [replace(errors, change=c) for c in CHANGES])
    return float(logsumexp(prior.log_weights_of_change() + each))


def _explore_area(
    model: ObservationModel, mode: Hypothesis, k: int, likelihood: Callable[[Hypothesis], float]
) -> Density:
    """The likelihood over the logarithm of area k, all else as in the mode."""
    ends = model.area_ends(mode.state[k], mode.beside(k))
    return explore(lambda log_area: likelihood(_with_area(mode, k, log_area)), *ends)


def _with_area(mode: Hypothesis, k: int, log_area: float) -> Hypothesis:
    areas = list(mode.areas)
    areas[k] = float(np.exp(log_area))
    return replace(mode, areas=tuple(areas))


def _piston_chances(model, candidates, chances, k) -> np.ndarray:
    """Probability (pistons,) of each piston of fault k, counted in pitches from the recording."""
    out = np.zeros(model.pistons)
    for candidate, chance in zip(candidates, chances):
        out[piston_index(model, candidate.pistons[k], candidate.turn)] += chance
    return out


def piston_index(model: ObservationModel, piston: int, turn: float) -> int:
    """How many pistons begin their delivery in the recording before the faulty one does.

    The angles add up to how far the faulty piston is past its outer dead centre at the recording's
    first sample; it comes there again after the rest of the revolution.
    """
    ahead = (model.anchor.angle + turn) / (2.0 * np.pi) - model.start
    return int(np.floor(-ahead * model.pistons - piston)) % model.pistons
