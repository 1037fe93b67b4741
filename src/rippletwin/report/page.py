"""The page as one HTML file that requests nothing and runs no script but its own."""

from __future__ import annotations

import base64
import hashlib
from functools import cache
from importlib.resources import files
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined, Template
from markupsafe import Markup

from rippletwin import store
from rippletwin.report.content import Page, WorkflowPart, make_page
from rippletwin.report.results import Results, read_results, refuse_foreign

TEMPLATES = "templates"


@cache
def _page_template() -> Template:
    """The page's template, compiled."""
    environment = Environment(
        loader=PackageLoader("rippletwin.report", TEMPLATES),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("page.html")


def render(page: Page) -> str:
    """The page as HTML; everything that is not a drawing of ours is escaped."""
    folder = files("rippletwin.report") / TEMPLATES
    script, style = ((folder / name).read_text() for name in ("page.js", "page.css"))
    # The browser runs this script and no other, wherever it may come from.
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return _page_template().render(
        page=page, script=Markup(script), style=Markup(style), script_hash=f"sha256-{digest}"
    )


def report_case(
    case_folder: str | Path,
    path: str | Path,
    explained: str | Path | None = None,
    diagnosed: str | Path | None = None,
) -> Path:
    """Write the report of the case and the results in its folders, as `read_results` finds them."""
    return write_report(read_results(case_folder, explained, diagnosed), path)


def write_report(results: Results, path: str | Path, workflow: WorkflowPart | None = None) -> Path:
    """Write the report of results to a file, whole or not at all; returns its path.

    Raises InputError where a result is not as the commands write it.
    """
    with refuse_foreign(results.case.folder):
        page = render(make_page(results, workflow))
    return store.write_text(path, page)
