"""Lines of a shaft that turns unevenly, and what they take from the piston orders."""

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
from rippletwin.twin.twin import Twin
from synthetic_observations import POINTS, make

ANGLE = 360.0 * np.arange(1536) / 1536


def test_a_swinging_shaft_spreads_an_order_as_bessel_functions_do():
    """Analytic (Jacobi and Anger): order k of a shaft ahead by |b| cos(t + arg b) is spread to
    order n by j^(n-k) J_(n-k)(k |b|) e^(j (n-k) arg b), times n/k, for the flow goes with the
    speed. At order 240 and b = 0.008 four fifths of its energy are gone."""
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


def test_an_even_shaft_leaves_the_ripple_alone():
    """By definition: without modulation every order below half the table's is as it was."""
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
    """Truth known: (rig, observation that states the even ripple, the same with the true one).
    The true ripple is `ripple_of` the even one and reaches every order up to 4 kHz through a known
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
    return bench, replace(o, values=values, flow_ripple=observations[0].flow_ripple), o


@pytest.mark.parametrize("size", [1e-3, 4e-3, 1e-2])
def test_the_swing_is_found_where_it_is_not_small(size):
    """Truth known: name, size to 3 % and phase (to a pitch of the pistons) come back, also where a
    first order in the swing is off by half; and the ripple that is fitted is the swung one where it
    had been the even one."""
    b = size * np.exp(0.3j)
    bench, even, o = recorded(lambda ripple: modulate_ripple(ripple, b))
    found = analyse_shaft_orders(Twin(bench, [even]), [even], 4000.0)
    assert found.name == "speed_fluctuation"
    assert found.value == pytest.approx(size, rel=0.03)
    swung = with_phase_modulation([even], found)[0]
    k = o.orders[o.orders % 9 == 0]
    true, before, after = (flow_harmonics(x.flow_ripple, k) for x in (o, even, swung))
    assert np.linalg.norm(after - true) < 0.1 * np.linalg.norm(before - true)


def test_lines_that_a_swing_leaves_a_fifth_of_are_not_named_for_it():
    """Truth known: a swing of 1e-3 rad, and lines half as high four orders from every sideband,
    which no swing makes. By a known line that is no swing; by one that is only calibrated, and may
    be off by as much, a swing is tried."""

    def mixed(even):
        swung = modulate_ripple(even, 1e-3)
        count = len(swung.flow)
        spectrum = np.fft.rfft(swung.flow)
        sideband = np.isin(np.arange(len(spectrum)) % 9, (1, 8))
        spectrum[4:] += 0.5 * np.where(sideband, spectrum, 0.0)[:-4]
        return replace(swung, flow=np.fft.irfft(spectrum, count))

    bench, stated, _ = recorded(mixed)
    twin = Twin(bench, [stated])
    assert analyse_shaft_orders(twin, [stated], 4000.0).name == "piston_spread"
    assert (
        analyse_shaft_orders(twin, [stated], 4000.0, ROUGH_MODULATION_SHARE).name
        == "speed_fluctuation"
    )


def test_a_swing_is_told_anew_by_the_line_as_explained():
    """Truth known: unsteady friction and a shaft that swings by 0.006 rad. By the line without that
    friction the swing is 4 % too large, and at order 234 it makes 1.4 rad of phase; the ripple that
    is fitted in the end is that of a swing right to 1 %, told by the line as it is explained. That
    line's impedance is 2 % off, which a scale of the whole ripple takes up and the swing not."""
    friction = ((EFFECTS["unsteady_friction"], Place("line")),)
    values = {"viscosity": 4e-5}
    bench, stated, _ = recorded(lambda r: modulate_ripple(r, 6e-3), friction, values)
    found = explain_observations(bench, [stated], processes=1)
    assert found.search.best.names == ("unsteady_friction",)
    assert found.shaft_orders.name == "speed_fluctuation"
    assert found.shaft_orders.value == pytest.approx(6e-3, rel=0.01)
    assert abs(found.observations[0].flow_ripple.swing) == pytest.approx(6e-3, rel=0.01)
