"""Where the numbers of a concealed trial miss: line parameters by segment, intervals of effects.

    python benchmarks/concealed_errors.py TRIAL

TRIAL is the folder of a trial whose seals are open, RESULTS/concealed. Prints how many delays and
impedances are within two stated standard deviations, apart for the first segment and the others and
for data sheets with and without the pump's geometry, every 95 % interval of an effect that misses
the true value, and every effect to which parts of the data give values more than TOLD standard
deviations apart.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import numpy as np

from concealed.names import judge_names
from concealed.score import intervals_hold
from opened_trial import check_opened, open_truth
from rippletwin.case.load import load_case

QUANTITIES = ("delay", "impedance")
TOLD = 3.0


def line_table(trial: Path, rows: list[dict]) -> str:
    """A Markdown table of the corrected line's errors."""
    found: dict[tuple[bool, str, bool], list[tuple[float, float]]] = {}
    for row in rows:
        rig = load_case(trial / "cases" / f"{row['case']:03d}", states=()).rig
        given = set(rig.pump) > {"pistons"}
        for k, error in enumerate(row["line_errors"]["corrected"]):
            is_first = k < len(QUANTITIES)  # segments in turn, each with its two quantities
            errors = found.setdefault((given, error["quantity"], is_first), [])
            errors.append((error["relative"], error["z"]))
    lines = [
        "| pump's geometry | quantity | segment | within two deviations | mean error | rms error |",
        "|---|---|---|---|---|---|",
    ]
    for key in product((True, False), QUANTITIES, (True, False)):
        if key in found:
            (given, quantity, is_first), (relative, z) = key, np.array(found[key]).T
            lines.append(
                f"| {'given' if given else 'not given'} | {quantity} |"
                f" {'first' if is_first else 'others'} | {np.sum(np.abs(z) < 2)} of {len(z)} |"
                f" {100 * relative.mean():+.2f} % | {100 * np.sqrt(np.mean(relative**2)):.2f} % |"
            )
    return "\n".join(lines)


def missed_intervals(trial: Path, rows: list[dict]) -> Iterator[str]:
    """A line for each interval of an effect that misses."""
    for row in rows:
        case = f"{row['case']:03d}"
        truth = open_truth(trial, case)
        verdict = json.loads((trial / "explained" / case / "verdict.json").read_text())
        for effect, claim in judge_names(truth, verdict).found:
            for name, value in effect["parameters"].items():
                alone = effect | {"parameters": {name: value}}
                if intervals_hold(alone, claim) == [False]:
                    stated = claim["parameters"][name]["value"]
                    yield (
                        f"case {row['case']}: {effect['name']} ({effect['element']}), {name}: "
                        f"stated {stated:.3g}, true {value:.3g}, ratio {stated / value:.2f}"
                    )


def disagreements(trial: Path, rows: list[dict]) -> Iterator[str]:
    """A line for each effect with a parameter of more than TOLD deviations between parts of data,
    which says whether the effect is among the wrong names of its case."""
    for row in rows:
        path = trial / "explained" / f"{row['case']:03d}" / "verdict.json"
        for effect in json.loads(path.read_text())["effects"]:
            found = effect.get("disagreement")
            if found is not None and found["deviations"] > TOLD:
                wrong = effect["name"] in row["wrong"].split(" + ")
                yield (
                    f"case {row['case']}: {effect['name']} ({effect['element']}), "
                    f"{effect['support']}{', a wrong name' if wrong else ''}: "
                    f"{found['parameter']} {found['part']:.3g} without {found['left_out']}, "
                    f"{found['whole']:.3g} with it, {found['deviations']:.1f} deviations"
                )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("trial", type=Path, help="folder RESULTS/concealed of an opened trial")
    trial = parser.parse_args().trial
    check_opened(parser, trial)
    rows = json.loads((trial / "rows.json").read_text())
    print(line_table(trial, rows), *missed_intervals(trial, rows), sep="\n")
    print(*disagreements(trial, rows), sep="\n")


if __name__ == "__main__":
    main()
