"""The documentation renders as a site."""

from __future__ import annotations

import importlib.util
import re

import pytest

from doc_pages import PAGES
from paths import ROOT

pytest.importorskip("material")


@pytest.fixture(scope="module")
def renderer():
    """docs/site_of_docs.py as a module."""
    path = ROOT / "docs" / "site_of_docs.py"
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def site(renderer, tmp_path_factory):
    """The folder of the site, as `make docs-site` renders it."""
    folder = tmp_path_factory.mktemp("site")
    renderer.gather(folder / "source")
    assert renderer.build(folder / "source", folder / "html") == 0
    return folder / "html"


def test_every_page_is_rendered(site):
    """mkdocs accepts every link and anchor, and no page is left out."""
    for page in PAGES:
        path = page.relative_to(ROOT).with_suffix(".html")
        path = path.with_name("index.html") if page.name == "README.md" else path
        assert (site / path).exists(), path


def test_pages_ask_no_other_host(site):
    """Scripts, styles, fonts and pictures are files of the site."""
    for page in site.rglob("*.html"):
        loaded = r"<(?:script|img|link)\b[^>]*\b(?:src|href)=\"?https?:"
        assert not re.search(loaded, page.read_text()), page


def test_a_broken_link_is_refused(renderer, tmp_path, capfd):
    """A link to a heading that is not there ends the rendering, and the message names it."""
    renderer.gather(tmp_path / "source")
    page = tmp_path / "source" / "docs" / "glossary.md"
    page.write_text(page.read_text() + "\n[gone](architecture.md#no-such-heading)\n")
    assert renderer.build(tmp_path / "source", tmp_path / "html") != 0
    assert "no-such-heading" in "".join(capfd.readouterr())
