"""Links between pages, and paths that pages name, lead somewhere."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from doc_pages import PAGES, prose_of
from paths import ROOT

FOLDERS = ("src", "tests", "benchmarks", "workflow", "config", "docs", "resources", "profiles")


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


def anchors_of(page: Path) -> set[str]:
    """Anchors of a page's headings, as GitHub makes them."""
    found: set[str] = set()
    for heading in re.findall(r"(?m)^#+ (.*)$", prose_of(page)):
        text = re.sub(r"[`*]|\[([^\]]*)\]\([^)]*\)", r"\1", heading).strip().lower()
        anchor = re.sub(r"[^\w\- ]", "", text).replace(" ", "-")
        number, unique = 0, anchor
        while unique in found:
            number += 1
            unique = f"{anchor}-{number}"
        found.add(unique)
    return found


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_relative_links_and_anchors_exist(page):
    """Every relative link leads to a file, and every anchor to a heading of that file."""
    broken = []
    text = re.sub(r"`[^`\n]*`", "", prose_of(page))
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        if re.match(r"\w+:", target):
            continue
        path, _, anchor = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        if not file.exists():
            broken.append(target)
        elif anchor and anchor not in anchors_of(file):
            broken.append(target)
    assert not broken


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_paths_in_backticks_exist(page):
    """A path that a page writes in backticks, from the repository's root, is there."""
    named = re.findall(r"`([\w./-]+)`", prose_of(page))
    paths = [n for n in named if "/" in n and n.split("/")[0] in FOLDERS]
    assert not [n for n in paths if not (ROOT / n).exists()]


def test_every_page_is_reached_from_the_readme():
    """From README.md, by links alone, a reader comes to every page."""
    reached, new = set(), {ROOT / "README.md"}
    while new:
        page = new.pop()
        reached.add(page)
        for target in re.findall(r"\]\(([^)#\s]+\.md)", prose_of(page)):
            file = (page.parent / target).resolve()
            if file in PAGES and file not in reached:
                new.add(file)
    assert {name_of(p) for p in PAGES} == {name_of(p) for p in reached}


def test_pages_that_the_code_names_exist():
    """A page that a docstring, comment or message of the code names is there."""
    missing = []
    for folder in ("src", "tests", "benchmarks", "workflow", "config", "resources", "profiles"):
        for file in (ROOT / folder).rglob("*"):
            if file.suffix not in (".py", ".smk", ".yaml", ".yml"):
                continue
            for page in re.findall(r"\bdocs/[\w/-]+\.md\b", file.read_text()):
                if not (ROOT / page).exists():
                    missing.append(f"{file.relative_to(ROOT)}: {page}")
    assert not missing
