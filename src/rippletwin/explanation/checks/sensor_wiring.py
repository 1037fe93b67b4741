"""Swapped sensors and inverted signs: wiring errors that look like missing physics."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.calibration.frequency_continuation import fit_hypothesis
from rippletwin.explanation.thresholds import LITTLE_MODEL_ERROR, MIN_LOG_BAYES_FACTOR
from rippletwin.twin.twin import Twin

MAX_EXPLAINED_MODEL_ERROR = 10.0 * LITTLE_MODEL_ERROR
"""Relative model error above which the explanation of correctly wired data is implausible."""


def find_swapped_sensors(base: Twin, observations: Sequence, explanation: Fit) -> str:
    """Two swapped sensors or a sensor with inverted sign, in words; "" if there are none.

    explanation   the best of the data as they are, with a passive network if one stands in

    Each swap and each inversion is undone and the line without effects is fitted. It is reported if
    its evidence exceeds that of the explanation by as much as an effect must add. The check costs
    several fits, so it runs only where the explanation leaves a large model error.
    """
    sensors = base.rig.sensors
    pressures = all(o.kind != "input_impedance" for o in observations)
    if explanation.model_error <= MAX_EXPLAINED_MODEL_ERROR or len(sensors) < 2 or not pressures:
        return ""
    evidence = {
        fault: fit_hypothesis(base, (), corrected).evidence
        for fault, corrected in _corrected_wirings(sensors, observations).items()
    }
    best = max(evidence, key=evidence.get)
    return best if evidence[best] > explanation.evidence + MIN_LOG_BAYES_FACTOR else ""


def _corrected_wirings(sensors: Sequence, observations: Sequence) -> dict[str, list]:
    """The observations with each possible wiring fault undone, by the fault in words."""
    count, corrected = len(sensors), {}
    for a, b in combinations(range(count), 2):
        order = list(range(count))
        order[a], order[b] = b, a
        corrected[f"sensors {sensors[a].name} and {sensors[b].name} are exchanged"] = [
            replace(o, values=o.values[order], covariance=o.covariance[:, order][:, :, order])
            for o in observations
        ]
    for k in range(count):
        sign = np.where(np.arange(count) == k, -1.0, 1.0)
        corrected[f"the sign of sensor {sensors[k].name} is inverted"] = [
            replace(
                o, values=o.values * sign[:, None], covariance=o.covariance * np.outer(sign, sign)
            )
            for o in observations
        ]
    return corrected
