"""Figures of an explanation: ripple, residuals, evidence, position profile, missing immittance."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import pairwise
from multiprocessing import get_context
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from rippletwin.calibration.fit import posterior_at_fit
from rippletwin.explanation.checks.profile_intervals import effect_intervals
from rippletwin.explanation.localise.missing_immittance import missing_immittance
from rippletwin.explanation.localise.residual_bands import residual_map
from rippletwin.explanation.localise.source_free_fits import compare_evidence
from rippletwin.explanation.thresholds import MIN_LOG_BAYES_FACTOR
from rippletwin.explanation.verdict.explanation import Explanation
from rippletwin.figures import style

MAX_COLUMNS = 4  # operating points or effects side by side
SAMPLES_PER_PITCH = 720
SINGLE_EFFECTS_SHOWN = 12
TITLE_LETTERS = 78  # of all titles side by side
EVIDENCE_TICKS = (-1000, -100, -10, 0, 10, 100, 1000, 10000)


def draw(
    explanation: Explanation,
    folder: str | Path,
    suffixes: Sequence[str] = (".png", ".svg"),
    processes: int = 1,
) -> list[Path]:
    """Write every applicable figure into `folder`/figures, once per suffix; returns the paths."""
    draw_one = partial(_draw_one, explanation, Path(folder) / "figures", suffixes)
    if processes < 2:
        return [path for name in FIGURES for path in draw_one(name)]
    with ProcessPoolExecutor(processes, get_context("fork")) as pool:
        return [path for paths in pool.map(draw_one, FIGURES) for path in paths]


def _draw_one(
    explanation: Explanation, folder: Path, suffixes: Sequence[str], name: str
) -> list[Path]:
    figure = FIGURES[name](explanation)
    if figure is None:
        return []
    paths = [folder / f"explain_{name}{suffix}" for suffix in suffixes]
    style.save(figure, *paths)
    return paths


def plot_ripple(e: Explanation) -> Figure:
    """Ripple at each sensor (rows) and operating point (columns): measured, calibrated, corrected.

    For observations that are not periodic, the amplitude against frequency.
    """
    shown = range(min(len(e.observations), MAX_COLUMNS))
    fits = {"calibrated": e.without_effects, "corrected": e.decision.accepted}
    curves = {"measured": []}
    for name, fit in fits.items():
        posterior = posterior_at_fit(fit, e.observations)
        h = posterior.best_source(posterior.predict(fit.twin.theta))
        curves[name] = [h[:, part] for part in posterior.forward.slices]
        curves["measured"] = [posterior.values[:, part] for part in posterior.forward.slices]
    looks = {
        "measured": dict(color=style.MEASURED, lw=1.8),
        "calibrated": dict(color=style.CALIBRATED, lw=1.0),
        "corrected": dict(color=style.CORRECTED, lw=1.0, ls="-."),
    }
    rows = max(len(curves["measured"][k]) for k in shown)
    fig, axes = style.figure(rows, len(shown), height=1.5, sharex="col", sharey="row")
    for k in shown:
        o = e.observations[k]
        axes[0, k].set_title(o.label, loc="left")
        for s in range(len(curves["measured"][k])):
            ax = axes[s, k]
            for name, values in curves.items():
                x, y = _curve(o, values[k][s])
                ax.plot(x, y, label=name, **looks[name])
            if o.kind == "input_impedance":
                ax.set_ylim(0.0, 1.1)  # the reflection of a passive line is at most 1
            elif o.orders is None:
                ax.set_yscale("log")
        axes[-1, k].set_xlabel("frequency / Hz" if o.orders is None else "shaft angle / degrees")
    first = e.observations[0]
    for s in range(rows):
        if first.kind == "input_impedance":
            axes[s, 0].set_ylabel("|reflection coefficient|")
        elif first.orders is None:
            axes[s, 0].set_ylabel(f"|{e.rig.sensors[s].name}| / Pa")
        else:
            axes[s, 0].set_ylabel(f"{e.rig.sensors[s].name} / MPa")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside upper right", ncols=3)
    return fig


def _curve(o, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """x and y of one sensor: ripple in MPa over a piston's pitch, or amplitude over frequency."""
    if o.orders is None:
        return o.frequency_hz, np.abs(values)
    orders = np.asarray(o.orders, float)
    pitch = 2 * np.pi / np.gcd.reduce(np.asarray(o.orders, int))
    angle = pitch * np.arange(SAMPLES_PER_PITCH) / SAMPLES_PER_PITCH
    return np.rad2deg(angle), (values @ np.exp(1j * np.outer(orders, angle))).real / 1e6


