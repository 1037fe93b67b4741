"""rig.yaml and configurations, damaged at random: refused in words or read, and nothing else."""

import pytest
import yaml
from hypothesis import given
from snakemake.exceptions import WorkflowError

from case_folders import ripple, sheet, write_case, write_hdf5
from config_errors import check_config
from fuzzing import EDITS, TREE_EDITS, edited, edited_tree, little_memory, tried
from paths import ROOT
from rippletwin.case.load import load_case
from rippletwin.case.rig_yaml import find_sheet_faults, parse_sheet
from rippletwin.errors import InputError

FULL = (ROOT / "docs/reference/rig_yaml.md").read_text().split("```yaml\n")[1].split("```")[0]
FULL_VALUES = yaml.safe_load(FULL.replace("9.5e6", "9500000.0"))
DEFAULTS = yaml.safe_load((ROOT / "config/config.yaml").read_text())


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A good case of a short recording."""
    folder = tmp_path_factory.mktemp("case")
    write_case(folder, sheet(), None)
    write_hdf5(folder / "healthy_0.h5", ripple(0.3))
    assert load_case(folder).recordings
    return folder


@tried(2)
@given(edits=EDITS)
def test_text_of_a_sheet(folder, edits):
    """Bytes of a sheet with every key are written over, cut, repeated: YAML or not."""
    path = folder / "text.yaml"
    path.write_bytes(edited(FULL.encode(), edits))
    try:
        content = parse_sheet(path)
    except InputError:
        return
    assert all(isinstance(error, InputError) for error in find_sheet_faults(path, content))


@tried(2)
@given(edits=TREE_EDITS)
def test_values_of_a_sheet(folder, edits):
    """Values of the smallest sheet are others, missing, too many; what passes is read whole."""
    path = folder / "rig.yaml"
    content = edited_tree(sheet(), edits)
    if not isinstance(content, dict):
        return
    found = find_sheet_faults(path, content)
    assert all(isinstance(error, InputError) and str(error) for error in found)
    if found:
        return
    path.write_text(yaml.safe_dump(content))
    try:
        with little_memory():
            load_case(folder)
    except InputError:
        pass


@tried(5)
@given(edits=TREE_EDITS)
def test_values_of_a_full_sheet(edits):
    """The same of the sheet with every key."""
    content = edited_tree(FULL_VALUES, edits)
    if isinstance(content, dict):
        assert all(
            isinstance(error, InputError) for error in find_sheet_faults(ROOT / "rig.yaml", content)
        )


@tried(0.3)
@given(edits=TREE_EDITS)
def test_values_of_a_configuration(edits):
    """A configuration that is refused is refused in words."""
    try:
        check_config(edited_tree(DEFAULTS, edits), ROOT / "workflow/schemas/config.schema.yaml")
    except WorkflowError as error:
        assert "config" in str(error)
