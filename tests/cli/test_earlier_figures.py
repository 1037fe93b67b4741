"""Figures of an earlier call do not stand beside the answer of a later one in the same folder."""

from pathlib import Path
from types import SimpleNamespace

import pytest
from matplotlib.figure import Figure

from made_results import DIAGNOSIS, HOSTILE, VERDICT, made_change, made_numbers, write_results
from rippletwin.case.load import load_case
from rippletwin.cli import diagnose as diagnose_command
from rippletwin.cli import main
from rippletwin.diagnosis import diagnose, kept_answers
from rippletwin.explanation import explain
from rippletwin.explanation.verdict import verdict_file
from rippletwin.figures import explained_numbers, explanation, fault_posterior
from rippletwin.report.results import read_results

MINE = {"mine.png", "explain_mine.png", "diagnose_mine.json"}


@pytest.fixture
def folder(tmp_path):
    """A case with results, and in their folders of figures every picture and a user's files."""
    write_results(tmp_path)
    explained = [f"explain_{name}.svg" for name in explanation.FIGURES]
    diagnosed = [f"diagnose_{HOSTILE}_{name}.png" for name in ("change", "severity")]
    for name, pictures in (("explained", explained), ("diagnosed", diagnosed)):
        for file in (*pictures, *MINE):
            (tmp_path / name / "figures" / file).touch()
    return tmp_path


def names(folder):
    return {path.name for path in (folder / "figures").iterdir()}


@pytest.fixture
def explained(monkeypatch):
    """`explain` finds something else, and writes it, without calculating."""

    def write(_, out):
        (Path(out) / "verdict.json").write_text("{}")
        return VERDICT

    monkeypatch.setattr(explain, "explain", lambda *_: SimpleNamespace(twin=None))
    monkeypatch.setattr(verdict_file, "write_verdict", write)


def test_explain_without_figures_leaves_none_of_an_earlier_verdict(folder, capsys, explained):
    """The report shows the new verdict without the ripples of the old one, and says so; files of
    the user stay."""
    out = folder / "explained"
    assert read_results(folder).explained is not None
    assert main(["explain", str(folder), "--out", str(out), "--no-figures"]) == 0
    results = read_results(folder)
    assert results.verdict == {} and results.explained is None
    assert any("no ripples" in each for each in results.missing)
    assert names(out) == MINE


def test_diagnose_that_explains_leaves_no_figures_of_an_earlier_verdict(
    folder, monkeypatch, explained
):
    """diagnose without --twin writes a verdict, so that it is as `explain --no-figures` there."""
    monkeypatch.setattr(diagnose, "check_recordings", lambda *_: None)
    out = folder / "explained"
    diagnose_command._twin_of(None, str(out), 1, load_case(folder), (), None)
    assert names(out) == MINE


def test_diagnose_without_figures_leaves_none_of_an_earlier_diagnosis(folder, capsys, monkeypatch):
    """Pictures are named after their recordings: those that the numbers name go with them."""
    answer = SimpleNamespace(entry=DIAGNOSIS | {"state": "healthy"}, numbers=None)
    monkeypatch.setattr(kept_answers, "diagnose_changed", lambda *_: [answer])
    out, twin = folder / "diagnosed", folder / "explained" / "twin.json"
    command = ["diagnose", str(folder), "--out", str(out), "--twin", str(twin), "--no-figures"]
    assert main(command) == 0
    assert read_results(folder).diagnosed == {} and names(out) == MINE


def test_figures_that_are_drawn_take_the_place_of_all_earlier_ones(folder, monkeypatch):
    """An explanation without an effect has no picture of it, and one recording's diagnosis is not
    another's: what is not drawn again goes."""
    monkeypatch.setattr(explained_numbers, "gather", lambda _: made_numbers(found=False))
    drawn = dict.fromkeys(explanation.FIGURES, lambda _: None) | {"place": lambda _: Figure()}
    monkeypatch.setattr(explanation, "FIGURES", drawn)
    explanation.draw(None, folder / "explained", [".svg"])
    assert names(folder / "explained") == MINE | {"explain.json", "explain_place.svg"}
    drawn = dict.fromkeys(fault_posterior.FIGURES, lambda _: Figure())
    monkeypatch.setattr(fault_posterior, "FIGURES", drawn)
    fault_posterior.draw([made_change("other")], folder / "diagnosed", [".svg"])
    new = {"diagnose.json", *(f"diagnose_other_{name}.svg" for name in drawn)}
    assert names(folder / "diagnosed") == MINE | new


@pytest.mark.parametrize("content", ["", "{}", "[1]", '[{"name": 1}]'])
def test_a_spoilt_file_of_numbers_is_replaced(folder, content):
    """What was edited names no pictures; the file goes all the same."""
    file = folder / "diagnosed" / "figures" / "diagnose.json"
    file.write_text(content)
    fault_posterior.remove_figures(folder / "diagnosed")
    assert not file.exists()
