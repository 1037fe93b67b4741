"""Rank correlation of networks' alignment with the fault and their accuracy on recordings.

Alignment is known before any fault has been recorded. If it ranks networks as their accuracy on
recorded faults does, it can choose one. Spearman's rank correlation measures how well it ranks; the
accuracy of the network that it ranks first measures what the choice would have gained.
"""

from __future__ import annotations

import itertools

import numpy as np
import pandas as pd
from scipy.stats import rankdata

from rippletwin.learning.architectures import ARCHITECTURES
from rippletwin.learning.markdown import markdown_table

MAX_EXACT_COUNT = 8  # of values, up to which the p-value is over all orders
PERMUTATIONS = 20_000  # random orders for more values
DOMAIN_NAMES = {"time": ["time"], "image": ["image"], "both": ["time", "image"]}
SCORES = {"accuracy": "strict", "accuracy_either": "either severity"}
NETWORK_HEADS = (
    "Dataset", "Architecture", "On fault", "Region", "Alignment", "Blind", "Accuracy", "Either",
)  # fmt: skip
RANKING_HEADS = (
    "Dataset", "Input", "Score", "n", "rho", "95 %", "p", "Chosen", "Its accuracy", "Best", "Mean",
)  # fmt: skip


def alignment_table(shares: pd.DataFrame, results: pd.DataFrame) -> pd.DataFrame:
    """One row for each trained network and dataset: alignment with the fault, and accuracy.

    shares : a row for each dataset, architecture, domain, seed and fault with ``attended`` (share
        of attention in the fault's region, NaN where there was none), ``region`` (the region's own
        share) and ``blind`` (share of inputs without any attention).
    results : tidy accuracies (``accuracy.result_row``).

    A seed's alignment is the mean over faults of attended / region; ``alignment`` and its standard
    deviation are over seeds, as the accuracies (per cent) are.
    """
    keys = ["dataset", "architecture"]
    ratio = shares.assign(alignment=shares.attended / shares.region)
    seeds = ratio.groupby([*keys, "domain", "seed"], sort=False)[
        ["attended", "region", "blind", "alignment"]
    ].mean()
    cells = seeds.groupby([*keys, "domain"], sort=False)
    table = cells.mean()
    table["alignment_std"] = cells["alignment"].std().fillna(0.0)  # of a single seed
    right = results.groupby(keys)[list(SCORES)].agg(["mean", "std"])
    right.columns = [name if kind == "mean" else f"{name}_std" for name, kind in right.columns]
    right = right.fillna({f"{name}_std": 0.0 for name in SCORES})
    return table.reset_index().merge(right, on=keys, how="left", validate="one_to_one")


def rank_table(table: pd.DataFrame) -> pd.DataFrame:
    """Rank correlation of ``alignment`` with accuracy for each dataset and kind of input.

    Columns rho, p, low, high (``rank_correlation``), the network with the highest alignment and
    its accuracy, the best accuracy and the mean accuracy (that of a random choice). Groups of fewer
    than three networks are left out.
    """
    rows = []
    for dataset, score in itertools.product(dict.fromkeys(table.dataset), SCORES):
        for name, domains in DOMAIN_NAMES.items():
            group = table[(table.dataset == dataset) & table.domain.isin(domains)]
            group = group.dropna(subset=["alignment", score])
            if len(group) < 3 or set(group.domain) != set(domains):
                continue
            rho, p, low, high = rank_correlation(group.alignment, group[score])
            chosen = group.loc[group.alignment.idxmax()]
            rows.append(
                dict(dataset=dataset, input=name, score=score, networks=len(group))
                | dict(rho=rho, p=p, low=low, high=high, chosen=chosen.architecture)
                | dict(chosen_accuracy=chosen[score], best=group[score].max())
                | dict(mean=group[score].mean())
            )
    names = "dataset input score networks rho p low high chosen chosen_accuracy best mean"
    return pd.DataFrame(rows, columns=names.split())


