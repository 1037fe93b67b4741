"""Reference pages agree with the code that they describe."""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import re

import pytest
import yaml

from paths import ROOT
from rippletwin.explanation.verdict.decision import VERDICTS
from rippletwin.twin.effects.library import EFFECTS

REFERENCE = ROOT / "docs" / "reference"
PAGES = sorted(p for p in REFERENCE.parent.rglob("*.md") if "<!-- table:" in p.read_text())


@pytest.fixture(scope="module")
def tables():
    """The script that writes the tables, as a module."""
    spec = importlib.util.spec_from_file_location("tables", REFERENCE / "tables.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def kinds_and_names(page: str) -> list[str]:
    return re.findall(r"<!-- table: (\w+ [\w/:]+) -->", (REFERENCE / page).read_text())


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_tables_are_those_of_the_source(tables, page):
    """Effects, keys, modules and options are as the source has them; else run
    `python docs/reference/tables.py` again."""
    text = page.read_text()
    assert tables.fill(text) == text


def test_every_effect_has_a_section_with_its_table():
    """Headings of the effects' page are the library's names, none missing and none stale, and each
    has its own table."""
    page = (REFERENCE / "effects.md").read_text()
    sections = re.findall(r"(?m)^### (\w+)\n\n<!-- table: effect (\w+) -->$", page)
    assert sorted(EFFECTS) == sorted(name for name, _ in sections)
    assert all(heading == name for heading, name in sections)


def test_every_section_of_rig_yaml_has_its_table():
    """rig_yaml.md has the keys of every section of the schema."""
    schema = yaml.safe_load((ROOT / "src/rippletwin/case/rig.schema.yaml").read_text())
    assert sorted(kinds_and_names("rig_yaml.md")) == sorted(
        f"keys {s}" for s in schema["properties"]
    )


def test_every_package_has_its_table():
    """modules.md lists every package of src/, and rippletwin's room by room."""
    source = ROOT / "src"
    packages = [p.parent for p in source.glob("*/__init__.py")]
    packages += [p.parent for p in source.glob("rippletwin/*/__init__.py")]
    listed = kinds_and_names("modules.md")
    assert sorted(listed) == sorted(f"modules {p.relative_to(source)}" for p in packages)


def test_every_command_has_its_options():
    """command_line.md shows --help of every command of rippletwin."""
    from rippletwin.cli.program import COMMANDS

    listed = kinds_and_names("command_line.md")
    assert {f"help {name}" for name in COMMANDS} <= set(listed)


def test_every_verdict_is_described():
    """verdict_json.md and explain.md have a row for every verdict that there is, and no other."""
    for page in (REFERENCE / "verdict_json.md", ROOT / "docs" / "explanation" / "explain.md"):
        section = page.read_text()
        rows = re.findall(r"(?m)^\| `(\w+)` \| [a-z]", section)
        assert set(VERDICTS) <= set(rows), page


def interfaces() -> list[tuple[str, list[str]]]:
    """(dotted name, parameters) of every row of architecture.md's list of interfaces."""
    page = (ROOT / "docs" / "architecture.md").read_text()
    rows = re.findall(r"(?m)^\| `([\w.]+)\(([^)]*)\)` \|", page)
    return [
        (name, [p.strip() for p in parameters.split(",") if p.strip()]) for name, parameters in rows
    ]


@pytest.mark.parametrize(("name", "parameters"), interfaces(), ids=[n for n, _ in interfaces()])
def test_interfaces_are_those_of_the_source(name, parameters):
    """Every call that architecture.md lists exists, with these parameters in this order; without
    `...` there are no others."""
    module, _, what = name.rpartition(".")
    found = getattr(importlib.import_module(f"rippletwin.{module}"), what)
    own = list(inspect.signature(found).parameters)
    if parameters[-1] == "...":
        assert own[: len(parameters) - 1] == parameters[:-1]
    else:
        assert own == parameters
