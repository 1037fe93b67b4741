"""Many cases through `explain` and many recordings through `diagnose`, all in one process.

    python benchmarks/soak.py CASE [--cases 200] [--recordings 1000]

CASE has a healthy recording, and one that is to be diagnosed. The same case is read, explained and
its recording diagnosed again and again, from the files to the answer. Memory and open descriptors
are printed along the way. The command fails where memory grows by more than 5 % from the first
tenth to the last, where a descriptor stays open, or where the last answer is not the first.
"""

from __future__ import annotations

import argparse
import gc
import json
import os
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from rippletwin.case.load import load_case
from rippletwin.diagnosis.diagnose import diagnose
from rippletwin.diagnosis.diagnosis_file import diagnosis_dict
from rippletwin.explanation.explain import explain
from rippletwin.explanation.verdict.verdict_file import write_verdict
from rippletwin.twin.twin_file import load_twin

MOST_GROWTH = 0.05  # of the memory, from the first tenth to the last


def resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGESIZE") / 1e6


def descriptors() -> int:
    return len(os.listdir("/proc/self/fd"))


def soak(what: str, count: int, answer: Callable[[], str]) -> bool:
    """Ask `count` times; prints what it takes, and returns whether memory, descriptors and answers
    stay."""
    memory, opened, first, began = [], [], None, time.monotonic()
    for number in range(1, count + 1):
        last = answer()
        first = first or last
        gc.collect()
        memory.append(resident_mb())
        opened.append(descriptors())
        if number % max(count // 10, 1) == 0:
            print(
                f"{what} {number} of {count}: {memory[-1]:.1f} MB, {opened[-1]} descriptors, "
                f"{time.monotonic() - began:.0f} s",
                flush=True,
            )
    tenth = max(count // 10, 1)
    before, after = np.median(memory[:tenth]), np.median(memory[-tenth:])
    half = memory[count // 2 :]
    slope = np.polyfit(np.arange(len(half)), half, 1)[0] if len(half) > 1 else 0.0
    print(
        f"{what}: {before:.1f} MB in the first tenth, {after:.1f} MB in the last "
        f"({after / before - 1:+.1%}), {1e3 * slope:+.1f} kB each in the second half; "
        f"{opened[-1] - opened[0]:+d} descriptors; first and last answer "
        f"{'equal' if first == last else 'differ'}"
    )
    return bool(after <= (1 + MOST_GROWTH) * before and opened[-1] <= opened[0] and first == last)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("case", type=Path, metavar="CASE")
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--recordings", type=int, default=1000)
    options = parser.parse_args()

    with TemporaryDirectory() as folder:

        def explain_case() -> str:
            case = load_case(options.case, states={"healthy"})
            write_verdict(explain(case, processes=1), Path(folder))
            return (Path(folder) / "verdict.json").read_text()

        def diagnose_recording() -> str:
            case = load_case(options.case)
            recordings = [r for r in case.recordings if r.state != "healthy"][:1]
            twin = load_twin(Path(folder) / "twin.json")
            return json.dumps(diagnosis_dict(diagnose(case, twin, recordings)))

        flat = soak("explain", options.cases, explain_case)
        flat &= soak("diagnose", options.recordings, diagnose_recording)
    if not flat:
        raise SystemExit("memory, descriptors or answers did not stay as they were")


if __name__ == "__main__":
    main()
