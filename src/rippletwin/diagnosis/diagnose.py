"""`diagnose`: from a case and its twin to the state of its recordings."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
from threadpoolctl import threadpool_limits

from rippletwin.calibration.likelihood import Likelihood
from rippletwin.calibration.misfit import measure_misfit
from rippletwin.calibration.shaft_angles import fit_shaft_angles
from rippletwin.case.model import Case, Recording, Rig
from rippletwin.diagnosis.anchor import differences, distance
from rippletwin.diagnosis.diagnoser import MOST_REPEATS, Diagnoser, check_observations
from rippletwin.diagnosis.diagnosis import Diagnosis
from rippletwin.diagnosis.faults.base import Fault
from rippletwin.diagnosis.faults.library import select_faults
from rippletwin.diagnosis.line_calibration import calibrate_line
from rippletwin.diagnosis.pump_calibration import RecalibratedTwin, calibrate_pump, one_each_point
from rippletwin.diagnosis.pump_flow import rebuild, with_fitted_pump
from rippletwin.errors import InputError
from rippletwin.pump.geometry import stated_numbers
from rippletwin.spectra.frequency_selection import select_fitted_frequencies
from rippletwin.spectra.observation import Observation, observe, revolutions_of
from rippletwin.twin.twin import Twin

HIGHEST_HZ = 4000.0


def diagnose(
    case: Case,
    twin: Twin,
    recordings: Sequence[Recording] | None = None,
    faults: Sequence[Fault] | None = None,
    progress: Callable[[str, int, int], None] | None = None,
    recalibrate: bool = True,
    anchored: bool = True,
) -> list[Diagnosis]:
    """Diagnose periodic recordings of a case by its twin, each anchored to the healthy recording of
    the nearest operating point, itself excepted.

    recordings    all of unknown state where None
    faults        those tried by default where None
    recalibrate   whether the twin's line is fitted to ratios between sensors (`calibrate_line`) and
                  its pump to the flow that the recordings ask for (`calibrate_pump`), if that
                  lowers its misfit of the healthy ripples
    anchored      whether a recording is compared with the healthy one or, for comparison, with the
                  twin's own ripple

    `progress` is told what is done, how much of it, and of how much. Raises InputError where the
    twin is that of another rig, where there is no healthy recording to anchor one to, and where the
    pump cannot be simulated at an operating point.
    """
    recordings = select_recordings(case) if recordings is None else recordings
    faults = select_faults() if faults is None else faults
    check_twin(case, twin)
    anchors = {r.label: find_anchors(case, r) for r in recordings}
    read, found = ReadOnce(case.rig), []
    with threadpool_limits(1):
        if recalibrate:
            fitted = recalibrate_twin(twin, healthy_beside(case, recordings), read)
        else:
            fitted = RecalibratedTwin(twin)
        diagnoser = Diagnoser(fitted.twin, faults, anchored, fitted.expected_gain)
        for k, recording in enumerate(recordings):
            if progress:
                progress("diagnosing", k, len(recordings))
            found.append(diagnose_one(diagnoser, recording, anchors[recording.label], read))
    if progress:
        progress("diagnosing", len(recordings), len(recordings))
    return found


class ReadOnce:
    """Observations of recordings, each made once. Called with a recording it returns its
    observation, and how far, in revolutions, the shaft turns from its first sample to where the
    observation's shaft angle counts from."""

    def __init__(self, rig: Rig):
        self._rig = rig
        self._read: dict[str, tuple[Observation, float]] = {}

    def __call__(self, recording: Recording) -> tuple[Observation, float]:
        if recording.label not in self._read:
            revolutions = revolutions_of(recording, self._rig)
            observation = observe(recording, self._rig, HIGHEST_HZ, revolutions=revolutions)
            self._read[recording.label] = observation, revolutions.start
        return self._read[recording.label]


def healthy_beside(case: Case, recordings: Sequence[Recording]) -> list[Recording]:
    """Healthy periodic recordings that are not among `recordings`."""
    taken = {r.label for r in recordings}
    return [r for r in case.healthy if r.kind == "periodic" and r.label not in taken]


def recalibrate_twin(twin: Twin, healthy: Sequence[Recording], read: ReadOnce) -> RecalibratedTwin:
    """The twin as it is, with its pump fitted to healthy recordings (`calibrate_pump`), or with its
    line fitted to them first (`calibrate_line`): whichever leaves least of the healthy ripples.

    As it is without healthy recordings, and where they have one sensor: it tells no line from a
    pump. Raises InputError where the pump cannot be simulated at an operating point.
    """
    observations = [read(each)[0] for each in healthy]
    if not observations or len(observations[0].values) < 2:
        return RecalibratedTwin(twin)
    labels = ", ".join(each.label for each in healthy)
    with pump_errors(f"healthy recordings {labels}"):
        return _recalibrate(twin, observations)


