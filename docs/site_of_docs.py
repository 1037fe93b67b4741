"""Render the documentation: .site/html/index.html.

    python docs/site_of_docs.py

Pages link to each other and to files of the repository by relative paths, README.md and config/
included. mkdocs takes one folder of pages, so all of them and the files that they link to are
gathered in .site/source, in the places that they have in the repository. `mkdocs build --strict`
then refuses a link or an anchor that leads nowhere, and a page that is not in mkdocs.yml.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SITE = ROOT / ".site"


def pages() -> list[Path]:
    """The pages of the documentation, relative to the repository's root."""
    single = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "config/README.md"]
    inside = sorted(path.relative_to(ROOT) for path in (ROOT / "docs").rglob("*.md"))
    return [*map(Path, single), *inside]


def linked_files(page: Path) -> set[Path]:
    """Files of the repository, no pages, that a page links to or shows."""
    found = set()
    for target in re.findall(r"\]\(([^)\s#]+)", (ROOT / page).read_text()):
        path = ((ROOT / page).parent / target).resolve()
        if path.is_file() and path.suffix != ".md" and path.is_relative_to(ROOT):
            found.add(path.relative_to(ROOT))
    return found


def gather(source: Path) -> None:
    """Copy all pages and what they link to into an empty folder."""
    shutil.rmtree(source, ignore_errors=True)
    for path in {*pages(), *(file for page in pages() for file in linked_files(page))}:
        (source / path).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / path, source / path)


def build(source: Path, site: Path) -> int:
    """Render the pages below `source` into `site`; the exit code is not 0 at a broken link."""
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", site]
    settings = {"SITE_SOURCE": str(source), "NO_MKDOCS_2_WARNING": "1"}
    return subprocess.run(command, cwd=ROOT, env=os.environ | settings).returncode


if __name__ == "__main__":
    gather(SITE / "source")
    sys.exit(build(SITE / "source", SITE / "html"))
