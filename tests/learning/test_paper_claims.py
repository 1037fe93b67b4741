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
    judge_claim,
    judge_claims,
    paired_difference,
)

PAPER = pd.read_csv(ROOT / "resources" / "paper_accuracy.csv")
NONE = PAPER.iloc[:0]


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
    assert paper_claims.verdict_of_difference(np.nan, np.nan) == "open"


@pytest.mark.parametrize(
    ("found", "expected"),
    [
        ("ssso", "reproduced"),
        ("so", "partly"),
        ("sssx", "partly"),
        ("oox", "not"),
        ("", "untested"),
    ],
)
def test_rule(found, expected):
    """The rule's four outcomes: half is no majority, one opposition spoils."""
    words = {"s": "supports", "o": "open", "x": "opposes"}
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
    cells = cells_of(made, NONE)
    compared = compare_cells(cells)
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
    (row,) = compare_cells(cells_of(made, NONE)).query("score == 'strict'").itertuples()
    assert (row.claim, row.difference, row.worse) == (paper_claims.CALIBRATION, 50, "CFD-P")


def test_the_papers_own_table():
    """Reading the paper's table by this rule: calibration helps beyond doubt and all learn from
    recordings; kernels in time are not a clean sweep, since 3@1 beats 150@50 on CFD-P, but 341@100
    beats 3@1 on two of three datasets with certainty."""
    cells = cells_of(results({"cnn1d_3_1": [1, 2]}), PAPER)
    compared = compare_cells(cells)
    table = judge_claims(compared, cells, 3072 / 9).set_index(["claim", "score"]).verdict
    assert table[paper_claims.CALIBRATION, paper_claims.PAPER] == "reproduced"
    assert table[paper_claims.LEARNABLE, paper_claims.PAPER] == "reproduced"
    own = compared[(compared.score == paper_claims.PAPER) & (compared.worse == "CNN1D (3@1)")]
    assert list(own.verdict) == ["open", "supports", "supports"]


def test_page_names_every_verdict():
    cells = cells_of(results({"cnn1d_341_100": [95, 96], "cnn1d_3_1": [60, 61]}), PAPER)
    compared = compare_cells(cells)
    page = claims_markdown(judge_claims(compared, cells, 3072 / 9), compared)
    assert "**reproduced**" in page and "**untested**" in page
    assert "| CNN1D (341@100) | CNN1D (3@1) | +35.0 |" in page
