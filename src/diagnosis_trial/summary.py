"""Shares over all recordings of a trial, each with its exact confidence interval."""

from collections import Counter
from collections.abc import Callable
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from concealed.summary import ProbabilityBin, Rate, Score, bin_probabilities, rate_of
from diagnosis_trial.score import CHANGED_LINE, LEAK_STATES, OUTSIDE_STATES

CHANGE_EDGES = (0.0, 0.02, 0.05, np.inf)
"""Changes of the ripple between which the state's share of right answers is given."""

PROBABILITY_EDGES = (0.0, 0.5, 0.8, 0.95, 0.99, 0.999, 1.0)
SINGLE = ("slipper", "cylinder")
COMPOUND = "slipper+cylinder"
KNOWN = ("healthy", *LEAK_STATES)
STATES = (*KNOWN, *OUTSIDE_STATES, CHANGED_LINE)
ANSWERS = (*KNOWN, "unlike", "crashed")
PLAIN = 0.05  # change of the ripple from which a state counts as plain
SIDE_BY_SIDE = 4  # columns that a page shows beside each other


def columns_of(rows: list[dict]) -> dict[str, list[dict]]:
    """Column -> its rows, one for each recording that it has answered."""
    columns = dict.fromkeys(row["column"] for row in rows)
    return {name: [row for row in rows if row["column"] == name] for name in columns}


def parts_of_page(columns: dict[str, list[dict]]) -> list[dict[str, list[dict]]]:
    """The columns in their order, SIDE_BY_SIDE at a time."""
    names = list(columns)
    parts = [names[k : k + SIDE_BY_SIDE] for k in range(0, len(names), SIDE_BY_SIDE)]
    return [{name: columns[name] for name in part} for part in parts]


def shared_rows(rows: list[dict]) -> list[dict]:
    """The rows of the recordings that all columns have answered."""
    columns = len({row["column"] for row in rows})
    answers = Counter((row["rig"], row["label"]) for row in rows)
    return [row for row in rows if answers[row["rig"], row["label"]] == columns]


def score_table(rows: list[dict]) -> list[Score]:
    """The main table over the rows of `diagnosis_trial.score.score_rig`."""

    def of(*states: str, where: Callable[[dict], bool] = lambda row: True) -> list[dict]:
        return [row for row in rows if row["state"] in states and where(row)]

    def right(chosen: list[dict]) -> Rate:
        return rate_of(row["right"] for row in chosen)

    def plain(row: dict) -> bool:
        return row["change"] >= PLAIN

    def finished(row: dict) -> bool:  # who crashes has named nothing, and earns nothing by it
        return row["told"] != "crashed"

    return [
        Score("Healthy again: called anything else", "at most 2 %",
              rate_of(not row["right"] for row in of("healthy"))),
        Score("One leak, change of the ripple 5 % or more: state right", "at least 98 %",
              right(of(*SINGLE, where=plain))),
        Score("One leak, change from 2 to 5 %: state right", "at least 90 %",
              right(of(*SINGLE, where=lambda row: 0.02 <= row["change"] < PLAIN))),
        Score("One leak, change below 2 %: state right", "",
              right(of(*SINGLE, where=lambda row: row["change"] < 0.02))),
        Score("One leak, change 5 % or more: likeliest known state right, unlike or not", "",
              rate_of(row["likeliest"] == row["state"] for row in of(*SINGLE, where=plain))),
        Score("Both leaks, each changing the ripple by 2 % or more: both named", "at least 90 %",
              right(of(COMPOUND, where=lambda row: row["weakest"] >= 0.02))),
        Score("Both leaks, all severities: both named", "", right(of(COMPOUND))),
        Score("95 % intervals of leak areas, state right: true area inside", "92 to 97 %",
              rate_of(covers(pair) for row in rows if row["right"] for pair in row["severities"])),
        Score("Faults that the tool does not know: given the name of a known one", "at most 10 %",
              rate_of(row["told"] in LEAK_STATES for row in of(*OUTSIDE_STATES, where=finished))),
        Score("The same, change 5 % or more: called unlike", "",
              right(of(*OUTSIDE_STATES, where=plain))),
        Score("The line was changed, change 5 % or more: called unlike", "",
              right(of(CHANGED_LINE, where=plain))),
        Score("The line was changed: given the name of a fault", "",
              rate_of(row["told"] in LEAK_STATES for row in of(CHANGED_LINE, where=finished))),
        Score("Piston told of one leak that is named: right", "",
              rate_of(row["piston_right"] for row in of(*SINGLE)
                      if row["right"] and row["piston_right"] is not None)),
        Score("One leak, state right: piston told", "",
              rate_of(row["piston_right"] is not None for row in of(*SINGLE) if row["right"])),
    ]  # fmt: skip


def covers(severity: dict) -> bool:
    """Whether a stated 95 % interval of a leak area holds the true one."""
    return severity["low"] <= severity["true"] <= severity["high"]


class ChangeBin(NamedTuple):
    """Recordings of one state whose change of the ripple lies between `low` and `high`."""

    state: str
    low: float
    high: float
    right: Rate
    noticed: Rate


def change_table(rows: list[dict]) -> list[ChangeBin]:
    """Share right, and share not called healthy, by the change of the ripple; no empty bins."""
    return [
        ChangeBin(
            state,
            low,
            high,
            rate_of(row["right"] for row in inside),
            rate_of(row["told"] not in ("healthy", "crashed") for row in inside),
        )
        for state in STATES[1:]
        for low, high in pairwise(CHANGE_EDGES)
        if (inside := [r for r in rows if r["state"] == state and low <= r["change"] < high])
    ]


def confusion_matrix(rows: list[dict]) -> np.ndarray:
    """Numbers of recordings (STATES, ANSWERS)."""
    counts = np.zeros((len(STATES), len(ANSWERS)), dtype=int)
    for row in rows:
        counts[STATES.index(row["state"]), ANSWERS.index(row["told"])] += 1
    return counts


class SeverityErrors(NamedTuple):
    """Stated over true leak areas of a fault: median, 5 and 95 % quantile; intervals that hold."""

    fault: str
    median: float
    low: float
    high: float
    coverage: Rate


def severity_table(rows: list[dict]) -> list[SeverityErrors]:
    """Of recordings whose state is right."""
    table = []
    for fault in SINGLE:
        found = [
            s for row in rows if row["right"] for s in row["severities"] if s["fault"] == fault
        ]
        if found:
            ratio = np.quantile([s["value"] / s["true"] for s in found], [0.5, 0.05, 0.95])
            table.append(SeverityErrors(fault, *map(float, ratio), rate_of(map(covers, found))))
    return table


def reliability_table(rows: list[dict]) -> list[ProbabilityBin]:
    """Recordings in a state that the column knows by the probability of the state that it names.
    Those that are called unlike state no probability."""
    stated = [
        (row["probability"], row["right"])
        for row in rows
        if row["state"] in row["states"] and row["probability"] is not None
    ]
    return bin_probabilities(stated, PROBABILITY_EDGES)
