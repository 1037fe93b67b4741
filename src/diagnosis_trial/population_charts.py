"""A scored trial as charts of a report's page: which leaks are found, and what is told of what."""

from __future__ import annotations

import numpy as np

from diagnosis_trial import detection
from diagnosis_trial.summary import (
    ANSWERS,
    SINGLE,
    STATES,
    columns_of,
    confusion_matrix,
    shared_rows,
)
from rippletwin.case.words import name_state
from rippletwin.report.content import Figure, Population, draw_figures
from rippletwin.report.matrix_picture import draw_matrix
from rippletwin.report.svg import Chart, Series

POINTS = 120  # of a drawn curve


def chart_population(rows: list[dict]) -> Population:
    """Charts of the rows of `diagnosis_trial.score.score_rig`, column by column.

    Over the recordings that all columns have answered.
    """
    columns = columns_of(shared_rows(rows))
    curves = [
        chart
        for name, chosen in columns.items()
        for state in SINGLE
        if (chart := chart_detection(chosen, state, name)) is not None
    ]
    recordings = {(row["rig"], row["label"]) for made in columns.values() for row in made}
    return Population(
        sentence=f"{len(recordings)} recordings of {len({rig for rig, _ in recordings})} virtual "
        "rigs that the tool had not seen. METHOD@TWIN is a method of diagnosis and the twin that "
        "it uses.",
        detection=draw_figures(curves),
        confusion=[draw_confusion(chosen, name) for name, chosen in columns.items()],
    )


def chart_detection(rows: list[dict], state: str, column: str) -> Chart | None:
    """Probability of detection of one leak against the ripple's change, of one column; None without
    such a leak."""
    leaks = detection.detect_leaks(rows, state)
    shown = leaks.shown
    if not len(shown):
        return None
    bins = detection.shares_in_bins(shown, leaks.hit)
    curve = detection.fit_curve(leaks.change, leaks.hit)
    smooth = np.geomspace(shown.min(), shown.max(), POINTS)
    x = np.unique(np.concatenate([smooth, [each.severity for each in bins]]))
    share, ends = np.full(len(x), np.nan), np.full((2, len(x)), np.nan)
    for each in bins:
        at = np.searchsorted(x, each.severity)
        share[at], ends[:, at] = each.rate.share, each.rate.interval
    series = [
        Series("recordings, with 95 % intervals", 100 * share, "measured", "dots", 100 * ends)
    ]
    note = f"{len(shown)} recordings; logarithmic"
    if curve is not None:
        series.insert(0, Series("fitted curve", 100 * curve.probability(x), "calibrated"))
        found = 100 * curve.severity(0.9)
        if 100 * x[0] < found < 100 * x[-1]:
            note = f"{note}; a change of {found:.2g} % is found in 90 % of cases"
    return Chart(
        f"{name_state(state)}, {column}",
        100 * x,
        series,
        "change of the ripple / %",
        "detected / %",
        note=note,
        x_logarithmic=True,
    )


def draw_confusion(rows: list[dict], column: str) -> Figure:
    """What is told of each state in one column; what never occurs is left out."""
    counts = confusion_matrix(rows)
    there, said = counts.any(axis=1), counts.any(axis=0)
    names = [[_short_name(each) for each in every] for every in (STATES, ANSWERS)]
    picture = draw_matrix(
        column,
        [name for name, chosen in zip(names[0], there) if chosen],
        [name for name, chosen in zip(names[1], said) if chosen],
        counts[there][:, said],
    )
    return Figure(column, "rows: true state; columns: told", picture, ())


def _short_name(state: str) -> str:
    return state.replace("_", " ").replace("+", " + ")
