"""How long `rippletwin explain` takes for a point, and what takes the time.

    python benchmarks/explain_time.py CASE... [--processes 2]
    python benchmarks/explain_time.py CASE... --profile

Explains one case folder after the other and prints the seconds for each operating point (input
impedances count as one), their median, the 95 % quantile and the largest. Nothing else should run
on the machine.

With --profile one process explains, and what runs is sampled every 5 ms of its processor time. The
first table has the stages of `explain`, the second the functions of rippletwin; a compiled kernel
counts for the function that calls it. The share of the kernels is the bound: without the time of
everything else, explaining would still take as long as they do.
"""

from __future__ import annotations

import argparse
import signal
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType

import numpy as np

from rippletwin.case.load import load_case
from rippletwin.case.model import Case
from rippletwin.explanation.explain import explain

INTERVAL_S = 0.005
SHOWN = 15  # functions
STEPS = {
    "observe_all": "observation of the recordings",
    "prepare_stage": "the twin and the shaft's modulation",
    "search_in_stages": "search",
    "judge_effects": "support of each effect",
    "add_profile_intervals": "intervals by profiles",
    "fit_passive_networks": "passive networks",
    "cross_validate": "cross-validation",
}
"""Function of `explain` -> the step that it is, in words."""
KERNELS = {
    "line.frequency_domain.line_network sweep",
    "line.frequency_domain.orifice_load solve",
    "calibration.reading_errors costs",
    "calibration.whitening __init__",
    "calibration.whitening _remove",
}
"""Functions that call a compiled kernel and do little else."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("cases", nargs="+", type=Path, metavar="CASE")
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--profile", action="store_true", help="in one process")
    options = parser.parse_args()
    cases = [load_case(folder, states={"healthy"}) for folder in options.cases]
    if options.profile:
        print_profile(cases)
    else:
        print_times(cases, options.processes)


def print_times(cases: list[Case], processes: int) -> None:
    """A row for each case, and the summary."""
    seconds = []
    for case in cases:
        began = time.perf_counter()
        explain(case, processes)
        each = (time.perf_counter() - began) / count_points(case)
        print(f"{case.folder}: {count_points(case)} points, {each:.1f} s a point", flush=True)
        seconds.append(each)
    middle, most = np.quantile(seconds, [0.5, 0.95])
    print(
        f"{len(cases)} cases, {processes} processes: median {middle:.1f} s a point, "
        f"95 % within {most:.1f} s, at most {max(seconds):.1f} s"
    )


def count_points(case: Case) -> int:
    """Operating points of the healthy recordings."""
    points = {(r.kind, r.speed_rpm, r.load_pressure) for r in case.healthy}
    return len(points)


def print_profile(cases: list[Case]) -> None:
    """Tables of steps and functions, in shares of the processor time."""
    steps: Counter[str] = Counter()
    functions: Counter[str] = Counter()

    def look(frame: FrameType | None) -> None:
        names = list(walk(frame))
        step = next((STEPS[name] for _, name in names[::-1] if name in STEPS), "the rest")
        steps[step] += 1
        if names:
            functions[" ".join(names[0])] += 1

    with sampled(look):
        for case in cases:
            explain(case, processes=1)
    print_shares("step", steps)
    print_shares("function", functions)
    kernels = sum(functions[name] for name in KERNELS)
    print(f"functions that call a compiled kernel: {kernels / sum(functions.values()):.0%}")


def walk(frame: FrameType | None) -> Iterator[tuple[str, str]]:
    """(module, function) of rippletwin's frames, innermost first."""
    while frame is not None:
        module = frame.f_globals.get("__name__", "")
        if module.startswith("rippletwin."):
            yield module.removeprefix("rippletwin."), frame.f_code.co_name
        frame = frame.f_back


@contextmanager
def sampled(look: Callable[[FrameType | None], None]) -> Iterator[None]:
    """Calls look(frame) after every INTERVAL_S of the process's processor time."""
    before = signal.signal(signal.SIGPROF, lambda number, frame: look(frame))
    signal.setitimer(signal.ITIMER_PROF, INTERVAL_S, INTERVAL_S)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def print_shares(what: str, counts: Counter[str]) -> None:
    """Markdown of the most frequent, per cent of all."""
    print(f"\n| {what} | % |\n|---|---|")
    for name, count in counts.most_common(SHOWN):
        print(f"| {name} | {100 * count / sum(counts.values()):.1f} |")


if __name__ == "__main__":
    main()
