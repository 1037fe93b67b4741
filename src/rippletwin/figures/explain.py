"""Pictures of an explanation: ripple, residuals, profile along the line, evidence, immittance."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from rippletwin.explain.describe import missing_admittance, named_admittance
from rippletwin.explain.detect import residual_map
from rippletwin.explain.locate import profile
from rippletwin.explain.posterior import Posterior
from rippletwin.explain.search import ACCEPT
from rippletwin.figures import style

SAMPLES = 720


def draw(explanation, folder: str | Path, suffix: str = ".png") -> list[Path]:
    """Write every figure that applies into `folder`/figures; returns their paths."""
    folder = Path(folder) / "figures"
    paths = []
    for name, make in FIGURES.items():
        figure = make(explanation)
        if figure is not None:
            paths.append(folder / f"explain_{name}{suffix}")
            style.save(figure, paths[-1])
    return paths


def overlay(e) -> Figure | None:
    """Ripple of the first periodic recording at each sensor: measured, calibrated, corrected."""
    periodic = [k for k, o in enumerate(e.observations) if o.orders is not None]
    if not periodic:
        return None
    k = periodic[0]
    o = e.observations[k]
    orders = np.asarray(o.orders, float)
    pitch = 2 * np.pi / np.gcd.reduce(np.asarray(o.orders, int))
    angle = pitch * np.arange(SAMPLES) / SAMPLES
    waves = np.exp(1j * np.outer(orders, angle))
    curves = {"measured": o.values}
    fits = {"calibrated": e.search.base, "corrected": e.judgement.accepted}
    for name, fit in fits.items():
        posterior = Posterior(fit.twin, e.observations)
        curves[name] = posterior.predict(fit.twin.theta)[:, posterior.forward.slices[k]]
    looks = {
        "measured": dict(color=style.MEASURED, lw=1.8),
        "calibrated": dict(color=style.CALIBRATED, lw=1.0),
        "corrected": dict(color=style.CORRECTED, lw=1.0, ls="-."),
    }
    fig, axes = style.figure(len(o.values), 1, height=1.7, sharex=True)
    for s, ax in enumerate(axes[:, 0]):
        for name, values in curves.items():
            ax.plot(np.rad2deg(angle), (values[s] @ waves).real / 1e6, label=name, **looks[name])
        ax.set_ylabel(f"{e.rig.sensors[s].name} / MPa")
    axes[-1, 0].set_xlabel("shaft angle within a piston's pitch / degrees")
    handles, labels = axes[0, 0].get_legend_handles_labels()
    fig.legend(handles, labels, loc="outside upper right", ncols=3)
    return fig


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
    bar = fig.colorbar(image, ax=axes, shrink=0.8)
    bar.set_label("log10 |residual| / believed error")
    return fig


def evidence(e) -> Figure:
    """Log evidence that each single effect adds to the base, with the threshold."""
    shown = e.search.singles[:15]
    gains = [e.search.gain(f) for f in shown]
    labels = [f"{f.names[0]}, {f.hypothesis[0][1]}" for f in shown]
    if len(e.search.best.hypothesis) > 1:
        labels.insert(0, " + ".join(e.search.best.names))
        gains.insert(0, e.search.gain(e.search.best))
    if e.search.others:
        labels.insert(0, "without a name")
        gains.insert(0, e.search.gain(e.search.others[0]))
    fig, axes = style.figure(1, 1, height=0.8 + 0.2 * len(gains))
    ax = axes[0, 0]
    places = np.arange(len(gains))[::-1]
    colours = [style.CORRECTED if g > ACCEPT else style.NEUTRAL for g in gains]
    ax.barh(places, gains, color=colours)
    ax.axvline(ACCEPT, color=style.ALARM, ls="--", lw=1, label="threshold")
    ax.set_xscale("symlog", linthresh=10)
    ax.set_yticks(places, labels)
    ax.set_xlabel("log evidence over the calibrated line")
    ax.legend(loc="lower right")
    return fig


def along(e) -> Figure | None:
    """Log likelihood gained by one free correction at each place of the line."""
    found = profile(e.search.base, e.observations)
    if found is None:
        return None
    fig, axes = style.figure(1, 1, height=2.4)
    ax = axes[0, 0]
    for kind, ls in (("shunt", "-"), ("series", "--")):
        ax.plot(found.position, found.gain[kind], ls=ls, label=f"free {kind}")
    for sensor in e.rig.sensors:
        ax.axvline(sensor.position, color=style.NEUTRAL, lw=0.8, ls=":")
        ax.text(sensor.position, ax.get_ylim()[1], sensor.name, ha="center", va="bottom")
    for end in np.cumsum([s.length for s in e.rig.line])[:-1]:
        ax.axvline(end, color=style.NEUTRAL, lw=0.4)
    ax.set_xlabel("distance from the pump / m")
    ax.set_ylabel("log evidence gained")
    ax.legend()
    return fig


def immittance(e) -> Figure | None:
    """Missing admittance against frequency, with the named law through it."""
    named = named_admittance(e.judgement.accepted, e.observations)
    if named is None:
        return None
    position, frequency, law = named
    points = missing_admittance(e.judgement.accepted, e.observations, position)
    fig, axes = style.figure(2, 1, height=1.7, sharex=True)
    order = np.argsort(frequency)
    for ax, part, title in zip(axes[:, 0], (np.real, np.imag), ("real", "imaginary")):
        ax.plot(frequency[order], part(points)[order], "o", ms=3, color=style.MEASURED)
        ax.plot(frequency[order], part(law)[order], color=style.CORRECTED)
        ax.set_ylabel(f"{title} part / m3/(Pa s)")
        spread = 3 * np.max(np.abs(law)) or 1.0
        ax.set_ylim(-spread, spread)
    axes[-1, 0].set_xlabel("frequency / Hz")
    axes[0, 0].set_title(f"missing admittance at {position:.2f} m", loc="left")
    return fig


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
