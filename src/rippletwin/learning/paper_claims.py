"""The paper's claims about networks, checked against our accuracies by one stated rule.

A claim about accuracy is a list of comparisons: one network against another on one dataset. Each is
a difference of mean accuracies with its 95 % interval: it *supports* the claim where the interval
lies above zero, *opposes* it where it lies below, and is *open* otherwise. One without an interval,
of a single seed or too few recordings, decides nothing and does not count. Accuracy has several
scores. With the *recording* as the unit the two are compared on each recording, seeds averaged, and
the interval is over recordings: it says what holds for other recordings. In the paper's protocol
three recordings are given, and the interval is over seeds (Welch's t): it says what holds for other
trainings.

A claim is

* **reproduced** where more than half of its comparisons support it and none opposes it,
* **partly** reproduced where some support it, but not so,
* **not** reproduced where none supports it,
* **untested** where no comparison with an interval could be made.

The same rule is applied to the paper's own table, which shows how demanding it is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy.stats import t as student

from rippletwin.learning.accuracy import summarise
from rippletwin.learning.architectures import ARCHITECTURES
from rippletwin.learning.footnote import mark_unconverged, with_footnote
from rippletwin.learning.markdown import markdown_table
from rippletwin.learning.recording_accuracy import paired_interval

EXPERIMENTAL = "experimental"  # the dataset of recordings, which no zero-shot claim concerns
RECORDINGS = "all recordings"
STRICT, EITHER, PAPER = "strict", "either severity", "the paper's table"
PAPER_SEEDS = 10


@dataclass(frozen=True)
class Claim:
    """A statement of the paper, and pairs of (better, worse) networks that would show it."""

    text: str
    pairs: tuple[tuple[str, str], ...]


KERNELS_IN_TIME = Claim(
    "Large kernels win in time: accuracy grows with the first kernel",
    (("cnn1d_341_100", "cnn1d_3_1"), ("cnn1d_341_100", "cnn1d_150_50")),
)
KERNELS_IN_IMAGES = Claim(
    "Small kernels win in time-frequency: accuracy falls with the first kernel",
    (("cnn2d_3_1", "cnn2d_30_3"), ("cnn2d_3_1", "cnn2d_7_2")),
)
DEPTH = Claim(
    "Depth costs robustness: deeper networks with the same first layer are less accurate",
    (
        ("cnn1d_341_100", "resnet34_1d"),
        ("resnet18_1d", "resnet34_1d"),
        ("cnn2d_3_1", "resnet34_2d"),
        ("resnet18_2d", "resnet34_2d"),
    ),
)
CALIBRATION = "Calibration decides: trained on CFD-MOC-P, networks beat those trained on CFD-P"
LEARNABLE = "Trained on recordings, every network reaches 100 %"
PERIOD = "A kernel of 341 samples spans one pumping period"


def cells_of(results: pd.DataFrame, paper: pd.DataFrame, shares: pd.DataFrame) -> pd.DataFrame:
    """Mean, standard deviation and number of every trained cell by each score.

    results : tidy accuracies in per cent (``accuracy.result_row``); paper : columns architecture,
    dataset, mean, std; shares : ``recording_shares``. Columns score, architecture, dataset, mean,
    std, count (of recordings, else of seeds), converged (whether all trainings did).
    """
    strict = summarise(results)
    by_recording = shares.agg(["mean", "std", "count"]).T.reset_index()
    ended = strict[["architecture", "dataset", "converged"]]
    scores = {
        RECORDINGS: by_recording.merge(ended, how="left") if len(by_recording) else by_recording,
        STRICT: strict,
        EITHER: summarise(results, "accuracy_either"),
        PAPER: paper.assign(count=PAPER_SEEDS, converged=True),
    }
    cells = pd.concat([table.assign(score=score) for score, table in scores.items() if len(table)])
    names = ["score", "architecture", "dataset", "mean", "std", "count", "converged"]
    return cells.dropna(subset=["mean"]).reset_index(drop=True)[names]


def paired_difference(better, worse) -> tuple[float, float, float]:
    """Difference of two means and its 95 % interval (Welch 1947); better, worse: mean, std, count.

    With fewer than two seeds on a side the interval is unknown: NaN. Without any spread on either
    side it is the difference itself.
    """
    mean = float(better[0] - worse[0])
    if min(better[2], worse[2]) < 2:
        return mean, float("nan"), float("nan")
    parts = np.array([std**2 / count for _, std, count in (better, worse)])
    if not parts.any():
        return mean, mean, mean
    degrees = parts.sum() ** 2 / (parts**2 / [better[2] - 1, worse[2] - 1]).sum()
    half = float(student.ppf(0.975, degrees) * np.sqrt(parts.sum()))
    return mean, mean - half, mean + half


def difference_over_recordings(better, worse) -> tuple[float, float, float]:
    """Mean difference of two cells and its 95 % interval (``paired_interval``); better, worse:
    shares (R,) of the same recordings, of which those that both have count."""
    differences = np.asarray(better, float) - np.asarray(worse, float)
    differences = differences[np.isfinite(differences)]
    if not differences.size:
        return (float("nan"),) * 3
    return float(differences.mean()), *paired_interval(differences)


def verdict_of_difference(low: float, high: float) -> str:
    """What one comparison says of its claim: "supports", "opposes" or "open"; "no interval" where
    too few seeds or recordings give none."""
    if not low <= high:
        return "no interval"
    return "supports" if low > 0 else "opposes" if high < 0 else "open"


def judge_claim(verdicts: list[str]) -> str:
    """The claim's verdict by the rule at the head of this module."""
    verdicts = [each for each in verdicts if each != "no interval"]
    supporting = verdicts.count("supports")
    if not verdicts:
        return "untested"
    if not supporting:
        return "not"
    clear = 2 * supporting > len(verdicts) and "opposes" not in verdicts
    return "reproduced" if clear else "partly"


