"""`diagnose`: from a case and its twin to the state of every recording."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import logsumexp
from threadpoolctl import threadpool_limits

from rippletwin.case.model import Case, Recording
from rippletwin.diagnosis.anchor import Anchor, distance, make_anchor
from rippletwin.diagnosis.diagnosis import Diagnosis
from rippletwin.diagnosis.drifting_line import DriftingLine
from rippletwin.diagnosis.evidence import ErrorPrior, StateEvidence, scatter_of, weigh_states
from rippletwin.diagnosis.faults.base import Fault
from rippletwin.diagnosis.faults.library import state_name, states_of
from rippletwin.diagnosis.observation_model import ObservationModel
from rippletwin.diagnosis.pump_flow import healthy_flow, leak_flow, with_fitted_pump
from rippletwin.diagnosis.unlike import judge_residual
from rippletwin.errors import InputError
from rippletwin.spectra.observation import observe
from rippletwin.twin.twin import Twin

HIGHEST_HZ = 4000.0
MOST_REPEATS = 2  # healthy recordings beside the anchor whose scatter is looked at
MIN_CHANGE_ERROR = 0.04  # relative, of the change by a leak behind the best of twins
CHANGE_ERROR_SHARE = 0.8  # of the twin's misfit of the healthy ripple
PRIOR = (0.5, 0.4, 0.1)
"""Prior probabilities of no fault, of one and of two; states of a kind share theirs evenly."""


class Diagnoser:
    """A case's twin and healthy recordings, ready to diagnose recordings one after the other.

    Raises InputError where the twin is none of this case's rig or no healthy recording is periodic.
    """

    def __init__(self, case: Case, twin: Twin, faults: Sequence[Fault]):
        self.case, self.twin, self.faults = case, twin, tuple(faults)
        _check_twin(case, twin)
        self._observed = {}

    def __call__(self, recording: Recording) -> Diagnosis:
        """The diagnosis of a periodic recording; raises InputError where there is no other,
        healthy one to anchor it to."""
        healthy = self._anchors(recording)
        unknown = self._observe(recording)
        anchor_recording, *repeats = healthy
        model = self._model(unknown, self._observe(anchor_recording), recording)
        prior = self._error_prior(model.anchor, anchor_recording, repeats)
        weighed = weigh_states(model, states_of(self.faults), prior)
        probabilities = _probabilities(weighed)
        best = max(weighed, key=lambda w: probabilities[state_name(w.state)])
        return Diagnosis(
            label=recording.label,
            probabilities=probabilities,
            best=best,
            unlikeness=judge_residual(model, best, prior),
            anchor=model.anchor,
            model=model,
        )

    def _model(self, unknown, healthy, recording: Recording) -> ObservationModel:
        """The observation model of `unknown`, anchored to `healthy`."""
        point = self.twin.operating_point(replace(unknown, source="free"))
        pressure = recording.load_pressure or point.load_pressure
        mean_flow = None if healthy.flow_ripple is None else np.mean(healthy.flow_ripple.flow)
        twin = with_fitted_pump(self.twin, mean_flow, healthy.speed_hz)
        pump, fluid = twin.rig.pump, twin.rig.fluid
        ripple = healthy_flow(pump, fluid, recording.speed_rpm, pressure)
        line = DriftingLine(twin, unknown, ripple)
        anchor = make_anchor(twin, healthy, unknown, line, recording.speed_rpm, pressure)
        flows = {
            fault.name: leak_flow(pump, fluid, recording.speed_rpm, pressure, fault)
            for fault in self.faults
        }
        return ObservationModel(unknown, anchor, line, flows)

    def _error_prior(
        self, anchor: Anchor, recording: Recording, repeats: Sequence[Recording]
    ) -> ErrorPrior:
        """What the twin's misfit and the scatter of healthy repeats say of the errors."""
        prior = ErrorPrior(
            change=float(np.hypot(MIN_CHANGE_ERROR, CHANGE_ERROR_SHARE * anchor.misfit))
        )
        scatter = [np.log(prior.scatter)]
        for repeat in repeats[:MOST_REPEATS]:
            model = self._model(self._observe(repeat), self._observe(recording), repeat)
            scatter.append(np.log(scatter_of(model, prior)))
        return replace(prior, scatter=float(np.exp(np.mean(scatter))))

    def _anchors(self, recording: Recording) -> list[Recording]:
        """The healthy recording whose operating point is nearest, and others of the same point."""
        healthy = [
            r for r in self.case.healthy if r.kind == "periodic" and r.label != recording.label
        ]
        if not healthy:
            raise InputError(
                self.case.folder / "rig.yaml",
                "recordings",
                f"no healthy periodic recording beside {recording.label}",
                "Diagnosing needs one, best of the same operating point",
            )
        healthy = sorted(healthy, key=lambda r: _apart(r, recording))
        same = _apart(healthy[0], recording)
        return [r for r in healthy if _apart(r, recording) == same]

    def _observe(self, recording: Recording):
        if recording.label not in self._observed:
            self._observed[recording.label] = observe(recording, self.case.rig, HIGHEST_HZ)
        return self._observed[recording.label]


