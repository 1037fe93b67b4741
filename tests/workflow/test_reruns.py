"""What runs again after an edit: dry runs over Snakemake's real records of a finished run."""

import os
import re
from pathlib import Path

from workflow_copy import make, planned, snakemake

TESTED_AGAIN = {
    "evaluate",
    "evaluate_compound",
    "attention",
    "attention_table",
    "claims",
    "plot_attention",
    "plot_ranks",
    "accuracy_table",
    "recording_table",
    "report_compound",
    "report_cost",
    "report_page",
    "plot_accuracy",
    "plot_confusion",
}
# Samples and images are temporary: who needs them again makes them again.
TIME_AGAIN = {"augment", "train"} | TESTED_AGAIN
IMAGES_AGAIN = TESTED_AGAIN | {
    "augment",
    "pair_windows",
    "synchrosqueeze",
    "synchrosqueeze_seeds",
    "train",
}
PICTURES_OF_SIGNALS = {"plot_seeds", "plot_compound_seeds", "compare_sst"}


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new))


def test_nothing_runs_after_a_finished_run(workflow):
    """A second run has nothing to do: no rule depends on something that changes by itself."""
    assert planned(workflow)[0] == set()


def test_a_scored_trial_reruns_the_page_only(workflow):
    """The page shows a trial that lies in the results folder, and again when its scores change; it
    never starts one."""
    rows = workflow / "out/diagnosis_trial/rows.json"
    rows.parent.mkdir()
    for content in ("[]", "[1]"):
        rows.write_text(content)
        assert planned(workflow)[0] == {"report_page"}
        assert snakemake(workflow).returncode == 0
        assert planned(workflow)[0] == set()


def test_training_key_reruns_training_only(workflow):
    """learning_rate reaches no rule before `train`, but that needs its temporary inputs again."""
    edit(workflow / "config/config.yaml", "learning_rate: 0.003", "learning_rate: 0.002")
    assert planned(workflow)[0] == TIME_AGAIN | IMAGES_AGAIN


def test_sst_key_reruns_image_networks_only(workflow):
    """An SST key leaves networks on time windows alone."""
    edit(workflow / "config/config.yaml", "voices: 32", "voices: 24")
    rules, text = planned(workflow)
    assert rules == IMAGES_AGAIN | PICTURES_OF_SIGNALS
    assert "cnn2d_7_2.pt" in text and "cnn1d_341_100.pt" not in text


def test_noise_key_reruns_augmentation_and_after(workflow):
    """The noise factor changes samples, not the signals they come from."""
    edit(workflow / "config/config.yaml", "factor: 0.15", "factor: 0.2")
    assert planned(workflow)[0] == TIME_AGAIN | IMAGES_AGAIN


def test_prior_in_rig_yaml_reruns_calibration_and_what_needs_the_twin(workflow):
    """A prior concerns calibration alone: neither the windows nor the pump are made again."""
    edit(workflow / "case/rig.yaml", "diameter: 0.03", "diameter: 0.05")
    rules, text = planned(workflow)
    assert {"calibrate", "plot_calibration", "explain", "propagate", "flow_sensor"} <= rules
    assert not {"cut_windows", "simulate_fault"} & rules
    for dataset in ("CFD-MOC-P", "CFD-MOC-P+"):
        assert f"output: out/models/{dataset}/" in text
    assert "output: out/models/CFD-P/" not in text


def test_pump_in_rig_yaml_reruns_faults(workflow):
    """The counterpart: what the pump model reads of rig.yaml does rerun it."""
    edit(workflow / "case/rig.yaml", "pistons: 9", "pistons: 11")
    assert {"cut_windows", "simulate_fault"} <= planned(workflow)[0]


def test_library_file_reruns_what_imports_it(workflow):
    """Synchrosqueezing is imported by the scripts that make or draw images, and by no other."""
    module = workflow / "src/rippletwin/learning/synchrosqueezing.py"
    edit(module, "COLUMNS = 256", "COLUMNS = 128")
    assert planned(workflow)[0] == IMAGES_AGAIN | PICTURES_OF_SIGNALS


def test_effect_file_reruns_calibration(workflow):
    """The library imports effects by computed names; their files count as sources all the same."""
    effect = workflow / "src/rippletwin/twin/effects/leak.py"
    effect.write_text(effect.read_text() + "\n# edited\n")
    assert "calibrate" in planned(workflow)[0]


def test_physics_of_explain_reruns_the_corrected_columns_only(workflow):
    """What only `explain` imports changes the corrected twin, not the calibrated one."""
    search = workflow / "src/rippletwin/explanation/search/stepwise_search.py"
    search.write_text(search.read_text() + "\n# edited\n")
    rules, text = planned(workflow)
    assert {"explain", "propagate", "flow_sensor"} <= rules and "calibrate" not in rules
    for dataset in ("CFD-MOC-P+", "CFD-Q+"):
        assert f"output: out/models/{dataset}/" in text
    assert "output: out/models/CFD-MOC-P/" not in text


def test_method_of_the_flow_sensor_reruns_the_flow_columns_only(workflow):
    """Spectral or physics-informed: the flow of recordings changes, no simulation does."""
    edit(workflow / "config/config.yaml", "method: spectral", "method: pinn")
    rules, text = planned(workflow)
    assert (
        "flow_sensor" in rules
        and not {"calibrate", "explain", "propagate", "simulate_fault"} & rules
    )
    assert "output: out/models/CFD-Q+/" in text and "output: out/models/CFD-MOC-P" not in text