def plot_residuals(e: Explanation) -> Figure:
    """Whitened residual per sensor, frequency and observation, calibrated and corrected."""
    fits = (e.search.base, e.decision.accepted)
    count = len(e.observations)
    fig, axes = style.figure(count, 2, height=1.3, sharey="row")
    maps = [residual_map(fit, e.observations) for fit in fits]
    for column, (which, title) in enumerate(zip(maps, ("calibrated", "corrected"))):
        for row, (o, size) in enumerate(zip(e.observations, which)):
            ax = axes[row, column]
            image = ax.pcolormesh(
                _edges(o.frequency_hz),
                np.arange(size.shape[0] + 1),
                np.log10(np.maximum(size, 0.1)),
                vmin=-1,
                vmax=2,
                cmap=style.SEQUENTIAL,
            )
            names = [s.name for s in e.rig.sensors] if len(size) > 1 else [o.kind]
            ax.set_yticks(np.arange(len(size)) + 0.5, names[: len(size)])
            ax.set_title(f"{title}: {o.label}", loc="left")
            if row == count - 1:
                ax.set_xlabel("frequency / Hz")
    bar = fig.colorbar(image, ax=axes)
    bar.set_label("log10 |residual| /\nstandard deviation")
    return fig


def plot_evidence(e: Explanation) -> Figure | None:
    """Log Bayes factor of each explanation against the base, with the threshold.

    Diamonds are fits with an unknown source. None where nothing was searched for.
    """
    search = e.search
    if not search.single_effect_fits:
        return None
    shown = {f.label: f for f in reversed(search.single_effect_fits[:SINGLE_EFFECTS_SHOWN])}
    if len(search.best.hypothesis) > 1:
        shown[search.best.label] = search.best
    if search.passive_networks:
        network = search.passive_networks[0]
        shown["without a name: " + network.label] = network
    values = [search.log_bayes_factor(f) for f in shown.values()]
    threshold = e.min_log_bayes_factor
    # A label has one line per effect; the distance between bars is that of their labels' heights.
    lines = np.array([1 + name.count(" + ") for name in shown])
    heights = np.cumsum(lines) - 0.5 * lines
    fig, axes = style.figure(1, 1, height=0.9 + 0.24 * int(np.sum(lines)))
    ax = axes[0, 0]
    colours = [style.CORRECTED if v > threshold else style.NEUTRAL for v in values]
    ax.barh(heights, values, color=colours, height=0.6)
    ax.barh(heights[:1], 0.0, color=style.CORRECTED, label="source as stated")  # for the legend
    source_free = {
        row["effects"]: row["source_free"]
        for row in compare_evidence(search.leading_fits, e.source_free_fits)
    }
    points = [
        (source_free[f.label], y) for y, f in zip(heights, shown.values()) if f.label in source_free
    ]
    if points:
        marker = dict(ms=5, color=style.MEASURED, mfc="white", label="source unknown")
        ax.plot(*np.array(points).T, "D", **marker)
    ax.axvline(threshold, color=style.ALARM, ls="--", lw=1, label=f"threshold {threshold:.2g}")
    ax.axvline(0.0, color=style.MEASURED, lw=0.6)
    ax.set_xscale("symlog", linthresh=10)
    every = [0.0, MIN_LOG_BAYES_FACTOR, *values, *source_free.values()]
    ticks = [t for t in EVIDENCE_TICKS if min(every) <= t <= max(every)]
    ax.set_xticks(ticks, [f"{t:g}" for t in ticks])
    ax.minorticks_off()
    ax.set_yticks(heights, [name.replace(" + ", "\n+ ") for name in shown])
    ax.set_xlabel("log Bayes factor against the calibrated line")
    fig.legend(loc="outside upper right", ncols=3)
    return fig


