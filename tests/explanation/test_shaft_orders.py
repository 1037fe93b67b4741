"""Shaft orders between the piston orders: modulation of the shaft and spread of the pistons."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import jv

from rippletwin.case.model import FlowRipple, Load
from rippletwin.explanation.explain import explain_observations
from rippletwin.explanation.localise.phase_modulation import modulate_ripple, with_phase_modulation
from rippletwin.explanation.localise.shaft_orders import analyse_shaft_orders
from rippletwin.explanation.thresholds import ROUGH_MODULATION_SHARE
from rippletwin.harmonics import flow_harmonics
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.twin import Twin
from synthetic_observations import POINTS, make

ANGLE = 360.0 * np.arange(1536) / 1536


def test_modulation_spreads_an_order_like_bessel_functions():
    """Analytic (Jacobi and Anger): order k of a shaft that leads by |b| cos(t + arg b) spreads to
    order n by j^(n-k) J_(n-k)(k |b|) e^(j (n-k) arg b), times n/k, because the flow is proportional
    to the speed. Order 240 loses four fifths of its energy at b = 0.008."""
    k, b = 240, 0.008 * np.exp(0.7j)
    even = FlowRipple(ANGLE, 1e-4 + 1e-5 * np.cos(np.deg2rad(k * ANGLE)))
    orders = np.arange(k - 4, k + 5)
    got = flow_harmonics(modulate_ripple(even, b), orders)
    m = orders - k
    expected = 1e-5 * 1j**m * jv(m, k * abs(b)) * np.exp(1j * m * np.angle(b)) * orders / k
    np.testing.assert_allclose(got, expected, atol=2e-9)
    assert abs(got[4]) ** 2 < 0.2 * 1e-10
    assert flow_harmonics(modulate_ripple(even, b), np.zeros(1))[0].real == pytest.approx(
        1e-4, rel=1e-6
    )


def test_no_modulation_leaves_the_ripple_unchanged():
    """Without modulation every order below half the number of samples stays the same."""
    rng = np.random.default_rng(1)
    orders = np.arange(9, 400, 9)
    flow = 1e-4 + sum(
        a * np.cos(np.deg2rad(k * ANGLE) + p)
        for k, a, p in zip(orders, 1e-5 / orders, rng.uniform(0, 6, len(orders)))
    )
    even = FlowRipple(ANGLE, flow)
    np.testing.assert_allclose(
        flow_harmonics(modulate_ripple(even, 0j), orders), flow_harmonics(even, orders), atol=1e-15
    )


def recorded(ripple_of, effects=(), values=None):
    """(true twin, observation that states the even ripple, the same with the true ripple).

    The true ripple is `ripple_of` the even one. It reaches every order up to 4 kHz through a known
    line, with 500 Pa of noise."""
    rng = np.random.default_rng(5)
    bench, observations, truth = make(rng, effects, values, points=POINTS[:1])
    bench = replace(bench, load=Load("anechoic"))
    o = observations[0]
    orders = np.arange(1, int(o.orders[-1]) + 1)
    noise = 500.0 * np.sqrt(4 / (3072 * 160))
    o = replace(
        o,
        orders=orders,
        frequency_hz=orders * o.speed_hz,
        covariance=np.tile(noise**2 * np.eye(3, dtype=complex), (len(orders), 1, 1)),
        flow_ripple=ripple_of(o.flow_ripple),
        values=np.ones((3, len(orders)), complex),
    )
    twin = Twin(bench, [o], effects=effects)
    if values:
        twin = twin.with_(theta=[truth.theta[truth.index[p.name]] for p in twin.parameters])
    values = twin.predict([o])[0]
    values = values + noise / np.sqrt(2) * (rng.normal(size=(*values.shape, 2)) @ [1, 1j])
    return twin, replace(o, values=values, flow_ripple=observations[0].flow_ripple), o


@pytest.mark.parametrize("size", [1e-3, 4e-3, 1e-2])
def test_a_large_modulation_is_found(size):
    """Name, amplitude to 3 % and phase of a known modulation are found, also where a first-order
    estimate is wrong by half. The fitted ripple becomes the modulated one."""
    b = size * np.exp(0.3j)
    twin, even, o = recorded(lambda ripple: modulate_ripple(ripple, b))
    found = analyse_shaft_orders(twin, [even], 4000.0)
    assert found.name == "speed_fluctuation"
    assert found.value == pytest.approx(size, rel=0.03)
    (modulated,) = with_phase_modulation([even], found)
    k = o.orders[o.orders % 9 == 0]
    true, before, after = (flow_harmonics(x.flow_ripple, k) for x in (o, even, modulated))
    assert np.linalg.norm(after - true) < 0.1 * np.linalg.norm(before - true)


def test_modulation_is_the_name_only_if_it_explains_nearly_all_the_energy():
    """A modulation of 1e-3 rad is recorded together with orders half as strong four orders from
    each sideband, which no modulation makes. With a known line that is no speed fluctuation; with
    the tolerance for a calibrated line it is tried as one."""

    def mixed(even):
        modulated = modulate_ripple(even, 1e-3)
        count = len(modulated.flow)
        spectrum = np.fft.rfft(modulated.flow)
        sideband = np.isin(np.arange(len(spectrum)) % 9, (1, 8))
        spectrum[4:] += 0.5 * np.where(sideband, spectrum, 0.0)[:-4]
        return replace(modulated, flow=np.fft.irfft(spectrum, count))

    twin, stated, _ = recorded(mixed)
    assert analyse_shaft_orders(twin, [stated], 4000.0).name == "piston_spread"
    assert (
        analyse_shaft_orders(twin, [stated], 4000.0, ROUGH_MODULATION_SHARE).name
        == "speed_fluctuation"
    )


def test_a_spread_of_the_pistons_is_found_in_a_line_with_air():
    """Orders 1 to 8 with 1 % of the mean flow each are found to 5 % as the rms of the flow, through
    a line whose compliance is nonlinear: a small ripple sees its linear part."""
    air = ((EFFECTS["entrained_air"], Place("line")),)
    values = {"entrained_air@line.gas_fraction": 5e-3}

    def with_spread(even):
        angle = np.deg2rad(even.angle_deg)
        extra = sum(np.cos(n * angle + n**2) for n in range(1, 9))
        return replace(even, flow=even.flow + 0.01 * np.mean(even.flow) * extra)

    twin, stated, _ = recorded(with_spread, air, values)
    assert ForwardModel(twin, [stated]).has_nonlinear_compliance
    found = analyse_shaft_orders(twin, [stated], 4000.0)
    assert found.name == "piston_spread" and found.coherence > 0.99
    assert found.value == pytest.approx(0.01 * np.sqrt(0.5 * 8), rel=0.05)


def test_the_modulation_is_estimated_again_with_the_explained_line():
    """With a line without the true unsteady friction, a modulation of 0.006 rad is estimated 4 %
    too large, and it makes 1.4 rad of phase at order 234. With the explained line it is right to
    1 %, and so is the fitted ripple. That line's impedance is 2 % wrong, which the size of the
    whole ripple absorbs and the modulation does not."""
    friction = ((EFFECTS["unsteady_friction"], Place("line")),)
    values = {"viscosity": 4e-5}
    twin, stated, _ = recorded(lambda r: modulate_ripple(r, 6e-3), friction, values)
    found = explain_observations(twin.rig, [stated], processes=1)
    assert found.search.best.names == ("unsteady_friction",)
    assert found.shaft_orders.name == "speed_fluctuation"
    assert found.shaft_orders.value == pytest.approx(6e-3, rel=0.01)
    assert abs(found.observations[0].flow_ripple.modulation) == pytest.approx(6e-3, rel=0.01)
