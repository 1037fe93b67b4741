"""Shaft orders between the piston orders: modulation of the shaft and spread of the pistons."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import jv

from rippletwin.case.model import FlowRipple, Load
from rippletwin.explanation.explain import explain_observations
from rippletwin.explanation.localise import modulation_fit
from rippletwin.explanation.localise.modulation_fit import fit_modulation
from rippletwin.explanation.localise.order_flow import OrderFlow
from rippletwin.explanation.localise.phase_modulation import with_phase_modulation
from rippletwin.explanation.localise.shaft_orders import (
    analyse_shaft_orders,
    probability_of_share,
)
from rippletwin.explanation.verdict.remainder_text import shaft_order_sentences
from rippletwin.harmonics import flow_harmonics, modulate_ripple, phase_modulate
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.twin import Twin
from synthetic_observations import POINTS, make

GEOMETRY = {
    "pistons": 9, "piston_diameter": 0.017, "pitch_radius": 0.0335, "swash_angle_deg": 17.0,
}  # fmt: skip
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


@pytest.mark.parametrize("b", [0.0, 1e-3 * np.exp(0.7j), 0.05j, -0.3])
def test_a_modulated_flow_is_the_flow_at_the_angle_of_the_shaft(b):
    """Definition, summed order by order: the flow at an instant is that of the shaft's angle then,
    times its speed; also where the modulation is so large that a sideband is 200 orders away."""
    rng = np.random.default_rng(2)
    spectrum = np.zeros(700, complex)
    spectrum[::7] = (rng.normal(size=(100, 2)) @ [1.0, 1j]) / (1.0 + np.arange(100))
    instant = 2.0 * np.pi * np.arange(2800) / 2800
    angle = instant + (b * np.exp(1j * instant)).real
    speed = 1.0 - (b * np.exp(1j * instant)).imag
    flow = (np.exp(1j * np.outer(angle, np.arange(700))) @ spectrum).real * speed
    np.testing.assert_allclose(phase_modulate(spectrum, b, 2800), flow, atol=1e-11)


def test_a_fit_of_the_modulation_that_is_cut_short_is_told(monkeypatch):
    """The usual fit converges; one of a single evaluation does not, and the sentence says so."""
    twin, even, _ = recorded(lambda ripple: modulate_ripple(ripple, 4e-3))
    found = analyse_shaft_orders(twin, [even], 4000.0)
    assert found.converged and "converge" not in shaft_order_sentences(found)[0]
    whole = modulation_fit.least_squares
    monkeypatch.setattr(
        modulation_fit, "least_squares", lambda *a, **k: whole(*a, **k | {"max_nfev": 1})
    )
    found = analyse_shaft_orders(twin, [even], 4000.0)
    assert found.names == ("speed_fluctuation",) and not found.converged
    assert "did not converge" in shaft_order_sentences(found)[0]


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
    """Name, amplitude to 1 % and phase of a known modulation are found, also where a first-order
    estimate is wrong by half. The fitted ripple becomes the modulated one."""
    b = size * np.exp(0.3j)
    twin, even, o = recorded(lambda ripple: modulate_ripple(ripple, b))
    found = analyse_shaft_orders(twin, [even], 4000.0)
    assert found.names == ("speed_fluctuation",)
    assert found.effects[0].value == pytest.approx(size, rel=0.01)
    assert abs(next(iter(found.modulation.values())) - b) < 0.02 * size
    (modulated,) = with_phase_modulation([even], found)
    k = o.orders[o.orders % 9 == 0]
    ripples = [twin.operating_point(x).ripple for x in (o, even, modulated)]
    true, before, after = (flow_harmonics(ripple, k) for ripple in ripples)
    assert np.linalg.norm(after - true) < 0.1 * np.linalg.norm(before - true)


def test_a_modulation_reaches_a_simulated_pump_too():
    """Analytic: of a pump that is simulated from its geometry, a modulation of 6e-3 rad leaves
    J_0(k |b|) of each piston order k, with its phase, as of a stated ripple."""
    twin, even, _ = recorded(lambda ripple: ripple)
    rig = replace(twin.rig, pump=GEOMETRY)
    simulated = replace(even, flow_ripple=None, source="nominal")
    twin = Twin(rig, [simulated], uncertain_pump=True)
    k = np.arange(9, 200, 9)
    flow = [
        flow_harmonics(twin.operating_point(o).ripple, k)
        for o in (simulated, replace(simulated, modulation=6e-3 * np.exp(0.3j)))
    ]
    np.testing.assert_allclose(flow[1], jv(0, 6e-3 * k) * flow[0], atol=1e-6 * abs(flow[0][0]))


def test_the_nominal_ripple_does_not_matter():
    """The amplitude is right to 1 % where each harmonic of the stated ripple is wrong by half, in
    size and phase: the flow at the piston orders is estimated, not taken from there."""
    rng = np.random.default_rng(4)

    def wrong(even):
        spectrum = np.fft.rfft(even.flow)
        spectrum[1:] *= 1.0 + 0.5 * (rng.normal(size=(len(spectrum) - 1, 2)) @ [1, 1j])
        return modulate_ripple(replace(even, flow=np.fft.irfft(spectrum, len(even.flow))), 4e-3)

    twin, stated, _ = recorded(wrong)
    found = analyse_shaft_orders(twin, [stated], 4000.0)
    assert found.names == ("speed_fluctuation",)
    assert found.effects[0].value == pytest.approx(4e-3, rel=0.01)


def spread_of(even, deviations):
    """The ripple of pistons whose delivery, a ninth of `even` but for its phase, is late by
    `deviations` (9,) rad: pattern m of them turns order k = m mod 9 by -j k."""
    orders = np.arange(1, len(even.flow) // 2)
    single = np.interp(orders, orders[8::9], np.abs(np.fft.rfft(even.flow))[orders[8::9]]) / 9
    patterns = np.fft.fft(deviations)[orders % 9]
    spectrum = np.fft.rfft(even.flow)
    spectrum[orders] += np.where(orders % 9 == 0, 0.0, -1j * orders * single * patterns)
    return replace(even, flow=np.fft.irfft(spectrum, len(even.flow)))


def test_a_modulation_beside_unequal_pistons_is_named_and_measured():
    """A modulation of 3e-3 rad beside pistons that are 5e-4 rad early or late: both are named, and
    the modulation is right to 15 %, the part of the deviations that looks like it."""
    deviations = np.random.default_rng(2).normal(0.0, 5e-4, 9)
    deviations -= deviations.mean()
    twin, stated, _ = recorded(lambda r: spread_of(modulate_ripple(r, 3e-3), deviations))
    found = analyse_shaft_orders(twin, [stated], 4000.0)
    assert found.names == ("speed_fluctuation", "piston_spread")
    assert found.effects[0].value == pytest.approx(3e-3, rel=0.15)


@pytest.mark.parametrize("pistons", [pytest.param(7, marks=pytest.mark.long), 9])
def test_unequal_pistons_alone_are_rarely_called_a_modulation(pistons):
    """Statistics, without a line: pistons early or late at random look like a modulation at the
    rate that is stated. Of 400 pumps 2 % are expected below a probability of 2 %, and 50 % below
    50 %; the counts are within four standard deviations of that, so the probability is one."""
    rng = np.random.default_rng(pistons)
    orders = np.arange(1, 12 * pistons + pistons // 2 + 1)
    even = np.where(orders % pistons == 0, 1.0, 0.0) * np.exp(0.3j * orders)
    single = np.exp(0.3j * orders)
    found = []
    for _ in range(400):
        patterns = np.fft.fft(rng.normal(0.0, 1e-4, pistons))[orders % pistons]
        flow = even + np.where(orders % pistons == 0, 0.0, -1j * orders * single * patterns)
        flow = OrderFlow(orders, flow, 1e-8 + 0 * orders, 1.0 + 0 * orders, 0 * orders, 1.0)
        modulation = fit_modulation(flow, pistons)
        share = 1.0 - modulation.left / modulation.energy
        found.append(probability_of_share(share, pistons))
    for rate in (0.02, 0.5):
        sd = np.sqrt(rate * (1 - rate) / 400)
        assert abs(np.mean(np.array(found) < rate) - rate) < 4 * sd


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
    assert found.names == ("piston_spread",) and found.coherence > 0.99
    assert found.effects[0].value == pytest.approx(0.01 * np.sqrt(0.5 * 8), rel=0.05)


@pytest.mark.long
def test_the_modulation_is_estimated_again_with_the_explained_line():
    """A modulation of 0.006 rad leaves half of order 234. With the explained line it is right to
    1 %, and so is the fitted ripple. That line's impedance is 2 % wrong, which the free flow at the
    piston orders absorbs and the modulation does not."""
    friction = ((EFFECTS["unsteady_friction"], Place("line")),)
    values = {"viscosity": 4e-5}
    twin, stated, _ = recorded(lambda r: modulate_ripple(r, 6e-3), friction, values)
    found = explain_observations(twin.rig, [stated], processes=1)
    assert found.search.best.names == ("unsteady_friction",)
    assert found.shaft_orders.names == ("speed_fluctuation",)
    assert found.shaft_orders.effects[0].value == pytest.approx(6e-3, rel=0.01)
    assert abs(found.observations[0].modulation) == pytest.approx(6e-3, rel=0.01)


@pytest.mark.filterwarnings("error")
def test_three_pistons_have_one_pattern_only():
    """Every deviation of three pistons looks like a modulation, so none is named, without a
    warning of a division by the patterns that are left."""
    twin, stated, _ = recorded(lambda r: modulate_ripple(r, 4e-3))
    twin = Twin(replace(twin.rig, pump={"pistons": 3}), [stated], theta=twin.theta)
    found = analyse_shaft_orders(twin, [stated], 4000.0)
    assert found.names == ("piston_spread",)


def test_a_band_leaves_out_shaft_orders_too():
    """Hum at order 3, which every sensor reads as a flow at the pump would make it, is not analysed
    above 100 Hz, and other orders are: of a spread over orders 1 to 8 the two that are left give
    its size to 5 %."""

    def with_spread(even):
        angle = np.deg2rad(even.angle_deg)
        extra = sum(np.cos(n * angle + n**2) for n in range(1, 9))
        return replace(even, flow=even.flow + 0.01 * np.mean(even.flow) * extra)

    def with_hum(even):
        return replace(even, flow=even.flow * (1.0 + 0.02 * np.cos(3 * np.deg2rad(even.angle_deg))))

    for ripple_of, names in ((with_hum, ()), (with_spread, ("piston_spread",))):
        twin, stated, _ = recorded(ripple_of)
        assert analyse_shaft_orders(twin, [stated], 4000.0).names == ("piston_spread",)
        found = analyse_shaft_orders(twin, [replace(stated, min_frequency_hz=110.0)], 4000.0)
        assert found.names == names
    assert found.effects[0].value == pytest.approx(0.01 * np.sqrt(0.5 * 8), rel=0.05)


def test_a_spread_has_no_size_where_the_mean_flow_or_its_orders_are_unknown():
    """A free source of an anechoic line has an unknown mean flow, and above the piston frequency no
    order of the first pitch is left: the name stays, without a number that would be made up."""

    def with_spread(even):
        angle = np.deg2rad(even.angle_deg)
        extra = sum(np.cos(n * angle + n**2) for n in (1, 4, 11, 13, 22))
        return replace(even, flow=even.flow + 0.01 * np.mean(even.flow) * extra)

    twin, stated, _ = recorded(with_spread)
    free = replace(stated, source="free", flow_ripple=None)
    line = Twin(twin.rig, [free])
    above = replace(stated, min_frequency_hz=160.0)
    for own, o in ((line, free), (twin, above)):
        found = analyse_shaft_orders(own, [o], 4000.0)
        assert found.names == ("piston_spread",)
        assert found.effects[0].value is None
        assert "unequal pistons. " in shaft_order_sentences(found)[0]
