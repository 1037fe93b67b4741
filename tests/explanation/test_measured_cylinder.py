"""A real line: the measured air tube. What the paper's steady friction lacks, found by itself."""

import json
import shutil

import numpy as np
import pytest
import yaml

from paths import MEASURED, ROOT
from rippletwin.calibration.frequency_continuation import refine
from rippletwin.calibration.misfit import score_fit
from rippletwin.case.load import load_case
from rippletwin.explanation.explain import explain
from rippletwin.explanation.verdict.verdict_file import write_verdict
from rippletwin.spectra.frequency_selection import select_fitted_frequencies
from rippletwin.spectra.observation import observe
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin

CYLINDER = MEASURED / "cylinder"
pytestmark = pytest.mark.skipif(
    not (CYLINDER / "measured_1.txt").exists(),
    reason="the measured cylinder is not there: docs/validation.md says how to get it",
)

SHEET = ROOT / "resources" / "air_tube" / "rig.yaml"


def case(folder, run, **uncertainty):
    folder.mkdir(exist_ok=True)
    shutil.copy(CYLINDER / f"measured_{run}.txt", folder / "measured.txt")
    sheet = yaml.safe_load(SHEET.read_text())
    sheet["uncertainty"] |= uncertainty
    (folder / "rig.yaml").write_text(yaml.safe_dump(sheet))
    return load_case(folder)


@pytest.fixture(scope="module")
def explained(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cylinder")
    explanation = explain(case(folder / "first", 1), processes=1)
    second = case(folder / "second", 2)
    return explanation, observe(second.recordings[0], second.rig), folder


def test_it_arrives_at_the_known_acoustics(explained):
    """From steady friction on run 1: viscous and thermal boundary layers, then radiation."""
    explanation, unseen, folder = explained
    best = explanation.decision.accepted
    assert best.names == ("unsteady_friction", "thermal_boundary_layer", "end_radiation")
    result = write_verdict(explanation, folder / "out")
    assert result["verdict"] == "named"
    assert json.loads((folder / "out" / "verdict.json").read_text()) == result
    assert score_fit(explanation.search.base, [unseen]).misfit > 0.5
    assert score_fit(best, [unseen]).misfit < 0.10
    # A smaller bore does the thermal layer's work; the gauge that measured it is what says no.
    (thermal,) = (w for w in result["without"] if w["effect"] == "thermal_boundary_layer")
    assert thermal["rivals"] and thermal["parameter"] == "diameter[1]" and thermal["pull"] > 10
    assert "only the data sheet rejects it" in result["sentence"]


def test_nothing_fitted_each_effect_brings_run_2_closer(explained):
    """With measured geometry and textbook air, nothing fitted: 107 -> 33 -> 8 -> 5 % on run 2."""
    explanation, unseen, _ = explained
    effects = explanation.decision.accepted.hypothesis
    base = Twin(explanation.rig, [unseen])
    posterior_errors = []
    for count in range(4):
        fit = refine(
            base,
            effects[:count],
            select_fitted_frequencies([unseen], explanation.rig),
            [_zeros(base, effects[:count])],
        )
        nominal = type(fit)(**{**fit.__dict__, "twin": base.with_(effects=effects[:count])})
        posterior_errors.append(score_fit(nominal, [unseen]).misfit)
    np.testing.assert_allclose(posterior_errors, [1.07, 0.335, 0.077, 0.043], rtol=0.25)
    assert np.all(np.diff(posterior_errors) < 0)


def test_a_free_radius_does_as_well_and_the_prior_rejects_it(tmp_path):
    """Viscous loss alone fits run 1 below 5 % with a bore far too small: ten standard deviations
    of the measured radius away, so that its evidence is below that of the accepted model."""
    free = case(tmp_path / "free", 1, diameter=0.3)
    data = select_fitted_frequencies([observe(free.recordings[0], free.rig)], free.rig)
    viscous = ((EFFECTS["unsteady_friction"], Place("line")),)
    both = (*viscous, (EFFECTS["thermal_boundary_layer"], Place("line")))
    base = Twin(free.rig, data)
    loose = refine(base, viscous, data, [_zeros(base, viscous)])
    bore = loose.twin.values()["diameter[1]"]
    assert score_fit(loose, data).misfit < 0.05
    assert bore < 0.85 * 0.0039
    assert abs(np.log(bore / 0.0039)) / 0.01 > 10
    tight = case(tmp_path / "tight", 1)
    base = Twin(tight.rig, data)
    alone = refine(base, viscous, data, [_zeros(base, viscous)])
    accepted = refine(base, both, data, [_zeros(base, both)])
    assert accepted.evidence > alone.evidence + 50


def _zeros(base, effects):
    return np.zeros(len(base.with_(effects=effects).parameters))
