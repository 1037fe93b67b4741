"""Benchmarks start, call what there is to call, and name a missing file; no result is tested."""

import ast
import importlib
import inspect
import runpy
import sys
from types import ModuleType

import pytest

from measured_case import copy_case
from paths import ROOT

FOLDER = ROOT / "benchmarks"
PACKAGES = {path.name for path in (ROOT / "src").iterdir()}
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


def imported(tree: ast.Module) -> dict[str, object]:
    """Name -> what a file imports by it from this repository's packages, late imports included."""
    found = {}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module.split(".")[0] in PACKAGES:
            module = importlib.import_module(node.module)
            for name in node.names:
                if not hasattr(module, name.name):
                    importlib.import_module(f"{node.module}.{name.name}")
                found[name.asname or name.name] = getattr(module, name.name)
    return found


def called(function: ast.expr, names: dict[str, object]) -> object:
    """What an expression calls, if it is an imported name or a function of an imported module."""
    if isinstance(function, ast.Attribute):
        module = called(function.value, names)
        return getattr(module, function.attr) if isinstance(module, ModuleType) else None
    return names.get(function.id) if isinstance(function, ast.Name) else None


@pytest.mark.parametrize("script", sorted(FOLDER.rglob("*.py")), ids=lambda path: path.stem)
def test_a_benchmark_calls_functions_as_they_are_declared(script):
    """No call of a function of src/ lacks an argument or has one too many: a run of a benchmark may
    find out after hours. Calls with stars are left out."""
    tree = ast.parse(script.read_text())
    names = imported(tree)
    for call in (node for node in ast.walk(tree) if isinstance(node, ast.Call)):
        function, keywords = called(call.func, names), {k.arg: k.value for k in call.keywords}
        starred = None in keywords or any(isinstance(each, ast.Starred) for each in call.args)
        if callable(function) and not starred:
            try:
                inspect.signature(function).bind(*call.args, **keywords)
            except TypeError as error:
                pytest.fail(f"{script.name}:{call.lineno}: {ast.unparse(call.func)}: {error}")


def test_a_missing_measurement_is_named(tmp_path):
    """A file that is not there ends a benchmark with its path and where to get it; no case is
    begun."""
    with pytest.raises(SystemExit, match=r"closed_1\.txt: no such file.*where to get the data"):
        copy_case("hole_tube", {"run_1.txt": tmp_path / "closed_1.txt"}, tmp_path / "case")
    assert not (tmp_path / "case").exists()
