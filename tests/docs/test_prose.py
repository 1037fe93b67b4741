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
}
"""Word that says nothing to a newcomer -> the term that is used."""


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
