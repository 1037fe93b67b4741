"""Shares over all cases, their intervals, and the page."""

import re

import numpy as np
import pytest
from scipy.stats import binom

from concealed.failures import circumstance
from concealed.figures import draw_figures
from concealed.page import report_page
from concealed.summary import (
    CHANGE_EDGES,
    Rate,
    brier_score,
    power_table,
    rate_of,
    reliability_table,
    score_table,
    support_table,
)
from scored_cases import claim, pair_truth, score_example, truth, verdict

ORIGIN = {
    "commit": "0123456789abcdef", "number": 1001, "not_committed": False,
    "checks": [{"truth": "exact solution", "error": 3.0, "allowed": 50.0}],
}  # fmt: skip


@pytest.fixture(scope="module")
def rows():
    """Cases of every kind: right, wrong, missed with and without support of the data."""
    none = truth(kind="none", effects=[], change=0.0)
    outside = truth(kind="outside")
    outside["effects"][0]["name"] = "resonator"
    right = verdict("named", claim("leak", conductance=(1.5, 2.5)))
    scored = [
        score_example(none, verdict("consistent"), held_out=0.0166),
        score_example(none | {"kind": "off"}, verdict("named", claim("leak"))),
        score_example(truth(), verdict("consistent"), 2.0),
        score_example(truth(sensors=3), right, 30.0, 0.0168),
        score_example(pair_truth(), right, 40.0),
        score_example(outside, verdict("named", claim("leak"))),
        score_example(truth(kind="indistinguishable"), right, 30.0),
    ]
    return [{"case": k} | row for k, row in enumerate(scored)]


def test_intervals_of_rates_are_exact():
    """Clopper and Pearson's limits make the observed count just 2.5 % likely on either side, by the
    binomial distribution itself."""
    low, high = Rate(7, 20).interval
    assert binom.sf(6, 20, low) == pytest.approx(0.025)
    assert binom.cdf(7, 20, high) == pytest.approx(0.025)
    assert rate_of([]).interval == (0.0, 1.0) and str(rate_of([])) == "no case"
    assert str(rate_of([True, True])) == "100 % (15.8 to 100 %), 2 of 2"
    assert str(Rate(82, 84)).startswith("97.6 % (")
    assert str(Rate(0, 104)) == "0 % (0 to 3.5 %), 0 of 104"


def test_a_missed_effect_counts_only_where_the_data_support_it(rows):
    """One of two plain single effects is missed: half are named. Its oracle log evidence is below
    the tool's threshold, so of those that the data support all are named."""
    rates = {score.what: score.rate for score in score_table(rows)}
    assert rates["Plain single effects: effect or its class named"] == Rate(1, 2)
    supported = "Plain single effects that the data support: effect or its class named"
    assert rates[supported] == Rate(1, 1)
    assert "do not support" in circumstance(rows[2])
    assert "support" in circumstance(rows[4]) and "not" not in circumstance(rows[4])


def test_supported_effects_add_to_what_is_found_and_to_what_is_wrong():
    """Of two leaks one is established and one supported; beside a third, established one a volume
    that is not there is supported."""
    established, supported = claim("leak"), claim("leak") | {"support": "supported"}
    beside = verdict("named", established, claim("line_volume") | {"support": "supported"})
    none = truth(kind="none", effects=[], change=0.0)
    rows = [
        score_example(truth(), verdict("named", established)),
        score_example(truth(), verdict("unexplained", supported)),
        score_example(truth(kind="outside"), beside),
        score_example(none, verdict("unexplained", supported)),
    ]
    strict, wide = support_table(rows)
    assert (strict.there, wide.there) == (Rate(2, 2), Rate(3, 5))
    assert (strict.right, wide.right) == (Rate(1, 2), Rate(2, 2))
    assert (strict.false_alarms, wide.false_alarms) == (Rate(0, 1), Rate(1, 1))
    assert (strict.misnamed, wide.misnamed) == (Rate(0, 1), Rate(1, 1))
    assert strict.both == Rate(0, 0)


