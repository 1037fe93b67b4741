"""Choice of the meshes of drawn rigs, against a much finer mesh."""

from dataclasses import replace

import pytest

from virtualrig.draw import draw_case
from virtualrig.resolution import (
    ALLOWED_ERROR,
    BASE_NUMERICS,
    build_drawn,
    choose_mesh,
    rms_of_harmonics,
    settled_harmonics,
)


@pytest.fixture(scope="module")
def stiffening():
    """A drawn rig at one operating point, on one pipe, whose liquid is made to stiffen."""
    d = draw_case(60, "a", 1, 3)
    sheet = d.sheet | {"sensors": d.sheet["sensors"][:1]}
    line = {"segments": [d.seal["line"]["segments"][1]]}
    liquid = {"name": "stiffening_liquid", "per_pascal": 4e-9, "reference": 8e6}
    changed = {"line": line, "sensors": [0.5], "effects": [liquid], "noise": 700.0}
    return replace(d, sheet=sheet, points=d.points[:1], seal=d.seal | changed)


@pytest.mark.long
def test_a_nonlinear_line_gets_the_mesh_that_its_noise_requires(stiffening):
    """On the chosen mesh the error against much narrower elements stays below a tenth of the noise
    and about as stated; on the mesh of linear lines it does not."""
    numerics, stated = choose_mesh(stiffening)
    point, allowed = stiffening.points[0], ALLOWED_ERROR * stiffening.seal["noise"]
    fine = BASE_NUMERICS | {"frequency": 2 * numerics["frequency"]}
    truth = settled_harmonics(build_drawn(stiffening, fine), point)

    def error(numerics):
        return float(
            rms_of_harmonics(
                settled_harmonics(build_drawn(stiffening, numerics), point) - truth
            ).max()
        )

    assert error(numerics) <= allowed < error(BASE_NUMERICS)
    assert stated / 2 < error(numerics) < 1.5 * stated <= 1.5 * allowed


def test_a_linear_line_keeps_its_mesh(stiffening):
    """Without nonlinear compliance nothing is refined and no error is estimated."""
    linear = replace(stiffening, seal=stiffening.seal | {"effects": []})
    assert choose_mesh(linear) == (BASE_NUMERICS, None)
