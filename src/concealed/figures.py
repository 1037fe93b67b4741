"""Figures of a trial: power, misfits, errors of the line, stated probabilities."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from concealed.summary import Rate, line_errors_of, power_table, reliability_table
from rippletwin.figures import style

LEAST_CHANGE = 1e-4  # smaller changes are drawn here
GREATEST_CHANGE = 2.0  # right end of the last bin
PROBABILITY_EDGES = (0.0, 0.5, 0.9, 0.99, 1.0)
KINDS = ("none", "off", "single", "indistinguishable", "pair", "outside")
SHORT_NAMES = {"indistinguishable": "alike"}


def draw_figures(rows: list[dict], folder: str | Path) -> list[Path]:
    """Write every figure of the scored cases into `folder`; returns their paths."""
    paths = []
    for name, make in FIGURES.items():
        paths.append(Path(folder) / f"{name}.png")
        style.save(make(rows), paths[-1])
    return paths


def draw_power(rows: list[dict]) -> Figure:
    """Shares of single effects that raise the alarm and that are named, by their change.

    Bars are exact 95 % intervals; ticks below and above are the single cases.
    """
    fig, axes = style.figure(1, 1, height=2.6)
    ax = axes[0, 0]
    bins = power_table(rows)
    for k, (label, colour, marker, name) in enumerate(
        (
            ("alarm", style.CALIBRATED, "o", "alarm"),
            ("effect or class named", style.CORRECTED, "s", "right"),
        )
    ):
        for n, b in enumerate(bins):
            low, high = max(b.low, LEAST_CHANGE), min(b.high, GREATEST_CHANGE)
            x = np.sqrt(low * high) * 1.08 ** (2 * k - 1)
            draw_rate(ax, x, getattr(b, name), colour, marker, label=None if n else label)
        cases = [row for row in rows if row["kind"] in ("single", "indistinguishable")]
        x = [max(row["change"], LEAST_CHANGE) for row in cases]
        y = [(1.04 + 0.04 * k if row[name] else -0.04 - 0.04 * k) for row in cases]
        ax.plot(x, y, "|", color=colour, ms=4)
    ax.set_xscale("log")
    ax.set_xlabel("relative change of the ripple that the effect makes")
    ax.set_ylabel("share of single effects")
    ax.set_xlim(0.7 * LEAST_CHANGE, GREATEST_CHANGE)
    ax.set_ylim(-0.13, 1.13)
    if bins:
        ax.legend(loc="upper left")
    return fig


def draw_misfits(rows: list[dict]) -> Figure:
    """Misfit of every case, nominal, calibrated and corrected; sorted by kind."""
    ordered = sorted(rows, key=lambda row: (KINDS.index(row["kind"]), row["misfit_calibrated"]))
    fig, axes = style.figure(1, 1, height=3.0)
    ax = axes[0, 0]
    x = np.arange(len(ordered))
    for key, label, marker, colour in (
        ("misfit_nominal", "nominal", "_", style.NOMINAL),
        ("misfit_calibrated", "calibrated", "o", style.CALIBRATED),
        ("misfit_corrected", "corrected", "x", style.CORRECTED),
    ):
        ax.plot(x, [row[key] for row in ordered], marker, color=colour, label=label, ms=4)
    ax.set_yscale("log")
    counts = [sum(row["kind"] == kind for row in ordered) for kind in KINDS]
    for kind, start, count in zip(KINDS, np.cumsum([0, *counts]), counts):
        if count:
            ax.axvline(start - 0.5, color=style.NEUTRAL, lw=0.5)
            ax.text(start + 0.5 * (count - 1), 1.01, SHORT_NAMES.get(kind, kind), ha="center",
                    va="bottom", transform=ax.get_xaxis_transform(), fontsize=7)  # fmt: skip
    ax.set_xticks([])
    ax.set_xlabel("cases")
    ax.set_ylabel("relative misfit")
    fig.legend(*ax.get_legend_handles_labels(), loc="outside lower right", ncols=3)
    return fig


def draw_line_errors(rows: list[dict]) -> Figure:
    """Distribution of errors of delays and impedances in cases with an effect, before and after."""
    fig, axes = style.figure(1, 2, height=2.4, sharey=True)
    for ax, quantity in zip(axes[0], ("delay", "impedance")):
        for twin, colour, dash in (
            ("calibrated", style.CALIBRATED, "-"),
            ("corrected", style.CORRECTED, "--"),
        ):
            found = line_errors_of(rows, quantity, twin)
            errors = np.sort([abs(error["relative"]) for error in found])
            if len(errors) and errors[-1] > 0:
                share = np.arange(1, len(errors) + 1) / len(errors)
                ax.step(errors, share, dash, color=colour, label=twin, where="post")
                ax.set_xscale("log")
        ax.set_xlabel(f"relative error of a segment's {quantity}")
    axes[0, 0].set_ylabel("share of segments below")
    if axes[0, 0].lines:
        axes[0, 0].legend(loc="upper left")
    return fig


def draw_probabilities(rows: list[dict]) -> Figure:
    """Share of named effects that are right, by the probability that the verdict states.

    Pooled between PROBABILITY_EDGES, since most are stated close to one; bars are exact 95 %
    intervals.
    """
    fig, axes = style.figure(1, 1, height=2.6)
    ax = axes[0, 0]
    ax.plot([0, 1], [0, 1], color=style.NEUTRAL, lw=0.8)
    for b in reliability_table(rows, PROBABILITY_EDGES):
        draw_rate(ax, b.mean, b.right, style.CORRECTED, "o")
    ax.set_xlabel("stated probability, pooled at 0.5, 0.9 and 0.99")
    ax.set_ylabel("share that is right")
    ax.set_xlim(0, 1.03)
    ax.set_ylim(-0.03, 1.05)
    return fig


def draw_rate(ax, x: float, rate: Rate, colour: str, marker: str, **options) -> None:
    """A share with its interval; `options` are those of matplotlib's `errorbar`."""
    low, high = rate.interval
    spread = [[rate.share - low], [high - rate.share]]
    ax.errorbar(x, rate.share, spread, fmt=marker, color=colour, ms=4, capsize=2, **options)


FIGURES = {
    "power": draw_power,
    "misfit": draw_misfits,
    "line_errors": draw_line_errors,
    "probabilities": draw_probabilities,
}