def test_every_kind_counts_in_its_own_scores(rows):
    """Alarms without an effect, pairs, and names outside the library, by hand."""
    rates = {score.what: score.rate for score in score_table(rows)}
    within = "No effect, nominal values within tolerance: established, not there"
    off = "No effect, nominal values 2 to 3 standard deviations off: established, not there"
    assert rates[within] == Rate(0, 1)
    assert rates[off] == Rate(1, 1)
    assert rates["Pairs: at least one effect named, no wrong name"] == Rate(1, 1)
    assert rates["Pairs: both effects named"] == Rate(0, 1)
    assert rates["Effects outside the library: established, not there"] == Rate(1, 1)


def test_established_effects_are_counted_over_all_kinds(rows):
    """Five leaks are established; those where none is concealed and outside the library are not
    there. Both single effects change the ripple by 10 % or more, and one is named."""
    rates = {score.what: score.rate for score in score_table(rows)}
    assert rates["Established effects: truly there"] == Rate(3, 5)
    large = "Single effects that change the ripple by 10 % or more: effect or its class named"
    assert rates[large] == Rate(1, 2)


def test_scores_of_the_twin_are_against_the_truth_and_against_calibration(rows):
    """The verdicts' 2 % of held-out data are 1.205 and 1.19 times those of the two fits begun from
    the truth, and less than a fifth of calibration's 11 %. One of two large single effects is
    named, as the only one; nothing remains where the resonator is."""
    rates = {score.what: score.rate for score in score_table(rows)}
    like_truth = "Held-out misfit at most 1.2 times that of the fit begun from the truth"
    assert rates[like_truth] == Rate(1, 2)
    assert "above that" in circumstance(rows[0]) and "like that" in circumstance(rows[3])
    fifth = "held-out misfit at most a fifth of calibration's"
    assert rates[f"Plain effects outside the library: {fifth}"] == Rate(1, 1)
    place = "Plain effects outside the library that have a place: what remains is there"
    assert rates[place] == Rate(0, 1)
    large = "Single effects that change the ripple by 10 % or more: effect or its class named first"
    assert rates[large] == Rate(1, 2)


def test_bins_hold_every_case_once(rows):
    """Counts over the bins of change and of probability add up to the cases; a probability of one
    lies in the last bin."""
    assert sum(b.alarm.count for b in power_table(rows)) == 3
    assert CHANGE_EDGES[0] == 0.0 and CHANGE_EDGES[-1] == np.inf
    stated = [{"probabilities": [(0.0, False), (0.5, True), (0.97, True), (1.0, True)]}]
    table = reliability_table(stated)
    assert [b.right.count for b in table] == [1, 1, 1, 1] and table[-1].high == 1.0
    assert brier_score(stated) == pytest.approx((0.5**2 + 0.03**2) / 4)


def test_the_page_states_all_cases_every_failure_and_an_interval_with_every_share(rows):
    """A line for each case; the four failures with their sentences and no other case among them;
    every share of cases is followed by its interval."""
    page = report_page(rows, ORIGIN)
    parts = dict(part.split("\n", 1) for part in page.split("\n## ")[1:])
    assert len([line for line in parts["All cases"].splitlines() if line[2:3].isdigit()]) == 7
    failed = [line.split("|")[1:3] for line in parts["Failures"].splitlines() if line[:1] == "|"]
    assert [tuple(map(str.strip, cells)) for cells in failed[2:]] == [
        ("1", "false alarm"), ("2", "not noticed"), ("4", "1 of 2 effects named"),
        ("5", "misnamed"),
    ]  # fmt: skip
    assert parts["Failures"].count("The sentence.") == 4
    shares = re.findall(r"\d+ of \d+ \|", page)
    with_interval = re.findall(r"\d % \([\d.]+ to [\d.]+ %\), \d+ of \d+ \|", page)
    assert len(shares) == len(with_interval) > 20
    assert "nan" not in page


def test_figures_are_drawn_of_few_and_of_no_cases(rows, tmp_path):
    """Every figure is written, also of a trial without single effects."""
    for name, some in (("all", rows), ("none", rows[:1])):
        for path in draw_figures(some, tmp_path / name):
            assert path.stat().st_size > 5000
