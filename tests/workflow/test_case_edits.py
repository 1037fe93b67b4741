"""What an edit of rig.yaml reruns, and what a case without a faulty recording plans: dry runs over
Snakemake's real records of a finished run."""

import re
from pathlib import Path

import pytest

from workflow_copy import RIG, make, planned, snakemake

OVERLAY = """\
results: out
case: case
seeds: 1
datasets: [CFD-MOC-P, CFD-MOC-PR]
architectures: [cnn1d_341_100]
"""
LATER = "- {file: later.csv, speed_rpm: 1000, load_pressure: 9500000, state: unknown}\n"
AGAIN = "- {file: again.csv, speed_rpm: 1000, load_pressure: 9500000, state: unknown}\n"
SLIPPER = RIG.splitlines(keepends=True)[-1]
SCORING = {"evaluate", "accuracy_table", "recording_table", "claims", "attention", "plot_confusion"}
DIAGNOSIS = {"diagnose", "report_page"}


def write(folder: Path, rig: str) -> None:
    (folder / "overlay.yaml").write_text(OVERLAY)
    (folder / "case/rig.yaml").write_text(rig)
    for name in ("later.csv", "again.csv"):
        (folder / "case" / name).write_text("time_s,p1\n")


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> Path:
    """A finished run of a case with a healthy, a faulty and an unknown recording."""
    folder = tmp_path_factory.mktemp("finished") / "workflow"
    make(folder)
    write(folder, RIG + LATER)
    result = snakemake(folder)
    assert result.returncode == 0, result.stderr
    return folder


def other_order(rig: str) -> str:
    """The same sheet: sections and keys in another order, numbers written in another way."""
    head, recordings = rig.split("recordings:\n")
    entries = "".join(
        re.sub(r"\{(file: \S+), (.*), (state: \w+)\}", r"{\3, \2, \1}", line) + "\n"
        for line in recordings.splitlines()
    )
    entries = entries.replace("9500000", "9.5e6")
    assert entries.count("{state: ") == entries.count("- ")
    lines = head.replace("pistons: 9", "pistons: 9.0").splitlines(keepends=True)
    return "recordings:\n" + entries + "".join(reversed(lines))


@pytest.mark.parametrize(
    "edit",
    [lambda rig: f"# a comment\n{rig}\n\n# another", other_order, lambda rig: rig],
    ids=["comments", "another order", "saved again"],
)
def test_an_edit_without_content_reruns_nothing(workflow, edit):
    """Jobs depend on what rig.yaml says, not on how it says it or on when it was saved."""
    write(workflow, edit(RIG + LATER))
    assert planned(workflow)[0] == set()


@pytest.mark.parametrize("first", [True, False])
def test_an_unknown_recording_plans_its_diagnosis_only(workflow, first):
    """Nothing is calibrated, explained, simulated, trained or scored again, wherever in the list
    the new recording stands behind the healthy one."""
    rig = RIG.replace(SLIPPER, AGAIN + SLIPPER) + LATER if first else RIG + LATER + AGAIN
    write(workflow, rig)
    rules, text = planned(workflow)
    assert rules == DIAGNOSIS | {"ask_networks"}
    assert "case/again.csv" in text


def test_an_unknown_recording_of_another_point_is_diagnosed_by_the_twin_only(workflow):
    """Networks know one operating point."""
    write(workflow, RIG + LATER + AGAIN.replace("9500000", "7000000"))
    assert planned(workflow)[0] == DIAGNOSIS


def test_an_unknown_recording_that_goes_reruns_no_more(workflow):
    """The reverse: without the last one, networks are not asked at all."""
    write(workflow, RIG)
    assert planned(workflow)[0] == DIAGNOSIS


def test_a_healthy_recording_reruns_what_it_is_fitted_with(workflow):
    """The counterpart: a recording that calibration uses does rerun it and all that follows."""
    write(workflow, RIG + LATER + AGAIN.replace("unknown", "healthy"))
    assert {"calibrate", "explain", "cut_windows", "train", "diagnose"} <= planned(workflow)[0]


def test_a_label_of_an_unknown_recording_reruns_its_diagnosis_only(workflow):
    """What a recording is called is its own affair."""
    write(workflow, RIG + LATER.replace("{", "{label: hot oil, "))
    assert planned(workflow)[0] == DIAGNOSIS | {"ask_networks"}


def test_networks_of_randomised_datasets_are_tested_on_late_windows(workflow):
    """Their signals have the pistons and errors of the early windows of the healthy recording, so
    that these are left out of the test; simulations of one severity use no window, and all are
    tested."""
    write_share = "open(snakemake.output[0], 'w').write(str(snakemake.params.learnt_share))\n"
    (workflow / "workflow/scripts/evaluate.py").write_text(write_share)
    said = {
        name: workflow / f"out/predictions/{name}/cnn1d_341_100.csv"
        for name in ("CFD-MOC-P", "CFD-MOC-PR")
    }
    for path in said.values():
        path.unlink()
    targets = (str(path.relative_to(workflow)) for path in said.values())
    result = snakemake(workflow, "--nolock", *targets)  # an option ends --configfile's values
    assert result.returncode == 0, result.stderr
    found = {name: path.read_text() for name, path in said.items()}
    assert found == {"CFD-MOC-P": "0.0", "CFD-MOC-PR": "0.8"}


@pytest.fixture
def fresh(tmp_path) -> Path:
    """A workflow that has never run."""
    make(tmp_path / "workflow")
    return tmp_path / "workflow"


def test_a_case_of_healthy_recordings_trains_nothing(fresh):
    """Nothing is there to be scored or told: the twin is calibrated and explained, faults are
    simulated and shown, and the page is written."""
    write(fresh, RIG.replace(SLIPPER, ""))
    rules, _ = planned(fresh)
    assert {"calibrate", "explain", "simulate_fault", "plot_seeds", "report_page"} <= rules
    assert not rules & (SCORING | {"train", "diagnose", "keep_networks", "ask_networks"})


def test_a_case_without_known_faults_scores_nothing(fresh):
    """An unknown recording is told by the twin and by the networks that are kept; those of which
    only accuracies would be wanted are not trained."""
    write(fresh, RIG.replace(SLIPPER, LATER))
    rules, text = planned(fresh)
    assert {"diagnose", "train", "keep_networks", "ask_networks", "report_page"} <= rules
    assert not rules & SCORING
    assert set(re.findall(r"out/models/([^/]+)/", text)) == {"CFD-MOC-PR"}


def test_without_a_known_recording_at_the_point_no_image_is_compared(fresh):
    """All healthy recordings are at another load pressure: simulated images have no recorded one
    beside them. With a healthy one at the point they are compared."""
    write(fresh, RIG.replace(SLIPPER, LATER.replace("9500000", "7000000")))
    assert "compare_sst" not in planned(fresh)[0]
    write(fresh, RIG.replace(SLIPPER, LATER))
    assert "compare_sst" in planned(fresh)[0]


def test_a_case_without_a_ripple_is_explained_only(fresh):
    """A measured spectrum has no pump: nothing is simulated."""
    spectrum = "- {file: healthy.csv, kind: spectrum, state: healthy}\n"
    write(fresh, RIG.split("recordings:\n")[0] + "recordings:\n" + spectrum)
    assert planned(fresh)[0] == {"explain", "report_page"}