def compare_cells(cells: pd.DataFrame, shares: pd.DataFrame) -> pd.DataFrame:
    """Every comparison that the cells (``cells_of``) allow; shares : ``recording_shares``.

    Columns claim, score, dataset, better, worse (labels), difference, low, high (per cent of the
    windows), verdict, converged (whether all trainings of both did).
    """
    rows = []
    for score, table in cells.groupby("score", sort=False):
        runs = {(c.architecture, c.dataset): (c.mean, c.std, c.count) for c in table.itertuples()}
        converged = {(c.architecture, c.dataset): c.converged for c in table.itertuples()}
        compare = paired_difference
        if score == RECORDINGS:
            runs = {cell: shares[cell] for cell in runs}
            compare = difference_over_recordings
        datasets = [name for name in dict.fromkeys(table.dataset) if name != EXPERIMENTAL]
        wanted = [
            (claim.text, (better, dataset), (worse, dataset))
            for claim in (KERNELS_IN_TIME, KERNELS_IN_IMAGES, DEPTH)
            for dataset in datasets
            for better, worse in claim.pairs
        ] + [(CALIBRATION, (name, "CFD-MOC-P"), (name, "CFD-P")) for name in ARCHITECTURES]
        for claim, better, worse in wanted:
            if better in runs and worse in runs:
                mean, low, high = compare(runs[better], runs[worse])
                rows.append(
                    (claim, score, better[1], _label(better), _label(worse, beside=better))
                    + (mean, low, high, verdict_of_difference(low, high))
                    + (converged[better] and converged[worse],)
                )
    names = "claim score dataset better worse difference low high verdict converged"
    return pd.DataFrame(rows, columns=names.split())


