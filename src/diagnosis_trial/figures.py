"""Figures of a diagnosis trial: detection, confusion, severities and stated probabilities."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from concealed.figures import draw_rate
from diagnosis_trial import detection
from diagnosis_trial.summary import (
    ANSWERS,
    SINGLE,
    STATES,
    columns_of,
    confusion_matrix,
    covers,
    parts_of_page,
    reliability_table,
)
from rippletwin.figures import style

LOOK = {"slipper": (style.CALIBRATED, "o"), "cylinder": (style.ALARM, "s")}


def draw_figures(rows: list[dict], folder: str | Path) -> list[Path]:
    """Write every figure of the scored recordings into `folder`; returns their paths."""
    columns = columns_of(rows)
    figures = {"detection": draw_detection(columns)}
    for name, chosen in columns.items():
        figures[file_name("confusion", name)] = draw_confusion(chosen)
        figures[file_name("severities", name)] = draw_severities(chosen)
    paths = []
    for name, figure in figures.items():
        paths.append(Path(folder) / f"{name}.png")
        style.save(figure, paths[-1])
    return paths


def file_name(figure: str, column: str) -> str:
    """Name of a column's figure, without its suffix."""
    return f"{figure}_{column.replace('@', '_')}"


def draw_detection(columns: dict[str, list[dict]]) -> Figure:
    """Probability of detection of one leak at 5 % false alarms against the change that it makes,
    one panel a fault, one curve a column; further columns in further rows of panels."""
    parts = parts_of_page(columns)
    fig, axes = style.figure(len(parts), len(SINGLE), height=2.8, sharex="col", sharey=True)
    for panels, part in zip(axes, parts, strict=True):
        for ax, state in zip(panels, SINGLE, strict=True):
            for k, (column, rows) in enumerate(part.items()):
                _draw_curve(ax, detection.detect_leaks(rows, state), column, k)
        panels[0].set_ylabel("probability of detection")
        _draw_legend(panels[-1], len(part))
    for ax, state in zip(axes[-1], SINGLE, strict=True):
        ax.set_xlabel(f"relative change of the ripple by a {state}'s leak")
    axes[0, 0].set_ylim(-0.12, 1.12)
    return fig


def _draw_legend(ax, columns: int) -> None:
    """The names of the curves in one line above the panel, over the panels left of it too."""
    ax.set_title(" ", fontsize=9)  # room for the line
    if ax.lines:
        legend = ax.legend(
            loc="lower right", bbox_to_anchor=(1, 1), ncols=columns, fontsize=7, columnspacing=1.2
        )
        legend.set_in_layout(False)  # else the panel becomes so narrow that the line fits above it


def _draw_curve(ax, leaks: detection.Leaks, label: str, rank: int) -> None:
    """The detection curve of a column, and shares in bins with exact intervals."""
    ax.set_xscale("log")
    shown = leaks.shown
    if not len(shown):
        return
    colour, marker, dash = f"C{rank}", "osD^"[rank], ("-", "--", ":", "-.")[rank]
    curve = detection.fit_curve(leaks.change, leaks.hit)
    if curve is not None:
        grid = np.geomspace(shown.min(), shown.max(), 200)
        ax.plot(grid, curve.probability(grid), dash, color=colour)
    for k, (middle, rate) in enumerate(detection.shares_in_bins(shown, leaks.hit)):
        x = middle * np.exp(0.03 * rank)  # intervals beside each other
        draw_rate(ax, x, rate, colour, marker, label=None if k else label, lw=0.8)


def draw_confusion(rows: list[dict]) -> Figure:
    """Share of the recordings of each state (rows) that get each answer; numbers in the cells."""
    counts = confusion_matrix(rows)
    share = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    fig, axes = style.figure(1, 1, height=3.4)
    ax = axes[0, 0]
    ax.imshow(share, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    for i, j in np.ndindex(*counts.shape):
        if counts[i, j]:
            colour = "white" if share[i, j] > 0.6 else "black"
            ax.text(j, i, str(counts[i, j]), ha="center", va="center", color=colour)
    ax.set_xticks(range(len(ANSWERS)), [_words(name) for name in ANSWERS])
    ax.set_yticks(range(len(STATES)), [_words(name) for name in STATES])
    ax.set_xlabel("the tool says")
    ax.set_ylabel("the truth is")
    return fig


def draw_severities(rows: list[dict]) -> Figure:
    """Stated against true leak areas with 95 % intervals; share right by stated probability."""
    fig, axes = style.figure(1, 2, height=2.9)
    _draw_areas(axes[0, 0], [s for row in rows if row["right"] for s in row["severities"]])
    _draw_reliability(axes[0, 1], rows)
    return fig


def _draw_areas(ax, found: list[dict]) -> None:
    """Stated against true leak areas; intervals that miss are hollow."""
    for fault in SINGLE:
        colour, marker = LOOK[fault]
        for holds, face in ((True, colour), (False, "white")):
            some = [s for s in found if s["fault"] == fault and covers(s) == holds]
            if some:
                true, value, low, high = (
                    np.array([s[key] for s in some]) * 1e6
                    for key in ("true", "value", "low", "high")
                )
                spread = np.maximum([value - low, high - value], 0)
                label = fault if holds else f"{fault}, interval misses"
                ax.errorbar(true, value, spread, fmt=marker, color=colour, mfc=face, ms=3.5,
                            lw=0.7, label=label)  # fmt: skip
    ax.set_xscale("log")
    ax.set_yscale("log")
    if found:
        ends = [min(s["true"] for s in found) * 1e6, max(s["true"] for s in found) * 1e6]
        ax.plot(ends, ends, color=style.NEUTRAL, lw=0.8, zorder=0)
        ax.legend(loc="upper left", fontsize=7)
    ax.set_xlabel("true leak (mm$^2$)")
    ax.set_ylabel("stated leak (mm$^2$)")


def _draw_reliability(ax, rows: list[dict]) -> None:
    """Share of the answers that is right by their stated probability."""
    ax.plot([0, 1], [0, 1], color=style.NEUTRAL, lw=0.8)
    for b in reliability_table(rows):
        draw_rate(ax, b.mean, b.right, style.CORRECTED, "o")
    ax.set_xlabel("stated probability of the state")
    ax.set_ylabel("share that is right")
    ax.set_xlim(-0.02, 1.02)
    ax.set_ylim(-0.03, 1.05)


def _words(name: str) -> str:
    return name.replace("_", " ").replace("+", "\n+ ")
