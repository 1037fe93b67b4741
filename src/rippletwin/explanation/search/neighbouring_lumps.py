"""Effects of one kind side by side that are one stretch of another pipe.

A row of lumps is a continuous pipe for waves longer than twice the distance between neighbours
(Brillouin 1946, Wave Propagation in Periodic Structures). Volumes that are as close as that are
therefore also tried as one passive piece of another pipe, of the length and the compliance that
they have together. Where the piece explains the data as well, there is no evidence for lumps: they
leave the explanation, and the piece is a start for the network that stands in.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.explanation.fit_jobs import FitJob, FromTheta, Workers
from rippletwin.explanation.fit_starts import transfer_theta
from rippletwin.explanation.search.stepwise_search import Search
from rippletwin.explanation.thresholds import EQUIVALENT_LOG_BAYES_FACTOR
from rippletwin.twin.effects.base import Place, segment_at
from rippletwin.twin.effects.library import EFFECTS, next_instance
from rippletwin.twin.parameters import coordinates

LUMP, PIECE = "line_volume", "passive_piece"
SHORTEST = 0.01  # m, with which a piece begins


def merge_neighbours(workers: Workers, search: Search) -> tuple[Search, Fit | None]:
    """The search without volumes that one passive piece explains as well, and the fit with that
    piece; the search as it is, and None, where there are none."""
    best, pieced = search.best, None
    for members in _rows(workers, best):
        rest = tuple(m for m in best.hypothesis if m not in members)
        piece = next_instance((EFFECTS[PIECE], Place("position")), rest)
        assert piece is not None  # a line may have one more of what is at a free position
        hypothesis = (*rest, piece)
        values = best.twin.values() | _piece_values(best, members, f"{PIECE}@{piece[1]}")
        theta = coordinates(workers.base.with_(effects=hypothesis).parameters, values)
        (fit,) = workers.fit([FitJob(hypothesis, FromTheta(theta))])
        if fit.evidence > best.evidence - EQUIVALENT_LOG_BAYES_FACTOR:
            job = FitJob(rest, FromTheta(transfer_theta(fit, rest, workers.base)))
            (best,), pieced = workers.fit([job]), fit
    if pieced is None:
        return search, None
    rivals = [fit for fit in search.rivals if LUMP not in fit.names]
    return replace(search, best=best, rivals=rivals), pieced


def _rows(workers: Workers, best: Fit) -> list[list]:
    """Groups of at least two volumes of `best` whose neighbours act as one pipe, in the order of
    their positions."""
    volumes = [m for m in best.hypothesis if m[0] is EFFECTS[LUMP]]
    if len(volumes) < 2:
        return []
    highest_hz = max(float(np.max(o.frequency_hz)) for o in workers.observations)
    values, lengths, last = best.twin.values(), best.twin.arrays(best.twin.theta).lengths, -np.inf
    groups: list[list] = []
    for member in sorted(volumes, key=lambda m: values[f"{LUMP}@{m[1]}.position"]):
        position = values[f"{LUMP}@{member[1]}.position"]
        speed = best.twin.rig.line[segment_at(lengths, position)].wave_speed
        reach = speed / (2.0 * highest_hz)
        if position - last > reach:
            groups.append([])
        groups[-1].append(member)
        last = position
    return [group for group in groups if len(group) > 1]


def _piece_values(best: Fit, members: list, label: str) -> dict[str, float]:
    """Place, length and softness of the piece with the volumes' compliance; the row ends half a
    distance beyond its last lumps."""
    values = best.twin.values()
    positions = [values[f"{LUMP}@{place}.position"] for _, place in members]
    volume = sum(values[f"{LUMP}@{place}.volume"] for _, place in members)
    length = max(float(np.ptp(positions)) * len(members) / (len(members) - 1), SHORTEST)
    arrays = best.twin.arrays(best.twin.theta)
    bore = arrays.diameters[segment_at(arrays.lengths, float(np.mean(positions)))]
    softer = 1.0 + volume / (0.25 * np.pi * bore**2 * length)
    return {
        f"{label}.position": float(np.mean(positions)),
        f"{label}.length": length,
        f"{label}.wave_speed_ratio": softer**-0.5,
    }
