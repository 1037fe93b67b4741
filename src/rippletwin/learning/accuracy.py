"""Accuracy of classifiers on recordings.

Recordings are healthy (H), slipper (S) or cylinder (C) of unknown severity, while the classifiers
know two severities, C1 and C2. The paper counts a cylinder recording as right when a pressure
classifier calls it C1 and a flow classifier C2; here that mapping is an argument, and accuracy with
either severity is reported beside it.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from rippletwin.learning.architectures import ARCHITECTURES, CLASSES
from rippletwin.learning.dataset import UNKNOWN

TRUE_STATES = ("H", "S", "C")
SEVERITY = {"pressure": "C1", "flow": "C2"}  # the class that the paper counts as right for C


def score(
    truth: np.ndarray,
    predicted: np.ndarray,
    signal: str,
    severity: dict[str, str] | None = SEVERITY,
) -> dict[str, float | np.ndarray]:
    """Accuracies (fractions) of predictions on recordings.

    truth : (n,) states of the recordings, of ``TRUE_STATES`` (C1 or C2 where severity is known).
        Windows of state ``UNKNOWN`` do not count.
    predicted : (n,) indices into ``CLASSES``.  signal : a key of ``severity``; where that is None,
        either severity is right: the rule for networks that learnt a range of severities.

    Returns ``accuracy`` (the paper's scoring), ``accuracy_either`` (C1 and C2 both right for a C),
    ``confusion`` (3, 4) counts and ``n``, the windows that count; the accuracies are NaN where
    none does. Raises ValueError for a state that is none of these, or for no window at all.
    """
    truth, predicted = np.asarray(truth, dtype=str), np.asarray(predicted)
    if truth.shape != predicted.shape or not truth.size:
        raise ValueError(f"{truth.shape} states for {predicted.shape} predictions")
    truth, predicted = truth[truth != UNKNOWN], predicted[truth != UNKNOWN]
    if not truth.size:
        nothing = np.zeros((len(TRUE_STATES), len(CLASSES)), dtype=int)
        return {"accuracy": np.nan, "accuracy_either": np.nan, "confusion": nothing, "n": 0}
    said = np.array(CLASSES)[predicted]
    cylinder = np.isin(truth, ("C", "C1", "C2"))
    either = np.where(cylinder, np.isin(said, ("C1", "C2")), said == truth)
    strict = either
    if severity is not None:
        strict = said == np.where(truth == "C", severity[signal], truth)
    return {
        "accuracy": float(strict.mean()),
        "accuracy_either": float(either.mean()),
        "confusion": count_confusions(truth, predicted),
        "n": truth.size,
    }


def count_confusions(truth: np.ndarray, predicted: np.ndarray) -> np.ndarray:
    """Counts (3 true states, 4 predicted classes); C1 and C2 of known severity count as C."""
    truth = np.asarray(truth, dtype=str)
    counts = np.zeros((len(TRUE_STATES), len(CLASSES)), dtype=int)
    unknown = set(truth) - {*TRUE_STATES, *CLASSES}
    if unknown:
        raise ValueError(f"unknown states {sorted(unknown)}; known are H, S, C, C1, C2")
    row = np.array([TRUE_STATES.index(state[0]) for state in truth], dtype=int)
    np.add.at(counts, (row, predicted), 1)
    return counts


def result_row(architecture: str, dataset: str, seed: int, scored: dict, history=None) -> dict:
    """One training's line of the tidy results table; accuracies in per cent.

    Confusion counts become columns ``H_H`` (true_predicted) and so on; ``history`` (of ``train``)
    adds how the training ended.
    """
    row = {
        "domain": ARCHITECTURES[architecture].domain,
        "architecture": architecture,
        "dataset": dataset,
        "seed": seed,
        "accuracy": 100 * scored["accuracy"],
        "accuracy_either": 100 * scored["accuracy_either"],
        "windows": scored["n"],
    }
    for i, true in enumerate(TRUE_STATES):
        for j, said in enumerate(CLASSES):
            row[f"{true}_{said}"] = int(scored["confusion"][i, j])
    if history is not None:
        row |= {
            "epochs": history.epochs,
            "converged": history.converged,
            "validation_loss": history.best_loss,
            "validation_accuracy": 100 * history.best_accuracy,
        }
    return row


def confusion_of(rows: pd.DataFrame) -> np.ndarray:
    """The (3, 4) confusion counts of tidy rows, summed."""
    counts = [[rows[f"{true}_{said}"].sum() for said in CLASSES] for true in TRUE_STATES]
    return np.array(counts, dtype=int)


def summarise(rows: pd.DataFrame, column: str = "accuracy") -> pd.DataFrame:
    """Mean, standard deviation (of the sample; 0 for one run) and runs of each table cell, and
    whether all its trainings ``converged``.

    A cell whose windows are all of unknown state has a mean of NaN and no runs. Rows that do not
    say how their training ended count as converged.
    """
    rows = rows if "converged" in rows else rows.assign(converged=True)
    cells = rows.groupby(["architecture", "dataset"], sort=False)
    table = cells[column].agg(["mean", "std", "count"])
    table["converged"] = cells["converged"].agg(lambda ended: ended.ne(False).all())
    return table.reset_index().fillna({"std": 0.0})
