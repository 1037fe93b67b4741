"""How much the answers depend on the processor: one case, explained as on others.

    python benchmarks/processors.py CASE

CASE is explained, and its recordings diagnosed, again and again on the machine at hand, while the
libraries are told to work as on another processor: OpenBLAS with the kernels of one without AVX,
numpy without AVX, and numba with code for any x86-64. Rounding differs then, and with it the
last digits of all sums. Prints whether verdict, effects, support and states stay, and by how much
their numbers move, in shares of half a 95 % interval.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

from rippletwin.case.load import load_case

OPENBLAS = {"OPENBLAS_CORETYPE": "Nehalem"}
NUMPY = {"NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX512_SPR"}
NUMBA = {"NUMBA_CPU_NAME": "generic", "NUMBA_CPU_FEATURES": ""}
VARIANTS = {
    "the same again": {},
    "OpenBLAS as without AVX": OPENBLAS,
    "numpy as without AVX": NUMPY,
    "numba for any x86-64": NUMBA,
    "all three": OPENBLAS | NUMPY | NUMBA,
}


def answer(case: Path, out: Path, variables: dict[str, str], diagnose: bool) -> list[dict]:
    """verdict.json of a case, explained with these environment variables, and diagnosis.json if it
    is to be diagnosed as well."""
    cache = {"NUMBA_CACHE_DIR": str(out / "numba")} if "NUMBA_CPU_NAME" in variables else {}
    command = [sys.executable, "-m", "rippletwin"]
    commands = [[*command, "explain", str(case), "--out", str(out)]]
    if diagnose:
        twin = ["--twin", str(out / "twin.json")]
        commands.append([*command, "diagnose", str(case), "--out", str(out), *twin])
    for each in commands:
        subprocess.run(each, check=True, capture_output=True, env=os.environ | variables | cache)
    files = ("verdict.json", "diagnosis.json")
    return [json.loads((out / file).read_text()) for file, _ in zip(files, commands)]


def compare(answers: list[dict], others: list[dict]) -> tuple[bool, bool, float]:
    """Whether answers are equal to the last digit; whether they say the same; and the largest
    difference of a number with an interval, in shares of half that (nan where they do not)."""
    if _said(answers) != _said(others):
        return False, False, float("nan")
    moved = [
        abs(one["value"] - other["value"]) / (0.5 * (one["ci95"][1] - one["ci95"][0]))
        for one, other in zip(_numbers(answers), _numbers(others))
    ]
    return answers == others, True, max(moved, default=0.0)


def _said(answers: list[dict]) -> list:
    """Verdict, effects, support and equivalents; the state of each recording."""
    verdict = answers[0]
    effects = [(e["name"], e["element"], e["support"]) for e in verdict["effects"]]
    states = [r["state"] for diagnosis in answers[1:] for r in diagnosis["recordings"]]
    return [verdict["verdict"], effects, verdict["equivalents"], states]


def _numbers(answers: list[dict]) -> list[dict]:
    """Every number that has an interval."""
    found = [p for e in answers[0]["effects"] for p in e["parameters"].values()]
    for diagnosis in answers[1:]:
        found += [leak for r in diagnosis["recordings"] for leak in r["severity"].values()]
    return [number for number in found if "ci95" in number]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("case", type=Path, metavar="CASE")
    options = parser.parse_args()
    print(
        "| libraries | to the last digit | verdict, effects, support, states | a number moves by |"
    )
    print("|---|---|---|---|")
    diagnose = bool(load_case(options.case, states={"unknown"}).recordings)
    with TemporaryDirectory() as folder:
        first = answer(options.case, Path(folder) / "first", {}, diagnose)
        for k, (name, variables) in enumerate(VARIANTS.items()):
            again = answer(options.case, Path(folder) / str(k), variables, diagnose)
            equal, agree, moved = compare(first, again)
            size = f"{moved:.1g} of half its interval at most" if agree else "-"
            said = "the same" if agree else "others"
            print(f"| {name} | {'equal' if equal else 'not equal'} | {said} | {size} |", flush=True)


if __name__ == "__main__":
    main()
