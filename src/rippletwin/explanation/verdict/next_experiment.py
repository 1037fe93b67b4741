"""Which recording would tell apart what these recordings cannot.

Two explanations that fit alike predict different readings elsewhere: at another speed or load
pressure, at a third sensor, under broadband excitation, with another end. Let A be accepted and B
its rival, with mode and posterior covariance P. If A holds, a new recording reads A's prediction;
B, free to move within P, misses it by d in whitened units, and loses

    1/2 d^H (I + J P J^T)^-1 d

of log evidence (J: derivatives of B's prediction; MacKay 1992, Neural Computation 4:590, first
order in J). The recording for which the least of the rivals' losses is largest is the one to make.
A nominal source is believed no better than in the fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.posterior import MIN_MODEL_ERROR, Posterior
from rippletwin.case.model import FlowRipple, Load, Rig, Sensor
from rippletwin.spectra.observation import Observation
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin

SPEED_FACTORS = (0.7, 1.4)  # of the median speed so far, on fifties of r/min
PRESSURE_FACTORS = (0.4, 1.0, 1.8)  # of the median load pressure so far
SENSOR_PLACES = 6  # for one more sensor
RANDOM_ERROR = 0.01  # relative, of cross spectra under random excitation: 100 averages and more
MAX_RANDOM_HZ = 4000.0
RANDOM_BINS = 150  # of a random recording that are worth something of their own
MIN_EXPECTED_LOSS = 3.0  # log evidence that tells two explanations apart: twenty to one
FLAT_VARIANCE = 1e4  # prior variance of a new shaft angle's coordinate
NEW_LABEL = "next recording"


@dataclass(frozen=True)
class Proposal:
    """A recording to make, in words, and the log evidence that every rival is expected to lose."""

    words: str
    loss: float

    def __str__(self) -> str:
        if self.loss < MIN_EXPECTED_LOSS:
            return (
                f"none of the recordings considered is expected to tell them apart; the best, to "
                f"{self.words}, brings {self.loss:.1f} in log evidence"
            )
        return f"{self.words}: expected to tell them apart by {self.loss:.0f} in log evidence"


def propose_recording(
    accepted: Fit, rivals: Sequence[Fit], observations: Sequence
) -> Proposal | None:
    """The recording that would best tell `accepted` from each of `rivals`; None without rivals.

    `observations` are those that were fitted: the next one has their kind of noise and source.
    """
    rivals = [fit for fit in rivals if fit is not accepted]
    if not rivals:
        return None
    best = None
    for words, rig, observation in candidate_recordings(accepted.twin, observations):
        losses = [expected_loss(accepted, fit, rig, observation) for fit in rivals]
        if best is None or min(losses) > best.loss:
            best = Proposal(words, float(min(losses)))
    return best


def propose_sensor_position(fit: Fit, observations: Sequence, kind: str, low: float, high: float):
    """A `Proposal` of one more sensor that narrows the place of a nameless shunt or series element.

    Between the ends (m) of its interval the element is held to be at one or at the other; None
    where no sensor can be added. The figure is the log evidence between the two, seen at the same
    operating point.
    """
    effect = EFFECTS["passive_network"]
    place = Place("position", form=kind)
    if (effect, place) not in fit.hypothesis:
        return None
    ends = []
    name = next(n for n in fit.twin.index if n.startswith(f"{effect.name}@{place}.position"))
    k = fit.twin.index[name]
    for x in (low, high):
        theta = fit.twin.theta.copy()
        theta[k] = fit.twin.parameters[k].prior.coordinate(x)
        covariance = fit.covariance.copy()
        covariance[k], covariance[:, k] = 0.0, 0.0
        covariance[k, k] = 1e-9
        ends.append(replace(fit, twin=fit.twin.with_(theta=theta), covariance=covariance))
    options = [
        Proposal(words, float(expected_loss(ends[0], ends[1], rig, observation)))
        for words, rig, observation in _sensors(fit.twin, observations)
    ]
    return max(options, key=lambda p: p.loss, default=None)


def expected_loss(accepted: Fit, rival: Fit, rig: Rig, observation: Observation) -> float:
    """Log evidence that `rival` is expected to lose on an observation if `accepted` holds."""
    (reading,) = _onto(accepted, rig, observation).predict([observation])
    covariance = observation.covariance
    if observation.kind == "random":
        size = RANDOM_ERROR**2 * np.abs(reading) ** 2
        covariance = np.einsum("sf,st->fst", size, np.eye(len(reading))).astype(complex)
    values = reading
    if observation.kind == "input_impedance":
        # `Posterior` compares reflections; it makes them of impedances itself.
        values = (1.0 + reading) / (1.0 - reading)
        size = (MIN_MODEL_ERROR * np.abs(values + 1.0) ** 2 / 2.0) ** 2
        covariance = np.einsum("sf,st->fst", size, np.eye(1)).astype(complex)
        observation = replace(observation, normalised=True)
    twin = _onto(rival, rig, observation)
    posterior = Posterior(twin, [replace(observation, values=values, covariance=covariance)])
    posterior.model_error = max(accepted.model_error, MIN_MODEL_ERROR)
    posterior.source_sd = rival.source_sd
    posterior.smooth_sd = rival.smooth_sd
    r, jacobian = posterior.linearise(twin.theta, posterior.predict(twin.theta))
    count = 2 * values.size
    r = r[:count]
    variances, basis = np.linalg.eigh(_covariance(rival, twin))
    columns = jacobian[:count] @ (basis * np.sqrt(np.maximum(variances, 0.0)))
    along = columns.T @ r
    rest = np.linalg.solve(np.eye(len(along)) + columns.T @ columns, along)
    return 0.5 * float(r @ r - along @ rest)


def candidate_recordings(twin: Twin, observations: Sequence) -> list[tuple[str, Rig, Observation]]:
    """What could be recorded next: words, the rig then, and an observation without values."""
    rig = twin.rig
    found = _sensors(twin, observations) if len(rig.sensors) else []
    periodic = [o for o in observations if o.kind == "periodic"]
    if periodic:
        found += _points(twin, periodic)
        found.append(("record under random excitation", rig, _random(twin, periodic[0])))
    else:
        found += _ends(twin, observations)
    return found


def _sensors(twin: Twin, observations: Sequence) -> list:
    """One more sensor in places well away from those that are there."""
    o = observations[0]
    if o.kind == "input_impedance":
        return []
    rig, found = twin.rig, []
    for x in (np.arange(SENSOR_PLACES) + 0.5) / SENSOR_PLACES * rig.length:
        if min(abs(x - s.position) for s in rig.sensors) < 0.5 * rig.length / SENSOR_PLACES:
            continue
        more = replace(rig, sensors=(*rig.sensors, Sensor("next", float(x))))
        words = f"record with one more sensor {x:.2f} m from the pump"
        if o.load_pressure and o.speed_hz:
            words += f" at {60 * o.speed_hz:.0f} r/min and {o.load_pressure / 1e6:.3g} MPa"
        found.append((words, more, _widened(o, more)))
    return found


def _widened(o: Observation, rig: Rig) -> Observation:
    """An observation as `o` with the rig's sensors, the new one as noisy as the others."""
    count, frequencies = len(rig.sensors), len(o.frequency_hz)
    variance = np.mean(np.einsum("fss->fs", o.covariance).real, axis=1)
    return replace(
        o,
        label=NEW_LABEL,
        values=np.ones((count, frequencies), complex),
        covariance=np.einsum("f,st->fst", variance, np.eye(count)).astype(complex),
        sensors=rig.sensors,
        mean=np.full(count, o.mean[-1]) if np.size(o.mean) else o.mean,
    )


