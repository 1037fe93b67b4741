"""One look for every picture: sizes, fonts, colours that survive colour blindness.

Colours are the qualitative set of Okabe and Ito (2008, Color Universal Design), which differ under
all common forms of colour blindness; maps are viridis. Lines that differ in colour also differ in
dash or marker.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure
from matplotlib.rcsetup import cycler

from rippletwin import store

MEASURED, NOMINAL, CALIBRATED, CORRECTED = "#000000", "#E69F00", "#0072B2", "#009E73"
ALARM, NEUTRAL = "#D55E00", "#8C8C8C"
CYCLE = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00", "#000000")
SEQUENTIAL = "viridis"
COLUMN = 7.0  # inches, width of a text column

# Set once for the process: text and legends drawn after a figure is made follow it too.
mpl.rcParams.update(
    {
        "figure.constrained_layout.use": True,
        "figure.dpi": 110,
        "savefig.dpi": 160,
        "font.size": 9,
        "figure.titlesize": 10,
        "axes.titlesize": 9,
        "axes.labelsize": 9,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.prop_cycle": cycler(color=CYCLE),
        "axes.grid": False,
        "legend.frameon": False,
        "legend.fontsize": 8,
        "lines.linewidth": 1.2,
        "svg.hashsalt": "rippletwin",  # the same picture gives the same bytes
    }
)


def figure(rows: int = 1, columns: int = 1, height: float = 2.2, **kwargs):
    """A figure one text column wide and its axes (rows, columns), `height` inches a row."""
    fig = Figure(figsize=(COLUMN, height * rows), layout="constrained")
    return fig, fig.subplots(rows, columns, squeeze=False, **kwargs)


def panels(count: int, most_columns: int, height: float, **kwargs):
    """A figure of `count` panels in rows of at most `most_columns`, `height` inches a row, and the
    axes of its panels."""
    columns = min(most_columns, count)
    fig, axes = figure(-(-count // columns), columns, height, **kwargs)
    for ax in axes.flat[count:]:
        ax.set_visible(False)
    return fig, list(axes.flat[:count])


def plain(text: str) -> str:
    """A name that a user gave, drawn as it is: between two $ matplotlib would read mathematics."""
    return text.replace("$", r"\$")


def legend_below(fig: Figure, ax) -> None:
    """One legend for the whole figure, of the labels of `ax`, below everything else."""
    handles, labels = ax.get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside lower center", ncols=max(len(labels), 1))


def save(fig: Figure, *paths) -> None:
    """Write a figure to each of `paths`; the suffix (.png, .svg) is the format."""
    for path in map(Path, paths):
        metadata = {"Date": None} if path.suffix == ".svg" else None
        with store.whole(path) as scratch:
            fig.savefig(scratch, metadata=metadata)
        fig.set_layout_engine("none")  # it is laid out: once takes as long as drawing