def rank_correlation(first: np.ndarray, second: np.ndarray) -> tuple[float, float, float, float]:
    """Spearman's rho of two rankings (n,), its p-value and its 95 % interval.

    p : share of all orders whose rho is at least as far from zero (drawn with a fixed generator
    beyond ``MAX_EXACT_COUNT`` values). Interval: Fisher's z with variance 1.06 / (n - 3) (Fieller,
    Hartley, Pearson 1957), the whole of [-1, 1] below four values. NaN where either has no order
    (all are equal). Raises ValueError below three values.
    """
    a, b = rankdata(first), rankdata(second)
    n = len(a)
    if n != len(b) or n < 3:
        raise ValueError(f"rank correlation of {n} and {len(b)} values: three of each are needed")
    a, b = a - a.mean(), b - b.mean()
    norm = np.sqrt((a @ a) * (b @ b))
    if norm == 0:
        return (float("nan"),) * 4
    rho = float(a @ b / norm)
    if n <= MAX_EXACT_COUNT:
        orders = np.array(list(itertools.permutations(b)))
        extra = 0
    else:
        orders = np.random.default_rng(0).permuted(np.tile(b, (PERMUTATIONS, 1)), axis=1)
        extra = 1  # the observed order counts among those drawn (Davison, Hinkley 1997, eq. 4.11)
    far = (np.abs(orders @ a) / norm >= abs(rho) - 1e-12).sum()
    p = (far + extra) / (len(orders) + extra)
    if n < 4:
        return rho, float(p), -1.0, 1.0
    half = 1.959964 * np.sqrt(1.06 / (n - 3))
    centre = np.arctanh(np.clip(rho, -1 + 1e-9, 1 - 1e-9))
    return rho, float(p), float(np.tanh(centre - half)), float(np.tanh(centre + half))


def ranking_markdown(table: pd.DataFrame, ranks: pd.DataFrame) -> str:
    """Both tables as a page."""
    networks = map(_network_line, table.itertuples())
    rankings = map(_ranking_line, ranks.itertuples())
    return f"""# Attention and accuracy

Alignment is the share of attention on the simulated fault over that region's own share,
mean and standard deviation over seeds: one is chance. It is found on simulations alone.
Accuracies, in per cent, are those on recordings.

{markdown_table(NETWORK_HEADS, networks)}
Blind: share of simulated faults for which a network shows no positive evidence at all.

## Does alignment choose the network?

Spearman's rank correlation of alignment and accuracy over the networks of a dataset,
its 95 % interval and the p-value over all orders (random ones beyond eight networks); then the
accuracy of the network with the highest alignment, of the best network and of the mean network.

{markdown_table(RANKING_HEADS, rankings)}
**{ranking_sentence(ranks)}**
"""


def _network_line(row) -> tuple[str, ...]:
    """The cells of NETWORK_HEADS."""
    return (
        row.dataset,
        ARCHITECTURES[row.architecture].title,
        f"{row.attended:.1%}",
        f"{row.region:.1%}",
        f"{row.alignment:.2f} ± {row.alignment_std:.2f}",
        f"{row.blind:.0%}",
        f"{row.accuracy:.1f} ± {row.accuracy_std:.1f}",
        f"{row.accuracy_either:.1f}",
    )


def _ranking_line(row) -> tuple[str, ...]:
    """The cells of RANKING_HEADS."""
    rho = "none: all equal", "–", "–"
    if np.isfinite(row.rho):
        rho = f"{row.rho:.2f}", f"{row.low:.2f} to {row.high:.2f}", f"{row.p:.3f}"
    numbers = (f"{x:.1f}" for x in (row.chosen_accuracy, row.best, row.mean))
    chosen = ARCHITECTURES[row.chosen].title
    return row.dataset, row.input, SCORES[row.score], str(row.networks), *rho, chosen, *numbers


def ranking_sentence(ranks: pd.DataFrame) -> str:
    """How many rank correlations (strict score, one kind of input) are positive, in a sentence."""
    judged = ranks[(ranks.score == "accuracy") & (ranks.input != "both")].dropna(subset=["rho"])
    if judged.empty:
        return "Too few networks, or no order among their accuracies: no rank correlation to judge."
    with_it, better = judged.rho > 0, judged.chosen_accuracy > judged["mean"]
    sure = with_it & (judged.p < 0.05)
    return (
        f"Of {len(judged)} rankings of networks by alignment, {with_it.sum()} go with accuracy "
        f"more than against it, {sure.sum()} of them beyond chance (p < 0.05); "
        f"choosing by alignment beats the mean network in {better.sum()} of them."
    )
