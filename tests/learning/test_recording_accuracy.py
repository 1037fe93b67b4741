"""Accuracy with the recording as the unit, by hand."""

import pandas as pd
import pytest
from scipy.stats import beta

from rippletwin.learning.recording_accuracy import (
    exact_interval,
    recording_cells,
    recording_rows,
    recording_table,
    severity_table,
)


def answers(said, truth):
    """Four windows of each recording and seed; `said` holds a text a seed and recording."""
    rows = [
        (seed, number, truth[number], word)
        for seed, texts in enumerate(said)
        for number, words in enumerate(texts)
        for word in words.split()
    ]
    return pd.DataFrame(rows, columns=["seed", "recording", "truth", "predicted"])


@pytest.fixture
def rows():
    said = [["H H H S", "C1 C2 H C2", "S S H H"], ["S S S S", "C1 C1 C2 C2", "S S S H"]]
    table = recording_rows(answers(said, ["H", "C", "S"]))
    return table.assign(architecture="cnn1d_3_1", dataset="CFD-MOC-PR")


def test_a_recording_is_right_where_most_windows_are(rows):
    """Either severity counts for a C; half of the windows is not most."""
    assert rows.right.tolist() == [True, True, False, False, True, True]
    assert rows.share.tolist() == [0.75, 0.75, 0.5, 0.0, 1.0, 0.75]
    assert rows.said_C2.tolist()[1] == 0.5


def test_cells_are_over_seeds_and_over_recordings(rows):
    """Two of three right by either seed; all windows together: H 3 of 8, C 7 of 8, S 5 of 8."""
    (cell,) = recording_cells(rows).to_dict("records")
    assert cell["mean"] == pytest.approx(200 / 3) and cell["std"] == pytest.approx(0)
    assert (cell["right"], cell["recordings"]) == (2, 3)
    low, high = exact_interval(2, 3)
    assert (cell["low"], cell["high"]) == (100 * low, 100 * high)


@pytest.mark.parametrize(("right", "count"), [(11, 11), (10, 11), (5, 11)])
def test_interval_is_that_of_clopper_and_pearson(right, count):
    """Against their formula by quantiles of the beta distribution."""
    low, high = exact_interval(right, count)
    assert low == pytest.approx(beta.ppf(0.025, right, count - right + 1))
    expected = 1.0 if right == count else beta.ppf(0.975, right + 1, count - right)
    assert high == pytest.approx(expected)


def test_pages_show_recordings_and_severities(rows):
    """Each recording by its name with the share of right windows, and of C2 for a cylinder."""
    table = recording_table(rows, ["CFD-MOC-PR", "CFD-Q"])
    assert "| CNN1D (3@1) | 67 ± 0 (2 of 3, 9 to 99) | – |" in table
    assert "†" not in table
    page = severity_table(rows, ["CFD-MOC-PR"], ["h", "c", "s"])
    assert "| c | C | 88 (50) |" in page and "| h | H | 38 |" in page


def test_a_cell_whose_trainings_did_not_all_converge_is_marked(rows):
    """The mark is in that cell alone, and a footnote says what it means."""
    rows = pd.concat([rows, rows.assign(dataset="CFD-Q")])
    table = recording_table(rows, ["CFD-MOC-PR", "CFD-Q"], {("cnn1d_3_1", "CFD-Q")})
    assert "| 67 ± 0 (2 of 3, 9 to 99) | 67 ± 0 (2 of 3, 9 to 99) † |" in table
    assert "convergence rule" in table.splitlines()[-1]


def test_unknown_recordings_are_not_scored():
    """Nobody knows what would be right."""
    assert recording_rows(answers([["H H"]], ["?"])).empty
