"""Gas in place of liquid, which recordings at one mean pressure hardly tell apart.

Only a change with pressure discriminates a volume of the line's liquid from a smaller one of gas,
whose compliance is V/(n p): another mean pressure, or a ripple so large that crests meet a stiffer
gas than troughs. Where all recordings have one mean pressure the search does without the gas, and
each volume that it accepts gets a rival: as much gas as yields alike.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rippletwin.calibration.fit import Fit, Hypothesis
from rippletwin.case.model import absolute
from rippletwin.explanation.fit_jobs import FitJob, FromTheta, Workers
from rippletwin.twin.effects.base import Place, segment_at
from rippletwin.twin.effects.library import EFFECTS, next_instance
from rippletwin.twin.effects.lumped_elements import (
    POLYTROPIC_EXPONENT,
    gas_compliance,
    volume_compliance,
)
from rippletwin.twin.parameters import coordinates

SAME_PRESSURE = 0.05  # relative; mean pressures closer than this count as one
LIQUID, GAS = "line_volume", "gas_volume"


def has_one_pressure(observations: Sequence) -> bool:
    """Whether no two of the observations have mean pressures that differ; one that is not known
    differs from none."""
    known = _mean_pressures(observations)
    return not known or max(known) <= (1.0 + SAME_PRESSURE) * min(known)


def _mean_pressures(observations: Sequence) -> list[float]:
    """Those that are known, Pa."""
    return [o.load_pressure for o in observations if o.load_pressure is not None]


def fit_gas_rivals(workers: Workers, best: Fit) -> list[Fit]:
    """Fits of `best` with each volume of liquid on the line exchanged for gas at its position.

    None where the mean pressures differ, for then the search has tried the gas, and none in a gas.
    """
    volumes = [k for k, (effect, _) in enumerate(best.hypothesis) if effect.name == LIQUID]
    if not volumes or workers.base.rig.fluid.is_gas or not has_one_pressure(workers.observations):
        return []
    return workers.fit([_job_with_gas(workers, best, k) for k in volumes])


def _job_with_gas(workers: Workers, best: Fit, k: int) -> FitJob:
    """The job that begins with as much gas as yields like the liquid of effect k."""
    rest, liquid = best.without(k), f"{LIQUID}@{best.hypothesis[k][1]}"
    effect_and_place = next_instance((EFFECTS[GAS], Place("position")), rest)
    assert effect_and_place is not None  # a line may have one more of what is at a free position
    hypothesis: Hypothesis = (*rest, effect_and_place)
    gas = f"{GAS}@{effect_and_place[1]}"
    rig, values = best.twin.rig, best.twin.values()
    position = values[f"{liquid}.position"]
    speed = rig.line[segment_at(np.array([s.length for s in rig.line]), position)].wave_speed
    liquid_yields = volume_compliance(values[f"{liquid}.volume"], rig.fluid.density, speed)
    pressure = absolute(float(np.mean(_mean_pressures(workers.observations) or [0.0])))
    gas_yields = gas_compliance(1.0, POLYTROPIC_EXPONENT, pressure)
    values |= {f"{gas}.position": position, f"{gas}.gas_volume": liquid_yields / gas_yields}
    theta = coordinates(workers.base.with_(effects=hypothesis).parameters, values)
    return FitJob(hypothesis, FromTheta(theta, exact=False))
