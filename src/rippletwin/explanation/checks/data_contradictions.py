"""Do the data contradict themselves? Then no physics is to be looked for in them.

What no line, pump or sensor error of the library can do: a sensor that reads nothing, or the same
as another elsewhere; a limiter's plateau; recordings that are copies; noise that is exactly zero;
a mean pressure that grows downstream; one recording whose halves, or two of one operating point,
are not of one state; sensors whose cables are exchanged or whose sign is turned. What the case
reader refuses already (a stuck or plainly clipped sensor, a wrong speed or unit) never comes here.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from rippletwin.explanation.checks.alarms import (
    DRIFT_SIGNIFICANCE,
    aligned_difference,
    at_common_orders,
    drift_p_value,
)

DEAD_RIPPLE_SHARE = (
    3e-3  # of the other sensors' ripple: no node of a line is as deep at every harmonic
)
SAME_RIPPLE_DIFFERENCE = 2e-3  # relative difference of two sensors' ripple that no two places have
MIN_SENSOR_DISTANCE_IN_WAVES = 0.05  # of the shortest wave: closer sensors may read the same
NOISELESS_VARIANCE_RATIO = 1e-20  # variance over power; single precision leaves 1e-14
MAX_PRESSURE_GROWTH = 0.25  # of the mean pressure: well above any sensor's gain error
CHANGED_RIPPLE_SHARE = (
    0.15  # of the ripple, between parts or repeats of one state: more than drift by degrees
)
WAVE_SPEED_DRIFT = 0.005  # relative wave speed between repeats: two kelvin of oil
PASSAGES_BEFORE_DECAY = 3.0  # of the line that a wave makes before it has died away
PLATEAU_CROWDING = 8.0  # times as many samples in the outermost 2 % of the range as in the next
PLATEAU_SHARE = 0.03  # of all samples


def find_contradictions(
    rig,
    recordings: Sequence = (),
    observations: Sequence = (),
    early: Sequence = (),
    late: Sequence = (),
) -> str:
    """What contradicts what, in words; "" where nothing does.

    `recordings` as read, `observations` of them with all their orders, `early` and `late` of the
    halves of periodic ones. Any of them may be left out, and is not looked at then.
    """
    delay = rig.delay
    pressures = [o for o in observations if o.kind != "input_impedance"]
    reasons = [find_clipping_plateau(r, s, row) for r in recordings for s, row in _rows(rig, r)]
    reasons += [
        check(o)
        for o in pressures
        for check in (
            find_dead_sensor,
            find_duplicated_sensors,
            find_noiseless_sensor,
            find_growing_mean_pressure,
        )
    ]
    reasons += [find_copied_recordings(a, b) for a, b in combinations(observations, 2)]
    reasons += [find_changed_state(a, b, delay) for a, b in zip(early, late)]
    reasons.append(find_incompatible_recordings(observations, delay))
    return "; ".join(dict.fromkeys(reason for reason in reasons if reason))


def find_dead_sensor(o) -> str:
    """A sensor without the ripple that the others read."""
    energy = np.sum(np.abs(o.values) ** 2, axis=1)
    if len(energy) < 2 or o.values.shape[1] < 4:
        return ""
    quiet = int(np.argmin(energy))
    others = float(np.median(np.delete(energy, quiet)))
    noise = float(np.sum(np.einsum("fss->sf", o.covariance).real[quiet]))
    if (
        energy[quiet] < DEAD_RIPPLE_SHARE**2 * others
        or energy[quiet] < 1.5 * noise < DEAD_RIPPLE_SHARE * others
    ):
        return f"sensor {o.sensors[quiet].name} reads no ripple in {o.label}: it is dead"
    return ""


def find_duplicated_sensors(o) -> str:
    """Two sensors far apart that read the same, but perhaps for a factor."""
    for a, b in combinations(range(len(o.values)), 2):
        x, y = o.values[a], o.values[b]
        apart = abs(o.sensors[a].position - o.sensors[b].position)
        if apart * o.frequency_hz[-1] / 2000.0 < MIN_SENSOR_DISTANCE_IN_WAVES or len(x) < 4:
            continue
        factor = np.sum(np.conj(x) * y).real / max(np.sum(np.abs(x) ** 2), 1e-300)
        if np.linalg.norm(y - factor * x) < SAME_RIPPLE_DIFFERENCE * np.linalg.norm(y):
            names = f"{o.sensors[a].name} and {o.sensors[b].name}"
            return f"sensors {names} read the same in {o.label} though {apart:.2f} m apart"
    return ""


def find_noiseless_sensor(o) -> str:
    """A measurement that repeats itself to the last digit: a copy of a period, or a simulation."""
    variance = np.einsum("fss->s", o.covariance).real
    power = np.sum(np.abs(o.values) ** 2, axis=1)
    silent = np.flatnonzero(variance <= NOISELESS_VARIANCE_RATIO * power)
    if len(silent) == 0:
        return ""
    return f"sensor {o.sensors[silent[0]].name} has no noise at all in {o.label}: no measurement"


def find_growing_mean_pressure(o) -> str:
    """A mean pressure that grows in the direction of the flow."""
    order = np.argsort([s.position for s in o.sensors])
    mean = np.asarray(o.mean, float)[order] if np.size(o.mean) == len(order) else np.zeros(1)
    scale = o.load_pressure or float(np.max(np.abs(mean)))
    if len(mean) < 2 or np.min(mean) < 0.3 * scale or scale <= 0:  # coupled without its mean
        return ""
    k = int(np.argmax(np.diff(mean)))
    if np.diff(mean)[k] < MAX_PRESSURE_GROWTH * scale:
        return ""
    a, b = (o.sensors[order[i]].name for i in (k, k + 1))
    return (
        f"the mean pressure grows downstream in {o.label}, from {mean[k]:.3g} Pa at {a} to "
        f"{mean[k + 1]:.3g} Pa at {b}"
    )


def find_copied_recordings(a, b) -> str:
    """Two recordings with the same numbers."""
    if a.values.shape == b.values.shape and np.allclose(a.values, b.values, rtol=1e-9, atol=0.0):
        return f"{b.label} is a copy of {a.label}"
    return ""


def find_changed_state(early, late, delay: float) -> str:
    """Halves of one recording that differ by far more than noise."""
    if early.orders is None or drift_p_value([early], [late], delay)[0] > DRIFT_SIGNIFICANCE:
        return ""
    early, late = at_common_orders(early, late)
    relative = _relative(*aligned_difference(early, late, delay), early)
    if relative < CHANGED_RIPPLE_SHARE:
        return ""
    return f"the ripple of {early.label} changes by {relative:.0%} between its halves"


def find_incompatible_recordings(observations: Sequence, delay: float) -> str:
    """A recording unlike all others of its operating point.

    Oil is never twice at one temperature: half a per cent of wave speed is allowed for, which
    leaves the low harmonics to speak. With two recordings nobody knows which is wrong.
    """
    periodic = [o for o in observations if o.orders is not None and o.speed_hz]
    unlike = {}
    for a, b in combinations(range(len(periodic)), 2):
        x, y = periodic[a], periodic[b]
        if abs(x.speed_hz / y.speed_hz - 1) > 0.005 or not _near(x.load_pressure, y.load_pressure):
            continue
        x, y = at_common_orders(x, y)
        phase = 2 * np.pi * x.frequency_hz * PASSAGES_BEFORE_DECAY * delay * WAVE_SPEED_DRIFT
        gap, variance = aligned_difference(x, y, delay)
        power = np.sum(np.abs(x.values) ** 2, axis=0)
        allowed = np.sum(variance, axis=0) + phase**2 * power
        left = np.maximum(np.sum(np.abs(gap) ** 2, axis=0) - 2.0 * allowed, 0.0)
        excess = float(np.sqrt(np.sum(left) / np.sum(power)))
        unlike.setdefault(a, []).append(excess > CHANGED_RIPPLE_SHARE)
        unlike.setdefault(b, []).append(excess > CHANGED_RIPPLE_SHARE)
    odd = [k for k, against in unlike.items() if all(against)]
    if not odd:
        return ""
    names = " and ".join(periodic[k].label for k in odd)
    if len(odd) == 1:
        return f"{names} is unlike every other recording of its operating point"
    return f"{names} are of one operating point and unlike each other"


def find_clipping_plateau(recording, sensor: str, row: np.ndarray) -> str:
    """A limiter with noise behind it: samples crowd at one end of the range, beyond any sinusoid.

    A sinusoid has 2.4 times as many samples in the outermost 2 % of its range as in the next (the
    arcsine law), noise fewer.
    """
    low, high = float(np.min(row)), float(np.max(row))
    step = 0.02 * (high - low)
    if step == 0:
        return ""
    for side, x in (("top", high - row), ("bottom", row - low)):
        outer, next_ = np.count_nonzero(x < step), np.count_nonzero((x >= step) & (x < 2 * step))
        if outer > PLATEAU_SHARE * row.size and outer > PLATEAU_CROWDING * max(next_, 1):
            return f"sensor {sensor} is clipped at the {side} in {recording.label}"
    return ""


def _rows(rig, recording) -> list:
    if recording.pressure is None:
        return []
    return [(s.name, row) for s, row in zip(rig.sensors, recording.pressure)]


def _relative(gap: np.ndarray, variance: np.ndarray, o) -> float:
    """Norm of a difference over that of the ripple, the variance expected taken off."""
    excess = max(np.sum(np.abs(gap) ** 2) - np.sum(variance), 0.0)
    return float(np.sqrt(excess / np.sum(np.abs(o.values) ** 2)))


def _near(a: float | None, b: float | None) -> bool:
    return a == b or (a is not None and b is not None and abs(a / b - 1) < 0.01)
