"""The documentation uses the words of its glossary, and none of those they replaced."""

from __future__ import annotations

import re

import pytest

from doc_pages import PAGES, prose_of
from paths import ROOT

REPLACED = {
    "valley": "local mode",
    "swallow": "absorb",
    r"seats?": "position",
    "beyond proportion": "nonlinear compliance",
    "blind to": "source-free",
    "one who knows": "oracle log evidence",
    "no real line is without": "always present",
    "goes on where": "identifies missing physics",
    "at every place it can be": "at each location",
    "as it then was": "blind tests of versions",
    "gave a name to": "identified",
    "has not got": "outside the library",
    "held anew": "iterated",
    "worth less than chance": "undetectable",
    "concealed twice": "the design of the trial",
    "in true metres": "actual position",
    "amplitude is the diagnosis": "amplitude carries the fault information",
    "has to pull": "deviation from the data sheet",
}
"""Words that say nothing to a newcomer -> the term that is used."""


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_words_are_those_of_the_glossary(page):
    """No page has a word that the glossary's terms replaced. Tables made from the source are the
    source's own matter."""
    text = re.sub(r"<!-- (table|output): .*?<!-- end -->", "", prose_of(page), flags=re.S)
    found = [f"{w} -> {t}" for w, t in REPLACED.items() if re.search(rf"(?i)\b{w}\b", text)]
    assert not found


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_no_page_names_a_place_on_a_machine(page):
    """Paths are relative to the repository or to the reader's folder."""
    assert not re.findall(r"(?<![\w.])(/tmp|/home|/root|/work|\.\./shared)\b", page.read_text())


def test_the_readme_says_at_once_what_a_newcomer_asks():
    """Its first screen, before any heading: what it does, for whom, what it needs, what comes out,
    how long it takes, and the picture of a report. The table behind it says how many sensors and
    points, which bandwidth, and what must be known of the pump."""
    readme = (ROOT / "README.md").read_text()
    screen, *sections = readme.split("\n## ")
    for question in ("What it does", "For whom", "What it needs", "What you get", "How long"):
        assert f"| **{question}" in screen
    (picture,) = re.findall(r"!\[.*?\]\((.*?)\)", screen)
    assert (ROOT / picture).is_file()
    needs = next(section for section in sections if section.startswith("What it needs"))
    for row in ("pressure sensors", "operating points", "recording", "bandwidth", "pump"):
        assert f"\n| {row} |" in needs