def plot_position_profile(e: Explanation) -> Figure | None:
    """Log Bayes factor of one free correction at each position of the line, and of each element."""
    if e.location is None:
        return None
    profile = e.location.profile
    values = {k: v for k, v in e.location.log_bayes_factors.items() if k != "position"}
    fig, axes = style.figure(1, 2, height=2.8, sharey=True, width_ratios=(2.2, 1))
    ax = axes[0, 0]
    for kind, ls, colour in (("shunt", "-", style.CALIBRATED), ("series", "--", style.NOMINAL)):
        y = profile.log_bayes_factors[kind]
        ax.plot(profile.position, y, ls=ls, color=colour, label=f"free {kind} element")
    edges = np.cumsum([0.0, *(s.length for s in e.rig.line)])
    for k, (a, b) in enumerate(pairwise(edges)):
        ax.axvspan(a, b, color=style.NEUTRAL, alpha=0.22 if k % 2 else 0.08, lw=0)
        ax.text(0.5 * (a + b), 0.02, f"{k + 1}", transform=ax.get_xaxis_transform(), ha="center")
    for sensor in e.rig.sensors:
        ax.axvline(sensor.position, color=style.MEASURED, lw=0.8, ls=":")
        ax.text(
            sensor.position, 1.0, sensor.name, transform=ax.get_xaxis_transform(), ha="center",
            va="bottom",
        )  # fmt: skip
    for entry in effect_intervals(e.decision.accepted):
        if "position" in entry["parameters"]:
            low, high = entry["parameters"]["position"]["ci95"]
            ax.axvspan(low, high, color=style.CORRECTED, alpha=0.35, lw=0, label="fitted position")
    ax.set_xlim(edges[0], edges[-1])
    ax.set_xlabel("distance from the pump / m (segments numbered)")
    ax.set_ylabel("log Bayes factor")
    ax.legend()
    ax = axes[0, 1]
    ax.plot(list(values.values()), "o", color=style.CORRECTED)
    ax.vlines(range(len(values)), 0, list(values.values()), color=style.CORRECTED, lw=1)
    ax.set_xticks(range(len(values)), list(values), rotation=90)
    ax.set_title("one free element", loc="left")
    return fig


def plot_immittance(e: Explanation) -> Figure | None:
    """The missing quantity against frequency, one column per effect, with the effect's law."""
    fit = e.decision.accepted
    found = [missing_immittance(fit, e.observations, k) for k in range(len(fit.hypothesis))]
    columns = [(name, m) for name, m in zip(fit.names, found) if m is not None][:MAX_COLUMNS]
    if not columns:
        return None
    fig, axes = style.figure(2, len(columns), height=1.8, sharex="col")
    for column, (name, m) in zip(axes.T, columns):
        order = np.argsort(m.frequency_hz)
        f, law = m.frequency_hz[order], m.law[order]
        is_known = m.sd[order] < 0.5 * np.max(np.abs(law))
        for ax, part, part_name in zip(column, (np.real, np.imag), ("real", "imaginary")):
            y, sd = part(m.points[order]), m.sd[order] / np.sqrt(2)
            ax.errorbar(
                f[is_known], y[is_known], sd[is_known], fmt="o", ms=2.5, lw=0.6,
                color=style.MEASURED, label="by the data alone",
            )  # fmt: skip
            ax.plot(f, part(law), color=style.CORRECTED, label="by the fitted effect")
            ax.axhline(0.0, color=style.NEUTRAL, lw=0.5)
            low, high = np.min(part(law)), np.max(part(law))
            margin = max(high - low, 0.3 * np.max(np.abs(law)))
            ax.set_ylim(low - 0.6 * margin, high + 0.6 * margin)
            ax.set_ylabel(f"{part_name} / {m.unit}")
        title = f"{name.replace('_', ' ')}: {m.quantity}, {m.where}"
        column[0].set_title(textwrap.fill(title, TITLE_LETTERS // len(columns)), loc="left")
        column[-1].set_xlabel("frequency / Hz")
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return fig


def _edges(x: np.ndarray) -> np.ndarray:
    """Cell edges (N + 1,) between and around points (N,)."""
    middle = 0.5 * (x[1:] + x[:-1])
    return np.concatenate([[2 * x[0] - middle[0]], middle, [2 * x[-1] - middle[-1]]])


FIGURES = {
    "ripple": plot_ripple,
    "residuals": plot_residuals,
    "evidence": plot_evidence,
    "profile": plot_position_profile,
    "immittance": plot_immittance,
}