def judge_claims(compared: pd.DataFrame, cells: pd.DataFrame, period: float) -> pd.DataFrame:
    """One row a claim and score: claim, score, verdict, evidence (a sentence).

    compared : of ``compare_cells``; cells : of ``cells_of``; period : samples between two pistons.
    """
    kernel = ARCHITECTURES["cnn1d_341_100"].kernel
    spans = "reproduced" if abs(kernel - period) <= 1 else "not"
    rows = [(PERIOD, "–", spans, f"{kernel} samples; one pumping period is {period:.1f} samples")]
    scores = list(dict.fromkeys(cells.score))
    for claim in (KERNELS_IN_TIME.text, KERNELS_IN_IMAGES.text, DEPTH.text, CALIBRATION):
        for score in scores:
            found = compared[(compared.claim == claim) & (compared.score == score)]
            counts = found.verdict.value_counts()
            evidence = "no comparison"
            if len(found):
                open_ended = int((~found.converged.astype(bool)).sum())
                evidence = (
                    f"{len(found)} comparisons: {counts.get('supports', 0)} support, "
                    f"{counts.get('opposes', 0)} oppose, {counts.get('no interval', 0)} without an "
                    f"interval; differences {found.difference.min():+.1f} "
                    f"to {found.difference.max():+.1f}, median {found.difference.median():+.1f}"
                )
                if open_ended:
                    evidence += f"; {open_ended} with trainings that did not converge"
            rows.append((claim, score, judge_claim(list(found.verdict)), evidence))
    for score in scores:
        learnt = cells[(cells.score == score) & (cells.dataset == EXPERIMENTAL)]["mean"]
        full = int((learnt >= 100).sum())
        word = "not" if not full else "reproduced" if full == len(learnt) else "partly"
        evidence = f"{full} of {len(learnt)} networks; lowest mean {learnt.min():.1f} %"
        if learnt.empty:
            word, evidence = "untested", "no comparison"
        rows.append((LEARNABLE, score, word, evidence))
    return pd.DataFrame(rows, columns=["claim", "score", "verdict", "evidence"])


def claims_markdown(judged: pd.DataFrame, compared: pd.DataFrame) -> str:
    """The page: verdicts, the rule, every comparison of ours."""
    verdicts = [(r.claim, r.score, f"**{r.verdict}**", r.evidence) for r in judged.itertuples()]
    page = f"""# The paper's claims

Accuracies on recordings, per cent of the windows. Each comparison is a difference of
means with its 95 % interval: it supports a claim where that lies above zero, opposes it
where it lies below, and is open otherwise. A claim is reproduced where more than half of
its comparisons support it and none opposes it, partly where some support it but not so,
not where none does; untested where nothing could be compared. Comparisons without an
interval do not count.

*{RECORDINGS}*: the recording is the unit. Both networks are compared on each recording,
either severity being right and seeds averaged, and the interval is over recordings
(Hartigan); five or less give none. The other scores are the paper's
protocol: one recording a state, and an interval over seeds (Welch), which says nothing
of other recordings. The rule is laid on the paper's own table too. Nothing corrects for
the number of comparisons: one in forty would support a claim by chance.

{markdown_table(("Claim", "Score", "Verdict", "Numbers"), verdicts)}"""
    heads = "Score", "Dataset", "Better, says the paper", "than", "Difference", "95 %", ""
    for claim, rows in compared[compared.score != PAPER].groupby("claim", sort=False):
        lines = [
            (
                *(r.score, r.dataset, r.better, r.worse),
                mark_unconverged(f"{r.difference:+.1f}", r.converged),
                f"{r.low:+.1f} to {r.high:+.1f}" if r.low <= r.high else "",
                r.verdict,
            )
            for r in rows.itertuples()
        ]
        page += f"\n## {claim}\n\n{markdown_table(heads, lines)}"
    return with_footnote(page)


def _label(cell: tuple[str, str], beside: tuple[str, str] | None = None) -> str:
    """The network, or the dataset where the network beside it is the same."""
    return cell[1] if beside and cell[0] == beside[0] else ARCHITECTURES[cell[0]].title
