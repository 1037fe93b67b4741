"""From observations to a diagnosis: one recording, healthy ones beside it, and the twin."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import logsumexp

from rippletwin.case.model import Rig
from rippletwin.diagnosis.anchor import (
    distance_between,
    even_flow,
    make_anchor,
    without_recording,
)
from rippletwin.diagnosis.diagnosis import Diagnosis
from rippletwin.diagnosis.drifting_line import DriftingLine
from rippletwin.diagnosis.evidence import ErrorPrior, StateEvidence, compare_healthy, weigh_states
from rippletwin.diagnosis.faults.base import Fault
from rippletwin.diagnosis.faults.library import state_name, states_of
from rippletwin.diagnosis.observation_model import ObservationModel
from rippletwin.diagnosis.pump_flow import (
    ORDERS,
    load_pressure_of,
    simulate_healthy_pump,
    simulate_leak_flow,
    with_fitted_pump,
)
from rippletwin.diagnosis.unlike import judge_residual
from rippletwin.errors import InputError
from rippletwin.spectra.frequency_selection import check_load_table, select_frequencies
from rippletwin.twin.twin import Twin

MOST_REPEATS = 2  # healthy recordings beside the anchor whose scatter is looked at
NO_REPEATS = np.zeros((0, ORDERS + 1), complex)
DIGITS = 3  # of speed and load pressure at which the pump is simulated
PRIOR = (0.5, 0.4, 0.1)
"""Prior probabilities of no fault, of one and of two; states of a kind share theirs evenly."""


class Diagnoser:
    """A twin and the faults to try; called with observations of all shaft orders.

    Where it is not `anchored`, recordings are compared with the twin's own healthy ripple.
    `expected_gain` is that of the pump's fit (`RecalibratedTwin`).
    """

    def __init__(
        self,
        twin: Twin,
        faults: Sequence[Fault],
        anchored: bool = True,
        expected_gain: float = 0.0,
    ):
        self.twin, self.faults, self.anchored = twin, tuple(faults), anchored
        self.expected_gain = expected_gain
        self._learned: dict[tuple[str, ...], tuple[ErrorPrior, np.ndarray]] = {}

    def __call__(self, observation, healthy: Sequence, start: float = 0.0) -> Diagnosis:
        """The diagnosis of a periodic observation, anchored to the first of `healthy`; the others
        tell how far healthy recordings of one operating point scatter. `start` as in
        `ObservationModel`."""
        labels = tuple(each.label for each in healthy)
        if labels not in self._learned:  # recordings of one operating point share it
            self._learned[labels] = self._learn_errors(healthy)
        prior, repeats = self._learned[labels]
        model = self.make_model(observation, healthy[0], start, repeats)
        weighed = weigh_states(model, states_of(self.faults), prior)
        log_posterior = _log_posterior(weighed)
        best = max(weighed, key=lambda w: log_posterior[state_name(w.state)])
        return Diagnosis(
            label=observation.label,
            log_posterior=log_posterior,
            best=best,
            unlikeness=judge_residual(model, best, prior),
            anchor=model.anchor,
            model=model,
            expected_gain=self.expected_gain,
        )

    def make_model(
        self, observation, healthy, start: float = 0.0, repeats: np.ndarray = NO_REPEATS
    ) -> ObservationModel:
        """The observation model of an observation, anchored to a healthy one, at the orders that
        the bands of both have, `ORDERS` at most. `start` and `repeats` as in `ObservationModel`.

        Raises InputError as `check_observations`.
        """
        check_observations([observation, healthy], self.twin.rig)
        orders = _common_orders(observation, healthy)
        healthy, observation = (
            select_frequencies(o, np.isin(o.orders, orders)) for o in (healthy, observation)
        )
        pressure = _rounded(load_pressure_of(self.twin, observation))
        speed_rpm = _rounded(60.0 * observation.speed_hz)
        given = healthy.flow_ripple and healthy.flow_ripple.stated_mean
        displacement = given and given / healthy.speed_hz
        twin = with_fitted_pump(self.twin, displacement)
        pump, fluid = twin.rig.pump, twin.rig.fluid
        ripple = simulate_healthy_pump(pump, fluid, speed_rpm, pressure)
        line = DriftingLine(twin, observation, ripple)
        anchor = make_anchor(twin, healthy, observation, line, speed_rpm, pressure)
        if not self.anchored:
            simulated = even_flow(ripple, anchor.orders, pump["pistons"])
            anchor = without_recording(anchor, simulated, line.response(), pump["pistons"])
        flows = {
            fault.name: simulate_leak_flow(pump, fluid, speed_rpm, pressure, fault)
            for fault in self.faults
        }
        return ObservationModel(observation, anchor, line, flows, repeats, start)

    def _learn_errors(self, healthy: Sequence) -> tuple[ErrorPrior, np.ndarray]:
        """What healthy repeats say of the errors, and changes (R, `ORDERS` + 1) of the pump's flow
        from one of them to the next, m3/s, by shaft order; 0 at orders that a repeat lacks."""
        prior = ErrorPrior()
        if not self.anchored:  # the twin's errors, which repeats share, are in the anchor
            return prior, NO_REPEATS
        first, *others = healthy
        repeats = [o for o in others if not distance_between(o, first)][:MOST_REPEATS]
        scatters = [prior.scatter]
        changes = np.zeros((len(repeats), ORDERS + 1), complex)
        for change, repeat in zip(changes, repeats):
            model = self.make_model(repeat, first)
            scatter, change[model.orders] = compare_healthy(model, prior)
            scatters.append(scatter)
        return replace(prior, scatter=float(np.exp(np.mean(np.log(scatters))))), changes


def check_observations(observations: Sequence, rig: Rig) -> None:
    """Raise InputError where the bands of the first of the periodic observations and of another one
    have no order of the pistons in common, and as `check_load_table`: no twin can diagnose it."""
    pistons, first = rig.pump["pistons"], observations[0]
    for each in observations:
        if not np.any(_common_orders(first, each) % pistons == 0):
            both = "" if each is first else f" together with that of recording {first.label}"
            raise InputError(
                f"recording {each.label}",
                "min_frequency_hz, max_frequency_hz",
                f"the band, {each.min_frequency_hz:.4g} to {each.frequency_hz[-1]:.4g} Hz{both}, "
                f"has no multiple of the piston frequency, {pistons * each.speed_hz:.4g} Hz, which "
                "a diagnosis needs",
                "Give a wider band, best to several times the piston frequency",
            )
    check_load_table(observations, rig)


def _common_orders(one, other) -> np.ndarray:
    """The shaft orders (F,) that the bands of two periodic observations have, `ORDERS` at most."""
    own = (o.orders[o.frequency_hz >= o.min_frequency_hz] for o in (one, other))
    common = np.intersect1d(*own)
    return common[common <= ORDERS]


def _rounded(value: float) -> float:
    """To some digits: recordings of one operating point share the pump's simulations."""
    return float(f"{value:.{DIGITS}g}")


def _log_posterior(weighed: Sequence[StateEvidence]) -> dict[str, float]:
    """Log posterior probabilities by state's name."""
    sizes = [len(w.state) for w in weighed]
    log_posterior = np.array(
        [w.log_evidence + np.log(PRIOR[n] / sizes.count(n)) for w, n in zip(weighed, sizes)]
    )
    # a state whose likelihood overflows explains nothing
    log_posterior[~np.isfinite(log_posterior)] = -np.inf
    log_posterior -= logsumexp(log_posterior)
    return {state_name(w.state): float(value) for w, value in zip(weighed, log_posterior)}
