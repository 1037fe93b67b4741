"""A stretch of soft pipe is no row of volumes; volumes apart are."""

import numpy as np

from rippletwin.explanation.fit_jobs import FitJob, FromTheta, Workers
from rippletwin.explanation.search.neighbouring_lumps import merge_neighbours
from rippletwin.explanation.search.stepwise_search import Search
from rippletwin.explanation.stages.preparation import prepare_base
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.parameters import coordinates
from synthetic_observations import POINTS, make

TWO_VOLUMES = tuple((EFFECTS["line_volume"], Place("position", number=k)) for k in (1, 2))


def search_that_named_volumes(observed, positions, volume):
    """Workers, and a search whose best fit has two volumes, begun at `positions`, m."""
    rig, observations, true = observed
    base, data = prepare_base(rig, observations)
    workers, twin = Workers(base, data), base.with_(effects=TWO_VOLUMES)
    values = true.values()
    for (effect, place), position in zip(TWO_VOLUMES, positions):
        values |= {
            f"{effect.name}@{place}.position": position,
            f"{effect.name}@{place}.volume": volume,
        }
    start = FromTheta(coordinates(twin.parameters, values))
    plain, best = workers.fit([FitJob(()), FitJob(TWO_VOLUMES, start)])
    return workers, Search(plain, [], best)


def test_a_soft_stretch_that_was_named_two_volumes_becomes_one_piece():
    """The line has 17 cm of pipe with 0.79 times the wave speed, and the search has named two
    volumes in it. They leave the explanation; the piece has the true place to 5 cm, the true
    length to 2 cm and the true ratio to 0.04, and leaves less than 0.5 %."""
    truth = {"position": 4.5, "length": 0.17, "wave_speed_ratio": 0.79, "diameter_ratio": 1.0,
             "compliance_ratio": 1e-4, "conductance": 1e-15}  # fmt: skip
    observed = make(
        np.random.default_rng(4),
        ((EFFECTS["passive_piece"], Place("position")),),
        {f"passive_piece@position.{name}": value for name, value in truth.items()},
        points=POINTS[:2],
    )
    workers, search = search_that_named_volumes(observed, (4.46, 4.53), 1e-5)
    merged, pieced = merge_neighbours(workers, search)
    assert "line_volume" not in merged.best.names and pieced is not None
    found = pieced.twin.values()
    for name, tolerance in (("position", 0.05), ("length", 0.02), ("wave_speed_ratio", 0.04)):
        assert abs(found[f"passive_piece@position.{name}"] - truth[name]) < tolerance
    assert pieced.model_error < 0.005


def test_volumes_apart_stay():
    """Two true volumes half a metre apart, four times the distance at which lumps act as a pipe."""
    at = (4.2, 4.7)
    truth = {f"line_volume@{p}.position": x for (_, p), x in zip(TWO_VOLUMES, at)}
    truth |= {f"line_volume@{p}.volume": 3e-5 for _, p in TWO_VOLUMES}
    observed = make(np.random.default_rng(5), TWO_VOLUMES, truth, points=POINTS[:2])
    workers, search = search_that_named_volumes(observed, at, 3e-5)
    assert merge_neighbours(workers, search) == (search, None)
