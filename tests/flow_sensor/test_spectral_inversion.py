"""The spectral flow sensor on frequency-domain truth: known flow, known line, known noise."""

import numpy as np
import pytest

from flow_windows import RESISTANCE, SAMPLES, SPEED, THREE, TWO, line, record, ripples
from paper_rig import SEGMENTS, SENSORS
from rippletwin.flow_sensor.estimate import band_limit, keep_orders, orders_within
from rippletwin.flow_sensor.line_response import line_response
from rippletwin.flow_sensor.spectral_inversion import estimate_flow
from rippletwin.harmonics import peak_amplitudes

BAND = 1500.0


def error(flow, truth):
    truth = band_limit(truth, SPEED, BAND)
    return np.sqrt(np.mean((flow - truth) ** 2) / np.mean(truth**2))


def test_waves_reproduce_the_network():
    """Waves at the pump give the readings, source flow and load of the line's own sweep."""
    orders = np.arange(1, 200)
    network = line(THREE, own=1e-14)(SPEED, orders)
    network.inserts.append((0.0, "shunt", 3e-14 * network.s))
    network.sensor_factor = np.array([[1.0], [1.05], [0.9]])
    network.source_flow, network.source_impedance = np.exp(1j * orders), 1e6 * network.s
    network.sensor_positions = [0.0, *network.sensor_positions[1:]]
    response = line_response(network)
    p = network.pump_pressure()
    q = network.flow_at([0.0])[0]
    zc = np.abs(np.sqrt(network.series[0] / network.shunt[0]))
    waves = np.stack([(p + zc * q) / 2, (p - zc * q) / 2], axis=-1)[..., None]
    readings = (response.to_sensors @ waves)[..., 0].T
    np.testing.assert_allclose(readings, network.readings(), rtol=1e-9)
    flow = (response.to_flow[:, None] @ waves)[:, 0, 0]
    np.testing.assert_allclose(flow, network.source_flow, rtol=1e-9)
    load = (response.to_load[:, None] @ waves)[:, 0, 0]
    assert np.max(np.abs(load) / np.abs(p)) < 1e-9


@pytest.mark.parametrize("positions", [TWO, THREE])
@pytest.mark.parametrize("load_error", [None, 0.1])
def test_exact_readings_give_the_flow(positions, load_error):
    """No noise, the right line: inversion of the direct problem, but for the regularisation."""
    rng = np.random.default_rng(1)
    flow = ripples(3, rng)
    windows = record(line(positions), flow, 0.0, rng)
    found = estimate_flow(
        windows, SPEED, line(positions), 1.0, BAND, model_error=1e-5, load_error=load_error
    )
    assert error(found.flow, flow) < 1e-4


def test_source_admittance_is_part_of_the_source():
    """With a compliance in the pump the ideal source's flow comes back, not the line's."""
    rng = np.random.default_rng(2)
    flow = ripples(2, rng)
    network = line(own=2e-14)
    windows = record(network, flow, 0.0, rng)
    found = estimate_flow(windows, SPEED, network, 1.0, BAND, model_error=1e-5)
    assert error(found.flow, flow) < 1e-4
    outlet = estimate_flow(windows, SPEED, network, 1.0, BAND, model_error=1e-5, of="outlet")
    at_pump = network(SPEED, outlet.orders).flow_at([0.0])[0]  # of unit source flow
    expected = at_pump * peak_amplitudes(flow)[:, outlet.orders]
    np.testing.assert_allclose(outlet.harmonics, expected, atol=1e-4 * np.abs(expected).max())
    assert error(outlet.flow, flow) > 0.1


@pytest.mark.parametrize("positions,limit", [(TWO, 0.03), (THREE, 0.01)])
@pytest.mark.parametrize("noise", [500.0, 4000.0])
def test_noise_leaves_the_flow_within_three_per_cent(positions, limit, noise):
    """Noise of 0.5 and 4 kPa a sample (the range of real sensors) against the true flow."""
    rng = np.random.default_rng(3)
    flow = ripples(20, rng)
    windows = record(line(positions), flow, noise, rng)
    found = estimate_flow(windows, SPEED, line(positions), noise, BAND)
    assert error(found.flow, flow) < limit


def test_stated_standard_deviation_is_that_of_the_errors():
    """With noise as the only error, the scatter over windows is what the estimate says of itself.

    The load is left out and the model declared exact. An order whose stated error is near the
    prior's is not measured, and neither is its prior: both sensors may sit at pressure nodes.
    """
    rng = np.random.default_rng(4)
    flow = ripples(400, rng)
    windows = record(line(), flow, 2000.0, rng)
    found = estimate_flow(windows, SPEED, line(), 2000.0, BAND, model_error=0.0, load_error=None)
    truth = peak_amplitudes(flow)[:, found.orders]
    rms = np.sqrt(np.mean(np.abs(found.harmonics - truth) ** 2, axis=0))
    measured = found.standard_deviation < 0.2 * found.prior
    ratio = (rms / found.standard_deviation)[measured]
    assert measured.sum() >= 85
    assert 0.9 < np.median(ratio) < 1.1
    assert 0.8 < ratio.min() and ratio.max() < 1.2


