"""The benchmark on openwind's tubes: what is drawn, and what counts as right."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest

from openwind_tubes import Cone, Hole, Tube
from third_party_tubes import KINDS, draw_tube, score

TUBE = Tube(0.4, 4e-3, (Hole(0.1, 2e-3, 2e-3), Hole(0.25, 2e-3, 2e-3)), end="closed")


def effect(name, position=None, support="established"):
    """An effect as verdict.json has it; the interval of a position is 4 mm wide."""
    parameters = {}
    if position is not None:
        parameters["position"] = {"value": position, "ci95": [position - 2e-3, position + 2e-3]}
    return {"name": name, "support": support, "parameters": parameters}


def test_what_is_there_is_right_at_its_place_alone():
    """Losses and both holes are right, the second hole by an interval that misses it."""
    result = score(
        TUBE,
        [
            effect("unsteady_friction"),
            effect("thermal_boundary_layer"),
            effect("side_hole", 0.101),
            effect("side_hole", 0.257),
        ],
    )
    assert result.wrong == []
    assert result.losses == (2, 2) and result.holes == (2, 2)
    assert result.places == pytest.approx([0.001, 0.007])
    assert result.covered == 1


@pytest.mark.parametrize(
    "wrong",
    [
        effect("side_hole", 0.115),  # 15 mm off
        effect("line_volume", 0.1),  # another name at the place
        effect("end_radiation"),  # of a closed end
    ],
)
def test_what_is_not_there_is_wrong(wrong):
    """Another place, another name, radiation of an end that is closed: wrong where established,
    and nothing otherwise."""
    assert score(TUBE, [wrong]).wrong == [wrong["name"]]
    assert score(TUBE, [wrong | {"support": "supported"}]).wrong == []


def test_a_hole_counts_once():
    """Two holes named at one true hole: one is wrong."""
    result = score(TUBE, [effect("side_hole", 0.099), effect("side_hole", 0.102)])
    assert result.holes == (1, 2) and result.wrong == ["side_hole"]


def test_losses_of_a_wall_without_losses_are_wrong():
    """The same names are right or wrong by the tube, and an open end radiates."""
    smooth = dataclasses.replace(TUBE, losses=0.0, end="unflanged")
    result = score(smooth, [effect("unsteady_friction"), effect("end_radiation")])
    assert result.wrong == ["unsteady_friction"] and result.right == ["end_radiation"]
    assert result.losses == (0, 0)


@pytest.mark.parametrize("kind", KINDS)
def test_tubes_are_drawn_as_their_kind_says(kind):
    """Holes inside the tube and smaller than the bore, apart from each other and from the cone, and
    the same for the same seed."""
    for seed in range(1000, 1020):
        tube = draw_tube(kind, np.random.default_rng(seed))
        assert tube == draw_tube(kind, np.random.default_rng(seed))
        assert len(tube.holes) == {"tube": 0, "two holes": 2}.get(kind, 1)
        assert (tube.cone is not None) == ("cone" in kind)
        assert (tube.losses > 0.0) == ("no losses" not in kind)
        places = sorted(hole.position for hole in tube.holes)
        places = [0.0, *places, tube.length]
        assert min(np.diff(places)) > 0.09 * tube.length
        for hole in tube.holes:
            behind = tube.cone is not None and hole.position > tube.cone.end
            assert hole.radius < (tube.cone.radius if behind else tube.radius)
            if tube.cone is not None:
                clear = max(tube.cone.begin - hole.position, hole.position - tube.cone.end)
                assert clear > 0.0


def test_a_bore_is_continuous():
    """The pieces of a tube with a cone follow each other without a step."""
    tube = Tube(0.4, 4e-3, cone=Cone(0.1, 0.14, 5e-3))
    bore = tube.bore()
    for before, after in pairwise(bore):
        assert before[1] == after[0] and before[3] == after[2]
    assert bore[0][0] == 0.0 and bore[-1][1] == tube.length
