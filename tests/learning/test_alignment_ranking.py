"""Rank correlation against scipy and known tables, alignment tables by hand."""

from __future__ import annotations

import numpy as np
import pandas as pd
import pytest
from scipy.stats import spearmanr

from rippletwin.learning.alignment_ranking import alignment_table, rank_correlation, rank_table


def test_rho_is_scipys():
    """Other implementation, with ties and without."""
    rng = np.random.default_rng(1)
    for values in (rng.standard_normal((2, 9)), rng.integers(4, size=(2, 7))):
        rho, _, low, high = rank_correlation(*values)
        assert rho == pytest.approx(spearmanr(*values).statistic) and low < rho < high


@pytest.mark.parametrize(("n", "expected"), [(3, 2 / 6), (4, 2 / 24), (5, 2 / 120), (6, 2 / 720)])
def test_p_of_perfect_order(n, expected):
    """Combinatorics: of n! orders only the same and the reverse are as far from zero."""
    assert rank_correlation(np.arange(n), np.arange(n) ** 3)[1] == pytest.approx(expected)


def test_drawn_p_agrees_with_the_exact_distribution():
    """Ten networks, rho 0.648: the critical value of the published tables for two-sided 0.05."""
    for seed in range(1000):
        order = np.random.default_rng(seed).permutation(10)
        if abs(spearmanr(np.arange(10), order).statistic - 0.648) < 0.01:
            break
    assert rank_correlation(np.arange(10), order)[1] == pytest.approx(0.05, abs=0.006)


def test_p_values_are_uniform_without_correlation():
    """Under independence a p-value below 0.1 comes in about a tenth of cases, and the interval
    holds zero in about 95 %."""
    rng = np.random.default_rng(0)
    found = np.array([rank_correlation(*rng.standard_normal((2, 7))) for _ in range(200)])
    assert 0.04 <= (found[:, 1] < 0.1).mean() <= 0.17
    assert ((found[:, 2] <= 0) & (found[:, 3] >= 0)).mean() > 0.9


def test_no_order_and_too_few():
    """Equal accuracies have no order; two networks no correlation."""
    assert np.isnan(rank_correlation([1, 2, 3], [5, 5, 5])).all()
    with pytest.raises(ValueError, match="three"):
        rank_correlation([1, 2], [2, 1])


def rows():
    """Three networks of one dataset, two seeds, two faults; alignment 1, 2 and 3 by construction,
    accuracies in the reverse order."""
    shares, results = [], []
    for k, name in enumerate(["cnn1d_341_100", "cnn1d_150_50", "cnn1d_3_1"], start=1):
        for seed in range(2):
            results.append(
                dict(dataset="D", architecture=name, seed=seed)
                | dict(accuracy=100 - 10 * k + seed, accuracy_either=90)
            )
            for fault, region in (("S", 0.1), ("C1", 0.2)):
                shares.append(
                    dict(dataset="D", architecture=name, domain="time", seed=seed, fault=fault)
                    | dict(attended=k * region, region=region, blind=0.0)
                )
    return pd.DataFrame(shares), pd.DataFrame(results)


def test_tables_by_hand():
    """Alignment is the mean ratio; its order opposes accuracy, so rho is -1, the choice is the
    worst network; a score that is the same for all has no rank correlation."""
    table = alignment_table(*rows())
    np.testing.assert_allclose(table.alignment, [1, 2, 3])
    np.testing.assert_allclose(table.attended, [0.15, 0.3, 0.45])
    np.testing.assert_allclose(table.accuracy, [90.5, 80.5, 70.5])
    strict, either = (row for _, row in rank_table(table).iterrows())
    assert strict.rho == -1 and strict.input == "time" and strict.networks == 3
    assert (strict.chosen, strict.chosen_accuracy, strict.best) == ("cnn1d_3_1", 70.5, 90.5)
    assert np.isnan(either.rho) and either["mean"] == 90


def test_a_single_seed_has_no_spread():
    """A run of one seed: its page says 0, not "nan", beside every mean."""
    shares, results = (table[table.seed == 0] for table in rows())
    table = alignment_table(shares, results)
    assert (table[["alignment_std", "accuracy_std", "accuracy_either_std"]] == 0.0).all(axis=None)


def test_inputs_without_attention_do_not_count():
    """A fault that a seed has no evidence for leaves that seed's mean to the other fault."""
    shares, results = rows()
    blind = (shares.architecture == "cnn1d_3_1") & (shares.fault == "S")
    shares.loc[blind, ["attended", "blind"]] = np.nan, 1.0
    table = alignment_table(shares, results)
    assert table.alignment[2] == pytest.approx(3) and table.blind[2] == 0.5
