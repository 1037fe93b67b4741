"""Pictures of the diagnosis: confusion matrices, accuracy beside the paper, SST images."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.colors import PowerNorm
from matplotlib.figure import Figure

from rippletwin.figures import style

ORDERS = "frequency in multiples of shaft\nand pumping frequency"


def plot_confusion(
    matrices: Mapping[str, np.ndarray], truth: Sequence[str], predicted: Sequence[str]
) -> Figure:
    """Confusion matrices, one panel a name: (len(truth), len(predicted)) shares of a row."""
    fig, axes = style.panels(len(matrices), 5, height=1.7, sharex=True, sharey=True)
    for ax, (name, matrix) in zip(axes, matrices.items()):
        ax.imshow(matrix, vmin=0, vmax=1, cmap="Blues", aspect="auto")
        for (i, j), share in np.ndenumerate(matrix):
            ax.text(
                j, i, f"{100 * share:.0f}", ha="center", va="center", fontsize=7,
                color="white" if share > 0.6 else "black",
            )  # fmt: skip
        ax.set_title(name, fontsize=7)
        ax.set_xticks(range(len(predicted)), predicted)
        ax.set_yticks(range(len(truth)), truth)
        ax.spines[:].set_visible(False)
        ax.tick_params(length=0)
    fig.suptitle("What do the networks call the recordings of each state?")
    fig.supxlabel("predicted (% of the recording's windows)", fontsize=9)
    fig.supylabel("recorded", fontsize=9)
    return fig


def plot_accuracy(
    architectures: Sequence[str],
    ours: Mapping[str, np.ndarray],
    paper: Mapping[str, np.ndarray],
) -> Figure:
    """Accuracy per architecture, one panel a dataset, beside the paper's.

    ours, paper: dataset -> (A, 2) mean and standard deviation in per cent, NaN where absent.
    """
    fig, axes = style.panels(len(ours), 5, height=3.0, sharey=True)
    rows = np.arange(len(architectures))
    for ax, dataset in zip(axes, ours):
        mean, spread = np.asarray(ours[dataset]).T
        ax.barh(rows, mean, xerr=spread, color=style.CALIBRATED, height=0.6, label="rippletwin")
        if dataset in paper:
            mean, spread = np.asarray(paper[dataset]).T
            ax.errorbar(
                mean, rows, xerr=spread, fmt="D", ms=4, color=style.ALARM, label="paper", zorder=3
            )
        ax.set_title(dataset, fontsize=8)
        ax.set(xlim=(0, 105), xlabel="accuracy / %")
    axes[0].set_yticks(rows, architectures)
    axes[0].invert_yaxis()
    fig.suptitle("How often are the networks right on recordings?")
    style.legend_below(fig, axes[0])
    return fig


def plot_sst(
    images: Mapping[str, np.ndarray],
    frequency_hz: np.ndarray,
    shaft_hz: float,
    pistons: int,
    columns: int = 4,
    label: str = "image value",
    top: float | None = None,
) -> Figure:
    """SST images side by side, `columns` a row: name -> (size, size), lowest frequency in the first
    row.

    frequency_hz (size,) is the (logarithmic) axis of the rows; ticks are multiples of the shaft
    and the pumping frequency. Time runs over two revolutions. `top` ends the colour scale, which is
    then of square roots, so that weak ridges show beside strong ones.
    """
    fig, axes = style.panels(len(images), columns, height=2.4, sharex=True, sharey=True)
    low = min(float(np.min(image)) for image in images.values())
    norm = PowerNorm(0.5 if top else 1, low, top or max(np.max(image) for image in images.values()))
    log_axis = np.log(frequency_hz)
    for ax, (name, image) in zip(axes, images.items()):
        mesh = ax.imshow(
            image, origin="lower", aspect="auto", cmap=style.SEQUENTIAL, norm=norm,
            extent=(0, 2, log_axis[0], log_axis[-1]),
        )  # fmt: skip
        ax.set_title(name, fontsize=7)
        order_ticks(ax, frequency_hz, shaft_hz, pistons)
    fig.suptitle("Which frequencies does each signal have, and when?")
    fig.supxlabel("revolutions", fontsize=9)
    fig.supylabel(ORDERS, fontsize=9)
    fig.colorbar(mesh, ax=axes, label=label, shrink=0.8, extend="max" if top else "neither")
    return fig


def order_ticks(ax, frequency_hz: np.ndarray, shaft_hz: float, pistons: int) -> None:
    """Ticks of a y axis in log(Hz): multiples of the shaft and of the pumping frequency."""
    pumping = shaft_hz * pistons
    ticks = [(shaft_hz, "1 shaft"), (2 * shaft_hz, "2"), (4 * shaft_hz, "4")]
    ticks += [(k * pumping, "1 pumping" if k == 1 else str(k)) for k in (1, 2, 3, 5, 10)]
    shown = [(f, text) for f, text in ticks if frequency_hz[0] <= f <= frequency_hz[-1] * 1.001]
    ax.set_yticks([np.log(f) for f, _ in shown], [text for _, text in shown])
