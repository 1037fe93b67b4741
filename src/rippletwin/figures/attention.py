"""Grad-CAM behind ripples and images, and alignment against accuracy.

Heat is attention over its mean, 1 where it is spread evenly, so that networks can be compared. A
figure has a column for each network and a row for each state; an orange bar at the edge marks the
region of the fault.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle, product

import matplotlib as mpl
import numpy as np
from matplotlib import patheffects
from matplotlib.figure import Figure

from rippletwin.figures import style
from rippletwin.figures.diagnosis import ORDERS, order_ticks

MAX_HEAT = 3.0  # of the colour scale in every figure, for comparison; few peaks exceed it
MARKERS = {False: "oDv", True: "shp"}
"""Of networks that judge windows, and of those that judge images: the next one where all colours
are taken."""
_BAR = dict(color=style.ALARM, lw=0)
_OUTLINED = [patheffects.withStroke(linewidth=1.5, foreground="black")]  # visible on any heat


def plot_windows(
    networks: Sequence[str],
    states: Sequence[str],
    ripple: np.ndarray,
    heat: np.ndarray,
    titles: Sequence[Sequence[str]],
    label: str,
    region: np.ndarray | None = None,
) -> Figure:
    """Ripples over one revolution, heat behind them.

    ripple (states, M) in the unit of ``label``; heat (networks, states, M), NaN without attention;
    titles [network][state]; region (states, M) booleans: crank angles that the fault changes.
    """
    fig, axes = _panels(networks, states, height=1.25)
    angle = np.arange(ripple.shape[-1]) * 360 / ripple.shape[-1]
    reach = 1.25 * np.abs(ripple).max()
    for ax, network, row in _each(axes):
        mesh = ax.imshow(
            heat[network, row][None], extent=(0, 360, -reach, reach), aspect="auto",
            cmap=_colours(), vmin=0, vmax=MAX_HEAT,
        )  # fmt: skip
        ax.plot(angle, ripple[row], color="white", lw=0.6, path_effects=_OUTLINED)
        if region is not None:
            stretches = _stretches(region[row], 0, 360 / len(angle))
            ax.broken_barh(stretches, (-reach, 0.13 * reach), **_BAR)
        ax.set_title(titles[network][row], fontsize=7)
        ax.set(xlim=(0, 360), ylim=(-reach, reach), xticks=(0, 120, 240, 360))
    fig.suptitle(_question("At which shaft angles", region))
    fig.supxlabel("crank angle / degrees", fontsize=9)
    fig.supylabel(label, fontsize=9)
    _key(fig, axes, mesh)
    return fig


def plot_images(
    networks: Sequence[str],
    states: Sequence[str],
    pictures: np.ndarray,
    heat: np.ndarray,
    titles: Sequence[Sequence[str]],
    frequency_hz: np.ndarray,
    shaft_hz: float,
    pistons: int,
    region: np.ndarray | None = None,
) -> Figure:
    """SST images over two revolutions as white contours, heat behind them.

    pictures (states, size, size), lowest frequency first; heat (networks, states, size, size), NaN
    without attention; frequency_hz (size,) of the rows; region (states, size) booleans: rows that
    the fault changes. Titles as in ``plot_windows``.
    """
    fig, axes = _panels(networks, states, height=1.7)
    rows = np.log(frequency_hz)
    pixel = (rows[-1] - rows[0]) / (len(rows) - 1)
    bottom, top = rows[0] - pixel / 2, rows[-1] + pixel / 2
    times = (np.arange(pictures.shape[-1]) + 0.5) * 2 / pictures.shape[-1]
    low, high = pictures.min(), pictures.max()
    for ax, network, row in _each(axes):
        mesh = ax.imshow(
            heat[network, row], origin="lower", extent=(0, 2, bottom, top), aspect="auto",
            cmap=_colours(), vmin=0, vmax=MAX_HEAT,
        )  # fmt: skip
        levels = low + (high - low) * np.array([0.08, 0.25, 0.6])
        ax.contour(times, rows, pictures[row], levels, colors="white", linewidths=(0.4, 0.7, 1.0))
        if region is not None:
            for start, height in _stretches(region[row], bottom, pixel):
                ax.barh(start, 0.12, height, align="edge", **_BAR)
        ax.set_title(titles[network][row], fontsize=7)
        order_ticks(ax, frequency_hz, shaft_hz, pistons)
        ax.tick_params(labelsize=6)
        ax.set(xlim=(0, 2), ylim=(bottom, top), xticks=(0, 1, 2))
    fig.suptitle(_question("At which frequencies and times", region))
    fig.supxlabel("revolutions", fontsize=9)
    fig.supylabel(ORDERS, fontsize=9)
    _key(fig, axes, mesh)
    return fig


def plot_ranks(
    groups: Mapping[str, tuple[Sequence[str], np.ndarray, np.ndarray, np.ndarray]],
) -> Figure:
    """Accuracy against alignment, a panel a dataset, a point a network.

    groups : dataset -> names, whether each judges images (A,), alignment (A, 2) and accuracy
    (A, 2) in per cent, mean and standard deviation over seeds.
    """
    fig, axes = style.panels(len(groups), 3, height=2.7, sharey=True)
    kind = {name: square for group in groups.values() for name, square in zip(*group[:2])}
    look: dict[str, tuple[str, str]] = {}
    for square, markers in MARKERS.items():
        names = [name for name in kind if kind[name] == square]
        look |= zip(names, cycle(product(markers, style.CYCLE)))
    for ax, (dataset, (labels, image, aligned, accuracy)) in zip(axes, groups.items()):
        for name, square, x, y in zip(labels, image, aligned, accuracy):
            marker, colour = look[name]
            ax.errorbar(
                x[0], y[0], xerr=x[1], yerr=y[1], fmt=marker, ms=5, elinewidth=0.6,
                color=colour, label=name, mfc="white" if square else None,
            )  # fmt: skip
        ax.axvline(1, color=style.NEUTRAL, lw=0.8, ls=":")
        ax.set(title=dataset, ylim=(-3, 103), xlabel="alignment (1: chance)")
    fig.suptitle("Are networks that attend to the simulated fault right more often?")
    fig.supylabel("accuracy on recordings / %", fontsize=9)
    handles: dict[str, object] = {}
    for ax in axes:
        handles |= {label: handle for handle, label in zip(*ax.get_legend_handles_labels())}
    fig.legend(handles.values(), handles, loc="outside lower center", ncols=4, fontsize=7)
    return fig


def plot_claims(groups: Mapping[str, tuple[Sequence[str], np.ndarray]]) -> Figure:
    """Differences that claims predict to be positive: claim -> labels, (n, 3) difference, ends of
    its 95 % interval (NaN where unknown), per cent of the windows."""
    groups = groups or {"nothing to compare": ([], np.empty((0, 3)))}
    counts = [max(1, len(labels)) for labels, _ in groups.values()]
    fig = Figure(figsize=(style.COLUMN, 1.2 + 0.17 * sum(counts) + 0.35 * len(counts)))
    axes = fig.subplots(len(groups), 1, squeeze=False, sharex=True, height_ratios=counts)[:, 0]
    for ax, (claim, (labels, values)) in zip(axes, groups.items()):
        rows = np.arange(len(labels))
        supports, opposes = values[:, 1] > 0, values[:, 2] < 0
        for mask, colour, marker, name in (
            (supports, style.CALIBRATED, "o", "supports"),
            (opposes, style.ALARM, "s", "opposes"),
            (~supports & ~opposes, style.NEUTRAL, "D", "open, or no interval"),
        ):
            ax.plot(values[mask, 0], rows[mask], marker, ms=4, color=colour, label=name)
            ax.hlines(rows[mask], values[mask, 1], values[mask, 2], color=colour, lw=1.2)
        ax.axvline(0, color="black", lw=0.8)
        ax.set_title(claim, loc="left")
        ax.set_yticks(rows, labels, fontsize=6)
        ax.set_ylim(max(1, len(rows)) - 0.5, -0.5)
    fig.suptitle("Do these networks support the paper's claims?")
    axes[-1].set_xlabel("difference of accuracy / %, 95 % interval over recordings")
    style.legend_below(fig, axes[0])
    return fig


def _question(where: str, region: np.ndarray | None) -> str:
    """The title of a figure, which says what its orange bars are."""
    title = f"{where} do the networks attend?"
    return title if region is None else f"{title}\nOrange: where the fault changes the signal"


def _panels(networks: Sequence[str], states: Sequence[str], height: float):
    fig, axes = style.figure(len(states), len(networks), height=height, sharex=True, sharey=True)
    fig.set_size_inches(max(style.COLUMN, 1.8 * len(networks) + 1.4), height * len(states) + 0.9)
    for ax, name in zip(axes[0], networks):
        ax.annotate(
            name, (0.5, 1.28), xycoords="axes fraction", ha="center", va="bottom", fontsize=9
        )
    for ax, state in zip(axes[:, 0], states):
        ax.set_ylabel(state, rotation=0, ha="right", va="center", fontsize=10, fontweight="bold")
    return fig, axes


def _each(axes: np.ndarray):
    return ((ax, network, row) for (row, network), ax in np.ndenumerate(axes))


def _stretches(inside: np.ndarray, origin: float, step: float) -> list[tuple[float, float]]:
    """(start, length) of each run of True, the first element reaching from origin to a step on."""
    edges = np.flatnonzero(np.diff(np.pad(inside.astype(int), 1)))
    return [(origin + a * step, (b - a) * step) for a, b in zip(edges[::2], edges[1::2])]


def _colours():
    return mpl.colormaps[style.SEQUENTIAL].with_extremes(bad="0.8")  # grey: no attention


def _key(fig: Figure, axes: np.ndarray, mesh) -> None:
    label = "attention over its mean (grey: none)"
    fig.colorbar(mesh, ax=axes, label=label, extend="max", shrink=0.6, aspect=40)