def _points(twin: Twin, periodic: Sequence[Observation]) -> list:
    """Other speeds and load pressures, with the nearest recording's ripple scaled to the speed."""
    speed = float(np.median([o.speed_hz for o in periodic]))
    pressures = [o.load_pressure for o in periodic if o.load_pressure]
    pistons, found = twin.rig.pump["pistons"], []
    rpms = sorted({50.0 * round(60 * speed * f / 50.0) for f in (*SPEED_FACTORS, 1.0)} - {0.0})
    loads = (
        [float(f"{np.median(pressures) * f:.2g}") for f in PRESSURE_FACTORS]
        if pressures
        else [None]
    )
    for rpm in rpms:
        for load in loads:
            if any(_same(o, rpm / 60, load) for o in periodic):
                continue
            near = min(periodic, key=lambda o: _distance(o, rpm / 60, load))
            ripple = twin.operating_point(near).ripple
            orders = pistons * np.arange(1, int(MAX_RANDOM_HZ * 60 / (pistons * rpm)) + 1)
            noise = np.mean(near.covariance, axis=0)
            if ripple is not None:
                ripple = FlowRipple(
                    np.asarray(ripple.angle_deg),
                    np.asarray(ripple.flow) * rpm / (60 * near.speed_hz),
                    load,
                )
            o = replace(
                near,
                label=NEW_LABEL,
                orders=orders,
                frequency_hz=orders * rpm / 60,
                values=np.ones((len(noise), len(orders)), complex),
                covariance=np.tile(noise, (len(orders), 1, 1)),
                speed_hz=rpm / 60,
                load_pressure=load,
                flow_ripple=ripple,
                mean=np.full(len(noise), load or 0.0),
            )
            words = f"record at {rpm:.0f} r/min"
            found.append((words + (f" and {load / 1e6:.3g} MPa" if load else ""), twin.rig, o))
    return found


