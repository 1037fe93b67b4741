"""What the wheel asks for: all that src/ imports, and Snakemake only as an extra."""

import ast
import os
import re
import shutil
import subprocess
import sys
import tomllib
from email import message_from_string

import pytest

from paths import ROOT

DISTRIBUTION = {"yaml": "pyyaml", "pywt": "pywavelets"}
"""Import name -> name of the distribution, where they differ beyond case."""
SOURCES = list((ROOT / "src").rglob("*.py"))
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def name_of(requirement: str) -> str:
    """Name of a requirement in lower case, without extras, version and marker."""
    return re.match(r"[\w.-]+", requirement)[0].lower()


def imported_by(path) -> set[str]:
    """Distributions whose modules a source file imports."""
    own = {folder.name for folder in (ROOT / "src").iterdir()}
    found = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            found |= {name.name.split(".")[0] for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            found.add(node.module.split(".")[0])
    found -= own | set(sys.stdlib_module_names)
    return {DISTRIBUTION.get(name, name).lower() for name in found}


def imported() -> set[str]:
    """Distributions whose modules src/ imports."""
    return set().union(*map(imported_by, SOURCES))


def of_extras() -> set:
    """The readers whose library is an extra; the registry tells when it is not installed."""
    from rippletwin.case.readers.registry import EXTRAS

    return {ROOT / "src/rippletwin/case/readers" / f"{name}.py" for name in EXTRAS}


def test_dependencies_are_what_the_source_imports():
    """A module imported without a requirement would fail after a bare install; a requirement that
    nothing imports would be installed for nothing. The libraries of some readers are extras."""
    base = {name_of(each) for each in PROJECT["dependencies"]}
    readers = {name_of(each) for each in PROJECT["optional-dependencies"]["readers"]}
    assert base | readers == imported() and not base & readers
    others = set().union(*(imported_by(path) for path in SOURCES if path not in of_extras()))
    assert readers.isdisjoint(others)


def test_every_requirement_is_pinned():
    """environment.txt has a pin for each requirement, extras included, that satisfies it."""
    requirements = pytest.importorskip("packaging.requirements")
    lines = (ROOT / "environment.txt").read_text().splitlines()
    pins = dict(line.lower().split("==") for line in lines if "==" in line)
    extras = PROJECT["optional-dependencies"]
    wanted = [*PROJECT["dependencies"], *extras["workflow"], *extras["readers"], *extras["dev"]]
    for each in map(requirements.Requirement, wanted):
        if each.name != PROJECT["name"]:
            assert each.specifier.contains(pins[each.name.lower()]), each


def test_wheel_needs_no_snakemake(tmp_path):
    """The metadata that setuptools writes into the wheel list Snakemake under an extra alone, and
    NumPy as a base requirement."""
    pytest.importorskip("setuptools")
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, tmp_path)
    shutil.copytree(ROOT / "src" / "rippletwin" / "cli", tmp_path / "src" / "rippletwin" / "cli")
    (tmp_path / "src" / "rippletwin" / "__init__.py").touch()
    code = "from setuptools.build_meta import *; prepare_metadata_for_build_wheel('made')"
    (tmp_path / "made").mkdir()
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=tmp_path, env=dict(os.environ), capture_output=True
    )
    assert done.returncode == 0, done.stderr.decode()
    (path,) = (tmp_path / "made").glob("*.dist-info/METADATA")
    requires = message_from_string(path.read_text()).get_all("Requires-Dist")
    base = {name_of(each) for each in requires if "extra ==" not in each}
    assert "numpy" in base and not any("snake" in name for name in base)
    assert any(name_of(each) == "snakemake" for each in requires)
