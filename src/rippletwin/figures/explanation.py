"""Pictures of an explanation: ripple, residuals, evidence, profile along the line, immittance."""

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
from rippletwin.explanation.thresholds import ACCEPT
from rippletwin.figures import style

POINTS = 4  # operating points or effects shown side by side at most
SAMPLES = 720
TITLE = 78  # letters that titles side by side have room for


def draw(
    explanation,
    folder: str | Path,
    suffixes: Sequence[str] = (".png", ".svg"),
    processes: int = 1,
) -> list[Path]:
    """Write every figure that applies into `folder`/figures, once a suffix; returns the paths."""
    one = partial(_draw, explanation, Path(folder) / "figures", suffixes)
    if processes < 2:
        return [path for name in FIGURES for path in one(name)]
    with ProcessPoolExecutor(processes, get_context("fork")) as pool:
        return [path for paths in pool.map(one, FIGURES) for path in paths]


def _draw(explanation, folder: Path, suffixes: Sequence[str], name: str) -> list[Path]:
    figure = FIGURES[name](explanation)
    if figure is None:
        return []
    paths = [folder / f"explain_{name}{suffix}" for suffix in suffixes]
    style.save(figure, *paths)
    return paths


def overlay(e) -> Figure | None:
    """Ripple at each sensor (rows) and operating point (columns): measured, calibrated, corrected.

    Of observations that are no periodic ripple the amplitude against frequency.
    """
    shown = range(min(len(e.observations), POINTS))
    fits = {"calibrated": e.search.base, "corrected": e.judgement.accepted}
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
                x, y = _trace(o, values[k][s])
                ax.plot(x, y, label=name, **looks[name])
            if o.kind == "input_impedance":
                ax.set_ylim(0.0, 1.1)  # of a passive line's reflection
            elif o.orders is None:
                ax.set_yscale("log")
        axes[-1, k].set_xlabel("frequency / Hz" if o.orders is None else "shaft angle / degrees")
    first = e.observations[0]
    for s in range(rows):
        if first.kind == "input_impedance":
            axes[s, 0].set_ylabel("|reflection|")
        elif first.orders is None:
            axes[s, 0].set_ylabel(f"|{e.rig.sensors[s].name}| / Pa")
        else:
            axes[s, 0].set_ylabel(f"{e.rig.sensors[s].name} / MPa")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside upper right", ncols=3)
    return fig


