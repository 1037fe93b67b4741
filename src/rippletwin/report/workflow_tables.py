"""Tables of what a whole run of the workflow adds: accuracies, networks' answers, timings."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path

from rippletwin.case.quantities import write_number
from rippletwin.case.words import name_state
from rippletwin.report.tables import Cell, Table, text

ATTENTION = {
    "simulated": "Where networks look in simulated signals (Grad-CAM), and how much of their "
    "attention is where the fault changes the signal.",
    "recorded": "Where networks look in recorded signals (Grad-CAM), and what they call them.",
}
LETTERS = (
    "H: healthy. S: worn slipper. C1, C2: scratched cylinder block, slightly and severely; C: of "
    "unknown severity."
)


def accuracy_table(
    rows: Sequence[Mapping],
    paper: Mapping[tuple[str, str], tuple[float, float]],
    datasets: Mapping[str, Mapping[str, str]],
) -> Table:
    """Accuracy of every network and dataset in per cent, beside the paper's.

    rows      each with architecture, title, dataset, mean, std, and whether all trainings converged
    paper     mean and standard deviation by (architecture, dataset)
    datasets  the row of config/datasets.tsv of each dataset
    """
    cells = []
    for row in rows:
        theirs = paper.get((row["architecture"], row["dataset"]))
        beside = Cell("", -1.0) if theirs is None else _mean(*theirs)
        ours = _mean(row["mean"], row["std"])
        if not row.get("converged", True):
            ours = ours._replace(text=f"{ours.text}, not all converged")
        cells.append(
            [text(row["title"]), text(describe_dataset(row["dataset"], datasets)), ours, beside]
        )
    columns = ("Network", "Learnt from", "Accuracy / %", "The paper's / %")
    return Table(
        "Accuracy on recordings: mean and standard deviation over seeds",
        columns, (False, False, True, True), cells,
    )  # fmt: skip


def describe_dataset(name: str, datasets: Mapping[str, Mapping[str, str]]) -> str:
    """What networks learnt from, in words, with the dataset's name."""
    row = datasets.get(name)
    if row is None:
        return name
    if row["line"] == "rig":
        return f"recordings of all states ({name})"
    twin, alone = f"{row['twin']} twin", row["line"] == "pipe"
    words = [f"{row['signal']} of the {'pump alone' if alone else twin}"]
    if alone:
        is_flow = row["signal"] == "flow"  # the pump's, whatever the pipe
        words.append(f"recordings through the line of the {twin}" if is_flow else "on a pipe")
    if row["randomised"] == "yes":
        words.append("range of severities")
    if row["anchored"] == "yes":
        words.append("set on the healthy recording")
    return f"{', '.join(words)} ({name})"


def describe_attention(windows: str) -> str:
    """What a picture of the networks' attention to `windows` (simulated, recorded) shows."""
    return f"{ATTENTION[windows]} {LETTERS}"


def answer_table(answers: Mapping[str, Mapping[str, Mapping]]) -> Table:
    """What networks say of recordings of unknown state: label -> network -> answer."""
    cells = [
        [
            text(label),
            text(network),
            text(name_state(said["state"])),
            *(Cell(f"{100 * said[key]:.0f}", said[key]) for key in ("share", "unlike")),
        ]
        for label, networks in answers.items()
        for network, said in networks.items()
    ]
    return Table(
        "Recordings of unknown state, as networks see them",
        ("Recording", "Network", "State", "Windows that say so / %", "Unlike all simulated / %"),
        (False, False, False, True, True),
        cells,
    )


def _mean(mean: float, sd: float) -> Cell:
    if mean != mean:  # nothing was scored
        return Cell("not scored", -1.0)
    return Cell(f"{mean:.1f} ± {sd:.1f}", mean)


def timing_table(folder: str | Path) -> Table:
    """Jobs, seconds and largest memory of each rule, of the benchmark files below `folder`."""
    folder = Path(folder)
    rules: dict[str, list[tuple[float, float]]] = {}
    for path in sorted(folder.rglob("*.tsv")):
        with path.open(newline="") as file:
            for row in csv.DictReader(file, delimiter="\t"):
                rule = path.relative_to(folder).with_suffix("").parts[0]
                rules.setdefault(rule, []).append(
                    (_number(row.get("s")), _number(row.get("max_rss")))
                )
    cells = []
    for rule, jobs in sorted(rules.items(), key=lambda item: -sum(s for s, _ in item[1])):
        seconds, memory = sum(s for s, _ in jobs), max(m for _, m in jobs)
        cells.append(
            [
                text(rule.replace("_", " ")),
                Cell(str(len(jobs)), len(jobs)),
                Cell(write_number(seconds), seconds),
                Cell(f"{memory:.0f}", memory),
            ]
        )
    return Table(
        "Time and memory of the jobs that had ended when this page was made",
        ("Stage", "Jobs", "Seconds, all jobs", "Largest job / MB"),
        (False, True, True, True),
        cells,
    )


def _number(words: str | None) -> float:
    """A number of a benchmark file; 0 where the job was too short to be measured, or has not
    written it yet."""
    try:
        return float(words or "")
    except ValueError:
        return 0.0
