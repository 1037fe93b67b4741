"""Accuracy with the recording as the unit, by hand."""

from itertools import product

import numpy as np
import pandas as pd
import pytest
from scipy.stats import beta

from rippletwin.learning.recording_accuracy import (
    exact_interval,
    paired_interval,
    recording_cells,
    recording_rows,
    recording_shares,
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


def test_shares_are_over_seeds(rows):
    """By hand: H is right in 3 and 0 of 4 windows, C in 3 and 4, S in 2 and 3."""
    shares = recording_shares(rows)["cnn1d_3_1", "CFD-MOC-PR"]
    assert shares.to_dict() == {0: 37.5, 1: 87.5, 2: 62.5}


@pytest.mark.parametrize(("right", "below"), [(5, True), (6, False)])
def test_interval_of_yes_and_no_agrees_with_the_sign_test(right, below):
    """Of eleven recordings one network is right on five or six more, all others being equal: the
    sign test has p = 2 of 32 and 2 of 64, the interval's lower end is 0 and above it."""
    low, high = paired_interval(np.array([1.0] * right + [0.0] * (11 - right)))
    assert (low == 0.0) == below and 0.0 <= low < high <= 1.0


def test_interval_is_that_of_all_changes_of_sign():
    """Other way to the same: the means that a test by all 2^8 changes of sign of the differences
    from them does not reject at 5 %."""
    differences = np.random.default_rng(0).normal(1.0, 1.0, 8)
    signs = np.array(list(product((-1, 1), repeat=8)))

    def rejected(mean):
        sums = signs @ (differences - mean)
        largest = np.abs(np.sum(differences - mean)) - 1e-9
        return np.mean(np.abs(sums) >= largest) <= 0.05

    low, high = paired_interval(differences)
    assert not rejected(low + 1e-3) and not rejected(high - 1e-3)
    assert rejected(low - 1e-3) and rejected(high + 1e-3)


@pytest.mark.parametrize("count", [11, 40])
def test_interval_holds_the_mean_as_often_as_it_says(count):
    """800 times recordings of a skewless law: 95 % within three deviations, for all subsets and
    for random ones."""
    rng = np.random.default_rng(count)
    ends = np.array([paired_interval(rng.uniform(-1, 1, count)) for _ in range(800)])
    held = np.mean((ends[:, 0] <= 0) & (ends[:, 1] >= 0))
    assert held == pytest.approx(0.95, abs=3 * np.sqrt(0.95 * 0.05 / 800))


def test_five_recordings_have_no_interval():
    """The least probability that five differences can show is 1 in 32 on either side."""
    assert np.isnan(paired_interval(np.ones(5))).all()
    assert paired_interval(np.ones(6)) == (1.0, 1.0)
    assert np.isnan(paired_interval(np.zeros(0))).all()


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