def test_half_wave_blind_sensors_neither_explode_nor_blind_the_estimate():
    """Sensors half a wavelength apart at order 18: bounded without the load, right with it."""
    rng = np.random.default_rng(5)
    apart = SEGMENTS[0].wave_speed / (2 * 18 * SPEED)
    blind = line((SENSORS[0], SENSORS[0] + apart))
    flow = ripples(50, rng)
    windows = record(blind, flow, 1000.0, rng)
    truth = peak_amplitudes(flow)[:, 18]
    alone = estimate_flow(windows, SPEED, blind, 1000.0, BAND, load_error=None)
    helped = estimate_flow(windows, SPEED, blind, 1000.0, BAND, load_error=0.1)
    size = np.sqrt(np.mean(np.abs(truth) ** 2))
    at = list(alone.orders).index(18)
    wrong = np.sqrt(np.mean(np.abs(alone.harmonics[:, at] - truth) ** 2)) / size
    right = np.sqrt(np.mean(np.abs(helped.harmonics[:, at] - truth) ** 2)) / size
    assert wrong < 5.0
    assert right < 0.1
    assert alone.standard_deviation[at] > 5 * helped.standard_deviation[at]


def test_wrong_load_hardly_matters_where_sensors_see():
    """A load resistance 20 % off within a trusted 10 %: the sensors outvote it."""
    rng = np.random.default_rng(6)
    flow = ripples(5, rng)
    windows = record(line(THREE), flow, 500.0, rng)
    found = estimate_flow(windows, SPEED, line(THREE, resistance=1.2 * RESISTANCE), 500.0, BAND)
    assert error(found.flow, flow) < 0.02


def test_wrong_wave_speed_costs_accuracy_above_all_at_high_frequency():
    """1 % wrong wave speed: phase errors grow with frequency, and the result stays bounded."""
    rng = np.random.default_rng(7)
    flow = ripples(20, rng)
    windows = record(line(THREE), flow, 500.0, rng)
    found = estimate_flow(windows, SPEED, line(THREE, wave_speed_factor=1.01), 500.0, BAND)
    truth = peak_amplitudes(flow)[:, found.orders]
    wrong = np.sum(np.abs(found.harmonics - truth) ** 2, axis=0)
    size = np.sum(np.abs(truth) ** 2, axis=0)
    low, high = (np.sqrt(wrong[b].sum() / size[b].sum()) for b in (slice(0, 20), slice(60, 90)))
    assert low < 0.15
    assert low < high < 1.0


def test_windows_of_wandering_speed_use_their_own_line():
    """Speeds 0.4 % apart: with each window's speed the flow is right, with the mean it is not."""
    rng = np.random.default_rng(8)
    flow = ripples(6, rng)
    speeds = SPEED * (1 + np.array([-0.002, 0.002, 0.0, 0.002, -0.002, 0.0]))
    windows = np.concatenate(
        [record(line(THREE), q[None], 0.0, rng, speed) for q, speed in zip(flow, speeds)]
    )
    own = estimate_flow(windows, speeds, line(THREE), 1.0, BAND, model_error=1e-4)
    mean = estimate_flow(windows, SPEED, line(THREE), 1.0, BAND, model_error=1e-4)
    assert error(own.flow, flow) < 1e-3
    assert error(mean.flow, flow) > 1e-2


def test_nothing_above_the_bandwidth():
    """The stated bandwidth is kept exactly, and the mean is removed."""
    rng = np.random.default_rng(9)
    flow = ripples(2, rng)
    windows = record(line(), flow, 100.0, rng) + 9.5e6
    found = estimate_flow(windows, SPEED, line(), 100.0, BAND)
    spectrum = np.abs(np.fft.rfft(found.flow))
    assert len(found.orders) == 90
    assert spectrum[:, 91:].max() < 1e-12 * spectrum.max()
    assert spectrum[:, 0].max() < 1e-12 * spectrum.max()


def test_band_limit_keeps_the_orders_of_the_bandwidth():
    """Against a tone on either side of the limit."""
    angle = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    inside, outside = np.cos(90 * angle), np.cos(91 * angle)
    np.testing.assert_allclose(band_limit(3.0 + inside + outside, SPEED, BAND), inside, atol=1e-12)


@pytest.mark.parametrize("bandwidth", [10.0, 30000.0])
def test_bandwidth_without_orders_is_refused(bandwidth):
    """The message has the key of the configuration and both ends of what it may be, in Hz."""
    with pytest.raises(ValueError, match=r"flow_sensor\.bandwidth_hz") as caught:
        orders_within(bandwidth, SPEED, SAMPLES)
    for end in (SPEED, SAMPLES * SPEED / 2):
        assert f"{end:.4g} Hz" in str(caught.value)


@pytest.mark.parametrize("share", [0.995, 1.0, 1.005])
def test_orders_stay_those_of_the_simulations_whatever_the_windows_speed(share):
    """90 orders at 1000 r/min end just at the bandwidth: windows half a per cent faster would have
    one less by their own speed."""
    speed = 1000.0 / 60.0
    windows = share * speed * np.ones(4)
    band = keep_orders(BAND, speed, windows, SAMPLES)
    assert len(orders_within(band, windows.mean(), SAMPLES)) == 90
    assert len(orders_within(BAND, 1.005 * speed, SAMPLES)) == 89
