"""An oil's density and viscosity at work, from its data sheet."""

import pytest

from rippletwin.case.oil import density_at, viscosity_at


def test_viscosity_goes_through_the_data_sheets_values():
    """The line through two temperatures holds at both, and between them it falls steadily."""
    assert viscosity_at(46, 6.8, 40) == pytest.approx(46)
    assert viscosity_at(46, 6.8, 100) == pytest.approx(6.8)
    values = [viscosity_at(46, 6.8, celsius) for celsius in range(0, 120, 5)]
    assert values == sorted(values, reverse=True)


def test_a_grade_46_oil_has_30_cst_at_50_degrees():
    """Charts of hydraulic oils read 30 cSt at 50 degrees for this one."""
    assert viscosity_at(46, 6.75, 50) == pytest.approx(30, abs=1)


def test_an_oil_that_thickens_is_refused():
    """The two values were exchanged."""
    with pytest.raises(ValueError, match="thinner"):
        viscosity_at(6.8, 46, 50)


@pytest.mark.parametrize(
    ("pair", "celsius", "words"),
    [
        ((0.25, 0.2), 50, "Walther's law holds above 0.3 cSt"),
        ((10000, 0.31), -60, "no viscosity follows for -60 degrees"),
    ],
)
def test_where_walthers_law_has_no_value(pair, celsius, words):
    """log log (nu + 0.7) needs more than 0.3 cSt; a law that is much too steep overflows."""
    with pytest.raises(ValueError, match=words):
        viscosity_at(*pair, celsius)


def test_density_falls_by_seven_parts_in_ten_thousand_a_degree():
    """Of 1000 litres at 15 degrees, 1035 at 65: the mass stays."""
    assert 1.035 * density_at(870, 65) == pytest.approx(870, rel=1e-6)
