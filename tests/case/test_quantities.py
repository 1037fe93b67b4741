"""Numbers as a person reads them: units, digits and intervals."""

import math

import pytest

from rippletwin.case import quantities as q


@pytest.mark.parametrize(
    ("value", "unit", "name", "text"),
    [
        (9.5e6, "Pa", "", "95.0 bar"),
        (0.0197, "m", "diameter[1]", "19.7 mm"),
        (1.14e9, "Pa", "bulk_modulus", "1.14 GPa"),
        (1e-12, "m3/(Pa s)", "", "0.00600 L/min per bar"),
        (5e-3, "m3/s", "", "300 L/min"),
        (3.2e-5, "m2/s", "viscosity", "32.0 mm²/s"),
        (6.1e-7, "m2", "", "0.610 mm²"),
        (0.031, "1", "gain_error", "3.10 %"),
        (math.pi / 180, "rad", "amplitude", "1.00°"),
        (0.4, "1", "damping_ratio", "0.400"),
    ],
)
def test_units_are_those_of_a_test_bench(value, unit, name, text):
    """Conversions by hand, one a dimension."""
    assert q.write_value(value, q.unit_of(unit, name)).replace("\u00a0", " ") == text


@pytest.mark.parametrize(
    ("value", "ends", "text"),
    [
        (3e3, (3e3, 3.01e3), "3000 (3000 to 3010)"),
        (15.05, (14.08, 16.07), "15.1 (14.1 to 16.1)"),
        (0.1, (0.09787, 0.1023), "0.1000 (0.0979 to 0.1023)"),
        (-2.0, (-2.6, -1.4), "−2.0 (−2.6 to −1.4)"),
    ],
)
def test_digits_are_those_that_the_interval_leaves(value, ends, text):
    """A value is not written more precisely than it is known, nor in powers of ten."""
    assert q.write_quantity(value, q.Unit(1.0, ""), ends) == text


def test_only_extreme_numbers_have_a_power_of_ten():
    """The power is written as in print."""
    assert q.write_number(-1.2e-7) == "−1.20 × 10⁻⁷"
    assert q.write_number(9.9999e-5) == "1.00 × 10⁻⁴"  # the mantissa never has two digits
    assert q.write_number(12345.0) == "12300"
    assert q.write_number(0.0) == "0"
    assert q.write_number(math.nan) == "unknown"


def test_a_probability_is_said_in_words_where_its_digits_mean_nothing():
    """1.97e-303 is no number for a reader; certainty is never claimed."""
    assert q.write_probability(1.97e-303) == "less than one in a million"
    assert q.write_probability(2e-5) == "about one in 100\u00a0000"
    assert q.write_probability(0.3) == "30 %"
    assert (q.write_certainty(1.0), q.write_certainty(0.0)) == ("> 99.9 %", "< 0.1 %")
    assert (q.write_certainty(0.9954), q.write_certainty(0.97)) == ("99.5 %", "97 %")
