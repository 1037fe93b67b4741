"""One period and its harmonics, against sums of cosines written out."""

import numpy as np
import pytest
from scipy.special import jv

from rippletwin.case.model import FlowRipple
from rippletwin.harmonics import (
    flow_harmonics,
    one_period,
    peak_amplitudes,
    phase_modulate,
    resample_period,
)

ORDERS = np.array([0, 3, 9, 40])


@pytest.mark.parametrize("count", [128, 135])
def test_peak_amplitudes_are_those_of_a_sum_of_cosines(count):
    """x = x0 + sum |X_k| cos(k t + arg X_k), for several rows at once, even and odd counts."""
    rng = np.random.default_rng(0)
    amplitudes = rng.normal(size=(2, 4)) + 1j * rng.normal(size=(2, 4))
    amplitudes[:, 0] = amplitudes[:, 0].real
    t = 2 * np.pi * np.arange(count) / count
    wave = sum(
        np.abs(a)[:, None] * np.cos(k * t + np.angle(a)[:, None])
        for k, a in zip(ORDERS, amplitudes.T)
    )
    np.testing.assert_allclose(peak_amplitudes(wave)[:, ORDERS], amplitudes, atol=1e-12)
    np.testing.assert_allclose(one_period(amplitudes, count, ORDERS), wave, atol=1e-12)


@pytest.mark.parametrize("count", [16, 17])
def test_a_period_survives_there_and_back(count):
    """Any period comes back from its harmonics, the last order of an even count included."""
    wave = np.random.default_rng(1).normal(size=(3, count))
    np.testing.assert_allclose(one_period(peak_amplitudes(wave), count), wave, atol=1e-12)


@pytest.mark.parametrize("count", [16, 17, 64, 81])
@pytest.mark.parametrize("size", [32, 33])
def test_a_resampled_period_is_the_same_wave(size, count):
    """Orders that both counts can have come back at the other instants, and no other ones do."""
    t, other = (2 * np.pi * np.arange(n) / n for n in (size, count))
    wave = np.array([1.0 + np.cos(7 * t + 0.3), np.sin(3 * t)])
    if size == 32 and count > size:
        wave[1] += np.cos(16 * t)  # of an even count the last order is a cosine
    expected = np.array([1.0 + np.cos(7 * other + 0.3), np.sin(3 * other)])
    expected[1] += np.cos(16 * other) if size == 32 and count > size else 0.0
    np.testing.assert_allclose(resample_period(wave, count), expected, atol=1e-12)
    above = resample_period(np.cos(16 * t), 32 if size == 33 else 16)
    np.testing.assert_allclose(above, 0.0, atol=1e-12)


def test_modulation_makes_the_sidebands_of_a_modulated_wave():
    """Analytic (Jacobi and Anger): order 27 of a shaft ahead by |b| cos(t + arg b) spreads to order
    n as j^(n-27) J_(n-27)(27 |b|) n/27; what is left of it is not it less its sidebands."""
    b, spectrum = 0.02 * np.exp(0.4j), np.zeros(28, complex)
    spectrum[27] = 3.0 * np.exp(1j)
    orders = np.arange(22, 33)
    m = orders - 27
    exact = 1j**m * jv(m, 27 * abs(b)) * np.exp(1j * m * np.angle(b)) * orders / 27 * spectrum[27]
    np.testing.assert_allclose(
        peak_amplitudes(phase_modulate(spectrum, b, 256))[orders], exact, atol=1e-9
    )


def test_flow_harmonics_are_those_of_the_ripple():
    """Amplitude and phase of a known cosine come back, from even and from uneven angles."""
    for angle in (np.arange(0.0, 360.0, 0.5), np.sort(np.r_[0.0, np.arange(0.2, 360.0, 0.37)])):
        flow = 2.0 + 0.5 * np.cos(9 * np.deg2rad(angle) + 0.3)
        mean, ninth, other = flow_harmonics(FlowRipple(angle, flow), np.array([0, 9, 18]))
        assert mean == pytest.approx(2.0, rel=1e-4)
        assert ninth == pytest.approx(0.5 * np.exp(0.3j), rel=2e-3)
        assert abs(other) < 1e-3


def cosines(angle_deg, orders=(9, 90, 135)):
    """Flow at these angles with a cosine of 0.5 and phase 0.3 at each order, and a mean of 2."""
    angle = np.deg2rad(angle_deg)
    return 2.0 + sum(0.5 * np.cos(k * angle + 0.3) for k in orders)


@pytest.mark.parametrize(
    ("angle", "tolerance"),
    [
        (np.round(np.arange(512) * 360 / 512, 3), 0.005),  # as a file rounds them
        (np.arange(512) * 360 / 512 + 0.15 * np.sin(np.arange(512)), 0.03),
    ],
)
def test_high_orders_of_rounded_and_of_uneven_angles_keep_their_size(angle, tolerance):
    """Against the cosines that were put in, with three and more angles a period. A straight line
    between angles would lose 20 % of order 135."""
    orders = np.array([9, 90, 135])
    found = flow_harmonics(FlowRipple(angle, cosines(angle)), orders)
    np.testing.assert_allclose(found, 0.5 * np.exp(0.3j), atol=0.5 * tolerance)


@pytest.mark.parametrize("count", [180, 181])
def test_orders_that_the_angles_do_not_resolve_have_no_amplitude(count):
    """Of n angles an order of n/2 or more is the mirror of a lower one, and order n the mean."""
    angle = 360.0 * np.arange(count) / count
    ripple = FlowRipple(angle, cosines(angle, (9, 81)))
    assert ripple.highest_order == (count - 1) // 2
    found = flow_harmonics(ripple, np.array([0, 9, 81, 90, 99, 171, 180, 181, 270]))
    np.testing.assert_allclose(found[:3], [2.0, 0.5 * np.exp(0.3j), 0.5 * np.exp(0.3j)], rtol=1e-9)
    # of 181 angles order 90 is resolved, and nothing is there
    np.testing.assert_allclose(found[3:], 0.0, atol=1e-12)
