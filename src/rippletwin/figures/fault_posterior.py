"""Pictures of a recording's diagnosis: what changed against what leaks change, and how large."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter

from rippletwin.case.quantities import unit_of, write_certainty, write_quantity
from rippletwin.case.words import name_state
from rippletwin.diagnosis import diagnosed_numbers
from rippletwin.diagnosis.diagnosed_numbers import DiagnosedNumbers
from rippletwin.figures import style

AREA = unit_of("m2")
LINES = ("-", "--", "-.")
SUFFIXES = (".png", ".svg")


def draw(
    numbers: Sequence[DiagnosedNumbers],
    folder: str | Path,
    suffixes: Sequence[str] = SUFFIXES,
) -> list[Path]:
    """Write both pictures of each recording into `folder`/figures, and the numbers behind them;
    returns the paths. Those of an earlier diagnosis are removed."""
    folder = Path(folder)
    remove_figures(folder)
    (folder / "figures").mkdir(parents=True, exist_ok=True)
    written = [diagnosed_numbers.save(numbers, folder)]
    for each in numbers:
        for name, plot in FIGURES.items():
            paths = _paths(folder, each.label, name, suffixes)
            style.save(plot(each), *paths)
            written += paths
    return written


def remove_figures(folder: str | Path) -> None:
    """Remove what `draw` has written into `folder`: beside another diagnosis it would be wrong.

    The pictures are those of the labels that diagnosed_numbers.FILE names, which goes last.
    """
    for label in diagnosed_numbers.load_labels(folder):
        for name in FIGURES:
            for path in _paths(Path(folder), label, name, SUFFIXES):
                path.unlink(missing_ok=True)
    (Path(folder) / diagnosed_numbers.FILE).unlink(missing_ok=True)


def _paths(folder: Path, label: str, name: str, suffixes: Sequence[str]) -> list[Path]:
    return [folder / "figures" / f"diagnose_{label}_{name}{suffix}" for suffix in suffixes]


def plot_change(d: DiagnosedNumbers) -> Figure:
    """Amplitude of the change at each shaft order and sensor, measured and by the most probable
    state, with the error that is allowed for."""
    fig, axes = style.figure(len(d.sensors), 1, height=2.0, sharex=True)
    measured, predicted, allowed = (
        np.asarray(values) / 1e5 for values in (d.measured, d.predicted, d.allowed)
    )
    for k, (ax, sensor) in enumerate(zip(axes[:, 0], d.sensors)):
        dot = dict(ms=2.5, color=style.MEASURED)
        ax.plot(d.orders, measured[k], "o", label="measured", **dot)
        label = f"predicted: {name_state(d.probable)}"
        ax.plot(d.orders, predicted[k], color=style.ALARM, lw=1.0, label=label)
        ax.plot(d.orders, allowed[k], ":", color=style.CALIBRATED, label="error allowed for")
        ax.set_yscale("log")
        ax.set_ylim(0.2 * max(float(np.min(allowed)), 1e-8), 2.0 * float(np.max(measured[k])))
        ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        ax.set_ylabel(f"{style.plain(sensor)}: change / bar,\nlogarithmic", fontsize=8)
    axes[-1, 0].set_xlabel("shaft order (multiples of the speed)")
    fig.suptitle(f"How does {style.plain(d.label)} differ from the healthy pump?")
    style.legend_below(fig, axes[0, 0])
    return fig


def plot_severity(d: DiagnosedNumbers) -> Figure:
    """Probability of each state, and the density of each leak area of the most probable one."""
    fig, axes = style.figure(1, 2, height=2.6, width_ratios=(1, 1.4))
    states = list(d.probabilities)[::-1]
    shares = [100 * d.probabilities[name] for name in states]
    ax = axes[0, 0]
    colours = [style.ALARM if name == d.probable else style.NEUTRAL for name in states]
    names = [name_state(name).replace(" and ", "\nand ") for name in states]
    ax.barh(names, shares, color=colours, height=0.6)
    for row, share in enumerate(shares):
        ax.text(share + 2, row, write_certainty(share / 100), va="center", fontsize=8)
    ax.set_xlim(0.0, 130.0)
    ax.set_xticks([0, 50, 100])
    ax.set_xlabel("probability / %")
    ax.set_title("Which state?", loc="left")
    _plot_areas(axes[0, 1], d)
    fig.suptitle(f"{style.plain(d.label)}: {name_state(d.state)}")
    return fig


FIGURES = {"change": plot_change, "severity": plot_severity}


def _plot_areas(ax, d: DiagnosedNumbers) -> None:
    ax.set_title("How large is the leak?", loc="left")
    if not d.leaks:
        ax.set_axis_off()
        ax.text(0.5, 0.5, "no leak", transform=ax.transAxes, ha="center")
        return
    for (name, leak), colour, line in zip(d.leaks.items(), style.CYCLE, LINES):
        interval = write_quantity(leak.median, AREA, (leak.low, leak.high))
        area = AREA.factor * np.asarray(leak.area)
        ax.plot(area, leak.density, line, color=colour, label=f"{name_state(name)}: {interval}")
        ax.axvspan(AREA.factor * leak.low, AREA.factor * leak.high, color=colour, alpha=0.15, lw=0)
    ax.set_xscale("log")
    low = min(AREA.factor * leak.low for leak in d.leaks.values())
    high = max(AREA.factor * leak.high for leak in d.leaks.values())
    ax.set_xlim(low / 3, high * 3)
    for axis in (ax.xaxis.set_major_formatter, ax.xaxis.set_minor_formatter):
        axis(FuncFormatter(_tick))
    ax.set_ylim(0, 1.35)
    ax.set_yticks([])
    ax.set_ylabel("how probable")
    ax.set_xlabel(f"leak area / {AREA.name}, logarithmic; shaded: 95 %")
    ax.legend(loc="upper left", fontsize=8)


def _tick(value: float, _=None) -> str:
    """A tick of a logarithmic axis at 1, 2 and 5 of each decade."""
    leading = value / 10 ** np.floor(np.log10(value) + 1e-9)
    return f"{value:.3g}" if round(leading, 6) in (1, 2, 5) else ""
