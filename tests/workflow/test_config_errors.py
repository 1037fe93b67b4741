"""A wrong configuration ends with a short message that names the key and what it should be."""

import pandas as pd
import pytest
import yaml
from snakemake.exceptions import WorkflowError
from snakemake.utils import validate

from config_errors import (
    check_config,
    check_datasets,
    check_load_pressures,
    check_names,
    check_severity,
    read_rig,
)
from paths import ROOT
from rippletwin.learning.architectures import ARCHITECTURES
from workflow_copy import RIG

SCHEMAS = ROOT / "workflow/schemas"
DEFAULTS = yaml.safe_load((ROOT / "config/config.yaml").read_text())


def dataset_table() -> pd.DataFrame:
    path = ROOT / "config/datasets.tsv"
    return pd.read_csv(path, sep="\t", dtype=str, keep_default_na=False)


def message(call, *arguments) -> str:
    with pytest.raises(WorkflowError) as caught:
        call(*arguments)
    return str(caught.value)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"sed": 2}, "unknown key sed. Did you mean seeds?"),
        ({"colour": "blue"}, "unknown key colour. Known here: results, case"),
        ({"sst": DEFAULTS["sst"] | {"sise": 8}}, "unknown key sst.sise. Did you mean size?"),
        ({"seeds": 0}, "seeds: 0: below 1"),
        ({"sst": DEFAULTS["sst"] | {"size": 10}}, "sst.size: 10: below 11"),
        (
            {"windows": DEFAULTS["windows"] | {"samples_per_revolution": 1535}},
            "windows.samples_per_revolution: 1535: below 1536",
        ),
        ({"noise": {"factor": "much"}}, "noise.factor: much: not of type number"),
        ({"noise": {}}, "missing noise.factor"),
        ({"scoring": {"pressure": "C3", "flow": "C2"}}, "C3: not one of C1, C2"),
        ({"datasets": ["CFD-P", "CFD-P"]}, "an entry is given twice"),
        ({"sst": [1] * 1000}, "sst: [1, 1, "),
    ],
)
def test_each_wrong_key_has_a_short_line(changes, said):
    """The line says the key, the value and the rule; no schema and no configuration is printed."""
    text = message(check_config, DEFAULTS | changes, SCHEMAS / "config.schema.yaml")
    assert said in text
    assert len(text.splitlines()) == 2 and len(text) < 600


def test_all_wrong_keys_are_told_at_once():
    """Three mistakes, three lines, and where to read on."""
    wrong = DEFAULTS | {"seeds": 0, "sed": 2, "noise": {}}
    assert len(message(check_config, wrong, SCHEMAS / "config.schema.yaml").splitlines()) == 4


def test_the_shipped_configuration_and_datasets_are_accepted():
    """The counterpart: nothing is wrong with what a fresh checkout has."""
    check_config(DEFAULTS, SCHEMAS / "config.schema.yaml")
    check_names("architectures", DEFAULTS["architectures"], list(ARCHITECTURES))
    table = dataset_table()
    validate(table, SCHEMAS / "datasets.schema.yaml")
    check_datasets(table)
    check_names("datasets", DEFAULTS["datasets"], list(table["name"]))


def test_an_unknown_name_is_named_with_its_neighbours():
    """A dataset and a network, of which the schema does not know the names."""
    text = message(check_names, "datasets", ["CFD-P", "CFDP"], list(dataset_table()["name"]))
    assert "'CFDP' is not known. Did you mean CFD-P" in text and "'CFD-P'" not in text
    assert "resnet18_1d" in message(check_names, "architectures", ["resnet18"], list(ARCHITECTURES))


@pytest.mark.parametrize(
    "changes",
    [
        {"signal": "force"},
        {"line": "none"},
        {"twin": "calibrated", "signal": "pressure", "line": "pipe"},
        {"twin": "none", "signal": "flow"},
        {"twin": "none", "line": "twin"},
        {"twin": "calibrated", "line": "twin", "uncorrected": "CFD-P"},
        {"randomised": "yes"},
        {"twin": "calibrated", "line": "twin", "anchored": "yes"},
        {"twin": "calibrated", "line": "twin", "randomised": "perhaps"},
        {"name": "a/b"},
        {"extra": "x"},
    ],
)
def test_the_schema_of_datasets_has_teeth(changes):
    """Each row is wrong in one way: an unknown word, a twin without use, a use without a twin, a
    comparison that is none, random twins of no twin, an anchor of a single revolution,
    a slash in a file's name, a column nobody reads."""
    row = {"name": "a", "signal": "pressure", "line": "pipe", "twin": "none"}
    row |= {"randomised": "no", "anchored": "no", "uncorrected": "none"}
    good = pd.DataFrame([row])
    validate(good, SCHEMAS / "datasets.schema.yaml")
    with pytest.raises(WorkflowError):
        validate(pd.DataFrame([row | changes]), SCHEMAS / "datasets.schema.yaml")


