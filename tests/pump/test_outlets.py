"""The pump and a pipe coupled in time, against the pipe in the frequency domain."""

import numpy as np
import pytest

from default_pump import LOAD, OIL, PIPE, POSITIONS, SPEED, relative_rms
from rippletwin.harmonics import flow_harmonics
from rippletwin.pump.outlets import ConstantPressure, Pipe, PressureWave
from rippletwin.pump.simulation import simulate


def pipe_response(piped, position, harmonics):
    """Pressure and flow at `position` from those at the pump, by the pipe's exact solution.

    p(x) = cosh(g x) p0 - Zc sinh(g x) q0 with g, Zc of steady laminar friction; no load needed.
    """
    p0 = np.fft.rfft(piped.outlet_pressure)[:harmonics]
    q0 = np.fft.rfft(piped.flow)[:harmonics]
    s = 2j * np.pi * np.arange(harmonics) * SPEED / 60
    s[0] = 1e-9j  # mean flow: the limit of s -> 0
    area = PIPE.area
    series = OIL.density / area * (s + 32 * OIL.kinematic_viscosity / PIPE.diameter**2)
    shunt = area * s / (OIL.density * PIPE.wave_speed**2)
    g, zc = np.sqrt(series * shunt), np.sqrt(series / shunt)
    p = np.cosh(g * position) * p0 - zc * np.sinh(g * position) * q0
    q = np.cosh(g * position) * q0 - np.sinh(g * position) / zc * p0
    return p, q


@pytest.mark.parametrize("sensor", [0, 1])
def test_sensor_pressure_agrees_with_the_frequency_domain(piped, sensor):
    """The pipe's exact solution driven by the computed outlet state, to 5 kHz (300 orders)."""
    expected, _ = pipe_response(piped, POSITIONS[sensor], 300)
    computed = np.fft.rfft(piped.sensor_pressure[sensor])[:300]
    assert np.linalg.norm((computed - expected)[1:]) < 1e-5 * np.linalg.norm(expected[1:])
    assert computed[0].real == pytest.approx(expected[0].real, rel=1e-6)


def test_flow_and_pressure_at_the_load_obey_the_orifice(piped):
    """Frequency-domain state at the pipe's end, in time: q = K_v sqrt(p) at every instant.

    Checked to 5 kHz, against the orifice's flow limited to the same band.
    """
    p, q = pipe_response(piped, PIPE.length, 300)
    samples = len(piped.flow)
    pressure, flow = (np.fft.irfft(np.pad(x, (0, samples // 2 + 1 - 300))) for x in (p, q))
    assert relative_rms(flow, piped.orifice * np.sqrt(pressure)) < 0.02
    assert flow.mean() == pytest.approx(piped.orifice * np.sqrt(pressure).mean(), rel=1e-4)
    assert pressure.mean() == pytest.approx(LOAD, rel=1e-3)


def test_orifice_discharges_into_the_back_pressure():
    """q = K sqrt(p - p0), and the pressure falls by Hagen-Poiseuille's law to that at the load."""
    outlet = Pipe(PIPE, POSITIONS, load_pressure=LOAD, back_pressure=2e6)
    run = simulate({}, OIL, SPEED, outlet, min_steps=3072)
    flow = run.flow.mean()
    assert flow == pytest.approx(run.orifice * np.sqrt(LOAD - 2e6), rel=1e-6)
    fall = 128 * OIL.density * OIL.kinematic_viscosity * flow / (np.pi * PIPE.diameter**4)
    expected = LOAD + fall * (PIPE.length - np.array(POSITIONS))
    np.testing.assert_allclose(run.sensor_pressure.mean(axis=1), expected, rtol=2e-4)
    with pytest.raises(ValueError, match="back_pressure"):
        Pipe(PIPE, load_pressure=1e6, back_pressure=2e6)


def test_coupled_mean_flow_equals_uncoupled(constant, piped):
    """Coupling loses no flow: a few kPa of pressure apart, the means agree to a few 1e-4."""
    assert piped.flow.mean() == pytest.approx(constant.flow.mean(), rel=5e-4)


def test_sensor_outside_the_pipe_is_refused():
    with pytest.raises(ValueError, match="outside"):
        Pipe(PIPE, (5.5,), load_pressure=LOAD)


def test_pump_against_the_pressure_of_a_pipe_delivers_as_in_the_pipe(piped):
    """Independent truth: the pump coupled to the pipe step by step in time. Against the pressure
    that it makes there, as sampled, its flow is the same to 0.2 % of the ripple, where the flow
    into a constant pressure differs by a third of it and more."""
    wave = simulate({}, OIL, SPEED, PressureWave(piped.outlet_pressure))
    free = simulate({}, OIL, SPEED, ConstantPressure(piped.outlet_pressure.mean()))
    ripple = np.linalg.norm(piped.flow - piped.flow.mean())
    assert np.linalg.norm(wave.flow - piped.flow) < 0.002 * ripple
    assert np.linalg.norm(free.flow - piped.flow) > 0.33 * ripple


def test_the_flow_against_a_given_pressure_is_of_second_order():
    """Of a pump with wide ports the flow is nearly the derivative of the pressure, which a solver
    may give half a step late. With half the step the difference to the same pump coupled to its
    pipe, to 4 kHz, is a fourth; of first order it would be half."""
    orders, errors = np.arange(9, 235, 9), []
    for steps in (12288, 24576):
        truth = simulate({}, OIL, SPEED, Pipe(PIPE, load_pressure=LOAD), min_steps=steps)
        wave = simulate({}, OIL, SPEED, PressureWave(truth.outlet_pressure), min_steps=steps)
        a, b = (flow_harmonics(ripple, orders) for ripple in (truth, wave))
        errors.append(np.linalg.norm(b - a) / np.linalg.norm(a))
    print(errors)
    assert errors[1] < errors[0] / 3
