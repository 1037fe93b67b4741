"""An open end, against the exact reflection without a flange and the piston in an infinite one."""

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import j1, struve, y1

from rippletwin.twin.effects.base import LineState
from rippletwin.twin.effects.end_radiation import radiation_element
from rippletwin.twin.effects.open_end import (
    FLANGED,
    UNFLANGED,
    radiation_impedance,
)

DENSITY, SPEED, RADIUS = 1.2, 343.0, 0.005
CHARACTERISTIC = DENSITY * SPEED / (np.pi * RADIUS**2)
LOW = np.array([0.02, 0.05, 0.1])  # k R


def impedance(kr, end_correction):
    """Z_r over Zc at `kr`."""
    s = 1j * kr * SPEED / RADIUS
    return radiation_impedance(s, 2 * RADIUS, SPEED, DENSITY, end_correction) / CHARACTERISTIC


def test_unflanged_end_reflects_as_levine_and_schwinger_found():
    """Their exact |R| (1948), integrated numerically; and (k R)^2/4 at low frequency."""

    def exact(kr):
        def part(angle):  # x = kr sin(angle) takes the singular end away
            x = kr * np.sin(angle)
            return np.arctan2(j1(x), -y1(x)) / x

        return np.exp(-2.0 * kr / np.pi * quad(part, 1e-9, 0.5 * np.pi)[0])

    for kr in (0.05, 0.1, 0.2, 0.3):
        z = impedance(kr, UNFLANGED)
        assert abs((z - 1.0) / (z + 1.0)) == pytest.approx(exact(kr), abs=kr**4)
    z = impedance(LOW, UNFLANGED)
    np.testing.assert_allclose(z.real, LOW**2 / 4, rtol=0.01)
    np.testing.assert_allclose(z.imag, 0.6133 * LOW, rtol=0.01)


def test_flanged_end_loses_what_a_piston_in_a_baffle_does():
    """A piston in an infinite baffle radiates R1 = 1 - J1(2 kR)/kR (Rayleigh 1896, sec. 302), about
    (k R)^2/2; its mass, of H1(2 kR)/kR, is a little larger than that of air which may bend its
    front."""
    z = impedance(LOW, FLANGED)
    np.testing.assert_allclose(z.real, 1.0 - j1(2 * LOW) / LOW, rtol=0.01)
    piston = struve(1, 2 * LOW) / LOW
    assert np.all((z.imag < piston) & (z.imag > 0.95 * piston))


def test_loss_grows_with_the_flange():
    """Between the two ends, and never beyond them, however long the end correction."""
    corrections = np.array([0.3, UNFLANGED, 0.7, 0.75, FLANGED, 1.2])
    loss = impedance(0.05, corrections).real / 0.05**2
    np.testing.assert_allclose(loss[[0, 1]], 0.25, rtol=0.01)
    np.testing.assert_allclose(loss[[4, 5]], 0.5, rtol=0.01)
    assert np.all(np.diff(loss[1:5]) > 0.05)


@pytest.mark.parametrize("end_correction", [0.5, UNFLANGED, 0.7, FLANGED])
def test_radiating_element_in_time_is_the_open_end(end_correction):
    """To second order in kR it is the same end, and passive at every frequency."""
    state = LineState(DENSITY, 1.5e-5, np.array([2 * RADIUS]), np.array([SPEED]), np.array([1.0]))
    element = radiation_element(state, end_correction)
    kr = np.array([0.05, 0.1, 0.2, 0.4])
    inside = element.immittance(1j * kr * SPEED / RADIUS) / CHARACTERISTIC
    assert np.all(np.abs(inside - impedance(kr, end_correction)) < 0.7 * kr**4)
    everywhere = 1j * np.geomspace(1.0, 1e7, 200)
    assert np.all(element.immittance(everywhere).real >= 0.0)
