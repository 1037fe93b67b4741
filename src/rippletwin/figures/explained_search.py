"""Which effect explains the recording, and what does it add to the line?"""

from __future__ import annotations

import textwrap

import numpy as np
from matplotlib.figure import Figure

from rippletwin.case.quantities import unit_of, write_number
from rippletwin.figures import style
from rippletwin.figures.explained_numbers import ExplainedNumbers

MAX_COLUMNS = 3  # effects side by side
LETTERS = 84  # of all titles side by side
LINEAR_TO = 10.0
TICKS = (-10_000, -1000, -100, -10, 0, 10, 100, 1000, 10_000, 100_000)


def plot_evidence(numbers: ExplainedNumbers) -> Figure | None:
    """Log Bayes factor of each explanation against the calibrated line, with the threshold.

    Diamonds are fits with an unknown source. None where nothing was searched for.
    """
    if not numbers.candidates:
        return None
    shown, threshold = numbers.candidates[::-1], numbers.threshold
    # A label has one line per effect; the distance between bars is that of their labels' heights.
    lines = np.array([len(c.effects) for c in shown])
    heights = np.cumsum(lines) - 0.5 * lines
    fig, axes = style.figure(1, 1, height=1.35 + 0.24 * int(np.sum(lines)))
    ax = axes[0, 0]
    for name, colour, hatch, is_above in (
        ("above the threshold", style.CALIBRATED, None, True),
        ("below it", "#B8D8EE", "////", False),
    ):
        bars = [
            (y, c.evidence) for y, c in zip(heights, shown) if (c.evidence > threshold) is is_above
        ]
        if bars:
            ax.barh(
                *np.array(bars).T, color=colour, hatch=hatch, ec="white", height=0.6, label=name
            )
    for y, c in zip(heights, shown):
        ax.annotate(
            write_number(c.evidence), (max(c.evidence, 0.0), y), (7, 0), va="center",
            textcoords="offset points", fontsize=8,
            bbox=dict(fc="white", ec="none", pad=0.5),
        )  # fmt: skip
    points = [(c.source_free, y) for y, c in zip(heights, shown) if c.source_free is not None]
    if points:
        marker = dict(ms=5, color=style.MEASURED, mfc="white", label="source-free fit")
        ax.plot(*np.array(points).T, "D", **marker)
    label = f"threshold {write_number(threshold)}"
    ax.axvline(threshold, color=style.ALARM, ls="--", lw=1, label=label)
    ax.axvline(0.0, color=style.MEASURED, lw=0.6)
    ax.set_xscale("symlog", linthresh=LINEAR_TO)
    every = [0.0, threshold, *(c.evidence for c in shown), *(x for x, _ in points)]
    low, high = min(every), max(every)
    ax.set_xlim(1.6 * low if low < 0 else -0.8, 4.0 * high)  # room for numbers and diamonds
    ticks = [t for t in TICKS if ax.get_xlim()[0] <= t <= ax.get_xlim()[1]]
    ax.set_xticks(ticks, [f"{t:,}".replace(",", "\u202f").replace("-", "−") for t in ticks])
    ax.minorticks_off()
    ax.set_yticks(heights, [style.plain("\n+ ".join(c.effects)) for c in shown])
    ax.set_xlabel(
        "log evidence, counted from the calibrated line\n(scale linear to ±10, logarithmic beyond)"
    )
    fig.suptitle("Which effects explain the recording?")
    style.legend_below(fig, ax)
    return fig


def plot_immittance(numbers: ExplainedNumbers) -> Figure | None:
    """The missing quantity against frequency, one column per effect, with the effect's law."""
    columns = numbers.missing[:MAX_COLUMNS]
    if not columns:
        return None
    fig, axes = style.figure(2, len(columns), height=1.9, sharex="col")
    for column, m in zip(axes.T, columns):
        unit = unit_of(m.unit) if m.unit != "1" else unit_of("1", "gain_error")
        law, points = m.law * unit.factor, m.points * unit.factor
        sd = m.sd * unit.factor / np.sqrt(2)
        is_known = m.sd < 0.5 * np.max(np.abs(m.law))
        # real and imaginary part have one scale: a part that is zero shows as zero
        reach = 1.25 * np.max(np.abs(np.concatenate([law.real, law.imag])))
        for ax, part, part_name in zip(column, (np.real, np.imag), ("real", "imaginary")):
            ax.errorbar(
                m.frequency_hz[is_known], part(points[is_known]), sd[is_known], fmt="o", ms=2.5,
                lw=0.6, color=style.MEASURED, label="by the recording alone",
            )  # fmt: skip
            ax.plot(m.frequency_hz, part(law), color=style.ALARM, label="by the fitted effect")
            ax.axhline(0.0, color=style.NEUTRAL, lw=0.5)
            low, high = np.min(part(law)), np.max(part(law))
            margin = max(0.4 * (high - low), 0.3 * reach)
            ax.set_ylim(low - margin, high + margin)
            if m is columns[0]:
                ax.set_ylabel(f"{part_name} part")
        title = textwrap.fill(f"{m.effect}: {m.quantity}", LETTERS // len(columns))
        column[0].set_title(f"{style.plain(title)}\nin {unit.name}", loc="left", fontsize=8)
        column[-1].set_xlabel("frequency / Hz")
    fig.suptitle("What do the effects add to the line, and does the recording ask for it?")
    style.legend_below(fig, axes[0, 0])
    return fig


def plot_load(numbers: ExplainedNumbers) -> Figure | None:
    """Amplitude and phase of the reflection coefficient of an unknown load; None where it is
    known."""
    end = numbers.load
    if end is None:
        return None
    fig, axes = style.figure(2, 1, height=1.9, sharex=True)
    size, sd = np.abs(end.reflection), end.sd / np.sqrt(2)
    phase = np.rad2deg(np.unwrap(np.angle(end.reflection)))
    phase_sd = np.rad2deg(np.minimum(sd / np.maximum(size, 1e-12), np.pi))
    for ax, values, half in zip(np.ravel(axes), (size, phase), (1.96 * sd, 1.96 * phase_sd)):
        band = dict(color=style.CALIBRATED, alpha=0.25, lw=0, label="95 % interval")
        ax.fill_between(end.frequency_hz, values - half, values + half, **band)
        ax.plot(end.frequency_hz, values, color=style.CALIBRATED, label="by the fitted load")
    upper, lower = np.ravel(axes)
    upper.set_ylim(0.0, 1.0)
    upper.set_ylabel("|R|")
    lower.set_ylabel("phase / deg")
    lower.set_xlabel("frequency / Hz")
    fig.suptitle("What share of a wave does the unknown load reflect?")
    style.legend_below(fig, upper)
    return fig
