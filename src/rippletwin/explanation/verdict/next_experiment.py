"""The next experiment: which recording would discriminate between equivalent explanations?

Two explanations that fit alike predict different readings elsewhere: at another speed or load
pressure, at a further sensor, under broadband excitation, with another end. Let A be accepted and
B its rival with posterior covariance P. If A is true, a new recording reads the prediction of A. B,
free to move within P, misses it by d in whitened units, and loses

    1/2 d^H (I + J P J^T)^-1 d

of log evidence, with J the Jacobian of B's prediction (MacKay 1992, Neural Computation 4:590, to
first order in J). The best recording has the largest loss of its least affected rival. The
assumed error of a nominal source is that of the fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.posterior import Posterior
from rippletwin.case.model import Rig
from rippletwin.explanation.thresholds import EQUIVALENT_LOG_BAYES_FACTOR, LITTLE_MODEL_ERROR
from rippletwin.explanation.verdict.candidate_recordings import (
    further_sensors,
    list_candidate_recordings,
)
from rippletwin.spectra.observation import Observation
from rippletwin.twin.twin import Twin

RANDOM_ERROR = 0.01  # relative, of cross spectra under random excitation: 100 averages or more
FLAT_VARIANCE = 1e4  # prior variance of the coordinate of a new shaft angle
FIXED_VARIANCE = 1e-9  # variance of a coordinate that is fixed
COMPARED_WITH_PUMP = 3
"""Recordings that are compared with the pump's numbers free: the best with its numbers held."""


@dataclass(frozen=True)
class Proposal:
    """A recording to make, in words, and the log evidence that every rival is expected to lose."""

    recording: str
    loss: float

    def __str__(self) -> str:
        if self.loss < EQUIVALENT_LOG_BAYES_FACTOR:
            return (
                "none of those considered is expected to tell them apart; the best is "
                f"{self.recording} ({self.loss:.1f} of log evidence)"
            )
        return f"{self.recording}; it should tell them apart ({self.loss:.0f} of log evidence)"


def propose_recording(
    accepted: Fit, rivals: Sequence[Fit], observations: Sequence
) -> Proposal | None:
    """The recording that best discriminates `accepted` from each of `rivals`; None without rivals,
    and where no further recording is possible.

    The new recording has the noise and the source of the fitted `observations`.
    """
    rivals = [fit for fit in rivals if fit is not accepted]
    if not rivals:
        return None

    def loss(candidate, uncertain_pump: bool) -> float:
        _, rig, observation = candidate
        return float(
            min(expected_loss(accepted, f, rig, observation, uncertain_pump) for f in rivals)
        )

    candidates = list_candidate_recordings(accepted.twin, observations)
    if any(e.element == "load" for fit in (accepted, *rivals) for e, _ in fit.hypothesis):
        # at another end an effect at the load is not there
        candidates = [c for c in candidates if c[1].load is accepted.twin.rig.load]
    if any(parameter.place == "pump" for parameter in accepted.twin.parameters):
        # How its numbers change the ripple at a new operating point takes many runs of the pump.
        candidates.sort(key=lambda each: -loss(each, uncertain_pump=False))
        candidates = candidates[:COMPARED_WITH_PUMP]
    proposals = [Proposal(each[0], loss(each, uncertain_pump=True)) for each in candidates]
    return max(proposals, key=lambda proposal: proposal.loss, default=None)


def propose_sensor_position(
    fit: Fit, observations: Sequence, low: float, high: float
) -> Proposal | None:
    """The further sensor that best narrows the position of the newest effect of a fit.

    low, high  ends (m) of the interval of its position

    The loss is the log evidence between the effect at one end and at the other, at the same
    operating point. None where no sensor can be added.
    """
    ends = []
    effect, place = fit.hypothesis[-1]
    k = fit.twin.index[f"{effect.name}@{place}.position"]
    for x in (low, high):
        theta = fit.twin.theta.copy()
        theta[k] = fit.twin.parameters[k].prior.coordinate(x)
        covariance = fit.covariance.copy()
        covariance[k], covariance[:, k] = 0.0, 0.0
        covariance[k, k] = FIXED_VARIANCE
        ends.append(replace(fit, twin=fit.twin.with_(theta=theta), covariance=covariance))
    options = [
        Proposal(recording, float(expected_loss(ends[0], ends[1], rig, observation)))
        for recording, rig, observation in further_sensors(fit.twin, observations)
    ]
    return max(options, key=lambda proposal: proposal.loss, default=None)


