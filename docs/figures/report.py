"""Picture of a report's first screen: docs/figures/report.png.

    python docs/figures/report.py my_case/report.html

Needs Debian's chromium, and playwright.
"""

from __future__ import annotations

import argparse
import shutil
import tempfile
from pathlib import Path

PICTURE = Path(__file__).with_name("report.png")
WIDTH, HEIGHT = 1180, 1080
FLAGS = ("--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-sync")


def photograph(report: Path, picture: Path = PICTURE) -> None:
    """Write the first screen of a report as PNG."""
    from playwright.sync_api import sync_playwright

    with sync_playwright() as run, tempfile.TemporaryDirectory() as profile:
        browser = run.chromium.launch_persistent_context(
            profile,
            executable_path=shutil.which("chromium"),
            args=list(FLAGS),
            viewport={"width": WIDTH, "height": HEIGHT},
            color_scheme="light",
        )
        page = browser.new_page()
        page.goto(report.resolve().as_uri())
        page.screenshot(path=picture)
        browser.close()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("report", type=Path)
    photograph(parser.parse_args().report)


if __name__ == "__main__":
    main()
