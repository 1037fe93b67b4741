"""Python and YAML examples of the documentation work as they stand."""

from __future__ import annotations

import ast
import json
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
NOTEBOOK = ROOT / "docs" / "how-to" / "notebook.md"
NEW_NETWORK = ROOT / "docs" / "how-to" / "add_a_network.md"


def first(page: Path, language: str) -> str:
    """The first block of a language on a page."""
    return next(b for b in blocks_of(page) if b.language == language).text


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

    blocks_there = [b for b in blocks_of(OWN_RECORDINGS) if b.language == "yaml"]
    (example,) = [e for e in (parse_yaml(b.text) for b in blocks_there) if "fluid" in e]
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


def test_the_effect_of_the_how_to_is_taken_and_is_a_side_hole(tmp_path):
    """Saved as the how-to says, the file of at most 40 lines is taken on a tube of air. Its
    impedance is within 15 % that of the library's side hole, which has the flow in the bore and
    friction besides; and the time domain, which it does not state, is within 1 % of the ripple."""
    from types import SimpleNamespace

    from rippletwin.twin.effects import library
    from rippletwin.twin.effects.base import Place
    from rippletwin.twin.propagation import propagate
    from two_domains import ORDERS, SPEED_HZ, STEPS, corrected, misfit, rig
    from two_domains import ripple as flow_ripple

    text, before = first(NEW_EFFECT, "python"), dict(library.EFFECTS)
    assert len(text.strip().splitlines()) <= 40
    (tmp_path / "own_hole.py").write_text(text)
    try:
        (own,) = library.add_effects([tmp_path / "own_hole.py"], rig("open"))
    finally:
        library.EFFECTS.clear()
        library.EFFECTS.update(before)
    place, admittance, lengths = Place("position"), [], np.array([0.41, 0.23])
    state = SimpleNamespace(
        density=1.2, viscosity=1.5e-5, friction="steady",
        diameters=np.array([0.008, 0.009]), wave_speeds=np.array([343.0, 343.0]),
    )  # fmt: skip
    for effect in (own, library.EFFECTS["side_hole"]):
        values = {p.name: p.nominal for p in effect.parameters(rig("open"), place)}
        s = 2j * np.pi * np.linspace(100.0, 4000.0, 50)
        line = SimpleNamespace(s=s, inserts=[], length=0.64, lengths=lengths)
        effect.apply(line, state, values, place)
        admittance.append(line.inserts[0][2])
    np.testing.assert_allclose(1.0 / admittance[0], 1.0 / admittance[1], rtol=0.15)
    wave, twin = flow_ripple(1e-5), corrected((own, place), load="open")
    moc = propagate(twin, wave.flow, wave.flow, SPEED_HZ, 1e5, steps=STEPS, tolerance=1e-4)
    assert misfit(moc.harmonics(ORDERS), twin.respond(wave, SPEED_HZ, 1e5, ORDERS)) < 0.01


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


def notebook_blocks() -> list[str]:
    """Python of notebook.md: simulate, label, diagnose, report."""
    return [block.text for block in blocks_of(NOTEBOOK) if block.language == "python"]


def test_the_notebook_simulates_and_reports(tmp_path, monkeypatch, capsys):
    """All examples of notebook.md but that which takes minutes run on a small case: a leak changes
    the readings of both sensors by more than a kPa, and the page is written."""
    (tmp_path / "my_case").mkdir()
    write_case(tmp_path / "my_case", sheet())
    monkeypatch.chdir(tmp_path)
    simulated, labelled, _, reported = notebook_blocks()
    names = {}
    exec(simulated, names)
    assert names["change"].shape == (2, len(names["slipper"].time_s))
    assert np.all(np.std(names["change"], axis=1) > 1e3)
    exec(labelled, names)
    assert names["revolution"].pressure.sizes == {"sensor": 2, "time": len(names["slipper"].time_s)}
    exec(reported, {})
    assert "my_case/report.html" in capsys.readouterr().out
    assert (tmp_path / "my_case" / "report.html").stat().st_size > 1e4


@pytest.mark.long
def test_the_notebook_diagnoses(tmp_path, monkeypatch, capsys):
    """The second example of notebook.md runs on a case of the virtual rig with a worn slipper, and
    says so after one of the verdicts that there are."""
    from rippletwin.explanation.verdict.decision import VERDICTS
    from virtualrig.cli import main as virtualrig

    monkeypatch.chdir(tmp_path)
    virtualrig(["record", "--out", "my_case", "--points", "smoke", "--seconds", "2"])
    names = {"__name__": "notebook"}
    exec(notebook_blocks()[2], names)
    capsys.readouterr()
    names["main"]()
    verdict, *diagnoses = capsys.readouterr().out.splitlines()
    assert verdict in VERDICTS
    assert "slipper_1000_95 slipper" in "\n".join(diagnoses)