def expected_loss(
    accepted: Fit, rival: Fit, rig: Rig, observation: Observation, uncertain_pump: bool = True
) -> float:
    """Log evidence that `rival` is expected to lose by an observation if `accepted` is true.

    uncertain_pump   whether the pump's numbers are those of the fits, where these have any; if not,
                     both have those of the data sheet
    """
    true = transfer_twin(accepted, rig, observation, uncertain_pump)
    (reading,) = true.predict([observation])
    covariance = observation.covariance
    if observation.source == "free":  # of unknown size, so that errors can only be relative
        variance = RANDOM_ERROR**2 * np.abs(reading) ** 2
        covariance = np.einsum("sf,st->fst", variance, np.eye(len(reading))).astype(complex)
    values = reading
    if observation.kind == "input_impedance":
        # `Posterior` compares reflection coefficients, which it makes of impedances itself.
        values = (1.0 + reading) / (1.0 - reading)
        variance = (LITTLE_MODEL_ERROR * np.abs(values + 1.0) ** 2 / 2.0) ** 2
        covariance = np.einsum("sf,st->fst", variance, np.eye(1)).astype(complex)
        observation = replace(observation, normalised=True)
    twin = transfer_twin(rival, rig, observation, uncertain_pump)
    posterior = Posterior(twin, [replace(observation, values=values, covariance=covariance)])
    posterior.model_error = max(accepted.model_error, LITTLE_MODEL_ERROR)
    posterior.source_sd = rival.source_sd
    posterior.smooth_sd = rival.smooth_sd
    r, jacobian = posterior.linearise(twin.theta, posterior.predict(twin.theta))
    count = 2 * values.size  # the rest are the residuals of the priors
    r = r[:count]
    variances, basis = np.linalg.eigh(_transfer_covariance(rival, twin))
    columns = jacobian[:count] @ (basis * np.sqrt(np.maximum(variances, 0.0)))
    projection = columns.T @ r
    absorbed = np.linalg.solve(np.eye(len(projection)) + columns.T @ columns, projection)
    return 0.5 * float(r @ r - projection @ absorbed)


def transfer_twin(
    fit: Fit, rig: Rig, observation: Observation, uncertain_pump: bool = True
) -> Twin:
    """The fitted twin on another rig and for one new recording; new parameters are nominal, and
    those of the pump are left out unless `uncertain_pump`."""
    old = fit.twin
    twin = Twin(
        rig,
        [observation],
        friction=old.friction,
        effects=old.effects,
        source_sd=old.source_sd,
        guessed_load=old.guessed_load and rig.load.kind == "orifice",
        absolute_gains=old.absolute_gains,
        uncertain_pump=old.uncertain_pump and uncertain_pump,
        changing_state=old.changing_state,
    )
    theta = [old.theta[old.index[p.name]] if p.name in old.index else 0.0 for p in twin.parameters]
    return twin.with_(theta=np.array(theta))


def _transfer_covariance(fit: Fit, twin: Twin) -> np.ndarray:
    """Posterior covariance of the fit in another twin's parameters; priors for the new ones."""
    index = [fit.twin.index.get(p.name) for p in twin.parameters]
    covariance = np.diag([FLAT_VARIANCE if p.flat else 1.0 for p in twin.parameters])
    here = [k for k, i in enumerate(index) if i is not None]
    there = [index[k] for k in here]
    covariance[np.ix_(here, here)] = fit.covariance[np.ix_(there, there)]
    return covariance