def test_datasets_differ_and_are_compared_with_known_ones():
    """Two rows of one name; two names for one thing; a comparison with a row that is not there."""
    table = dataset_table()
    again = table[table["name"] == "CFD-P"]
    assert "CFD-P, CFD-P: the same name" in message(check_datasets, pd.concat([table, again]))
    other = again.assign(name="mine")
    assert "CFD-P, mine: the same" in message(check_datasets, pd.concat([table, other]))
    wrong = table.replace({"uncorrected": {"CFD-Q": "CFD-R"}})
    assert "'CFD-R' is not known" in message(check_datasets, wrong)


@pytest.fixture
def case(tmp_path):
    """Write a case whose recordings nobody reads; returns its folder."""

    def write(sheet: str):
        (tmp_path / "rig.yaml").write_text(sheet)
        for entry in yaml.safe_load(RIG)["recordings"]:
            (tmp_path / entry["file"]).write_text("time_s,p1\n")
        return tmp_path

    return write


@pytest.mark.parametrize(
    ("sheet", "said"),
    [
        ("", ["empty"]),
        ("fluid:\n\tdensity: 870\n", ["line 2", "tab"]),
        (RIG.replace("state: healthy", "state: Healthy"), ["recordings[0].state", "Healthy"]),
        (RIG.replace("slipper.csv", "sliper.csv"), ["recordings[1].file", "sliper.csv"]),
        (RIG.replace("density: 870", "density: 0.87"), ["fluid.density"]),
    ],
)
def test_a_wrong_sheet_ends_the_planning_with_one_line(case, sheet, said):
    """The file and the place are named; nothing of YAML's own trace or of Python's is shown."""
    folder = case(sheet)
    text = message(read_rig, str(folder))
    assert text.startswith(f"config: case: {folder / 'rig.yaml'}: ")
    assert all(word in text for word in said)
    assert "\n" not in text


def test_every_fault_of_a_sheet_has_a_line(case):
    """Two wrong values are told at once."""
    wrong = RIG.replace("state: healthy", "state: Healthy").replace("kind: orifice", "kind: hole")
    lines = message(read_rig, str(case(wrong))).splitlines()
    assert len(lines) == 2 and all(line.startswith("config: case: ") for line in lines)


def test_a_case_that_is_not_there_is_named(tmp_path):
    """A misspelt folder: the path that was looked for."""
    assert "nowhere" in message(read_rig, str(tmp_path / "nowhere"))


def test_a_recording_that_faults_are_simulated_for_needs_its_load_pressure():
    """A sheet may leave the pressure out where the load is unknown; a simulated fault cannot."""
    entries = yaml.safe_load(RIG)["recordings"]
    check_load_pressures(entries)
    del entries[0]["load_pressure"]
    text = message(check_load_pressures, entries)
    assert f"{entries[0]['file']}: load_pressure: missing" in text and "\n" not in text


def test_a_sheet_in_order_is_read(case):
    """By the folder or by the file; numbers are numbers, 9.5e6 too, as for the jobs."""
    folder = case(RIG.replace("9500000", "9.5e6"))
    path, sheet = read_rig(f"{folder}/")
    assert path == str(folder / "rig.yaml") and read_rig(path) == (path, sheet)
    assert sheet["recordings"][0]["load_pressure"] == 9.5e6


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"severity_limit": 3e-6}, "faults.severity_limit: 3e-06 must be between 1e-07 and 2e-06"),
        ({"severity": {"S": [2e-6, 1e-7], "C": [1e-7, 2e-6]}}, "faults.severity.S: 2e-06 to 1e-07"),
    ],
)
def test_severities_that_cannot_be_are_named(changes, said):
    """A limit that leaves a class empty, and a range that falls; the shipped ones are right."""
    check_severity(DEFAULTS["faults"])
    assert said in message(check_severity, DEFAULTS["faults"] | changes)
