"""Charts as SVG: a function of arrays that returns markup, coloured by the page's style sheet.

A chart carries its numbers in an attribute, from which the page's script reads what it shows under
the pointer. All text is escaped.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

WIDTH, HEIGHT = 400, 236
LEFT, RIGHT, TOP, BOTTOM = 68, 18, 8, 42
TICKS = 5
FEW_DECADES = 2.2  # of a logarithmic x: below it 2 and 5 have ticks too
DIGITS = 4
MAX_DECADES = 4.5  # of a logarithmic axis: less than that of the largest value is at the bottom


@dataclass(frozen=True)
class Series:
    """One curve: name, y (N,), `role` for its colour (measured, calibrated, corrected, predicted,
    allowed) and `form`: line, dots or stems. NaN is left out. `ends` (2, N) of intervals about
    dots."""

    name: str
    y: np.ndarray
    role: str
    form: str = "line"
    ends: np.ndarray | None = None


@dataclass(frozen=True)
class Chart:
    """Curves over one x (N,), with labels that say quantity and unit.

    heading  what the chart is of; `note` a second line below it
    x_ticks  where, in place of round numbers
    mark     a horizontal line
    """

    heading: str
    x: np.ndarray
    series: Sequence[Series]
    x_label: str
    y_label: str
    note: str = ""
    logarithmic: bool = False
    x_logarithmic: bool = False
    x_ticks: Sequence[float] = ()
    mark: float | None = None


def round_ticks(low: float, high: float, count: int = TICKS) -> list[float]:
    """About `count` round numbers from low to high."""
    span = high - low
    if not span > 0:
        return [low]
    raw = span / count
    size = 10.0 ** np.floor(np.log10(raw))
    step = size * next(m for m in (1, 2, 5, 10) if m * size >= raw * 0.999)
    first = np.ceil(low / step - 1e-9)
    last = np.floor(high / step + 1e-9)
    return [float(k * step) + 0.0 for k in np.arange(first, last + 1)]


def logarithmic_ticks(low: float, high: float) -> list[float]:
    """Powers of ten from low to high, with their double and fivefold where there are few."""
    factors = (1, 2, 5) if np.log10(high / low) < FEW_DECADES else (1,)
    decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    ticks = [float(f"{factor}e{k}") for k in decades for factor in factors]
    return [tick for tick in ticks if low * (1 - 1e-9) <= tick <= high * (1 + 1e-9)]


def draw_chart(chart: Chart) -> Markup:
    """The chart as an <svg> element that fills its container."""
    scale = _Scale.of(chart)
    parts = [*_axes(chart, scale)]
    for series in chart.series:
        parts.append(_DRAWN[series.form](chart.x, series, scale))
    parts.append(
        Markup('<line class="cursor" y1="{}" y2="{}" x1="0" x2="0"/>').format(TOP, HEIGHT - BOTTOM)
    )
    numbers = {
        "x": _rounded(chart.x),
        "plot": [LEFT, WIDTH - LEFT - RIGHT],
        "range": [scale.x_low, scale.x_high],
        "xLogarithmic": scale.x_logarithmic,
        "xLabel": chart.x_label,
        "yLabel": chart.y_label,
        "series": [{"name": s.name, "role": s.role, "y": _rounded(s.y)} for s in chart.series],
    }
    label = f"{chart.heading}. {chart.note}. {chart.y_label} over {chart.x_label}"
    return Markup(
        '<svg class="chart" viewBox="0 0 {} {}" role="img" tabindex="0" aria-label="{}" '
        'data-chart="{}">{}</svg>'
    ).format(WIDTH, HEIGHT, label, json.dumps(numbers), Markup("").join(parts))


@dataclass(frozen=True)
class _Scale:
    """From data to places in the picture; the ends of a logarithmic axis are exponents of ten."""

    x_low: float
    x_high: float
    x_logarithmic: bool
    y_low: float
    y_high: float
    logarithmic: bool

    @classmethod
    def of(cls, chart: Chart) -> _Scale:
        x = _ends(np.log10(chart.x) if chart.x_logarithmic else chart.x)
        every = np.concatenate(
            [
                np.ravel(v).astype(float)
                for s in chart.series
                for v in (s.y, s.ends)
                if v is not None
            ]
        )
        every = every[np.isfinite(every)]
        if chart.logarithmic:
            every = np.log10(every[every > 0])
            high = float(np.max(every, initial=-3.0))
            low = float(max(np.min(every, initial=high - 1), high - MAX_DECADES))
            return cls(*x, chart.x_logarithmic, np.floor(low), np.ceil(high), True)
        low, high = float(np.min(every, initial=0.0)), float(np.max(every, initial=0.0))
        margin = 0.06 * ((high - low) or 1.0)
        return cls(*x, chart.x_logarithmic, low - margin, high + margin, False)

    def x(self, x):
        x = np.log10(x) if self.x_logarithmic else np.asarray(x, float)
        share = (x - self.x_low) / (self.x_high - self.x_low)
        return LEFT + share * (WIDTH - LEFT - RIGHT)

    def y(self, y):
        y = np.asarray(y, float)
        if self.logarithmic:
            with np.errstate(divide="ignore"):
                y = np.log10(np.maximum(y, 10.0**self.y_low))
        share = (y - self.y_low) / (self.y_high - self.y_low)
        return HEIGHT - BOTTOM - share * (HEIGHT - TOP - BOTTOM)


def _ends(x: np.ndarray) -> tuple[float, float]:
    low, high = float(np.min(x)), float(np.max(x))
    return (low, high) if high > low else (low - 0.5, high + 0.5)


def _axes(chart: Chart, scale: _Scale) -> list[Markup]:
    """Grid, ticks and labels."""
    bottom, right = HEIGHT - BOTTOM, WIDTH - RIGHT
    if chart.logarithmic:
        y_ticks = [10.0**k for k in range(int(scale.y_low), int(scale.y_high) + 1)]
    else:
        y_ticks = round_ticks(scale.y_low, scale.y_high)
    parts = []
    for tick in y_ticks:
        y = f"{float(scale.y(tick)):.1f}"
        parts.append(
            Markup(
                '<line class="grid" x1="{}" x2="{}" y1="{}" y2="{}"/>'
                '<text class="tick" x="{}" y="{}" dy="0.32em" text-anchor="end">{}</text>'
            ).format(LEFT, right, y, y, LEFT - 6, y, _tick(tick))
        )
    for tick in chart.x_ticks or _x_ticks(scale):
        x = f"{float(scale.x(tick)):.1f}"
        parts.append(
            Markup(
                '<line class="axis" x1="{}" x2="{}" y1="{}" y2="{}"/>'
                '<text class="tick" x="{}" y="{}" text-anchor="middle">{}</text>'
            ).format(x, x, bottom, bottom + 4, x, bottom + 16, _tick(tick))
        )
    parts.append(
        Markup(
            '<line class="axis" x1="{}" x2="{}" y1="{}" y2="{}"/>'
            '<text class="label" x="{}" y="{}" text-anchor="middle">{}</text>'
            '<text class="label" transform="translate(14 {}) rotate(-90)" '
            'text-anchor="middle">{}</text>'
        ).format(
            LEFT,
            right,
            bottom,
            bottom,
            (LEFT + right) / 2,
            HEIGHT - 6,
            chart.x_label,
            (TOP + bottom) / 2,
            chart.y_label,
        )
    )
    if chart.mark is not None:
        y = f"{float(scale.y(chart.mark)):.1f}"
        mark = '<line class="mark" x1="{}" x2="{}" y1="{}" y2="{}"/>'
        parts.append(Markup(mark).format(LEFT, right, y, y))
    return parts


def _x_ticks(scale: _Scale) -> list[float]:
    if scale.x_logarithmic:
        return logarithmic_ticks(10.0**scale.x_low, 10.0**scale.x_high)
    return round_ticks(scale.x_low, scale.x_high)


def _line(x: np.ndarray, series: Series, scale: _Scale) -> Markup:
    known = np.isfinite(series.y)
    points = " ".join(
        f"{a:.1f},{b:.1f}" for a, b in zip(scale.x(x)[known], scale.y(series.y)[known])
    )
    return Markup('<polyline class="line {}" points="{}"/>').format(series.role, points)


def _stems(x: np.ndarray, series: Series, scale: _Scale) -> Markup:
    known = np.isfinite(series.y)
    bottom = HEIGHT - BOTTOM
    path = "".join(
        f"M{a:.1f} {bottom}V{b:.1f}" for a, b in zip(scale.x(x)[known], scale.y(series.y)[known])
    )
    return Markup('<path class="stems {}" d="{}"/>').format(series.role, path)


def _dots(x: np.ndarray, series: Series, scale: _Scale) -> Markup:
    known = np.isfinite(series.y)
    dots = (
        Markup('<circle cx="{}" cy="{}" r="2.4"/>').format(f"{a:.1f}", f"{b:.1f}")
        for a, b in zip(scale.x(x)[known], scale.y(series.y)[known])
    )
    drawn = Markup('<g class="dots {}">{}</g>').format(series.role, Markup("").join(dots))
    if series.ends is None:
        return drawn
    low, high = (scale.y(ends)[known] for ends in np.asarray(series.ends))
    whiskers = "".join(f"M{a:.1f} {b:.1f}V{c:.1f}" for a, b, c in zip(scale.x(x)[known], low, high))
    return Markup('<path class="stems {}" d="{}"/>{}').format(series.role, whiskers, drawn)


_DRAWN = {"line": _line, "stems": _stems, "dots": _dots}


def _tick(value: float) -> str:
    return f"{value:.6g}".replace("-", "\u2212")


def _rounded(values) -> list:
    return [
        float(f"{value:.{DIGITS}g}") if np.isfinite(value) else None
        for value in np.asarray(values, float)
    ]
