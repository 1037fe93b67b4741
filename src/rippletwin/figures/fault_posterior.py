"""Pictures of a recording's diagnosis: what changed against what leaks change, and how large."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from rippletwin.diagnosis.diagnosis import Diagnosis
from rippletwin.diagnosis.faults.library import state_name
from rippletwin.figures import style


def draw(
    diagnoses: Sequence[Diagnosis], folder: str | Path, suffixes: Sequence[str] = (".png", ".svg")
) -> list[Path]:
    """Write both pictures of each recording into `folder`/figures; returns the paths."""
    written = []
    for d in diagnoses:
        for name, figure in (("change", change(d)), ("severity", severity(d))):
            paths = [
                Path(folder) / "figures" / f"diagnose_{d.label}_{name}{suffix}"
                for suffix in suffixes
            ]
            style.save(figure, *paths)
            written += paths
    return written


def change(d: Diagnosis) -> Figure:
    """Amplitude of the change at each shaft order and sensor, measured and by the most probable
    state, with the error that is allowed for."""
    model, best = d.model, d.best
    model.linearise_line(best.mode)
    parts = model.parts(best.mode)
    error = np.sqrt(model.variance(parts, best.errors)) / 1e3
    measured = np.abs(model.values - parts.healthy) / 1e3
    predicted = np.abs(parts.change) / 1e3
    sensors = model.line.twin.rig.sensors
    fig, axes = style.figure(len(measured), 1, height=1.8, sharex=True)
    for ax, sensor, seen, told, allowed in zip(axes[:, 0], sensors, measured, predicted, error):
        ax.plot(model.orders, seen, "o", ms=2.5, color=style.MEASURED, label="measured")
        name = "no change" if not best.state else state_name(best.state)
        ax.plot(model.orders, told, color=style.CORRECTED, lw=0.8, label=f"predicted: {name}")
        ax.plot(model.orders, allowed, ":", color=style.NEUTRAL, label="error allowed for")
        ax.set_yscale("log")
        ax.set_ylim(0.2 * max(float(np.min(allowed)), 1e-6), 2.0 * float(np.max(seen)))
        ax.set_ylabel(f"{sensor.name}: change / kPa")
    axes[0, 0].set_title(f"{d.label}: {d.state}", loc="left")
    axes[-1, 0].set_xlabel("shaft order")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside upper right", ncols=3)
    return fig


def severity(d: Diagnosis) -> Figure:
    """Probability of each state, and the density of each leak area of the most probable one."""
    fig, axes = style.figure(1, 2, height=2.4, width_ratios=(1, 1.4))
    names = list(d.probabilities)[::-1]
    ax = axes[0, 0]
    colours = [style.CORRECTED if n == state_name(d.best.state) else style.NEUTRAL for n in names]
    ax.barh(names, [d.probabilities[n] for n in names], color=colours, height=0.6)
    ax.set_xlim(0.0, 1.0)
    ax.set_xlabel("probability")
    ax.set_title(f"{d.label}: {d.state}", loc="left")
    ax = axes[0, 1]
    for (name, density), colour in zip(d.best.areas.items(), style.CYCLE):
        shape = np.exp(density.log_density - np.max(density.log_density))
        ax.plot(np.exp(density.nodes), shape, color=colour, label=name)
        middle, low, high = np.exp(density.quantiles([0.5, 0.025, 0.975]))
        ax.axvspan(low, high, color=colour, alpha=0.15, lw=0)
        ax.axvline(middle, color=colour, lw=0.8, ls=":")
    ax.set_xscale("log")
    ax.set_yticks([])
    ax.set_ylabel("density over log area")
    ax.set_xlabel("leak area / m2")
    if d.best.areas:
        ax.legend()
    else:
        ax.text(0.5, 0.5, "no leak", transform=ax.transAxes, ha="center")
    return fig