def _random(twin: Twin, near: Observation) -> Observation:
    """Broadband excitation from an unknown source at a recording's mean state."""
    frequency = np.linspace(30.0, MAX_RANDOM_HZ, RANDOM_BINS)
    ripple = near.flow_ripple or twin.operating_point(near).ripple
    count = len(twin.rig.sensors)
    return replace(
        near,
        kind="random",
        label=NEW_LABEL,
        orders=None,
        speed_hz=None,
        frequency_hz=frequency,
        values=np.ones((count, len(frequency)), complex),
        covariance=np.zeros((len(frequency), count, count), complex),
        source="free",
        flow_ripple=ripple,
    )


def _ends(twin: Twin, observations: Sequence) -> list:
    """The same measurement with another end, for benches without a pump."""
    return [
        (f"record with the line's end {kind}", replace(twin.rig, load=Load(kind)), o)
        for o in [replace(observations[0], label=NEW_LABEL)]
        for kind in ("open", "closed", "anechoic")
        if twin.rig.load.kind != kind and not _changes_end(twin)
    ]


def _changes_end(twin: Twin) -> bool:
    return any(effect.element == "load" for effect, _ in twin.effects)


def _same(o: Observation, speed_hz: float, load: float | None) -> bool:
    return _distance(o, speed_hz, load) < 0.05


def _distance(o: Observation, speed_hz: float, load: float | None) -> float:
    far = abs(np.log(o.speed_hz / speed_hz))
    return far + (abs(np.log(o.load_pressure / load)) if load and o.load_pressure else 0.0)


def _onto(fit: Fit, rig: Rig, observation: Observation) -> Twin:
    """The fit's twin on another rig and for one new recording; what is new stands at nominal."""
    old = fit.twin
    twin = Twin(
        rig, [observation], old.friction, old.effects, old.source_sd,
        guessed_load=old.guessed_load and rig.load.kind == "orifice",
    )  # fmt: skip
    theta = [old.theta[old.index[p.name]] if p.name in old.index else 0.0 for p in twin.parameters]
    return twin.with_(theta=np.array(theta))


def _covariance(fit: Fit, twin: Twin) -> np.ndarray:
    """The fit's posterior covariance in another twin's parameters, priors for those it has not."""
    index = [fit.twin.index.get(p.name) for p in twin.parameters]
    covariance = np.diag([FLAT_VARIANCE if p.flat else 1.0 for p in twin.parameters])
    here = [k for k, i in enumerate(index) if i is not None]
    there = [index[k] for k in here]
    covariance[np.ix_(here, here)] = fit.covariance[np.ix_(there, there)]
    return covariance
