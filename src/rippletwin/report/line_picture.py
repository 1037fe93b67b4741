"""The line to scale as SVG: pump, segments, sensors, load, and what was found where."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from markupsafe import Markup

from rippletwin.figures.explained_numbers import LinePlace, Places
from rippletwin.report.svg import round_ticks

PIPE, ROW, TOP = 34.0, 40.0, 62.0  # height of the widest pipe, of an interval and of the sensors
LETTER = 6.6  # width of a letter
END = 46.0  # width of pump and of load
MIN_WIDTH = 6.0  # of an interval: a point is drawn that wide


@dataclass(frozen=True)
class MarkedPlace:
    """An interval along the line, and the class of its colour: found, free or left."""

    place: LinePlace
    role: str


def describe_place(place: LinePlace) -> str:
    """Where it is, in words: "6.00 to 7.15 m" or "at 0.42 m"."""
    if place.high - place.low < 5e-3:
        return f"at {place.low:.2f} m"
    return f"{place.low:.2f} to {place.high:.2f} m"


def draw_line(places: Places, marked: Sequence[MarkedPlace], width: float) -> Markup:
    """The line as an <svg> element of a given width in pixels."""
    axis = TOP + PIPE + 62
    height = axis + ROW * len(marked) + 12
    pixels = (width - 2 * END) / places.length

    def x(position: float) -> float:
        return END + position * pixels

    parts = [*_pipe(places, x), *_sensors(places, x, width), *_scale(places, x, axis)]
    for row, each in enumerate(marked):
        parts.append(_interval(each, x, axis + 18 + ROW * row, width))
    described = "; ".join(f"{m.place.words}, {describe_place(m.place)}" for m in marked)
    sensors = ", ".join(f"{name} at {position:.2f} m" for name, position in places.sensors)
    label = (
        f"The line to scale: pump, {len(places.segments)} segment(s), {places.length:.2f} m, load. "
        f"Sensors: {sensors or 'none'}. {described or 'Nothing is marked'}."
    )
    return Markup(
        '<svg class="line-picture" viewBox="0 0 {} {}" role="img" aria-label="{}">{}</svg>'
    ).format(f"{width:.0f}", f"{height:.0f}", label, Markup("").join(parts))


def _pipe(places: Places, x) -> list[Markup]:
    widest = max(diameter for _, diameter in places.segments)
    middle, start, parts = TOP + PIPE / 2, 0.0, []
    for k, (length, diameter) in enumerate(places.segments, 1):
        high, wide = PIPE * diameter / widest, x(start + length) - x(start)
        centre = x(start) + wide / 2
        size = (f"{length:.2f} m", f"⌀ {1e3 * diameter:.3g} mm")
        parts.append(
            Markup(
                "<g><title>segment {}: {}, {}</title>"
                '<rect class="pipe" x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}"/>'
                '<text class="label strong" x="{:.1f}" y="{:.1f}" dy="0.35em" '
                'text-anchor="middle">{}</text></g>'
            ).format(k, *size, x(start), middle - high / 2, wide, high, centre, middle, k)
        )
        if wide > LETTER * max(map(len, size)):
            for line, words in enumerate(size):
                parts.append(_text(words, centre, TOP + PIPE + 16 + 13 * line, "tick"))
        start += length
    half, tip = PIPE / 2 + 8, x(places.length) + 16
    pump = (f"{middle - half:.1f}", f"{x(0) - 2:.1f}", f"{2 * half:.1f}")
    valve = (
        f"M{tip - 16:.1f} {middle - 16:.1f}v32l16 -16zM{tip + 16:.1f} {middle - 16:.1f}v32l-16 -16z"
    )
    parts.append(
        Markup(
            '<rect class="machine" x="2" y="{}" width="{}" height="{}" rx="3"/>'
            '<path class="machine" d="{}"/>'
        ).format(*pump, valve)
    )
    parts.append(_text("pump", x(0) / 2, middle + 4, "label inverse"))
    parts.append(_text("load", tip, TOP + PIPE + 16, "label"))
    return parts


def _sensors(places: Places, x, width: float) -> list[Markup]:
    parts, right_end = [], [-1e9, -1e9]
    for name, position in sorted(places.sensors, key=lambda sensor: sensor[1]):
        words = f"{name}, {position:.2f} m"
        half = LETTER * len(words) / 2
        centre = min(max(x(position), half), width - half)
        row = 0 if centre - half > right_end[0] + 4 else 1
        right_end[row] = centre + half
        y = 32 - 18 * row
        parts.append(
            Markup(
                '<g><title>sensor {}</title><line class="sensor" x1="{:.1f}" x2="{:.1f}" y1="{}" '
                'y2="{}"/><path class="sensor-head" d="M{:.1f} {}l-6 -10h12z"/></g>'
            ).format(words, x(position), x(position), y + 6, TOP + 4, x(position), TOP + 4)
        )
        parts.append(_text(words, centre, y, "label"))
    return parts


def _scale(places: Places, x, y: float) -> list[Markup]:
    parts = [
        Markup('<line class="axis" x1="{:.1f}" x2="{:.1f}" y1="{:.1f}" y2="{:.1f}"/>').format(
            x(0), x(places.length), y - 14, y - 14
        )
    ]
    for tick in round_ticks(0.0, places.length):
        parts.append(
            Markup('<line class="axis" x1="{:.1f}" x2="{:.1f}" y1="{:.1f}" y2="{:.1f}"/>').format(
                x(tick), x(tick), y - 18, y - 14
            )
        )
        parts.append(_text(f"{tick:.6g}", x(tick), y - 2, "tick"))
    parts.append(_text("m", x(places.length) + 20, y - 2, "tick"))
    return parts


def _interval(marked: MarkedPlace, x, y: float, width: float) -> Markup:
    place = marked.place
    start, end = x(place.low), x(place.high)
    if end - start < MIN_WIDTH:
        start, end = (start + end - MIN_WIDTH) / 2, (start + end + MIN_WIDTH) / 2
    words = f"{place.words}, {describe_place(place)}"
    half = min(LETTER * len(words) / 2, width / 2)
    centre = min(max((start + end) / 2, half), width - half)
    return Markup(
        '<g><title>{}</title><rect class="interval {}" x="{:.1f}" y="{:.1f}" width="{:.1f}" '
        'height="9" rx="2"/>{}</g>'
    ).format(words, marked.role, start, y, end - start, _text(words, centre, y + 23, "label"))


def _text(words: str, x: float, y: float, kind: str) -> Markup:
    return Markup('<text class="{}" x="{:.1f}" y="{:.1f}" text-anchor="middle">{}</text>').format(
        kind, x, y, words
    )
