"""Contradictions in the data, which no physics can explain.

No line, pump or sensor error of the library makes a sensor that reads nothing or the same as
another elsewhere, a clipping plateau, copied recordings, noise that is exactly zero, a mean
pressure that grows downstream, or halves or repeats of one operating point in different states. The
case reader refuses stuck or clearly clipped sensors and wrong speeds or units before this.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from rippletwin.case.quantities import BAR, write_value
from rippletwin.explanation.checks.alarms import (
    aligned_difference,
    at_common_orders,
    drift_p_value,
)
from rippletwin.explanation.thresholds import DRIFT_SIGNIFICANCE

DEAD_RIPPLE_SHARE = 3e-3
"""Ripple of a dead sensor relative to the others: no node of a line is as deep at all harmonics."""
SAME_RIPPLE_DIFFERENCE = 2e-3  # relative, of two sensors; two places differ by more
MIN_SENSOR_DISTANCE_IN_WAVELENGTHS = 0.05  # of the shortest; closer sensors may read the same
MAX_WAVE_SPEED = 2000.0  # m/s; no oil line has more, so that wavelengths are not underestimated
NOISELESS_VARIANCE_RATIO = 1e-20  # of variance to power; single precision leaves 1e-14
MIN_MEAN_SHARE = 0.3  # of the load pressure; a lower mean is that of an AC-coupled sensor
MAX_PRESSURE_GROWTH = 0.25  # of the mean pressure: well above any sensor's gain error
CHANGED_RIPPLE_SHARE = 0.15
"""Change of the ripple between halves or repeats of one state: more than slow drift makes."""
SAME_SPEED = 0.005  # relative, between recordings of one operating point
SAME_PRESSURE = 0.01  # relative, between recordings of one operating point
WAVE_SPEED_DRIFT = 0.005  # relative, between repeats: two kelvin of oil temperature
PASSAGES_BEFORE_DECAY = 3.0  # passages of the line before a wave has decayed
EDGE_SHARE = 0.02  # of a signal's range, at either end
PLATEAU_CROWDING = 8.0  # of samples within EDGE_SHARE of the end over those in the next EDGE_SHARE
PLATEAU_SHARE = 0.03  # of all samples
BLOCK = 2**20  # samples that are looked at together: long recordings fill the memory


def find_contradictions(
    rig,
    recordings: Sequence = (),
    observations: Sequence = (),
    early: Sequence = (),
    late: Sequence = (),
) -> str:
    """The contradictions in words, separated by semicolons; "" if there are none.

    recordings    as read
    observations  of the recordings, with all orders
    early, late   observations of the two halves of periodic recordings

    What is left out is not checked.
    """
    delay = rig.delay
    pressures = [o for o in observations if o.kind != "input_impedance"]
    reasons = find_plateaus(rig, recordings)
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
    """A sensor without the ripple that the others measure."""
    energy = np.sum(np.abs(o.values) ** 2, axis=1)
    if len(energy) < 2 or o.values.shape[1] < 4:
        return ""
    quiet = int(np.argmin(energy))
    others = float(np.median(np.delete(energy, quiet)))
    noise = float(np.sum(o.variance[quiet]))
    if (
        energy[quiet] < DEAD_RIPPLE_SHARE**2 * others
        or energy[quiet] < 1.5 * noise < DEAD_RIPPLE_SHARE * others
    ):
        return f"sensor {o.sensors[quiet].name} measures no ripple in {o.label}: it is dead"
    return ""


def find_duplicated_sensors(o) -> str:
    """Two distant sensors with the same signal, up to a factor."""
    shortest_wavelength = MAX_WAVE_SPEED / o.frequency_hz[-1]
    for a, b in combinations(range(len(o.values)), 2):
        x, y = o.values[a], o.values[b]
        distance = abs(o.sensors[a].position - o.sensors[b].position)
        too_close = distance < MIN_SENSOR_DISTANCE_IN_WAVELENGTHS * shortest_wavelength
        if too_close or len(x) < 4:
            continue
        factor = np.sum(np.conj(x) * y).real / max(np.sum(np.abs(x) ** 2), 1e-300)
        if np.linalg.norm(y - factor * x) < SAME_RIPPLE_DIFFERENCE * np.linalg.norm(y):
            names = f"{o.sensors[a].name} and {o.sensors[b].name}"
            return f"sensors {names} measure the same in {o.label} though {distance:.2f} m apart"
    return ""


def find_noiseless_sensor(o) -> str:
    """A sensor without noise: its signal is a copied period or a simulation."""
    variance = np.einsum("fss->s", o.covariance).real
    power = np.sum(np.abs(o.values) ** 2, axis=1)
    silent = np.flatnonzero(variance <= NOISELESS_VARIANCE_RATIO * power)
    if len(silent) == 0:
        return ""
    name = o.sensors[silent[0]].name
    return f"sensor {name} has no noise at all in {o.label}, so it is no measurement"


def find_growing_mean_pressure(o) -> str:
    """A mean pressure that grows in the direction of the flow."""
    order = np.argsort([s.position for s in o.sensors])
    mean = np.asarray(o.mean, float)[order] if np.size(o.mean) == len(order) else np.zeros(1)
    scale = o.load_pressure or float(np.max(np.abs(mean)))
    if len(mean) < 2 or np.min(mean) < MIN_MEAN_SHARE * scale or scale <= 0:
        return ""
    k = int(np.argmax(np.diff(mean)))
    if np.diff(mean)[k] < MAX_PRESSURE_GROWTH * scale:
        return ""
    a, b = (o.sensors[order[i]].name for i in (k, k + 1))
    before, behind = (write_value(float(mean[i]), BAR) for i in (k, k + 1))
    return (
        f"the mean pressure grows downstream in {o.label}, from {before} at {a} to {behind} at {b}"
    )


def find_copied_recordings(a, b) -> str:
    """Two recordings with identical values."""
    if a.values.shape == b.values.shape and np.allclose(a.values, b.values, rtol=1e-9, atol=0.0):
        return f"{b.label} is a copy of {a.label}"
    return ""


def find_changed_state(early, late, delay: float) -> str:
    """Two halves of a recording that differ by far more than noise; `delay` (s) of the line."""
    if early.orders is None or drift_p_value([early], [late], delay)[0] > DRIFT_SIGNIFICANCE:
        return ""
    early, late = at_common_orders(early, late)
    difference, variance = aligned_difference(early, late, delay)
    excess = max(np.sum(np.abs(difference) ** 2) - np.sum(variance), 0.0)
    change = float(np.sqrt(excess / np.sum(np.abs(early.values) ** 2)))
    if change < CHANGED_RIPPLE_SHARE:
        return ""
    return f"the ripple of {early.label} changes by {change:.0%} between its halves"


def find_incompatible_recordings(observations: Sequence, delay: float) -> str:
    """Recordings that differ from all others of their operating point; `delay` (s) of the line.

    The oil temperature is never the same twice, so a change of wave speed by WAVE_SPEED_DRIFT is
    allowed; its phase grows with frequency, and the low harmonics decide. Of two recordings it is
    not known which one is wrong.
    """
    periodic = [o for o in observations if o.orders is not None and o.speed_hz]
    differs: dict[int, list[bool]] = {}
    for a, b in combinations(range(len(periodic)), 2):
        x, y = periodic[a], periodic[b]
        if not _same_operating_point(x, y):
            continue
        x, y = at_common_orders(x, y)
        phase = 2 * np.pi * x.frequency_hz * PASSAGES_BEFORE_DECAY * delay * WAVE_SPEED_DRIFT
        difference, variance = aligned_difference(x, y, delay)
        power = np.sum(np.abs(x.values) ** 2, axis=0)
        allowed = np.sum(variance, axis=0) + phase**2 * power
        excess = np.maximum(np.sum(np.abs(difference) ** 2, axis=0) - 2.0 * allowed, 0.0)
        change = float(np.sqrt(np.sum(excess) / np.sum(power)))
        differs.setdefault(a, []).append(change > CHANGED_RIPPLE_SHARE)
        differs.setdefault(b, []).append(change > CHANGED_RIPPLE_SHARE)
    outliers = [k for k, comparisons in differs.items() if all(comparisons)]
    if not outliers:
        return ""
    first = periodic[outliers[0]]
    outliers = [k for k in outliers if _same_operating_point(periodic[k], first)]
    labels = " and ".join(periodic[k].label for k in outliers)
    if len(outliers) == 1:
        return f"{labels} differs from every other recording of its operating point"
    return f"{labels} are of one operating point but differ from each other"


def find_clipping_plateau(recording, sensor: str, row: np.ndarray) -> str:
    """A clipped signal with noise: samples of `row` (N,), Pa, crowd at one end of the range.

    A sinusoid has 2.4 times as many samples in the outermost 2 % of its range as in the next 2 %
    (arcsine law), and noise has fewer.
    """
    low, high = float(np.min(row)), float(np.max(row))
    step = EDGE_SHARE * (high - low)
    if step == 0:
        return ""
    counts = np.zeros((2, 2), int)  # of the outermost samples and of the next, at top and bottom
    for begin in range(0, row.size, BLOCK):
        block = row[begin : begin + BLOCK]
        for end, x in zip(counts, (high - block, block - low)):
            outer, both = np.count_nonzero(x < step), np.count_nonzero(x < 2 * step)
            end += outer, both - outer
    for side, (outer, next_) in zip(("top", "bottom"), counts):
        if outer > PLATEAU_SHARE * row.size and outer > PLATEAU_CROWDING * max(next_, 1):
            return f"sensor {sensor} is clipped at the {side} in {recording.label}"
    return ""


def find_plateaus(rig, recordings: Sequence) -> list[str]:
    """`find_clipping_plateau` of each sensor of recordings as read, where it is not ""."""
    found = (
        find_clipping_plateau(r, sensor, row) for r in recordings for sensor, row in _rows(rig, r)
    )
    return [each for each in found if each]


def plateau_warnings(rig, recordings: Sequence) -> list[str]:
    """A line for every clipped signal with noise of recordings as read."""
    return [f"{each}; record again with a larger range" for each in find_plateaus(rig, recordings)]


def _rows(rig, recording) -> list:
    """(sensor's name, samples) of each sensor of a recording."""
    if recording.pressure is None:
        return []
    return [(s.name, row) for s, row in zip(rig.sensors, recording.pressure)]


def _same_operating_point(a, b) -> bool:
    """Whether two periodic observations have one speed and one load pressure."""
    if abs(a.speed_hz / b.speed_hz - 1) > SAME_SPEED:
        return False
    p, q = a.load_pressure, b.load_pressure
    return p == q or (p is not None and q is not None and abs(p / q - 1) < SAME_PRESSURE)
