"""Tables of a diagnosis trial, on made-up rows; the page and its pictures are written from them."""

import numpy as np
import pytest

from concealed.summary import bin_probabilities
from diagnosed_rigs import made_rows as rows
from diagnosis_trial.figures import draw_detection, draw_figures
from diagnosis_trial.page import report_page
from diagnosis_trial.summary import (
    ANSWERS,
    STATES,
    change_table,
    columns_of,
    confusion_matrix,
    reliability_table,
    score_table,
    severity_table,
    shared_rows,
)


def by_words(table, words):
    """The rate of the one line whose text contains `words`."""
    (line,) = [score for score in table if words in score.what]
    return line.rate


def test_shares_of_the_main_table():
    """Counts of made-up rows, each told beforehand."""
    table = score_table(rows())
    assert (by_words(table, "Healthy again").hits, by_words(table, "Healthy again").count) == (
        1,
        10,
    )
    plain = by_words(table, "change of the ripple 5 % or more")
    assert (plain.hits, plain.count) == (5, 10)  # slippers right, cylinders wrong
    likeliest = by_words(table, "likeliest known state")
    assert (likeliest.hits, likeliest.count) == (5, 10)
    assert by_words(table, "given the name of a known one").share == 0.5
    assert by_words(table, "the line was changed, change".capitalize()).share == 1.0
    assert by_words(table, "95 % intervals").hits == by_words(table, "95 % intervals").count - 1
    assert by_words(table, "each changing the ripple").share == 1.0
    assert by_words(table, "Piston told").share == 1.0


def test_confusion_counts_every_recording_once():
    """The sum is the number of recordings, and a row holds those of its state."""
    made = rows()
    counts = confusion_matrix(made)
    assert counts.sum() == len(made) and counts.shape == (len(STATES), len(ANSWERS))
    assert counts[STATES.index("cylinder"), ANSWERS.index("slipper")] == 10


def test_bins_by_change_and_severity_ratios():
    """Slippers are noticed above 3 %; stated leaks are 1.02 of the true ones but for one rig."""
    bins = {(b.state, b.low): b for b in change_table(rows())}
    assert bins["slipper", 0.0].noticed.share == 0
    assert bins["slipper", 0.05].right.share == 1
    (slipper,) = severity_table(rows())
    assert slipper.median == pytest.approx(np.sqrt(0.8 * 1.3))
    assert slipper.high > 2 and slipper.coverage.count == slipper.coverage.hits + 1


def test_stated_probabilities_are_those_of_known_states():
    """Unlike ones and faults that the tool does not know are left out."""
    table = reliability_table(rows())
    assert sum(b.right.count for b in table) == 10 * 4 - 1
    wrong = next(b for b in table if b.low == 0.8)
    assert wrong.mean == pytest.approx(0.83, abs=0.05)


def test_a_column_is_asked_about_the_states_that_it_has():
    """A network without a state of both leaks states no probability of it: the recordings with both
    are no evidence of its calibration."""
    made = [row | {"states": ["healthy", "slipper", "cylinder"]} for row in rows()]
    assert sum(b.right.count for b in reliability_table(made)) == 10 * 3 - 1


def test_a_probability_that_rounding_takes_beyond_one_counts():
    """Of the sum of two probabilities."""
    (sure,) = bin_probabilities([(1.0 + 1e-10, True), (1.0, True)], (0.999, 1.0))
    assert sure.right.count == 2


def test_who_crashes_has_named_no_fault():
    """Crashed recordings are in neither line of wrong names."""
    crashed = [row | {"told": "crashed", "right": False} for row in rows()]
    table = score_table(crashed)
    assert by_words(table, "given the name of a known one").count == 0
    assert by_words(table, "given the name of a fault").count == 0


def two_columns() -> list[dict]:
    """Besides the rows of all recordings those of a network that knows the first two of a rig."""
    made = rows()
    seen = [row for row in made if row["label"] in ("unknown_00", "unknown_02")]
    return made + [row | {"column": "PRA@nominal", "told": "healthy"} for row in seen]


def test_columns_are_compared_on_the_recordings_that_all_have_answered():
    """A network that answers at one operating point must not be compared with easier ones."""
    found = columns_of(shared_rows(two_columns()))
    assert list(found) == ["anchored@calibrated", "PRA@nominal"]
    labels = [{(row["rig"], row["label"]) for row in made} for made in found.values()]
    assert labels[0] == labels[1] and len(labels[0]) == 20
    every = [len(made) for made in columns_of(two_columns()).values()]
    assert every == [len(rows()), 20]


def test_page_and_pictures_are_written(tmp_path, monkeypatch):
    """Every section has a table; also where next to nothing was recorded. Intervals come from few
    draws."""
    monkeypatch.setattr("diagnosis_trial.detection.RESAMPLED", 20)
    origin = {"commit": "0" * 40, "number": 1000, "not_committed": False}
    for made in (rows(), rows(1)[:1], two_columns()):
        columns = len(columns_of(made))
        page = report_page(made, origin)
        assert page.count("\n## ") == 2 + columns + (columns > 1)
        assert "nan" not in page and "| slipper |" in page
        paths = draw_figures(made, tmp_path)
        assert all(path.stat().st_size > 5000 for path in paths)
        assert len(paths) == 1 + 2 * columns
        assert all(f"figures/{path.name}" in page for path in paths)


def test_many_columns_stand_in_tables_that_fit_on_a_page(monkeypatch):
    """Each column's recordings are counted in one table of scores, each has one curve."""
    monkeypatch.setattr("diagnosis_trial.detection.RESAMPLED", 2)
    names = [f"{method}@{twin}" for method in ("P", "PR", "Q") for twin in ("nominal", "explained")]
    made = [row | {"column": name} for name in names for row in rows()]
    page = report_page(made, {"commit": "0" * 40, "number": 1000, "not_committed": False})
    heads = [line for line in page.splitlines() if line.startswith("| score |")]
    assert [head.count("@") for head in heads] == [4, 2]
    assert all(sum(name in head for head in heads) == 1 for name in names)
    figure = draw_detection(columns_of(made))
    curves = [
        text.get_text() for ax in figure.axes if ax.get_legend() for text in ax.get_legend().texts
    ]
    assert curves == names
