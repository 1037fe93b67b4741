"""A real tube with a side hole open: the library's side hole at its true place and size."""

import pytest

from measured_holes import case, unseen_run
from paths import MEASURED
from rippletwin.calibration.frequency_continuation import fit_hypothesis
from rippletwin.calibration.misfit import score_fit
from rippletwin.explanation.fit_starts import scan_starts
from rippletwin.spectra.frequency_selection import select_fitted_frequencies
from rippletwin.spectra.observation import observe
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin

TUBE = MEASURED / "tube_four_holes"
pytestmark = pytest.mark.skipif(
    not (TUBE / "first_open_1.txt").exists(), reason="the measured tube is not there"
)


def test_the_open_hole_is_where_and_what_it_is(tmp_path):
    """The first hole is 100 mm from the mouthpiece and 3 mm wide, measured with a gauge. Fitted to
    two runs from the data sheet and twelve positions, the side hole is within 10 mm and 20 % of
    that, and the misfit of the third run is below 10 %; runs differ by 2 to 6 %."""
    fitted = case(TUBE, "first_open", tmp_path / "fitted")
    unseen = unseen_run(TUBE, "first_open", 3, fitted, tmp_path / "unseen")
    observation = observe(fitted.recordings[0], fitted.rig)
    data = select_fitted_frequencies([observation], fitted.rig)
    hypothesis = (
        (EFFECTS["unsteady_friction"], Place("line")),
        (EFFECTS["thermal_boundary_layer"], Place("line")),
        (EFFECTS["end_radiation"], Place("load")),
        (EFFECTS["side_hole"], Place("position")),
    )
    fit = fit_hypothesis(
        Twin(fitted.rig, data), hypothesis, data, scan_starts(fitted.rig, hypothesis)
    )
    values = fit.twin.values()
    assert values["side_hole@position.position"] == pytest.approx(0.1, abs=0.01)
    assert values["side_hole@position.diameter"] == pytest.approx(3e-3, rel=0.2)
    assert score_fit(fit, [unseen]).misfit < 0.1