def diagnose(
    case: Case,
    twin: Twin,
    recordings: Sequence[Recording],
    faults: Sequence[Fault],
    progress: Callable[[str, int, int], None] | None = None,
) -> list[Diagnosis]:
    """Diagnose recordings of a case by its twin; `progress` is told what is done, and of how many.

    Raises InputError as `Diagnoser` does.
    """
    found = []
    with threadpool_limits(1):
        diagnoser = Diagnoser(case, twin, faults)
        for k, recording in enumerate(recordings):
            if progress:
                progress("diagnosing", k, len(recordings))
            found.append(diagnoser(recording))
    if progress:
        progress("diagnosing", len(recordings), len(recordings))
    return found


def select_recordings(case: Case, labels: Sequence[str] = ()) -> list[Recording]:
    """The recordings of these labels, or all whose state is unknown.

    Raises InputError for a label that is not there, a recording that is not periodic, and where
    there is nothing to diagnose.
    """
    sheet = case.folder / "rig.yaml"
    known = {r.label: r for r in case.recordings}
    for label in labels:
        if label not in known:
            raise InputError(
                sheet, "recordings", f"no recording {label}", f"There are {', '.join(known)}"
            )
    chosen = [known[label] for label in dict.fromkeys(labels)]
    if not labels:
        chosen = [r for r in case.recordings if r.state == "unknown"]
    for recording in chosen:
        if recording.kind != "periodic":
            raise InputError(
                sheet,
                f"recording {recording.label}",
                f"of kind {recording.kind}",
                "Only periodic recordings can be diagnosed",
            )
    if not chosen:
        raise InputError(
            sheet,
            "recordings",
            "none has state: unknown",
            "Mark those to diagnose, or name them with --recording",
        )
    return chosen


def _check_twin(case: Case, twin: Twin) -> None:
    ours, its = ([s.name for s in rig.sensors] for rig in (case.rig, twin.rig))
    if set(ours) - set(its) or "pistons" not in twin.rig.pump:
        raise InputError(
            case.folder / "rig.yaml",
            "sensors",
            f"{', '.join(ours)}, but the twin has {', '.join(its)}",
            "Give the twin of this rig, or none to have the healthy recordings explained",
        )


def _apart(one: Recording, other: Recording) -> float:
    """How far the operating points of two recordings are apart, as stated."""
    return distance(one.speed_rpm, other.speed_rpm, one.load_pressure, other.load_pressure)


def _probabilities(weighed: Sequence[StateEvidence]) -> dict[str, float]:
    """Posterior probabilities by state's name."""
    sizes = [len(w.state) for w in weighed]
    log_posterior = np.array(
        [w.log_evidence + np.log(PRIOR[n] / sizes.count(n)) for w, n in zip(weighed, sizes)]
    )
    chances = np.exp(log_posterior - logsumexp(log_posterior))
    return {state_name(w.state): float(p) for w, p in zip(weighed, chances)}
