"""Ripples over one revolution: measured, nominal, calibrated and corrected."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure

from rippletwin.figures import style

# In the order of drawing: a later curve lies over the earlier ones.
_LOOK = {
    "nominal": dict(color=style.NOMINAL, ls="--", lw=0.8),
    "measured": dict(color=style.MEASURED, lw=1.8),
    "calibrated": dict(color=style.CALIBRATED, lw=1.0),
    "corrected": dict(color=style.CORRECTED, ls="-.", lw=1.0),
}


def shown_unit(units: str) -> tuple[float, str]:
    """What a signal in `units`, Pa or m3/s, is divided by to be drawn, and its axis's label."""
    return (1e5, "pressure ripple / bar") if units == "Pa" else (1e-3 / 60, "flow ripple / L/min")


def plot_overlay(
    angle_deg: np.ndarray, curves: Mapping[str, np.ndarray], sensors: Sequence[str], title: str = ""
) -> Figure:
    """Pressure ripple at each sensor: measured, nominal, calibrated (and corrected).

    angle_deg (M,); curves: name -> (S, M) Pa; one panel a sensor.
    """
    fig, axes = style.figure(len(sensors), 1, height=1.9, sharex=True)
    for k, (ax, sensor) in enumerate(zip(axes[:, 0], sensors)):
        for name, values in sorted(curves.items(), key=lambda item: list(_LOOK).index(item[0])):
            ax.plot(angle_deg, values[k] / 1e5, label=name, **_LOOK[name])
        ax.set_ylabel(f"{style.plain(sensor)}: ripple / bar")
    style.legend_below(fig, axes[0, 0])
    fig.suptitle(f"Does calibration bring the twin to the recording? {style.plain(title)}".rstrip())
    axes[-1, 0].set_xlabel("crank angle / degrees")
    axes[-1, 0].set_xlim(angle_deg[0], angle_deg[-1])
    axes[-1, 0].set_xticks(np.arange(0, 361, 40))
    return fig


def plot_states(
    angle_deg: np.ndarray, curves: Mapping[str, np.ndarray], ylabel: str, scale: float = 1.0
) -> Figure:
    """One ripple a state, one panel each: curves name -> (M,), divided by `scale`."""
    fig, axes = style.figure(len(curves), 1, height=1.3, sharex=True, sharey=True)
    for ax, (name, values) in zip(axes[:, 0], curves.items()):
        ax.plot(angle_deg, values / scale, color=style.CALIBRATED)
        ax.set_title(name, loc="left")
    fig.suptitle("How does one revolution of each simulated state look?")
    fig.supylabel(ylabel, fontsize=9)
    axes[-1, 0].set_xlabel("crank angle / degrees")
    axes[-1, 0].set_xticks(np.arange(0, 361, 40))
    return fig
