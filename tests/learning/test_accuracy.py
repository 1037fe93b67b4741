"""The paper's scoring on cases decided by hand, and the paper's table against its source."""

from __future__ import annotations

import re

import numpy as np
import pandas as pd
import pytest

from paths import ROOT
from rippletwin.learning.accuracy import (
    confusion_of,
    count_confusions,
    result_row,
    score,
    summarise,
)
from rippletwin.learning.architectures import ARCHITECTURES, CLASSES
from rippletwin.learning.tables import accuracy_table, answer_table, cost_table
from rippletwin.learning.training import History
from rippletwin.report.workflow_tables import accuracy_table as page_table

PAPER = pd.read_csv(ROOT / "resources" / "paper_accuracy.csv")
H, S, C1, C2 = range(4)


def test_a_cylinder_is_c1_for_pressure_and_c2_for_flow():
    """By hand: of three cylinder windows called C1, C1, C2, pressure has two right and flow one;
    either severity has all three."""
    truth, said = ["C", "C", "C", "H"], [C1, C1, C2, H]
    pressure, flow = score(truth, said, "pressure"), score(truth, said, "flow")
    assert (pressure["accuracy"], flow["accuracy"]) == (0.75, 0.5)
    assert pressure["accuracy_either"] == flow["accuracy_either"] == 1.0


def test_the_mapping_is_an_argument():
    """The strict alternative for a rig whose severity is known: flow scored as C1."""
    assert score(["C", "C"], [C1, C2], "flow", {"flow": "C1"})["accuracy"] == 0.5
    assert score(["C", "C"], [C1, C1], "flow", {"flow": "C1"})["accuracy"] == 1.0


def test_known_severities_are_held_to_theirs():
    """A window known to be C2 is wrong as C1, right with either severity."""
    scored = score(["C2", "C1"], [C1, C1], "pressure")
    assert (scored["accuracy"], scored["accuracy_either"]) == (0.5, 1.0)


def test_a_healthy_pump_called_cylinder_is_wrong_in_both_scores():
    """False alarms and missed faults never count, whatever the severity."""
    scored = score(["H", "S", "C"], [C1, C2, S], "pressure")
    assert scored["accuracy"] == scored["accuracy_either"] == 0


def test_always_guessing_one_class_scores_a_third():
    """The paper's 33.3 +- 0.00: one class out of three of equal size."""
    truth = np.repeat(["H", "S", "C"], 160)
    for label, right in ((H, 1 / 3), (S, 1 / 3), (C1, 1 / 3), (C2, 0)):
        assert score(truth, np.full(480, label), "pressure")["accuracy"] == pytest.approx(right)


def test_confusion_counts():
    """By hand, three true states against four classes; known severities join C."""
    counts = count_confusions(["H", "H", "S", "C", "C2"], [H, C1, S, C2, C1])
    np.testing.assert_array_equal(counts, [[1, 0, 1, 0], [0, 1, 0, 0], [0, 0, 1, 1]])


def test_unknown_states_and_nothing_are_refused():
    """A misspelt state or an empty set is an error, not an accuracy."""
    with pytest.raises(ValueError, match="unknown states"):
        score(["X"], [H], "pressure")
    with pytest.raises(ValueError, match="predictions"):
        score([], [], "pressure")


def test_windows_of_unknown_state_are_not_scored():
    """Half the windows known: accuracy is that of the known half; none known: no number at all,
    and a dash in the table rather than a zero."""
    scored = score(["H", "?", "S", "?"], [H, S, H, H], "pressure")
    assert scored["accuracy"] == 0.5 and scored["n"] == 2 and scored["confusion"].sum() == 2
    nothing = score(["?", "?"], [H, S], "pressure")
    assert np.isnan(nothing["accuracy"]) and nothing["n"] == 0
    rows = pd.DataFrame([result_row("cnn1d_3_1", "CFD-Q", 0, nothing)])
    table = accuracy_table(rows, PAPER.iloc[:0], ["CFD-Q"])
    assert "nan" not in table and "–" in table.splitlines()[4]
    assert confusion_of(rows).sum() == 0


def test_predictions_are_shares_of_windows_and_seeds():
    """By hand: two seeds, two windows, three predictions S and one C2."""
    answers = pd.DataFrame(
        {
            "recording": "unknown.csv",
            "dataset": "CFD-Q",
            "architecture": "cnn1d_3_1",
            "predicted": ["S", "S", "C2", "S"],
        }
    )
    title = ARCHITECTURES["cnn1d_3_1"].title
    line = f"| unknown.csv | CFD-Q | {title} | 4 | 0 | 75 | 0 | 25 |"
    assert answer_table(answers).splitlines()[2] == line


def tidy():
    """Two seeds of one cell, one of another, of a dataset the paper has not."""
    rows = []
    for dataset, seed, said in (("CFD-P", 0, [H, S]), ("CFD-P", 1, [H, H]), ("CFD-P+", 0, [S, S])):
        history = History([0.5], [0.9], 0, True, "target")
        scored = score(["H", "S"], said, "pressure")
        rows.append(result_row("cnn1d_3_1", dataset, seed, scored, history))
    return pd.DataFrame(rows)


