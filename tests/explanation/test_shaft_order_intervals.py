"""Intervals of the amplitudes at shaft orders: how often they contain the truth."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rippletwin.calibration.frequency_continuation import refine
from rippletwin.case.model import FlowRipple, Load
from rippletwin.explanation.localise.shaft_order_intervals import add_amplitude_intervals
from rippletwin.explanation.localise.shaft_orders import analyse_shaft_orders
from rippletwin.harmonics import flow_harmonics, modulate_ripple
from rippletwin.spectra.frequency_selection import select_fitted_frequencies
from rippletwin.twin.twin import Twin
from synthetic_observations import POINTS, make

HIGHEST_HZ = 1000.0
RIPPLE_SD = 0.02  # relative, of each harmonic of the nominal ripple
NOISE = 100.0  # Pa, rms of each reading's amplitude
MODULATION = 4e-3 * np.exp(0.3j)  # rad
SPREAD = 0.05  # relative flow at each shaft order below the first piston order
DATA_SETS = 40


@pytest.fixture(scope="module")
def fitted():
    """A fitted line at one operating point, and a blank recording of all its shaft orders."""
    rng = np.random.default_rng(5)
    bench, observations, truth = make(rng, points=POINTS[:1])
    bench = replace(bench, load=Load("anechoic"))
    o = observations[0]
    twin = Twin(bench, [o])
    theta = [truth.theta[truth.index[p.name]] for p in twin.parameters]
    o = replace(o, values=twin.predict([o], theta)[0])
    data = select_fitted_frequencies([o], bench)
    fit = refine(Twin(bench, data), (), data, [theta])
    orders = np.arange(1, int(HIGHEST_HZ / o.speed_hz) + 1)
    blank = replace(
        o,
        orders=orders,
        frequency_hz=orders * o.speed_hz,
        covariance=np.tile(NOISE**2 * np.eye(3, dtype=complex), (len(orders), 1, 1)),
        values=np.ones((3, len(orders)), complex),
    )
    return replace(fit, source_sd=RIPPLE_SD, smooth_sd=0.0), blank


def normal(rng, *shape):
    """Complex normal draws of unit variance."""
    return rng.normal(size=(*shape, 2)) @ np.array([1, 1j]) / np.sqrt(2)


def wrong_ripple(rng, ripple):
    """The ripple with an error of RIPPLE_SD in every harmonic, at 512 angles."""
    spectrum = np.fft.rfft(ripple.flow)[:257] * (512 / len(ripple.flow))
    spectrum[1:] *= 1.0 + RIPPLE_SD * normal(rng, 256)
    angle = 360.0 * np.arange(512) / 512
    return FlowRipple(angle, np.fft.irfft(spectrum, 512), ripple.pressure_mean)


def modulated(rng, ripple):
    """The ripple that a shaft with MODULATION delivers."""
    return modulate_ripple(wrong_ripple(rng, ripple), MODULATION)


def with_spread(rng, ripple):
    """The ripple of pistons of which each shaft order below the ninth has SPREAD of the flow."""
    ripple = wrong_ripple(rng, ripple)
    angle = np.deg2rad(ripple.angle_deg)
    phases = rng.uniform(0, 2 * np.pi, 8)
    extra = sum(np.cos(n * angle + phase) for n, phase in enumerate(phases, 1))
    return FlowRipple(ripple.angle_deg, ripple.flow + SPREAD * np.mean(ripple.flow) * extra)


def record(rng, fit, covariance, blank, ripple_of):
    """A recording by a line drawn from the posterior, which states the nominal even ripple."""
    theta = rng.multivariate_normal(fit.twin.theta, covariance)
    true = replace(blank, flow_ripple=ripple_of(rng, blank.flow_ripple))
    values = fit.twin.predict([true], theta)[0]
    return replace(blank, values=values + NOISE * normal(rng, *values.shape))


def intervals(fit, covariance, blank, ripple_of, expected_name):
    """Values and intervals (DATA_SETS,) of as many data sets."""
    results = []
    for seed in range(DATA_SETS):
        rng = np.random.default_rng([7, seed])
        o = record(rng, fit, covariance, blank, ripple_of)
        wide = replace(fit, covariance=covariance)
        shaft_orders = analyse_shaft_orders(fit.twin, [o], HIGHEST_HZ)
        assert shaft_orders.names == (expected_name,)
        found = add_amplitude_intervals(shaft_orders, wide, [o], HIGHEST_HZ, draws=40)
        results.append(found.effects[0])
    return results


def coverage(results, truth):
    return np.mean([low <= truth <= high for low, high in (r.interval for r in results)])


def test_the_interval_of_a_modulation_contains_the_truth(fitted):
    """Of 40 recordings 34 to 40 intervals contain the true modulation, and they are far narrower
    than a fifth either way."""
    fit, blank = fitted
    results = intervals(fit, fit.covariance, blank, modulated, "speed_fluctuation")
    assert 0.85 <= coverage(results, abs(MODULATION)) <= 1.0
    assert all(r.interval[1] - r.interval[0] < 0.2 * r.value for r in results)


@pytest.mark.parametrize("diameter_sd", [0.0, 0.1])
def test_the_interval_of_a_spread_contains_the_truth(fitted, diameter_sd):
    """The same for a spread of the pistons, also where the bore is uncertain by 10 %.

    The flow for a given pressure goes with the square of the bore, so an interval of a fifth either
    way would contain the truth in two of three cases only."""
    fit, blank = fitted
    direction = np.zeros(len(fit.twin.theta))
    for name, k in fit.twin.index.items():
        if name.startswith("diameter"):
            direction[k] = diameter_sd / fit.twin.rig.uncertainty.diameter
    covariance = fit.covariance + np.outer(direction, direction)
    results = intervals(fit, covariance, blank, with_spread, "piston_spread")
    truth = SPREAD * np.sqrt(0.5 * 8)
    assert 0.85 <= coverage(results, truth) <= 1.0
    if diameter_sd:
        a_fifth = [SimpleNamespace(interval=(0.8 * r.value, 1.2 * r.value)) for r in results]
        assert coverage(a_fifth, truth) < 0.85
    else:
        assert all(r.interval[1] - r.interval[0] < 0.1 * r.value for r in results)


def test_there_is_no_interval_without_a_name_or_a_covariance(fitted):
    """Even ripple gives no name and no interval; a fit without a covariance gives none either."""
    fit, blank = fitted
    rng = np.random.default_rng(1)
    even = record(rng, fit, fit.covariance, blank, lambda rng, ripple: ripple)
    nothing = analyse_shaft_orders(fit.twin, [even], HIGHEST_HZ)
    assert nothing.effects == ()
    assert add_amplitude_intervals(nothing, fit, [even], HIGHEST_HZ) is nothing
    o = record(rng, fit, fit.covariance, blank, modulated)
    shaft_orders = analyse_shaft_orders(fit.twin, [o], HIGHEST_HZ)
    unknown = replace(fit, covariance=np.full_like(fit.covariance, np.nan))
    found = add_amplitude_intervals(shaft_orders, unknown, [o], HIGHEST_HZ)
    assert found.effects and all(effect.interval is None for effect in found.effects)
    assert flow_harmonics(blank.flow_ripple, np.array([1]))[0] == pytest.approx(0.0, abs=1e-9)
