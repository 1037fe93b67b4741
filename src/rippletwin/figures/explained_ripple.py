"""How well do the calibrated and the corrected twin follow the recordings?"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullFormatter

from rippletwin.case.quantities import write_share
from rippletwin.figures import style
from rippletwin.figures.explained_numbers import ExplainedNumbers, Point

MAX_COLUMNS = 4  # operating points side by side
SAMPLES_PER_PITCH = 360
LOOKS = {
    "measured": dict(color="#9A9A9A", lw=3.2),
    "calibrated": dict(color=style.CALIBRATED, lw=1.1),
    "corrected": dict(color=style.ALARM, lw=1.1, ls=(0, (4, 1.5))),
}
"""The thin lines show on the wide one, also where all three agree."""
RESIDUAL_LIMITS = 0.1, 100.0
LABELLED = 1.0, 3.0  # times powers of ten, on a logarithmic axis
LEAST_HEIGHT = 2.6  # inches, of a figure of one row


def title_of(point: Point) -> str:
    """An operating point in words: "1000 r/min, 95 bar", or its label where there is no shaft."""
    if point.speed_rpm is None:
        return point.label
    words = [f"{point.speed_rpm:.0f} r/min"]
    if point.load_pressure is not None:
        words.append(f"{point.load_pressure / 1e5:.4g} bar")
    return ", ".join(words)


def curves_of(numbers: ExplainedNumbers) -> tuple[str, ...]:
    """Curves that differ: the corrected twin is the calibrated one where nothing was corrected."""
    same = all(np.array_equal(p.calibrated, p.corrected) for p in numbers.points)
    return ("measured", "calibrated") if same else ("measured", "calibrated", "corrected")


def curve(point: Point, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """x and y of amplitudes (F,) at one sensor: ripple in bar over a piston's pitch in degrees, or
    amplitude over frequency in Hz."""
    if point.orders is None:
        return point.frequency_hz, np.abs(values)
    orders = np.asarray(point.orders, float)
    pitch = 2 * np.pi / np.gcd.reduce(np.asarray(point.orders, int))
    angle = pitch * np.arange(SAMPLES_PER_PITCH + 1) / SAMPLES_PER_PITCH
    ripple = (values @ np.exp(1j * np.outer(orders, angle))).real
    return np.rad2deg(angle), ripple / 1e5


def axis_labels(point: Point, sensor: str) -> tuple[str, str]:
    """Labels of x and y of `curve`."""
    if point.orders is not None:
        return "shaft angle / degrees", f"{sensor}: ripple / bar"
    if point.kind == "input_impedance":
        return "frequency / Hz", "size of the reflection"
    return "frequency / Hz", f"{sensor}: amplitude / Pa,\nlogarithmic"


def plot_ripple(numbers: ExplainedNumbers) -> Figure:
    """Ripple at each sensor (rows) and operating point (columns)."""
    shown, names = numbers.points[:MAX_COLUMNS], curves_of(numbers)
    rows = max(len(p.measured) for p in shown)
    height = max(1.75, LEAST_HEIGHT / rows)
    fig, axes = style.figure(rows, len(shown), height=height, sharex="col")
    first_of = _share_y_by_kind(axes, shown)
    for k, (column, point) in enumerate(zip(axes.T, shown)):
        for ax in column[len(point.measured) :]:
            ax.set_visible(False)
        for s, (ax, sensor) in enumerate(zip(column, point.sensors)):
            for name in names:
                ax.plot(*curve(point, getattr(point, name)[s]), label=name, **LOOKS[name])
            x_label, y_label = axis_labels(point, style.plain(sensor))
            if point.kind == "input_impedance":
                ax.set_ylim(0.0, 1.1)  # the reflection of a passive line is at most 1
            elif point.orders is None:
                ax.set_yscale("log")
                ax.yaxis.set_major_locator(LogLocator(subs=LABELLED))
                ax.yaxis.set_minor_formatter(NullFormatter())
            if first_of[point.kind] == k:
                ax.set_ylabel(y_label, fontsize=8)
            errors = [write_share(point.misfit(getattr(point, n), s)) for n in names[1:]]
            head = f"{style.plain(title_of(point))}\n" if s == 0 else ""
            ax.set_title(f"{head}error {' → '.join(errors)}", loc="left", fontsize=8)
        column[len(point.measured) - 1].set_xlabel(x_label)
    if len(names) > 2:
        fig.suptitle("Does the corrected twin follow the recording? Error calibrated → corrected")
    else:
        fig.suptitle("Does the calibrated twin follow the recording?")
    style.legend_below(fig, axes[0, 0])
    return fig


def _share_y_by_kind(axes: np.ndarray, points: Sequence[Point]) -> dict[str, int]:
    """Share the y axis of each row among the columns of one kind, which alone have one unit and
    scale. Returns the first column of each kind; the others show no numbers."""
    first_of: dict[str, int] = {}
    for k, point in enumerate(points):
        first = first_of.setdefault(point.kind, k)
        if first == k:
            continue
        for ax, of_kind in zip(axes[:, k], axes[:, first]):
            ax.sharey(of_kind)
            ax.tick_params(axis="y", which="both", labelleft=False)
    return first_of


def plot_residuals(numbers: ExplainedNumbers) -> Figure:
    """Error over the error to be expected: per sensor, frequency and observation."""
    names = curves_of(numbers)[1:]
    height = max(1.2, LEAST_HEIGHT / len(numbers.points))
    fig, axes = style.figure(len(numbers.points), len(names), height=height, sharey="row")
    norm = LogNorm(*RESIDUAL_LIMITS, clip=True)
    for row, point in zip(axes, numbers.points):
        for ax, name in zip(row, names):
            size = getattr(point, f"residual_{name}")
            image = ax.pcolormesh(
                _edges(point.frequency_hz), np.arange(len(size) + 1), size, norm=norm,
                cmap=style.SEQUENTIAL,
            )  # fmt: skip
            sensors = [style.plain(sensor) for sensor in point.sensors[: len(size)]]
            ax.set_yticks(np.arange(len(size)) + 0.5, sensors)
            ax.set_title(f"{name}: {style.plain(title_of(point))}", loc="left", fontsize=8)
    for ax in axes[-1]:
        ax.set_xlabel("frequency / Hz")
    bar = fig.colorbar(image, ax=axes, extend="both", ticks=[0.1, 1, 10, 100])
    bar.ax.set_yticklabels(["0.1", "1", "10", "100"])
    bar.set_label("error over expected error\n(logarithmic; 1: as expected)", fontsize=8)
    fig.suptitle("At which frequencies does the twin miss the recording?")
    return fig


def _edges(x: np.ndarray) -> np.ndarray:
    """Cell edges (N + 1,) between and around points (N,), a single one 1 % wide."""
    if len(x) == 1:
        return x[0] * np.array([0.995, 1.005])
    middle = 0.5 * (x[1:] + x[:-1])
    return np.concatenate([[2 * x[0] - middle[0]], middle, [2 * x[-1] - middle[-1]]])
