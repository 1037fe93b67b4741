"""The rule that judges claims: intervals against scipy, verdicts by hand, the paper's own table."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.stats import ttest_ind

from paths import ROOT
from rippletwin.learning import paper_claims
from rippletwin.learning.paper_claims import (
    cells_of,
    claims_markdown,
    compare_cells,
    difference_over_recordings,
    judge_claim,
    judge_claims,
    paired_difference,
)
from rippletwin.learning.recording_accuracy import CELL, recording_shares

PAPER = pd.read_csv(ROOT / "resources" / "paper_accuracy.csv")
NONE = PAPER.iloc[:0]
UNSEEN = pd.DataFrame(columns=pd.MultiIndex.from_arrays([[], []], names=CELL))
"""Shares of no recording."""


def summary(values):
    return np.mean(values), np.std(values, ddof=1), len(values)


def test_interval_is_welchs():
    """Other implementation: scipy's interval of the unequal-variance t-test."""
    rng = np.random.default_rng(0)
    a, b = rng.normal(90, 5, 10), rng.normal(80, 15, 7)
    expected = ttest_ind(a, b, equal_var=False).confidence_interval(0.95)
    mean, low, high = paired_difference(summary(a), summary(b))
    np.testing.assert_allclose((low, high), expected)
    assert mean == pytest.approx(a.mean() - b.mean())


def test_no_spread_and_one_seed():
    """Ten equal runs on either side leave no doubt; one run leaves nothing but doubt."""
    assert paired_difference((100, 0, 10), (90, 0, 10)) == (10, 10, 10)
    assert np.isnan(paired_difference((100, 0, 1), (90, 0, 10))[1:]).all()
    assert paper_claims.verdict_of_difference(np.nan, np.nan) == "no interval"


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        ("ssso", "reproduced"),
        ("so", "partly"),
        ("sssx", "partly"),
        ("oox", "not"),
        ("", "untested"),
        ("nn", "untested"),
        ("sn", "reproduced"),
    ],
)
def test_rule(found, expected):
    """The rule's four outcomes: half is no majority, one opposition spoils, and a comparison that
    could not be decided says nothing against a claim."""
    words = {"s": "supports", "o": "open", "x": "opposes", "n": "no interval"}
    assert judge_claim([words[letter] for letter in found]) == expected


def results(accuracies, dataset="CFD-MOC-P"):
    """Tidy rows of networks with given accuracies by seed."""
    return pd.DataFrame(
        dict(architecture=name, dataset=dataset, seed=seed, accuracy=a, accuracy_either=a)
        for name, values in accuracies.items()
        for seed, a in enumerate(values)
    )


def test_made_results_are_judged_as_made():
    """Large kernels far better in time, kernels alike in images: one claim is reproduced, the
    other not; a tenth of a sample decides nothing about the period, eleven pistons do."""
    made = results(
        {
            "cnn1d_341_100": [95, 96, 97],
            "cnn1d_150_50": [60, 61, 62],
            "cnn1d_3_1": [30, 31, 32],
            "cnn2d_3_1": [50, 60, 70],
            "cnn2d_30_3": [51, 61, 69],
        }
    )
    cells = cells_of(made, NONE, UNSEEN)
    compared = compare_cells(cells, UNSEEN)
    table = judge_claims(compared, cells, 3072 / 9).set_index(["claim", "score"]).verdict
    assert table[paper_claims.KERNELS_IN_TIME.text, "strict"] == "reproduced"
    assert table[paper_claims.KERNELS_IN_IMAGES.text, "strict"] == "not"
    assert table[paper_claims.DEPTH.text, "strict"] == "untested"
    assert table[paper_claims.CALIBRATION, "strict"] == "untested"
    assert table[paper_claims.PERIOD, "–"] == "reproduced"
    eleven = judge_claims(compared, cells, 3072 / 11).set_index("claim").verdict
    assert eleven[paper_claims.PERIOD] == "not"


def test_calibration_compares_a_network_with_itself():
    """By hand: 90 on calibrated and 40 on uncalibrated simulations."""
    made = pd.concat(
        [results({"cnn1d_3_1": [90, 90]}), results({"cnn1d_3_1": [40, 40]}, dataset="CFD-P")]
    )
    compared = compare_cells(cells_of(made, NONE, UNSEEN), UNSEEN)
    (row,) = compared.query("score == 'strict'").itertuples()
    assert (row.claim, row.difference, row.worse) == (paper_claims.CALIBRATION, 50, "CFD-P")


def seen(said, dataset="CFD-MOC-P"):
    """Rows of recordings, a row a seed and recording: network -> shares by seed and recording."""
    return pd.DataFrame(
        {"architecture": name, "dataset": dataset, "seed": seed, "recording": f"r{k}", "share": x}
        for name, seeds in said.items()
        for seed, shares in enumerate(seeds)
        for k, x in enumerate(shares)
    )