def _recalibrate(twin: Twin, observations: Sequence[Observation]) -> RecalibratedTwin:
    """`recalibrate_twin` to observations of two sensors or more."""
    points = one_each_point(observations)
    # A line that is right already would lose what it owes to the ripple: ratios between sensors say
    # nothing of the way from the pump to the first sensor.
    own = with_fitted_pump(twin)
    again = calibrate_line(twin, observations)
    lines = [own] if np.array_equal(own.theta, again.theta) else [own, again]
    fitted = (calibrate_pump(line, points, twin.rig.pump) for line in lines)
    tried = [RecalibratedTwin(twin), *fitted]
    if len(stated_numbers(twin.rig.pump)) > 1:
        # leaks are those of the lumped pump: a ripple that is given says nothing of its numbers
        observations = [replace(o, flow_ripple=None) for o in observations]
    return min(tried, key=lambda each: healthy_misfit(each.twin, observations))


def diagnose_one(
    diagnoser: Diagnoser, recording: Recording, anchors: Sequence[Recording], read: ReadOnce
) -> Diagnosis:
    """The diagnosis of a recording, anchored to the first of `anchors`.

    Raises InputError where the pump cannot be simulated at its operating point.
    """
    observation, start = read(recording)
    with pump_errors(f"recording {recording.label}"):
        return diagnoser(observation, [read(each)[0] for each in anchors], start)


@contextmanager
def pump_errors(source: str) -> Iterator[None]:
    """Raise InputError, naming the recordings `source`, where the pump cannot be simulated."""
    try:
        yield
    except ArithmeticError as error:
        raise InputError(
            source,
            "speed_rpm, load_pressure",
            f"the pump cannot be simulated there: {error}",
            "Correct them, or the pump's numbers in rig.yaml",
        ) from error


def healthy_misfit(twin: Twin, observations: Sequence) -> float:
    """Relative misfit of a twin's healthy ripples at the pistons' orders, shaft angles free."""
    fitted = with_fitted_pump(twin)
    data = select_fitted_frequencies(observations, fitted.rig, HIGHEST_HZ)
    turned = rebuild(fitted, fitted.rig, data)
    theta = np.zeros(len(turned.theta))
    theta[[turned.index[name] for name in fitted.index]] = fitted.theta
    model = Likelihood(turned, data, evenness=1.0)
    return measure_misfit(model, fit_shaft_angles(model, theta)).relative


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


def find_anchors(case: Case, recording: Recording) -> list[Recording]:
    """The healthy recording whose operating point is nearest, and others of the same point: as many
    as `Diagnoser` looks at. Among those of one point the least different come first, then by their
    labels: the order of the sheet does not count. Raises InputError where there is none."""

    def points(other: Recording) -> tuple:
        return other.speed_rpm, recording.speed_rpm, other.load_pressure, recording.load_pressure

    healthy = [r for r in case.healthy if r.kind == "periodic" and r.label != recording.label]
    if not healthy:
        raise InputError(
            case.folder / "rig.yaml",
            "recordings",
            f"no healthy periodic recording beside {recording.label}",
            "Diagnosing needs one, best of the same operating point",
        )
    apart = {r.label: distance(*points(r)) for r in healthy}
    nearest = min(apart.values())
    same = [r for r in healthy if apart[r.label] == nearest]
    same.sort(key=lambda r: (sum(differences(*points(r))), r.label))
    return same[: 1 + MOST_REPEATS]


def check_recordings(case: Case, recordings: Sequence[Recording]) -> None:
    """Raise InputError where one of them can be diagnosed by no twin: it has no healthy recording
    to be compared with (`find_anchors`), or either is refused by `check_observations`."""
    read = ReadOnce(case.rig)
    for recording in recordings:
        compared = [recording, *find_anchors(case, recording)]
        check_observations([read(each)[0] for each in compared], case.rig)


def check_twin(case: Case, twin: Twin) -> None:
    """Raise InputError where the twin is that of another rig: a sensor of the case is not in it, or
    its pump has another number of pistons."""
    ours, its = ([s.name for s in rig.sensors] for rig in (case.rig, twin.rig))
    remedy = "Give the twin of this rig, or none to have the healthy recordings explained"
    if set(ours) - set(its):
        found = f"{', '.join(ours)}, but the twin has {', '.join(its)}"
        raise InputError(case.folder / "rig.yaml", "sensors", found, remedy)
    pistons = [rig.pump.get("pistons") for rig in (case.rig, twin.rig)]
    if pistons[1] is None or pistons[0] not in (None, pistons[1]):
        found = f"{pistons[0]}, but the twin has {pistons[1] or 'none'}"
        raise InputError(case.folder / "rig.yaml", "pump.pistons", found, remedy)
