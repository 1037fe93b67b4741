"""How fine the meshes of drawn rigs are: against one that is much finer."""

from dataclasses import replace

import pytest

from virtualrig.draw import draw
from virtualrig.resolution import ALLOWED, NUMERICS, built, resolved, rms, settled


@pytest.fixture(scope="module")
def stiffening():
    """A drawn rig at one operating point, on one pipe, whose liquid is made to stiffen."""
    d = draw(60, "a", 1, 3)
    sheet = d.sheet | {"sensors": d.sheet["sensors"][:1]}
    line = {"segments": [d.seal["line"]["segments"][1]]}
    liquid = {"name": "stiffening_liquid", "per_pascal": 4e-9, "reference": 8e6}
    changed = {"line": line, "sensors": [0.5], "effects": [liquid], "noise": 700.0}
    return replace(d, sheet=sheet, points=d.points[:1], seal=d.seal | changed)


@pytest.mark.long
def test_a_line_that_is_not_linear_gets_the_mesh_that_its_noise_asks_for(stiffening):
    """On the mesh chosen the error against elements much narrower stays below a tenth of the noise
    and about what is stated; the mesh of linear lines would not do."""
    numerics, stated = resolved(stiffening)
    point, allowed = stiffening.points[0], ALLOWED * stiffening.seal["noise"]
    fine = NUMERICS | {"frequency": 2 * numerics["frequency"]}
    truth = settled(built(stiffening, fine), point)

    def error(numerics):
        return float(rms(settled(built(stiffening, numerics), point) - truth).max())

    assert error(numerics) <= allowed < error(NUMERICS)
    assert stated / 2 < error(numerics) < 1.5 * stated <= 1.5 * allowed


def test_a_linear_line_keeps_its_mesh(stiffening):
    """Without what yields out of proportion nothing is refined and no error is estimated."""
    linear = replace(stiffening, seal=stiffening.seal | {"effects": []})
    assert resolved(linear) == (NUMERICS, None)