def test_the_band_of_the_flow_sensor_reruns_the_flow_columns_only(workflow):
    """Simulated and estimated flow are cut at it; no signal of pressure is made anew."""
    edit(workflow / "config/config.yaml", "bandwidth_hz: 1500", "bandwidth_hz: 1200")
    rules, text = planned(workflow)
    assert {"flow_sensor", "seed_signal"} <= rules and "propagate" not in rules
    assert "output: out/models/CFD-Q+/" in text
    assert "output: out/models/CFD-MOC-P" not in text and "output: out/models/CFD-P/" not in text


def test_a_network_that_the_flow_sensor_is_without_reruns_nothing(workflow):
    """The spectral method has no physics-informed network. The page states the configuration, so it
    alone is written anew."""
    edit(workflow / "config/config.yaml", "width: 32", "width: 16")
    edit(workflow / "config/config.yaml", "steps: 300", "steps: 200")
    assert planned(workflow)[0] == {"report_page"}


def test_a_compound_fault_adds_jobs_of_its_own(workflow):
    """Another pair of faults is simulated, propagated and shown. Every simulated dataset is trained
    again, whose temporary weights are asked, and no single fault is simulated again."""
    edit(workflow / "overlay.yaml", "[[S, C1]]", "[[S, C1], [S, C2]]")
    rules, text = planned(workflow)
    wanted = "simulate_fault propagate seed_signal evaluate_compound report_compound".split()
    assert set(wanted) <= rules
    for dataset in ("CFD-P", "CFD-MOC-P", "CFD-MOC-P+", "CFD-Q+"):
        assert f"output: out/models/{dataset}/" in text
    assert "output: out/faults/S+C2.zarr" in text and "output: out/faults/S.zarr" not in text


def test_a_row_of_datasets_that_nobody_uses_reruns_nothing(workflow):
    """Edited or added: the rows of the configured datasets decide, each for itself."""
    table = workflow / "config/datasets.tsv"
    edit(table, "experimental\tpressure\trig\tnone", "experimental\tflow\trig\tcalibrated")
    edit(table, "CFD-P\t", "mine\tflow\ttwin\tcalibrated\tno\tno\tnone\nCFD-P\t")
    assert planned(workflow)[0] == set()


def test_a_row_of_datasets_reruns_its_dataset(workflow):
    """The flow of CFD-Q+ through the pipe instead of the corrected line: its seed signals are made
    anew and what follows; the line is not propagated again, and no other dataset is trained but
    for what temporary files ask for."""
    table = workflow / "config/datasets.tsv"
    edit(table, "CFD-Q+\tflow\ttwin", "CFD-Q+\tflow\tpipe")
    rules, text = planned(workflow)
    assert "seed_signal" in rules
    assert not {"propagate", "flow_sensor", "explain", "simulate_fault"} & rules
    assert "output: out/models/CFD-Q+/" in text
    assert "output: out/models/CFD-MOC-P" not in text and "output: out/models/CFD-P/" not in text


def test_a_share_of_recordings_reruns_no_simulated_dataset(workflow):
    """How much of a recording networks learn from concerns `experimental` and randomised datasets,
    of which none is configured here. The page states the configuration, so it alone is written
    anew."""
    edit(workflow / "config/config.yaml", "training_share: 0.8", "training_share: 0.7")
    assert planned(workflow)[0] == {"report_page"}


def test_a_job_has_the_profiles_memory(workflow):
    """profiles/default is loaded although no profile is named: a rule that says nothing of memory
    or threads gets both from there."""
    (workflow / "out/claims.md").unlink()
    text = planned(workflow)[1]
    resources = re.search(r"^rule claims:\n(?:    .*\n)*?    resources: (.*)$", text, re.M)[1]
    assert "mem_mb=1000" in resources
    assert "Using workflow specific profile profiles/default" in text


def test_unknown_key_is_named(workflow):
    """A misspelt key stops the run with a message that names it and the right one, and is short."""
    edit(workflow / "overlay.yaml", "seeds: 1", "seeeds: 1")
    result = snakemake(workflow, "--dry-run")
    said = result.stdout + result.stderr
    assert result.returncode != 0 and len(said.splitlines()) < 10
    assert "unknown key seeeds. Did you mean seeds?" in said


def test_a_range_of_severities_reruns_no_dataset_of_one_severity(workflow):
    """The range, its limit and the number of twins concern randomised datasets alone, of which none
    is configured here. The page states the configuration, so it alone is written anew."""
    edit(workflow / "config/config.yaml", "S: [1.0e-7, 2.0e-6]", "S: [2.0e-7, 2.0e-6]")
    edit(workflow / "config/config.yaml", "severity_limit: 3.464e-7", "severity_limit: 4.0e-7")
    edit(workflow / "config/config.yaml", "draws: 400", "draws: 200")
    assert planned(workflow)[0] == {"report_page"}


def test_an_edited_file_of_operating_points_records_again(tmp_path):
    """A file as `virtualrig.points` is an input of the recordings: one that is older than they are
    reruns nothing, and one that was written since makes them anew."""
    folder = tmp_path / "workflow"
    make(folder)
    edit(folder / "overlay.yaml", "case: case", "case: virtualrig\nvirtualrig: {points: mine.yaml}")
    points = folder / "mine.yaml"
    points.write_text("points: []\n")
    (folder / "out/case/recordings").mkdir(parents=True)
    (folder / "out/case/rig.yaml").touch()
    for newer, answer in ((-60, "Nothing to be done"), (60, "rule record:")):
        time = (folder / "out/case/rig.yaml").stat().st_mtime + newer
        os.utime(points, (time, time))
        result = snakemake(folder, "--dry-run", "out/case/rig.yaml")
        assert answer in result.stdout + result.stderr