def _trace(o, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """x and y of one sensor: ripple in MPa over a piston's pitch, or amplitude over frequency."""
    if o.orders is None:
        return o.frequency_hz, np.abs(values)
    orders = np.asarray(o.orders, float)
    pitch = 2 * np.pi / np.gcd.reduce(np.asarray(o.orders, int))
    angle = pitch * np.arange(SAMPLES) / SAMPLES
    return np.rad2deg(angle), (values @ np.exp(1j * np.outer(orders, angle))).real / 1e6


def residuals(e) -> Figure:
    """Whitened residual per sensor, frequency and observation, before and after."""
    fits = (e.search.base, e.judgement.accepted)
    count = len(e.observations)
    fig, axes = style.figure(count, 2, height=1.3, sharey="row")
    maps = [residual_map(fit, e.observations) for fit in fits]
    for column, (which, title) in enumerate(zip(maps, ("before", "after"))):
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
    bar.set_label("log10 |residual|\n/ believed error")
    return fig


def evidence(e) -> Figure | None:
    """Log evidence that each explanation adds to the base, with the threshold; beside it what
    survives in a fit that is blind to the source. None where nothing was searched for."""
    search = e.search
    if not search.singles:
        return None
    shown = {f.label: f for f in reversed(search.singles[:12])}
    if len(search.best.hypothesis) > 1:
        shown[search.best.label] = search.best
    if search.passive_networks:
        shown["no name: " + search.passive_networks[0].label] = search.passive_networks[0]
    gains = [search.gain(f) for f in shown.values()]
    # One effect a line of the label, and each bar as far from its neighbours as its label is high.
    lines = np.array([1 + name.count(" + ") for name in shown])
    places = np.cumsum(lines) - 0.5 * lines
    fig, axes = style.figure(1, 1, height=0.9 + 0.24 * int(np.sum(lines)))
    ax = axes[0, 0]
    colours = [style.CORRECTED if g > e.threshold else style.NEUTRAL for g in gains]
    ax.barh(places, gains, color=colours, height=0.6)
    ax.barh(places[:1], 0.0, color=style.CORRECTED, label="source as stated")  # the legend's patch
    unseen = {row["effects"]: row["source_free"] for row in compare_evidence(search, e.blind)}
    points = [(unseen[f.label], y) for y, f in zip(places, shown.values()) if f.label in unseen]
    if points:
        looks = dict(ms=5, color=style.MEASURED, mfc="white", label="blind to the source")
        ax.plot(*np.array(points).T, "D", **looks)
    words = f"threshold {e.threshold:.2g}"
    ax.axvline(e.threshold, color=style.ALARM, ls="--", lw=1, label=words)
    ax.axvline(0.0, color=style.MEASURED, lw=0.6)
    ax.set_xscale("symlog", linthresh=10)
    ticks = [t for t in (-1000, -100, -10, 0, 10, 100, 1000, 10000) if _within(t, gains, unseen)]
    ax.set_xticks(ticks, [f"{t:g}" for t in ticks])
    ax.minorticks_off()
    ax.set_yticks(places, [name.replace(" + ", "\n+ ") for name in shown])
    ax.set_xlabel("log evidence over the calibrated line")
    fig.legend(loc="outside upper right", ncols=3)
    return fig


def along(e) -> Figure | None:
    """Log evidence gained by one free correction at each place of the line, and of each element."""
    if e.located is None:
        return None
    scan = e.located.profile
    gains = {name: gain for name, gain in e.located.gains.items() if name != "position"}
    fig, axes = style.figure(1, 2, height=2.8, sharey=True, width_ratios=(2.2, 1))
    ax = axes[0, 0]
    for kind, ls, colour in (("shunt", "-", style.CALIBRATED), ("series", "--", style.NOMINAL)):
        ax.plot(scan.position, scan.gain[kind], ls=ls, color=colour, label=f"free {kind} there")
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
    for entry in effect_intervals(e.judgement.accepted):
        if "position" in entry["parameters"]:
            low, high = entry["parameters"]["position"]["ci95"]
            ax.axvspan(low, high, color=style.CORRECTED, alpha=0.35, lw=0, label="fitted place")
    ax.set_xlim(edges[0], edges[-1])
    ax.set_xlabel("distance from the pump / m; numbers: segments")
    ax.set_ylabel("log evidence gained")
    ax.legend()
    ax = axes[0, 1]
    names = list(gains)
    ax.plot(list(gains.values()), "o", color=style.CORRECTED)
    ax.vlines(range(len(names)), 0, list(gains.values()), color=style.CORRECTED, lw=1)
    ax.set_xticks(range(len(names)), names, rotation=90)
    ax.set_title("one element free", loc="left")
    return fig


def immittance(e) -> Figure | None:
    """What the line lacks against frequency, one column an effect, with its law through it."""
    fit = e.judgement.accepted
    found = [missing_immittance(fit, e.observations, k) for k in range(len(fit.hypothesis))][
        :POINTS
    ]
    found = [(name, m) for name, m in zip(fit.names, found) if m is not None]
    if not found:
        return None
    fig, axes = style.figure(2, len(found), height=1.8, sharex="col")
    for column, (name, m) in zip(axes.T, found):
        order = np.argsort(m.frequency_hz)
        f, law = m.frequency_hz[order], m.law[order]
        known = m.sd[order] < 0.5 * np.max(np.abs(law))
        for ax, part, title in zip(column, (np.real, np.imag), ("real", "imaginary")):
            y, sd = part(m.points[order]), m.sd[order] / np.sqrt(2)
            ax.errorbar(
                f[known], y[known], sd[known], fmt="o", ms=2.5, lw=0.6, color=style.MEASURED,
                label="asked for by the data",
            )  # fmt: skip
            ax.plot(f, part(law), color=style.CORRECTED, label="law of the effect")
            ax.axhline(0.0, color=style.NEUTRAL, lw=0.5)
            low, high = np.min(part(law)), np.max(part(law))
            room = max(high - low, 0.3 * np.max(np.abs(law)))
            ax.set_ylim(low - 0.6 * room, high + 0.6 * room)
            ax.set_ylabel(f"{title} / {m.unit}")
        words = f"{name.replace('_', ' ')}: {m.quantity}, {m.where}"
        column[0].set_title(textwrap.fill(words, TITLE // len(found)), loc="left")
        column[-1].set_xlabel("frequency / Hz")
    fig.legend(*axes[0, 0].get_legend_handles_labels(), loc="outside upper right", ncols=2)
    return fig


def _within(tick: float, gains, unseen) -> bool:
    every = [0.0, ACCEPT, *gains, *unseen.values()]
    return min(every) <= tick <= max(every)


def _edges(x: np.ndarray) -> np.ndarray:
    middle = 0.5 * (x[1:] + x[:-1])
    return np.concatenate([[2 * x[0] - middle[0]], middle, [2 * x[-1] - middle[-1]]])


FIGURES = {
    "ripple": overlay,
    "residuals": residuals,
    "evidence": evidence,
    "profile": along,
    "immittance": immittance,
}
