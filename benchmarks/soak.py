"""Many cases through `explain` and many recordings through `diagnose`, all in one process.

    python benchmarks/soak.py CASE [--cases 200] [--recordings 1000]

CASE has a healthy recording, and one that is to be diagnosed. Each time the case is read from its
files, and its recordings are made larger by one more millionth: no two inputs are the same, so a
cache that keeps what belongs to an input grows. Memory and open descriptors are printed along the
way. The command fails where memory grows by more than 5 % from the first tenth to the last, where a
descriptor stays open, or where the first input, asked again at the end, has another answer.
"""

from __future__ import annotations

import argparse
import gc
import json
import os
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from rippletwin.case.load import load_case
from rippletwin.case.model import Case
from rippletwin.diagnosis.diagnose import diagnose
from rippletwin.diagnosis.diagnosis_file import diagnosis_dict
from rippletwin.explanation.explain import explain
from rippletwin.explanation.verdict.verdict_file import write_verdict
from rippletwin.twin.twin_file import load_twin

MOST_GROWTH = 0.05  # of the memory, from the first tenth to the last
SCALE_STEP = 1e-6  # by which the recordings of an input are larger than those of the one before


def resident_mb() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGESIZE") / 1e6


def descriptors() -> int:
    return len(os.listdir("/proc/self/fd"))


def scaled_case(folder: Path, number: int, **options) -> Case:
    """The case of a folder, its recordings larger by `number` times SCALE_STEP."""
    case = load_case(folder, **options)
    scale = 1.0 + number * SCALE_STEP
    recordings = tuple(replace(r, pressure=scale * r.pressure) for r in case.recordings)
    return replace(case, recordings=recordings)


def soak(what: str, count: int, answer: Callable[[int], str]) -> bool:
    """Ask for the answers 0 to count - 1, and for answer 0 again; prints what it takes, and
    returns whether memory, descriptors and the first answer stay."""
    memory, opened, began = [], [], time.monotonic()
    first = answer(0)
    for number in range(1, count + 1):
        last = answer(number % count)
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
        f"{opened[-1] - opened[0]:+d} descriptors; the first input's answer at the end is "
        f"{'the same' if first == last else 'another'}"
    )
    return bool(after <= (1 + MOST_GROWTH) * before and opened[-1] <= opened[0] and first == last)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("case", type=Path, metavar="CASE")
    parser.add_argument("--cases", type=int, default=200)
    parser.add_argument("--recordings", type=int, default=1000)
    options = parser.parse_args()

    with TemporaryDirectory() as folder:

        def explain_case(number: int) -> str:
            case = scaled_case(options.case, number, states={"healthy"})
            write_verdict(explain(case, processes=1), Path(folder))
            return (Path(folder) / "verdict.json").read_text()

        def diagnose_recording(number: int) -> str:
            case = scaled_case(options.case, number)
            recordings = [r for r in case.recordings if r.state != "healthy"][:1]
            twin = load_twin(Path(folder) / "twin.json")
            return json.dumps(diagnosis_dict(diagnose(case, twin, recordings)))

        flat = soak("explain", options.cases, explain_case)
        flat &= soak("diagnose", options.recordings, diagnose_recording)
    if not flat:
        raise SystemExit("memory, descriptors or answers did not stay as they were")


if __name__ == "__main__":
    main()
