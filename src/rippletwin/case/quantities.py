"""Quantities in the units that a person uses, with as many digits as are known.

The library calculates in SI units. A reader expects bar, mm, L/min and per cent.
"""

from __future__ import annotations

import math
from typing import NamedTuple

SIGNIFICANT = 3  # digits of a value without an interval
MOST_DIGITS = 6
STATED_DIGITS = 4  # of a value of the data sheet, at most
MINUS = "\u2212"
SUPERSCRIPTS = str.maketrans("-0123456789", "\u207b⁰¹²³⁴⁵⁶⁷⁸⁹")
MIN_PLAIN, MAX_PLAIN = 1e-4, 1e6
"""Numbers outside are written with a power of ten."""


class Unit(NamedTuple):
    """A unit that a person uses: a value in SI units times `factor` is in `name`."""

    factor: float
    name: str


BAR = Unit(1e-5, "bar")
UNITS = {
    "Pa": BAR,
    "m": Unit(1.0, "m"),
    "m/s": Unit(1.0, "m/s"),
    "m2": Unit(1e6, "mm²"),
    "m3": Unit(1e6, "cm³"),
    "m3/s": Unit(6e4, "L/min"),
    "m2/s": Unit(1e6, "mm²/s"),
    "m3/(Pa s)": Unit(6e9, "L/min per bar"),
    "Pa s/m3": Unit(1e-5 / 6e4, "bar per L/min"),
    "Pa s/m4": Unit(1e-5 / 6e4, "bar per L/min and m"),
    "m2/(Pa s)": Unit(6e9, "L/min per bar and m"),
    "Pa s2/m3": Unit(1e-8, "bar s²/L"),
    "s": Unit(1e3, "ms"),
    "rad": Unit(180 / math.pi, "°"),
    "deg": Unit(1.0, "°"),
    "1": Unit(1.0, ""),
}
BY_NAME = {
    "diameter": Unit(1e3, "mm"),
    "bulk_modulus": Unit(1e-9, "GPa"),
    "compliance_ratio": Unit(100.0, "%"),
    "gas_fraction": Unit(100.0, "%"),
    "gain_error": Unit(100.0, "%"),
    "amplitude": Unit(100.0, "%"),
    "load": Unit(100.0, "%"),
    "air_fraction": Unit(100.0, "%"),
    "delay": Unit(1e6, "µs"),
}
"""Parameters that are read in another unit than others of their dimension."""


def unit_of(unit: str, name: str = "") -> Unit:
    """The unit in which a quantity in the SI unit `unit` is read; `name` is the parameter's."""
    stem = name.partition("[")[0]
    if stem == "amplitude" and unit not in ("", "1"):
        return UNITS[unit]
    return BY_NAME.get(stem) or UNITS.get(unit or "1") or Unit(1.0, unit)


def write_number(value: float, step: float | None = None, significant: int = SIGNIFICANT) -> str:
    """A number with the digits that matter.

    step         half the width of its interval, of which one digit is shown, two where the first
                 is a 1 or a 2
    significant  digits of a number without a step
    """
    if not math.isfinite(value):
        return "unknown"
    if value == 0.0:
        return "0"
    size = math.floor(math.log10(abs(value)))
    if not step or not math.isfinite(step):
        digits = significant - 1 - size
    else:
        place = math.floor(math.log10(abs(step)))
        digits = (1 if abs(step) < 3 * 10.0**place else 0) - place
        digits = min(digits, MOST_DIGITS - 1 - size)
    if not MIN_PLAIN <= abs(value) < MAX_PLAIN:
        decimals = max(0, min(digits + size, 3))
        mantissa = round(value / 10.0**size, decimals)
        if abs(mantissa) >= 10.0:  # rounding has carried it over
            mantissa, size = mantissa / 10.0, size + 1
        power = str(size).translate(SUPERSCRIPTS)
        return f"{mantissa:.{decimals}f} × 10{power}".replace("-", MINUS)
    text = f"{round(value, digits):.{max(digits, 0)}f}"
    if float(text) == 0.0:
        text = text.lstrip("-")
    return text.replace("-", MINUS)


def write_quantity(value: float, unit: Unit, ends: tuple[float, float] | None = None) -> str:
    """A value in SI units as "12.3 mm", with "(12.1 to 12.5)" where its interval is known."""
    text = write_number(value * unit.factor, _step(unit, ends))
    if ends is not None:
        text += f" ({write_interval(ends, unit)})"
    return text + _suffix(unit)


def write_value(value: float, unit: Unit, ends: tuple[float, float] | None = None) -> str:
    """A value in SI units with its unit; the digits are those that its interval leaves."""
    return write_number(value * unit.factor, _step(unit, ends)) + _suffix(unit)


def write_stated(value: float, unit: Unit) -> str:
    """A value of the data sheet in SI units with its unit, and with the digits that were given."""
    text = write_number(value * unit.factor, significant=STATED_DIGITS)
    if "." in text and "×" not in text:
        text = text.rstrip("0").rstrip(".")
    return text + _suffix(unit)


def write_interval(ends: tuple[float, float], unit: Unit) -> str:
    """Both ends of an interval in SI units, as "12.1 to 12.5" without the unit."""
    step = _step(unit, ends)
    low, high = (write_number(end * unit.factor, step) for end in sorted(ends))
    return f"{low} to {high}"


def write_share(share: float) -> str:
    """A share in per cent: "2.2 %", "75 %", "0.04 %"."""
    percent = 100.0 * share
    return f"{percent:.0f} %" if percent >= 9.95 else f"{write_number(percent, significant=2)} %"


def write_certainty(p: float) -> str:
    """A probability in per cent that never claims to be certain."""
    if p > 0.999:
        return "> 99.9 %"
    if p > 0.99:
        return f"{100.0 * p:.1f} %"
    return "< 0.1 %" if p < 0.001 else write_share(p)


def write_probability(p: float) -> str:
    """A probability in words where its digits say nothing any more."""
    if p < 1e-6:
        return "less than one in a million"
    if p < 1e-3:
        return f"about one in {10 ** round(-math.log10(p)):,}".replace(",", "\u00a0")
    return f"{write_number(100 * p, significant=2)} %"


def plain(text: str) -> str:
    """Text for a terminal: spaces at which a line may break, and the minus of a keyboard."""
    return text.replace("\u00a0", " ").replace(MINUS, "-")


def _step(unit: Unit, ends: tuple[float, float] | None) -> float | None:
    return None if ends is None else abs(ends[1] - ends[0]) * unit.factor / 2


def _suffix(unit: Unit) -> str:
    if unit.name == "°":
        return "°"
    return f"\u00a0{unit.name}" if unit.name else ""
