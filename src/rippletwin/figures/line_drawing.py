"""Where along the line is it? The line to scale, with what was found below it."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from matplotlib.figure import Figure
from matplotlib.patches import FancyBboxPatch, Polygon, Rectangle

from rippletwin.figures import style
from rippletwin.figures.explained_numbers import ExplainedNumbers, LinePlace, Places

LETTERS = 88  # of a line below the picture
LABELLED_SHARE = 0.08  # of the line's length: a shorter segment has no room for its size
ROW = 1.0  # height of an interval and its label, in pipe widths
FREE = "best single place, whatever the effect"
TELLING_SHARE = 0.5
"""Of the line's length: a longer interval of one free correction tells no place."""
POINT_SHARE = 0.006  # of the line's length: what is shorter is drawn as a mark of this length


def tells_place(places: Places) -> bool:
    """Whether one free correction anywhere in the line could be placed."""
    if places.free is None:
        return False
    return places.free[1] - places.free[0] < TELLING_SHARE * places.length


def describe_free(places: Places) -> str:
    """What the scan of one free correction along the line tells, in one sentence."""
    count = len(places.sensors)
    sensors = {1: "one sensor", 2: "two sensors", 3: "three sensors"}.get(count, f"{count} sensors")
    if places.free is None:
        return f"With {sensors} no place along the line can be told without an effect's name."
    low, high = (f"{end:.2f}" for end in (max(places.free[0], 0.0), places.free[1]))
    if not tells_place(places):
        return (
            f"Without an effect's name, {sensors} cannot tell the place: one free correction "
            f"fits as well anywhere from {low} to {high} m."
        )
    return f"Without an effect's name, one free correction fits best from {low} to {high} m."


def shown_places(places: Places) -> list[LinePlace]:
    """What has a place along the line; an effect of the whole line has none of its own."""
    shown = list(places.found)
    if tells_place(places):
        low, high = places.free
        shown.append(LinePlace(FREE, max(low, 0.0), min(high, places.length)))
    return shown


def plot_place(numbers: ExplainedNumbers) -> Figure | None:
    """The line to scale, with the place and interval of each effect; None without sensors."""
    places = numbers.places
    if not places.sensors:
        return None
    shown = shown_places(places)
    fig, axes = style.figure(1, 1, height=2.1 + 0.33 * len(shown))
    ax = axes[0, 0]
    _draw_line(ax, places)
    _draw_intervals(ax, places, shown)
    length = places.length
    ax.set_xlim(-0.09 * length, 1.09 * length)
    ax.set_ylim(-1.9 - ROW * max(len(shown), 1), 2.1)
    ax.set_yticks([])
    ax.spines["left"].set_visible(False)
    ax.set_xlabel(
        "distance from the pump / m, to scale; diameters enlarged\n"
        + textwrap.fill(describe_free(places), LETTERS)
    )
    fig.suptitle("Where along the line is what the twin lacks?")
    return fig


def _draw_line(ax, places: Places) -> None:
    length, widest = places.length, max(d for _, d in places.segments)
    start = 0.0
    for k, (segment, diameter) in enumerate(places.segments, 1):
        half = 0.5 * diameter / widest
        box = Rectangle((start, -half), segment, 2 * half, fc="#DCE6EE", ec="black", lw=0.8)
        ax.add_patch(box)
        middle = start + segment / 2
        ax.text(middle, 0, f"{k}", ha="center", va="center", fontsize=8)
        if segment > LABELLED_SHARE * length:
            size = f"{segment:.2f} m\n⌀ {1e3 * diameter:.3g} mm"
            ax.text(middle, -0.6, size, ha="center", va="top", fontsize=7, color="#444444")
        start += segment
    pump = FancyBboxPatch(
        (-0.07 * length, -0.7),
        0.07 * length,
        1.4,
        boxstyle="square,pad=0",
        fc="#56656F",
        ec="black",
    )
    ax.add_patch(pump)
    ax.text(-0.035 * length, 0, "pump", color="white", ha="center", va="center", fontsize=8)
    for side in (-1, 1):
        tip = length + 0.035 * length
        corners = [
            (tip, 0),
            (tip + side * 0.035 * length, 0.7),
            (tip + side * 0.035 * length, -0.7),
        ]
        ax.add_patch(Polygon(corners, fc="#56656F", ec="black"))
    ax.text(length * 1.035, 0.85, "load", ha="center", va="bottom", fontsize=8)
    for name, x in places.sensors:
        ax.plot([x, x], [0.5, 1.2], color=style.CALIBRATED, lw=1.2)
        ax.plot(x, 1.25, "v", color=style.CALIBRATED, ms=6)
        ax.text(x, 1.5, f"{style.plain(name)}\n{x:.2f} m", ha="center", va="bottom", fontsize=8)


def _draw_intervals(ax, places: Places, shown: Sequence[LinePlace]) -> None:
    for row, place in enumerate(shown):
        y, width = -2.0 - ROW * row, max(place.high - place.low, POINT_SHARE * places.length)
        start = 0.5 * (place.low + place.high - width)
        free = place.words == FREE
        colour = style.NOMINAL if free else style.ALARM
        ax.add_patch(Rectangle((start, y - 0.14), width, 0.28, fc=colour, ec="none"))
        centre, ends = 0.5 * (place.low + place.high), (0.25, 0.75)
        share = centre / places.length
        align = "left" if share < ends[0] else "right" if share > ends[1] else "center"
        x = {"left": start, "right": start + width, "center": centre}[align]
        where = f"{place.low:.2f} to {place.high:.2f} m"
        if place.high - place.low < 1e-6 * places.length:
            where = f"{place.low:.2f} m"
        ax.text(x, y - 0.22, f"{style.plain(place.words)}: {where}", ha=align, va="top", fontsize=8)
    if not shown:
        ax.text(0.5 * places.length, -2.2, "nothing found", ha="center", fontsize=8)