def test_recordings_are_the_unit():
    """By hand. Two seeds that are each right on all windows of another half of eleven recordings
    are 50 % right on each. 341@100 is right on six recordings that 3@1 misses, and on none of the
    other five: the mean is 6/11, and the claim holds for other recordings (sign test: 2 of 64).
    150@50 misses five of the six: that it is worse by 1/11 may be chance, sure as both seeds are.
    """
    right, missed = [1.0] * 6 + [0.0] * 5, [0.0] * 11
    halves = [[1.0, 0.0] * 5 + [1.0], [0.0, 1.0] * 5 + [0.0]]
    rows = seen(
        {
            "cnn1d_341_100": [right, right],
            "cnn1d_3_1": [missed, missed],
            "cnn1d_150_50": [[0.0] + right[1:], [0.0] + right[1:]],
            "resnet34_1d": halves,
        }
    )
    shares = recording_shares(rows)
    assert (shares["resnet34_1d", "CFD-MOC-P"] == 50.0).all()
    nothing = results({"cnn1d_3_1": [0, 0]})
    cells = cells_of(nothing, NONE, shares)
    compared = compare_cells(cells, shares).query("score == @paper_claims.RECORDINGS")
    table = compared.set_index(["better", "worse"])
    over_3, over_150 = (table.loc["CNN1D (341@100)", f"CNN1D ({k})"] for k in ("3@1", "150@50"))
    assert over_3.difference == pytest.approx(600 / 11) and over_3.verdict == "supports"
    assert over_150.difference == pytest.approx(100 / 11) and over_150.verdict == "open"
    judged = judge_claims(compared, cells, 3072 / 9).set_index(["claim", "score"]).verdict
    assert judged[paper_claims.KERNELS_IN_TIME.text, paper_claims.RECORDINGS] == "partly"


def test_three_recordings_give_no_interval():
    """Networks that differ in all windows of all three recordings: no interval, no verdict, though
    seeds agree to the last window."""
    mean, low, high = difference_over_recordings([100.0] * 3, [0.0] * 3)
    assert mean == 100 and np.isnan([low, high]).all()
    assert paper_claims.verdict_of_difference(low, high) == "no interval"


def test_only_recordings_that_both_have_are_compared():
    """A network that was not asked about the last recording is compared on the other six."""
    both = difference_over_recordings([50.0] * 6 + [np.nan], [20.0] * 7)
    assert both == (30.0, 30.0, 30.0)


def test_the_papers_own_table():
    """Reading the paper's table by this rule: calibration helps beyond doubt and all learn from
    recordings; kernels in time are not a clean sweep, since 3@1 beats 150@50 on CFD-P, but 341@100
    beats 3@1 on two of three datasets with certainty."""
    cells = cells_of(results({"cnn1d_3_1": [1, 2]}), PAPER, UNSEEN)
    compared = compare_cells(cells, UNSEEN)
    table = judge_claims(compared, cells, 3072 / 9).set_index(["claim", "score"]).verdict
    assert table[paper_claims.CALIBRATION, paper_claims.PAPER] == "reproduced"
    assert table[paper_claims.LEARNABLE, paper_claims.PAPER] == "reproduced"
    own = compared[(compared.score == paper_claims.PAPER) & (compared.worse == "CNN1D (3@1)")]
    assert list(own.verdict) == ["open", "supports", "supports"]


def test_comparisons_with_trainings_that_did_not_converge_are_marked():
    """One seed of the better network stopped too soon: its comparison has a mark on the page, and
    the claim's evidence counts it; the other has none."""
    made = results({"cnn1d_341_100": [95, 96], "cnn1d_150_50": [60, 61], "cnn1d_3_1": [30, 31]})
    made["converged"] = [True, True, True, False, True, True]
    cells = cells_of(made, NONE, UNSEEN)
    compared = compare_cells(cells, UNSEEN)
    own = compared[compared.score == "strict"]
    assert dict(zip(own.worse, own.converged)) == {"CNN1D (3@1)": True, "CNN1D (150@50)": False}
    judged = judge_claims(compared, cells, 3072 / 9)
    page = claims_markdown(judged, compared)
    assert "| CNN1D (150@50) | +35.0 † |" in page and "| CNN1D (3@1) | +65.0 |" in page
    assert "; 1 with trainings that did not converge" in page and "convergence rule" in page
    made["converged"] = True
    compared = compare_cells(cells_of(made, NONE, UNSEEN), UNSEEN)
    assert "converge" not in claims_markdown(judge_claims(compared, cells, 3072 / 9), compared)


def test_page_names_every_verdict():
    made = results({"cnn1d_341_100": [95, 96], "cnn1d_3_1": [60, 61]})
    cells = cells_of(made, PAPER, UNSEEN)
    compared = compare_cells(cells, UNSEEN)
    page = claims_markdown(judge_claims(compared, cells, 3072 / 9), compared)
    assert "**reproduced**" in page and "**untested**" in page
    assert "| CNN1D (341@100) | CNN1D (3@1) | +35.0 |" in page
