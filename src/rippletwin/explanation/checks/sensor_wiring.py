"""Exchanged sensors and inverted signs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np

from rippletwin.calibration.frequency_continuation import fit_hypothesis
from rippletwin.calibration.posterior import MIN_MODEL_ERROR
from rippletwin.explanation.search.stepwise_search import Search
from rippletwin.explanation.thresholds import ACCEPT

MAX_EXPLAINED_MODEL_ERROR = (
    10.0 * MIN_MODEL_ERROR
)  # model error that no explanation of sound data leaves


def find_swapped_sensors(base_twin, observations: Sequence, search: Search) -> str:
    """Sensors exchanged or turned in sign: data changed so need no missing physics.

    Each exchange of two sensors and each turned sign is undone and the paper's line fitted; it is
    believed where that is better, by the evidence an effect must add, than the best explanation of
    the data as they are. Not asked where the search found a fair fit: it costs some fits.
    """
    count = len(base_twin.rig.sensors)
    pressures = all(o.kind != "input_impedance" for o in observations)
    if search.best.model_error <= MAX_EXPLAINED_MODEL_ERROR or count < 2 or not pressures:
        return ""
    tried = {}
    names = [s.name for s in base_twin.rig.sensors]
    for a, b in combinations(range(count), 2):
        order = list(range(count))
        order[a], order[b] = b, a
        changed = [
            replace(o, values=o.values[order], covariance=o.covariance[:, order][:, :, order])
            for o in observations
        ]
        tried[f"sensors {names[a]} and {names[b]} are exchanged"] = changed
    for k in range(count):
        sign = np.where(np.arange(count) == k, -1.0, 1.0)
        changed = [
            replace(
                o,
                values=o.values * sign[:, None],
                covariance=o.covariance * np.outer(sign, sign),
            )
            for o in observations
        ]
        tried[f"sensor {names[k]} has its sign turned"] = changed
    evidence = {
        words: fit_hypothesis(base_twin, (), changed).evidence for words, changed in tried.items()
    }
    best = max(evidence, key=evidence.get)
    return best if evidence[best] > search.best.evidence + ACCEPT else ""
