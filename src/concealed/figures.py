"""Pictures of the trial on concealed effects: power, stated probabilities, misfits, bias."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from scipy.stats import binomtest

from rippletwin.figures import style

LEAST_CHANGE = 1e-4
STATED = (0.5, 0.9, 0.99)  # between pooled probabilities; most names are stated as all but sure


def draw(rows: list[dict], folder: str | Path, suffix: str = ".png") -> list[Path]:
    """Write every figure of the scored cases into `folder`; returns their paths."""
    paths = []
    for name, make in FIGURES.items():
        paths.append(Path(folder) / f"{name}{suffix}")
        style.save(make(rows), paths[-1])
    return paths


def power(rows: list[dict]) -> Figure:
    """Share of single effects that raise the alarm and are named rightly, against their change.

    A running mean over a factor of three of the change, below it every case.
    """
    singles = [r for r in rows if r["kind"] in ("single", "indistinguishable")]
    fig, axes = style.figure(1, 1, height=2.6)
    ax = axes[0, 0]
    change = np.array([max(r["change"], LEAST_CHANGE) for r in singles])
    grid = np.geomspace(LEAST_CHANGE, 2.0, 80)
    looks = (
        ("alarm", style.CALIBRATED, "-", np.array([r["alarm"] for r in singles], float)),
        ("right effect", style.CORRECTED, "--", np.array([r["right"] for r in singles], float)),
    )
    for k, (label, colour, dash, values) in enumerate(looks):
        if not len(values):
            continue
        weight = np.exp(-0.5 * (np.log(grid[:, None] / change) / np.log(np.sqrt(3))) ** 2)
        known = weight.sum(axis=1) > 0.5
        curve = np.where(known, weight @ values / np.maximum(weight.sum(axis=1), 1e-9), np.nan)
        ax.plot(grid, curve, dash, color=colour, label=label)
        place = values + (0.03 if k else -0.03) * (1 - 2 * values) - 0.06 * k * (values > 0.5)
        ax.plot(change, place, "|", color=colour, ms=5)
    ax.set_xscale("log")
    ax.set_xlabel("change of the ripple that the effect makes, relative")
    ax.set_ylabel("share of single effects")
    ax.set_ylim(-0.1, 1.1)
    ax.legend(loc="center left")
    return fig


def misfit(rows: list[dict]) -> Figure:
    """Misfit of every case: nominal values, recalibrated, corrected; sorted by kind."""
    kinds = ("none", "off", "single", "indistinguishable", "pair", "outside")
    ordered = sorted(rows, key=lambda r: (kinds.index(r["kind"]), r["misfit_calibrated"]))
    fig, axes = style.figure(1, 1, height=3.0)
    ax = axes[0, 0]
    x = np.arange(len(ordered))
    for key, label, mark, colour in (
        ("misfit_nominal", "nominal", "_", style.NOMINAL),
        ("misfit_calibrated", "calibrated", "o", style.CALIBRATED),
        ("misfit_corrected", "corrected", "x", style.CORRECTED),
    ):
        ax.plot(x, [r[key] for r in ordered], mark, color=colour, label=label, ms=4)
    ax.set_yscale("log")
    ends = [sum(r["kind"] == kind for r in ordered) for kind in kinds]
    for kind, start, count in zip(kinds, np.cumsum([0, *ends]), ends):
        if count:
            ax.axvline(start - 0.5, color=style.NEUTRAL, lw=0.5)
            short = {"indistinguishable": "alike"}.get(kind, kind)
            ax.text(start + 0.5 * (count - 1), 1.01, short, ha="center", va="bottom",
                    transform=ax.get_xaxis_transform(), fontsize=7)  # fmt: skip
    ax.set_xticks([])
    ax.set_xlabel("cases")
    ax.set_ylabel("relative misfit")
    fig.legend(*ax.get_legend_handles_labels(), loc="outside lower right", ncols=3)
    return fig


def bias(rows: list[dict]) -> Figure:
    """Errors of calibrated delays and impedances of cases with an effect, before and after."""
    fig, axes = style.figure(1, 2, height=2.4, sharey=True)
    for ax, quantity in zip(axes[0], ("delay", "impedance")):
        for which, colour, dash in (
            ("calibrated", style.CALIBRATED, "-"),
            ("corrected", style.CORRECTED, "--"),
        ):
            errors = np.sort(
                [
                    abs(b["relative"])
                    for r in rows
                    if r["effects"]
                    for b in r["bias"][which]
                    if b["quantity"] == quantity
                ]
            )
            if len(errors):
                share = np.arange(1, len(errors) + 1) / len(errors)
                ax.step(errors, share, dash, color=colour, label=which, where="post")
        ax.set_xscale("log")
        ax.set_xlabel(f"relative error of a segment's {quantity}")
    axes[0, 0].set_ylabel("share of segments below")
    axes[0, 0].legend(loc="lower right")
    return fig


def probabilities(rows: list[dict]) -> Figure:
    """Stated probability of named effects against how often such a name is right, pooled between
    the values of STATED, with exact 95 % intervals."""
    stated = np.array([pair for r in rows for pair in r["stated"]], float).reshape(-1, 2)
    pool = np.digitize(stated[:, 0], STATED)
    fig, axes = style.figure(1, 1, height=2.6)
    ax = axes[0, 0]
    ax.plot([0, 1], [0, 1], color=style.NEUTRAL, lw=0.8)
    for k in range(len(STATED) + 1):
        group = stated[pool == k]
        if len(group):
            p, right = group.mean(axis=0)
            low, high = binomtest(int(group[:, 1].sum()), len(group)).proportion_ci()
            spread = [[right - low], [high - right]]
            ax.errorbar(p, right, spread, fmt="o", color=style.CORRECTED, ms=4, capsize=2)
    ax.set_xlabel("stated probability, pooled at 0.5, 0.9 and 0.99")
    ax.set_ylabel("share that is right")
    ax.set_xlim(0, 1.03)
    ax.set_ylim(-0.03, 1.05)
    return fig


FIGURES = {"power": power, "misfit": misfit, "bias": bias, "probabilities": probabilities}
