"""Wave speed from bulk modulus, bore and wall."""

import math

import pytest

from rippletwin.line.wave_speed import wave_speed

DENSITY, BULK_MODULUS, STEEL, POISSON = 870.0, 1.6e9, 207e9, 0.3


def test_a_rigid_wall_leaves_the_free_liquid():
    """An infinitely stiff wall and no wall give Newton's and Laplace's sqrt(K/rho)."""
    free = math.sqrt(BULK_MODULUS / DENSITY)
    assert wave_speed(DENSITY, BULK_MODULUS, 0.02) == pytest.approx(free)
    assert wave_speed(DENSITY, BULK_MODULUS, 0.02, 0.002, 1e20) == pytest.approx(free)


@pytest.mark.parametrize("wall", [1e-4, 2e-3, 2e-2])
def test_walls_expand_as_lames_cylinder_does(wall):
    """Independent truth: Lame's stresses in a thick cylinder without axial stress. Its area grows
    by 2/E ((Do^2 + Di^2)/(Do^2 - Di^2) + mu) a pascal; the liquid's compressibility adds to it."""
    inner, outer = 0.02, 0.02 + 2 * wall
    growth = 2 / STEEL * ((outer**2 + inner**2) / (outer**2 - inner**2) + POISSON)
    expected = math.sqrt(1 / (DENSITY * (1 / BULK_MODULUS + growth)))
    assert wave_speed(DENSITY, BULK_MODULUS, inner, wall, STEEL) == pytest.approx(expected)


def test_nothing_is_calculated_from_a_negative_number():
    """A bulk modulus below zero has no wave."""
    with pytest.raises(ValueError, match="positive"):
        wave_speed(DENSITY, -1.0, 0.02)
