"""Recordings that could be made next: further sensors, operating points, excitations, ends.

Each candidate is (the recording in words, the rig then, an observation without values).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rippletwin.case.model import FlowRipple, Load, Rig, Sensor
from rippletwin.case.quantities import BAR, plain, write_value
from rippletwin.spectra.observation import Observation
from rippletwin.twin.twin import Twin

SPEED_FACTORS = (0.7, 1.4)  # of the median speed so far
SPEED_STEP_RPM = 50.0  # proposed speeds are multiples of it
PRESSURE_FACTORS = (0.4, 1.0, 1.8)  # of the median load pressure so far
SENSOR_POSITIONS = 6  # considered for a further sensor
HIGHEST_HZ = 4000.0  # of a proposed recording
RANDOM_RANGE_HZ = (30.0, HIGHEST_HZ)
RANDOM_BINS = 150  # independent frequencies of a random recording
SAME_POINT_DISTANCE = 0.05  # in logarithms of speed and pressure
LEAST_DROP = 0.05  # of the load pressure: what an orifice needs to have
NEW_LABEL = "next recording"


def list_candidate_recordings(
    twin: Twin, observations: Sequence
) -> list[tuple[str, Rig, Observation]]:
    """Possible next recordings: in words, the rig then, and an observation without values."""
    rig = twin.rig
    candidates = further_sensors(twin, observations) if len(rig.sensors) else []
    periodic = [o for o in observations if o.kind == "periodic"]
    if periodic:
        candidates += _operating_points(twin, periodic)
        recording = "random excitation"
        candidates.append((recording, rig, _random_recording(twin, periodic[0])))
    else:
        candidates += _other_ends(twin, observations)
    return candidates


def further_sensors(twin: Twin, observations: Sequence) -> list:
    """Candidates with one more sensor, well away from those that exist."""
    o = observations[0]
    if o.kind == "input_impedance":
        return []
    rig, candidates = twin.rig, []
    for x in (np.arange(SENSOR_POSITIONS) + 0.5) / SENSOR_POSITIONS * rig.length:
        if min(abs(x - s.position) for s in rig.sensors) < 0.5 * rig.length / SENSOR_POSITIONS:
            continue
        extended = replace(rig, sensors=(*rig.sensors, Sensor("next", float(x))))
        recording = f"one more sensor {x:.2f} m from the pump"
        if o.load_pressure and o.speed_hz:
            recording += f", at {60 * o.speed_hz:.0f} r/min and {_pressure(o.load_pressure)}"
        candidates.append((recording, extended, _with_sensors_of(o, extended)))
    return candidates


def _with_sensors_of(o: Observation, rig: Rig) -> Observation:
    """An observation with the rig's sensors, the new one as noisy as the others."""
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


def _operating_points(twin: Twin, periodic: Sequence[Observation]) -> list:
    """Candidates at other speeds and load pressures."""
    speed = float(np.median([o.speed_hz for o in periodic]))
    pressures = [o.load_pressure for o in periodic if o.load_pressure]
    rpms = {
        SPEED_STEP_RPM * round(60 * speed * factor / SPEED_STEP_RPM)
        for factor in (*SPEED_FACTORS, 1.0)
    }
    loads: list[float | None] = [None]
    if pressures:
        loads = [float(f"{np.median(pressures) * factor:.2g}") for factor in PRESSURE_FACTORS]
        if twin.rig.load.kind == "orifice":  # which passes flow from the line alone
            back = twin.rig.load.back_pressure
            loads = [p for p in loads if p - back > LEAST_DROP * p]
    candidates = []
    highest = 60.0 * HIGHEST_HZ / twin.rig.pump["pistons"]  # above it no harmonic is used
    for rpm in sorted(rpm for rpm in rpms if 0.0 < rpm <= highest):
        for load in loads:
            nearest = min(periodic, key=lambda o: _distance(o, rpm / 60, load))
            if _distance(nearest, rpm / 60, load) < SAME_POINT_DISTANCE:
                continue
            recording = f"another operating point, {rpm:.0f} r/min"
            if load:
                recording += f" and {_pressure(load)}"
            observation = _at_operating_point(twin, nearest, rpm / 60, load)
            candidates.append((recording, twin.rig, observation))
    return candidates


def _at_operating_point(
    twin: Twin, near: Observation, speed_hz: float, load: float | None
) -> Observation:
    """A recording at another speed (rev/s) and load pressure (Pa), with noise as in `near`."""
    pistons = twin.rig.pump["pistons"]
    orders = pistons * np.arange(1, int(HIGHEST_HZ / (pistons * speed_hz) + 1e-9) + 1)
    noise = np.mean(near.covariance, axis=0)
    return replace(
        near,
        label=NEW_LABEL,
        orders=orders,
        frequency_hz=orders * speed_hz,
        values=np.ones((len(noise), len(orders)), complex),
        covariance=np.tile(noise, (len(orders), 1, 1)),
        speed_hz=speed_hz,
        load_pressure=load,
        flow_ripple=_scaled_ripple(twin, near, speed_hz),
        modulation=0.0,  # the ripple has it already
        mean=np.full(len(noise), load or 0.0),
    )


def _scaled_ripple(twin: Twin, near: Observation, speed_hz: float) -> FlowRipple | None:
    """The flow ripple of `near` in proportion to the speed (rev/s); None for a free source.

    The admittance of the pump, if known, stays that of the recording.
    """
    ripple = twin.operating_point(near).ripple
    if ripple is None:
        return None
    return replace(ripple, flow=np.asarray(ripple.flow) * speed_hz / near.speed_hz)


def _random_recording(twin: Twin, near: Observation) -> Observation:
    """Broadband excitation by an unknown source at the operating point of a recording."""
    frequency = np.linspace(*RANDOM_RANGE_HZ, RANDOM_BINS)
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


def _other_ends(twin: Twin, observations: Sequence) -> list:
    """Candidates with another end of the line, for benches without a pump."""
    if any(effect.element == "load" for effect, _ in twin.effects):
        return []
    observation = replace(observations[0], label=NEW_LABEL)
    return [
        (f"the line with its end {kind}", replace(twin.rig, load=Load(kind)), observation)
        for kind in ("open", "closed", "anechoic")
        if twin.rig.load.kind != kind
    ]


def _pressure(pressure: float) -> str:
    return plain(write_value(pressure, BAR))


def _distance(o: Observation, speed_hz: float, load: float | None) -> float:
    """Distance of an operating point from a recording's, in logarithms of speed and pressure."""
    distance = abs(np.log(o.speed_hz / speed_hz))
    if load and o.load_pressure:
        distance += abs(np.log(o.load_pressure / load))
    return distance
