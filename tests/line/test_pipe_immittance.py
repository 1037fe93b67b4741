"""Immittances of a segment and the exponential sum that stands for its friction."""

import numpy as np
import pytest
from scipy.special import iv

from paper_line import DENSITY, VISCOSITY
from rippletwin.line.frequency_domain.pipe_immittance import (
    scaled_friction,
    series_impedance,
    shunt_admittance,
)
from rippletwin.line.time_domain.weighting_functions import recursion
from summed_friction import summed_friction

OIL = {"density": DENSITY, "viscosity": VISCOSITY, "diameter": 0.02}


def radial_profile_friction(sigma, cells=4000):
    """Friction of a pipe from its velocity profile: no Bessel function in it.

    sigma u - (1/y)(y u')' = 1, u(1) = 0 by finite volumes in y = r/R; sigma + ... = 1/mean(u).
    """
    y = (np.arange(cells) + 0.5) / cells
    face = np.arange(cells + 1) / cells
    left, right = face[:-1] * cells, face[1:] * cells
    right[-1] *= 2.0  # half a cell to the wall
    diagonal = sigma * y / cells + left + right
    upper, lower = -(face[1:-1] * cells), -(face[1:-1] * cells)
    value, rest = np.zeros(cells, complex), y / cells + 0j
    d = diagonal.astype(complex)
    for i in range(1, cells):  # Thomas's algorithm
        w = lower[i - 1] / d[i - 1]
        d[i] -= w * upper[i - 1]
        rest[i] -= w * rest[i - 1]
    value[-1] = rest[-1] / d[-1]
    for i in range(cells - 2, -1, -1):
        value[i] = (rest[i] - upper[i] * value[i + 1]) / d[i]
    return 1.0 / np.sum(2.0 * y * value / cells)


@pytest.mark.parametrize("r", [0.3, 3.0, 20.0, 60.0])
def test_friction_is_that_of_the_velocity_profile(r):
    """Independent verification: s I0/I2 is the friction of the solved axial momentum equation."""
    sigma = 1j * r**2
    assert scaled_friction(np.array(sigma)) == pytest.approx(
        radial_profile_friction(sigma), rel=2e-4
    )


def test_friction_agrees_with_unscaled_bessel_functions():
    """The series near zero, the scaled Bessel functions and Hankel's series are one function."""
    r = np.geomspace(0.02, 400.0, 2000)[:, None] * np.exp(0.25j * np.pi * np.array([0.0, 0.5, 1.0]))
    # Below |r| = 0.05 quotients of small I2 lose digits themselves.
    reference = r**2 * iv(0, r) / iv(2, r)
    assert np.max(np.abs(scaled_friction(r**2) / reference - 1)) < 1e-12


def test_low_frequency_limit():
    """s I0/I2 -> 8 + 4 s/3: the analytic expansion of a creeping oscillation."""
    sigma = 1j * np.geomspace(1e-6, 1e-2, 20)
    difference = scaled_friction(sigma) - (8 + 4 * sigma / 3)
    assert np.all(np.abs(difference) < 0.01 * np.abs(sigma) ** 2 + 1e-14)


def test_high_frequency_limit_without_overflow():
    """s I0/I2 -> s (1 + 2/sqrt(s) + 3/s), to |r| = 1e4 and far beyond, without overflow."""
    sigma = 1j * np.geomspace(1e3, 1e6, 20) ** 2
    limit = sigma * (1 + 2 / np.sqrt(sigma) + 3 / sigma)
    assert np.all(np.isfinite(scaled_friction(sigma)))
    error = np.abs(scaled_friction(sigma) / limit - 1)
    assert np.all(error < 4 / np.abs(sigma) ** 1.5 + 1e-15)


def test_steady_flow_is_hagen_poiseuille():
    """At s = 0 both friction laws are 128 mu/(pi D^4), the analytic resistance of a pipe."""
    resistance = 128 * DENSITY * VISCOSITY / (np.pi * 0.02**4)
    for friction in ("steady", "unsteady"):
        z = series_impedance(np.zeros(1), friction=friction, **OIL)
        assert z[0] == pytest.approx(resistance, rel=1e-14)
    assert series_impedance(np.zeros(1), friction="none", **OIL)[0] == 0


def test_lossless_characteristic_impedance_and_speed():
    """sqrt(Z'/Y') = rho a/A and sqrt(Z'Y') = s/a without friction (definition of both)."""
    s = 2j * np.pi * np.array([10.0, 1e4])
    z = series_impedance(s, friction="none", **OIL)
    y = shunt_admittance(s, density=DENSITY, wave_speed=1000.0, diameter=0.02)
    assert np.sqrt(z / y) == pytest.approx(DENSITY * 1000 / (np.pi * 1e-4), rel=1e-14)
    assert np.sqrt(z * y) == pytest.approx(s / 1000, rel=1e-14)


def test_arguments_broadcast():
    """Diameters (n, 1) with s (F,) give what each diameter gives alone (parity)."""
    s, d = 2j * np.pi * np.array([5.0, 500.0, 5e4]), np.array([0.001, 0.02])
    both = series_impedance(s, density=870, viscosity=3e-5, diameter=d[:, None])
    one = [series_impedance(s, density=870, viscosity=3e-5, diameter=x) for x in d]
    assert np.allclose(both, one, rtol=1e-14, atol=0)


def test_unknown_friction_is_refused():
    with pytest.raises(ValueError, match="friction"):
        series_impedance(np.ones(1), friction="turbulent", **OIL)


def test_exponential_sum_stands_for_the_friction():
    """The ten weights reproduce the unsteady part to 0.2 % wherever oil lines work (r to 1000)."""
    sigma = 1j * np.geomspace(0.1, 1000.0, 500) ** 2
    exact = scaled_friction(sigma)
    assert np.max(np.abs(summed_friction(sigma) - exact) / np.abs(exact - sigma)) < 2e-3


def test_recursion_is_the_sum_at_fine_steps():
    """Driven by a sine, the recursion's response tends to 4 sum m s/(s + n) as step^2."""
    frequency, errors = 2000.0, []
    for points in (80, 160):
        step = 2 * np.pi / frequency / points
        e, g, h = recursion(step)
        z = np.exp(1j * frequency * step)
        memory = np.sum((g - h / z) * (1 - 1 / z) / (1 - e / z))
        exact = (summed_friction(np.array(1j * frequency)) - 1j * frequency - 8) / 4
        errors.append(abs(memory / exact - 1))
    assert errors[1] < 2e-3
    assert errors[0] / errors[1] > 3.0
