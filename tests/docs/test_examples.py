"""Python and YAML examples of the documentation work as they stand."""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
from pathlib import Path

import jsonschema
import numpy as np
import pytest
import yaml

from case_folders import ripple, sheet, write_case
from doc_pages import blocks, blocks_of
from paths import ROOT

OWN_RECORDINGS = ROOT / "docs" / "how-to" / "own_recordings.md"
NEW_EFFECT = ROOT / "docs" / "how-to" / "add_an_effect.md"
NEW_NETWORK = ROOT / "docs" / "how-to" / "add_a_network.md"


def only(page: Path, language: str) -> str:
    """The one block of a language on a page."""
    (block,) = [b for b in blocks_of(page) if b.language == language]
    return block.text


@pytest.mark.parametrize("block", blocks("python"), ids=str)
def test_python_examples_are_python(block):
    """Every example parses, and everything that it imports from this project exists."""
    tree = ast.parse(block.text)
    imports = [n for n in tree.body if isinstance(n, (ast.Import, ast.ImportFrom))]
    exec(compile(ast.Module(imports, []), str(block), "exec"), {})


@pytest.mark.parametrize("language", ["yaml", "json"])
def test_data_examples_can_be_read(language):
    """Every YAML and JSON example is what it says."""
    read = {"yaml": yaml.safe_load, "json": json.loads}[language]
    assert all(read(block.text) is not None for block in blocks(language))


def test_sheet_of_the_how_to_is_valid():
    """The minimal sheet of own_recordings.md passes the schema of rig.yaml."""
    schema = yaml.safe_load((ROOT / "src/rippletwin/case/rig.schema.yaml").read_text())
    from rippletwin.case.yaml_limits import parse_yaml

    example = parse_yaml(only(OWN_RECORDINGS, "yaml"))
    jsonschema.Draft202012Validator(schema).validate(example)


def test_a_recording_written_as_the_how_to_says_is_read(tmp_path, monkeypatch):
    """The HDF5 snippet of own_recordings.md makes a recording that a case can hold."""
    from rippletwin.case.load import load_case

    content, pressure = sheet(), ripple()
    content["recordings"][0]["file"] = "recordings/healthy_0.h5"
    write_case(tmp_path, content, pressure=None)
    (tmp_path / "recordings").mkdir()
    monkeypatch.chdir(tmp_path)
    exec(only(OWN_RECORDINGS, "python"), {"pressure": pressure})
    (recording,) = load_case(tmp_path).recordings
    np.testing.assert_array_equal(recording.pressure, pressure)


@pytest.mark.long
def test_the_effect_of_the_how_to_is_found_and_acts(tmp_path):
    """Saved as the how-to says, the example is in the library, and in both domains it changes what
    a line reads by the same amount."""
    import shutil

    shutil.copytree(
        ROOT / "src" / "rippletwin",
        tmp_path / "rippletwin",
        ignore=shutil.ignore_patterns("__pycache__"),
    )
    effects = tmp_path / "rippletwin" / "twin" / "effects"
    (effects / "resistance.py").write_text(only(NEW_EFFECT, "python"))
    tests = ROOT / "tests"
    done = subprocess.run(
        [
            sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-k", "resistance",
            str(tests / "twin" / "test_effects.py"), str(tests / "twin" / "test_propagation.py"),
        ],
        cwd=ROOT, capture_output=True, text=True,
        env={**os.environ, "PYTHONPATH": str(tmp_path)},
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-1000:]
    assert "passed" in done.stdout and "no tests ran" not in done.stdout


def test_the_network_of_the_how_to_can_be_built():
    """The entry of add_a_network.md makes a network that takes a window of one revolution."""
    import torch

    from rippletwin.learning import architectures, networks

    name, entries = "cnn1d_75_25", dict(architectures.ARCHITECTURES)
    try:
        exec(only(NEW_NETWORK, "python"), vars(architectures))
        network = networks.build(name, channels=2)
        assert network(torch.zeros(3, 2, 3072)).shape == (3, 4)
    finally:
        architectures.ARCHITECTURES.clear()
        architectures.ARCHITECTURES.update(entries)
