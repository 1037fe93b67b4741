"""The benchmarks start; their results are not tested."""

import ast
import runpy
import sys

import pytest

from paths import ROOT

FOLDER = ROOT / "benchmarks"
SCRIPTS = [path for path in sorted(FOLDER.glob("*.py")) if "__main__" in path.read_text()]


@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_a_benchmark_starts_as_its_docstring_says(script, monkeypatch, capsys):
    """The docstring states the command, and the script, run so with --help, finds all that it
    imports and prints the docstring's first line."""
    docstring = ast.get_docstring(ast.parse(script.read_text()))
    assert f"python benchmarks/{script.name}" in docstring
    monkeypatch.setattr(sys, "argv", [str(script), "--help"])
    monkeypatch.syspath_prepend(str(FOLDER))
    with pytest.raises(SystemExit, match="0"):
        runpy.run_path(str(script), run_name="__main__")
    printed = " ".join(capsys.readouterr().out.split())
    assert docstring.splitlines()[0] in printed
