"""The physics-informed flow sensor: its equations, its trunk and its heads, on known truth."""

import numpy as np
import pytest
import torch

from flow_windows import SPEED, TWO, line, record, ripples
from rippletwin.flow_sensor import pinn
from rippletwin.flow_sensor.estimate import band_limit
from rippletwin.flow_sensor.line_response import line_response
from rippletwin.flow_sensor.spectral_inversion import estimate_flow
from rippletwin.flow_sensor.trunk import Trunk, equations
from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine
from rippletwin.line.frequency_domain.pipe_immittance import series_impedance, shunt_admittance

BAND = 750.0  # five pumping frequencies: half the default, to train in seconds
SETTINGS = pinn.Settings(steps=60, frequencies=24, points=10)


@pytest.fixture(scope="module", autouse=True)
def one_thread():
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.fixture(scope="module")
def trained():
    return pinn.train(line(), SPEED, BAND, SETTINGS)


def relative(flow, truth, speed=SPEED):
    truth = band_limit(truth, speed, BAND)
    return np.sqrt(np.mean((flow - truth) ** 2) / np.mean(truth**2))


def lumped(speed_hz, orders):
    """A lossless line of two segments with elements at x = 0, inside, at the joint and the load.

    Its waves are the trunk's carriers exactly, so an untrained trunk must satisfy everything.
    """
    s = 2j * np.pi * orders * speed_hz
    diameters, speeds = (0.02, 0.015), (1000.0, 1300.0)
    return FrequencyDomainLine(
        s=s,
        lengths=np.array([2.0, 1.0]),
        series=np.array(
            [
                series_impedance(s, density=870, viscosity=0.0, diameter=d, friction="none")
                for d in diameters
            ]
        ),
        shunt=np.array(
            [
                shunt_admittance(s, density=870, wave_speed=a, diameter=d)
                for a, d in zip(speeds, diameters)
            ]
        ),
        source_admittance=1e-14 * s,
        source_impedance=1e6 * s,
        load=("impedance", np.full(len(s), 3e10 + 0j)),
        inserts=[
            (0.0, "shunt", 2e-14 * s),
            (0.7, "shunt", np.full(len(s), 2e-11)),
            (2.0, "series", 1e5 * s),
            (2.0, "shunt", 1e-14 * s),
            (3.0, "shunt", 3e-14 * s),
        ],
        sensor_positions=np.array([0.7, 1.5, 2.0, 3.0]),
        sensor_factor=np.array([[1.0], [1.1], [1.0], [0.95]]),
    )


def test_equations_hold_for_exact_waves():
    """Every kind of row against the transfer matrices of the line: lossless waves are exact.

    The coefficients are solved from the waves at the pump and the equations; then the residuals
    vanish, and sensors and load agree with the network.
    """
    orders = np.linspace(1.0, 40.0, 30)
    network = lumped(SPEED, orders)
    trunk = Trunk(3, (network.s.imag[0], network.s.imag[-1]), width=16, seed=0)
    with torch.no_grad():
        rows = equations(trunk, network, np.array([0.1, 0.4, 0.9]))
        matrix = torch.cat([rows.equations, rows.joints, rows.waves], dim=1)
        target = torch.zeros(*matrix.shape[:2], 2, dtype=matrix.dtype)
        target[:, -2:] = torch.eye(2, dtype=matrix.dtype)
        head = torch.linalg.solve(matrix.mH @ matrix, matrix.mH @ target)
    assert (matrix @ head - target).abs().max() < 1e-9
    expected = line_response(network)
    np.testing.assert_allclose((rows.sensors @ head).numpy(), expected.to_sensors, atol=1e-8)
    mismatch = (rows.load @ head).numpy()[:, 0]  # parallel to the load's row at the pump
    parallel = np.abs(np.sum(mismatch * np.conj(expected.to_load), axis=1))
    np.testing.assert_allclose(parallel, np.linalg.norm(mismatch, axis=1), rtol=1e-7)


def test_slopes_are_the_derivatives_of_the_values():
    """The trunk's slopes against central differences of its values, off its start."""
    network = lumped(SPEED, np.linspace(1.0, 40.0, 30))
    trunk = Trunk(3, (network.s.imag[0], network.s.imag[-1]), width=16, seed=0)
    generator = torch.Generator().manual_seed(0)
    last = trunk.envelope[-1]
    with torch.no_grad():
        last.weight += 0.3 * torch.randn(last.weight.shape, generator=generator, dtype=torch.double)
        piece, place = np.arange(3), np.array([0.2, 0.5, 0.8])
        omega = torch.as_tensor(network.s.imag)
        phase = omega[:, None] * torch.tensor([1e-3, 2e-3, 3e-3])
        _, slope = trunk(piece, place, omega, phase)
        step = 1e-5
        above, _ = trunk(piece, place + step, omega, phase)
        below, _ = trunk(piece, place - step, omega, phase)
    difference = (above - below) / (2 * step)
    assert (difference - slope).abs().max() < 1e-6 * slope.abs().max()


def test_training_lowers_the_loss(trained):
    """The losses of data, equations and boundaries fall by far more than chance allows."""
    _, history = trained
    assert history[-1] < 0.05 * history[0]


def test_trained_trunk_finds_the_flow(trained):
    """Noise-free twin-made recordings, known flow: within 1 %; the untrained trunk is far worse."""
    rng = np.random.default_rng(11)
    flow = ripples(5, rng)
    windows = record(line(), flow, 0.0, rng)
    trunk, _ = trained
    found = pinn.estimate_flow(windows, SPEED, line(), trunk, 1.0, BAND)
    assert relative(found.flow, flow) < 0.01
    raw = Trunk(3, tuple(trunk.omega.tolist()), width=16, seed=0)
    untrained = pinn.estimate_flow(windows, SPEED, line(), raw, 1.0, BAND, equation_error=1e-3)
    assert relative(untrained.flow, flow) > 3 * relative(found.flow, flow)


def test_both_sensors_of_flow_agree_under_noise(trained):
    """4 kPa of noise: against truth within 3 %, like the spectral sensor, an independent method."""
    rng = np.random.default_rng(12)
    flow = ripples(10, rng)
    windows = record(line(), flow, 4000.0, rng)
    trunk, _ = trained
    learnt = pinn.estimate_flow(windows, SPEED, line(), trunk, 4000.0, BAND)
    spectral = estimate_flow(windows, SPEED, line(), 4000.0, BAND)
    assert relative(learnt.flow, flow) < 0.03
    assert relative(learnt.flow, spectral.flow) < 0.03


def test_other_speeds_need_no_other_trunk(trained):
    """Frequency is an input of the trunk: a speed 1 % off the trained one works as well."""
    rng = np.random.default_rng(13)
    flow = ripples(4, rng)
    speed = 1.01 * SPEED
    windows = record(line(), flow, 0.0, rng, speed)
    trunk, _ = trained
    found = pinn.estimate_flow(windows, speed, line(), trunk, 1.0, BAND)
    assert relative(found.flow, flow, speed) < 0.01


def test_training_is_reproducible():
    """Same seed, same trunk; the global random state is left alone."""
    settings = pinn.Settings(steps=3, frequencies=8, points=4)
    torch.manual_seed(5)
    before = torch.random.get_rng_state()
    first = pinn.train(line(TWO), SPEED, 300.0, settings)[1]
    assert torch.equal(before, torch.random.get_rng_state())
    np.testing.assert_array_equal(first, pinn.train(line(TWO), SPEED, 300.0, settings)[1])
