"""Measure the tool's speed beside other programs, and write docs/benchmarks.md.

    python benchmarks/bench.py [--only NAME ...] [--page-only] [--results FOLDER] [--page FILE]

Every benchmark runs in a process of its own, on one thread, and writes NAME.json to FOLDER. The
page and its figure are made from all files there. `make bench` runs this in an environment that has
the other programs.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
ROOT = FOLDER.parent
NAMES = (
    "line_time_domain",
    "line_frequency_domain",
    "calibration",
    "images",
    "training",
    "workflow",
    "explaining",
    "starting",
    "growth",
)
ONE_THREAD = {name: "1" for name in ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")}


def measure(name: str, results: Path, quick: bool) -> bool:
    """Run one benchmark; whether it ended well."""
    paths = [str(FOLDER), str(ROOT / "src"), os.environ.get("PYTHONPATH", "")]
    environment = os.environ | ONE_THREAD | {"PYTHONPATH": os.pathsep.join(filter(None, paths))}
    command = [sys.executable, "-m", "speed.run_one", name, str(results / f"{name}.json")]
    done = subprocess.run([*command, *["--quick"] * quick], env=environment)
    return done.returncode == 0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--only", nargs="+", choices=NAMES, default=NAMES, metavar="NAME",
                        help=f"of {', '.join(NAMES)}")  # fmt: skip
    parser.add_argument("--page-only", action="store_true", help="write the page, measure nothing")
    parser.add_argument("--quick", action="store_true", help="tiny sizes, to see that it runs")
    parser.add_argument("--results", type=Path, default=FOLDER / "results")
    parser.add_argument("--page", type=Path, default=ROOT / "docs" / "benchmarks.md")
    arguments = parser.parse_args()
    arguments.results.mkdir(parents=True, exist_ok=True)
    failed = []
    for name in () if arguments.page_only else arguments.only:
        print(f"{name} ...", flush=True)
        if not measure(name, arguments.results, arguments.quick):
            failed.append(name)
    records = [json.loads(path.read_text()) for path in sorted(arguments.results.glob("*.json"))]
    if records:
        sys.path[:0] = [str(FOLDER), str(ROOT / "src")]
        from speed.page import write

        picture = arguments.page.parent / "figures" / "benchmarks.svg"
        write(records, arguments.page, picture)
        print(f"{arguments.page} and {picture} are written")
    if failed:
        sys.exit(f"failed: {', '.join(failed)}")


if __name__ == "__main__":
    main()