def test_cells_whose_trainings_did_not_all_converge_are_marked():
    """One of two seeds stopped too soon: that cell has a mark and the table a footnote, here and in
    the table of costs, and the page of a run says it in words. Where all converged there is
    neither."""
    rows = tidy()
    assert summarise(rows)["converged"].all()
    for table in (
        accuracy_table(rows, PAPER, ["CFD-P", "CFD-P+"]),
        cost_table(rows, [("CFD-P", "CFD-P+")]),
    ):
        assert "†" not in table
    rows.loc[1, "converged"] = False
    assert summarise(rows)["converged"].tolist() == [False, True]
    for table in (
        accuracy_table(rows, PAPER, ["CFD-P", "CFD-P+"]),
        cost_table(rows, [("CFD-P", "CFD-P+")]),
    ):
        assert "75.0 ± 35.4 †" in table and "| 50.0 ± 0.0 |" in table
        assert table.endswith(
            "\n\n† Not every training behind this number met the convergence rule.\n"
        )
    cells = summarise(rows).assign(title="CNN1D").to_dict("records")
    shown = [row[2].text for row in page_table(cells, {}, {}).rows]
    assert shown == ["75.0 ± 35.4, not all converged", "50.0 ± 0.0"]


def test_rows_carry_what_the_report_needs():
    """Per cent, epochs, convergence, and a confusion matrix that survives the table."""
    rows = tidy()
    assert rows["accuracy"].tolist() == [100, 50, 50] and rows["converged"].all()
    assert (rows["domain"] == "time").all() and rows["epochs"].tolist() == [1, 1, 1]
    np.testing.assert_array_equal(confusion_of(rows[:2]), [[2, 0, 0, 0], [1, 1, 0, 0], [0] * 4])


def test_mean_and_deviation_of_the_seeds():
    """Sample standard deviation of 100 and 50: 35.36; of a single run: 0, not a hole."""
    cells = summarise(tidy()).set_index("dataset")
    assert cells.loc["CFD-P", "mean"] == 75 and cells.loc["CFD-P", "count"] == 2
    assert cells.loc["CFD-P", "std"] == pytest.approx(50 / np.sqrt(2))
    assert cells.loc["CFD-P+", "std"] == 0


def test_the_table_has_the_papers_layout():
    """Ten rows in the paper's order, its four columns with ours in between in the order asked for
    (without one that nobody ran), its figures in brackets beside ours, a dash for what was not
    run."""
    order = ["CFD-P", "CFD-P+", "CFD-MOC-P", "never run", "CFD-Q", "experimental"]
    lines = accuracy_table(tidy(), PAPER, order).splitlines()
    header = [cell.strip() for cell in lines[0].strip("|").split("|")]
    assert header[2:] == ["CFD-P", "CFD-P+", "CFD-MOC-P", "CFD-Q", "experimental"]
    assert [line.split("|")[2].strip() for line in lines[2:]] == [
        a.title for a in ARCHITECTURES.values()
    ]
    row = lines[2 + list(ARCHITECTURES).index("cnn1d_3_1")]
    assert (
        "75.0 ± 35.4 (28.0 ± 10.7)" in row and "– (66.8 ± 0.2)" in row and "| 50.0 ± 0.0 |" in row
    )


def test_the_cost_is_the_corrected_less_the_calibrated():
    """By hand: 75 with the calibrated twin, 50 with the corrected. A network that ran on one of
    them alone has no cost and does not enter the mean."""
    alone = result_row("resnet18_1d", "CFD-P", 0, score(["H"], [H], "pressure"))
    rows = pd.concat([tidy(), pd.DataFrame([alone])])
    lines = cost_table(rows, [("CFD-P", "CFD-P+")]).splitlines()
    assert lines[0] == "| Architecture | CFD-P | CFD-P+ | cost |"
    assert lines[2].endswith("| 75.0 ± 35.4 | 50.0 ± 0.0 | -25.0 |")
    assert lines[3].endswith("| 100.0 ± 0.0 | – | – |")
    assert lines[4] == "| mean of networks | 75.0 | 50.0 | -25.0 |"


def test_the_papers_table_is_the_papers():
    """Against the paper's own source, number by number."""
    source = ROOT.parent / "shared" / "paper.tex"
    if not source.exists():
        pytest.skip("the paper's source is not beside this checkout")
    text = source.read_text()
    table = text[text.index("\\caption{Diagnostic Accuracy Comparison}") :]
    table = table[: table.index("\\bottomrule")]
    numbers = re.findall(r"([\d.]+)\$\\pm\$([\d.]+)", table)
    assert PAPER[["mean", "std"]].to_numpy().tolist() == [[float(m), float(d)] for m, d in numbers]


def test_the_papers_table_is_complete():
    """Ten architectures in their order, four columns each, and the headline cells."""
    assert PAPER["architecture"].drop_duplicates().tolist() == list(ARCHITECTURES)
    assert (PAPER.groupby("architecture").size() == 4).all()
    cell = PAPER.set_index(["architecture", "dataset"])["mean"]
    assert cell["cnn1d_341_100", "CFD-MOC-P"] == 100 and cell["cnn2d_3_1", "CFD-Q"] == 100
    assert cell["cnn2d_30_3", "CFD-Q"] == 82.8 and cell["cnn1d_150_50", "CFD-P"] == 0
    assert set(CLASSES) == {"H", "S", "C1", "C2"}


def test_where_no_severity_is_asked_either_is_right():
    """By hand: C1 and C2 are both right for C, and what is no cylinder fault is still wrong."""
    truth = np.array(["C", "C", "C", "H", "S"])
    said = np.array([CLASSES.index(name) for name in ("C1", "C2", "S", "H", "C1")])
    scored = score(truth, said, "pressure", None)
    assert scored["accuracy"] == scored["accuracy_either"] == 3 / 5
    assert score(truth, said, "pressure")["accuracy"] == 2 / 5
