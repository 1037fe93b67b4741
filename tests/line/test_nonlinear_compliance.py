"""Nonlinear compliance, against the second harmonic that it makes of a progressive wave."""

import numpy as np
import pytest

from paper_line import DENSITY, network
from rippletwin.line.frequency_domain.nonlinear_compliance import (
    OUTFLOW_TOLERANCE,
    NonlinearCompliance,
    NonlinearComplianceSolver,
)
from rippletwin.line.frequency_domain.prescribed_outflows import FundamentalSolutions
from rippletwin.line.time_domain.line_elements import Pipe

LENGTH, DIAMETER, SPEED, PRESSURE = 6.6, 0.02, 1000.0, 1e7
AREA = 0.25 * np.pi * DIAMETER**2
ORDERS = np.arange(1, 16)
IMPEDANCE = DENSITY * SPEED / AREA
S = 2j * np.pi * 150.0 * ORDERS


def compliance(curvature, start=0.0, stop=LENGTH, volume=AREA * LENGTH):
    """What stores c_2 x^2 of its volume; the whole pipe by default."""
    pressure = np.full(len(S), PRESSURE)
    return NonlinearCompliance(
        start, stop, volume, pressure, np.full((1, len(S)), float(curvature))
    )


def driven(amplitude, stored):
    """A lossless pipe, endless both ways, that carries one harmonic of `amplitude` (Pa), with the
    nonlinear compliance `stored`."""
    source = np.where(ORDERS == 1, 2.0 * amplitude / IMPEDANCE, 0.0).astype(complex)
    line = network(S, [Pipe(LENGTH, DIAMETER, SPEED)], "none", source_flow=source)
    line.source_admittance = 1.0 / IMPEDANCE
    line.load = "anechoic", None
    line.nonlinear_compliances = [stored]
    p, q = line.load_state()

    def law(a, b, c):
        scale = c / (a * p + b * q)
        return scale * p, scale * q

    NonlinearComplianceSolver([slice(0, len(S))], ORDERS).solve(line, law)
    return line


@pytest.mark.parametrize("curvature", [-2e-4, 1e-4])
def test_second_harmonic_grows_as_the_distance(curvature):
    """Of a progressive wave p1 cos, storing c_2 (p/P)^2 besides makes to second order a second
    harmonic rho a omega x |c_2| (p1/P)^2 / 2 (as Fubini's, Hamilton & Blackstock 1998, Nonlinear
    Acoustics, sec. 4.2): an analytic solution, and the first is left alone."""
    amplitude = 0.02 * PRESSURE
    line, x = driven(amplitude, compliance(curvature)), LENGTH * np.arange(5, 31, 5) / 30
    forward = 0.5 * (line.pressure_at(x) + IMPEDANCE * line.flow_at(x))
    omega = abs(S[0])
    second = 0.5 * DENSITY * SPEED * omega * x * abs(curvature) * (amplitude / PRESSURE) ** 2
    np.testing.assert_allclose(np.abs(forward[:, 1]), second, rtol=0.01)
    np.testing.assert_allclose(np.abs(forward[:, 0]), amplitude, rtol=1e-3)


def test_nonlinear_storage_conserves_energy():
    """Lossless pipe: the mean power that enters leaves at the end, in whatever harmonic (energy
    is conserved, for what is stored in a crest comes back)."""
    line, ends = driven(0.2 * PRESSURE, compliance(-2e-3)), [0.0, LENGTH]
    power = 0.5 * np.real(line.pressure_at(ends) * line.flow_at(ends).conj())
    assert np.sum(power[0]) == pytest.approx(np.sum(power[1]), rel=1e-3)
    assert power[1, 0] < 0.995 * power[0, 0]  # some of it in other harmonics


def test_zero_series_is_the_linear_line():
    """Series of zeros: the linear line, to rounding."""
    line = driven(0.05 * PRESSURE, compliance(0.0))
    forced = line.pressure_at([1.0])
    line.outflows = None
    np.testing.assert_allclose(forced, line.pressure_at([1.0]), atol=1e-9 * np.abs(forced).max())


def lossy():
    """Two segments with unsteady friction, a load that reflects and an impedance at the source."""
    pipes = [Pipe(3.1, DIAMETER, SPEED), Pipe(2.2, 0.6 * DIAMETER, 1.2 * SPEED)]
    line = network(S, pipes, "unsteady", source_flow=1e-4 / ORDERS)
    line.source_admittance = 0.3 / IMPEDANCE
    line.load = "admittance", 0.2 / IMPEDANCE
    return line


def test_an_outflow_is_the_branch_that_takes_as_much():
    """The flow into a shunt admittance, prescribed instead: the same pressure and flow all along
    the line, and the same relation at the load."""
    branched, forced, x = lossy(), lossy(), np.array([0.4, 2.0, 3.5, 5.0])
    places = np.array([1.3, 4.1])
    admittances = [2.0 / IMPEDANCE * (0.1 + 0.02j * ORDERS), S * 1e-13]
    branched.inserts = [(at, "shunt", y) for at, y in zip(places, admittances)]
    forced.outflows = places, branched.pressure_at(places) * admittances
    np.testing.assert_allclose(forced.pressure_at(x), branched.pressure_at(x), rtol=1e-10)
    np.testing.assert_allclose(forced.flow_at(x), branched.flow_at(x), rtol=1e-10)
    a, b, c = forced.load_relation()
    p, q = branched.pressure_at([5.3])[0], branched.flow_at([5.3])[0]
    np.testing.assert_allclose(a * p + b * q, c, rtol=1e-10)


def test_variation_of_constants_is_the_sweep():
    """Pressure with outflows, from both solutions without them and from one sweep with them."""
    line, x = lossy(), np.array([0.4, 2.0, 3.5, 5.0])
    outflow = 1e-5 * np.exp(1j * np.outer(np.arange(1, 5), ORDERS))
    basis = FundamentalSolutions(line, x)
    a, b, c = basis.load_relation(outflow)
    p, q = line.load_state()
    scale = c / (a * p + b * q)
    pressure = basis.pressure_under((scale * p, scale * q), outflow)
    line.outflows = x, outflow
    np.testing.assert_allclose(line.pressure_at(x), pressure, rtol=1e-10)


@pytest.mark.parametrize("diverging", [2, 8])
def test_iteration_converges_despite_several_sharp_resonances(diverging):
    """Against the exact solution: x = A x + b, where A takes `diverging` directions three to six
    times further at every pass, as resonances do, and the rest a tenth."""
    rng = np.random.default_rng(2)
    turn = np.linalg.qr(rng.normal(size=(40, 40)) + 1j * rng.normal(size=(40, 40)))[0]
    far = np.linspace(3.0, 6.0, diverging) * np.exp(1j * rng.uniform(0, 2 * np.pi, diverging))
    map_ = (turn * np.r_[far, np.full(40 - diverging, 0.1)]) @ np.conj(turn).T
    b = rng.normal(size=40) + 1j * rng.normal(size=40)
    full = NonlinearComplianceSolver([slice(0, 10)], np.arange(1, 11))
    found = full.find_fixed_point(lambda x: (map_ @ x.ravel() + b).reshape(4, 10), (4, 10))
    assert full.solved
    exact = np.linalg.solve(np.eye(40) - map_, b).reshape(4, 10)
    assert np.abs(found - exact).max() < 10 * OUTFLOW_TOLERANCE * np.abs(exact).max()


def test_warm_start_saves_passes():
    """After a map, one that differs by a hundredth: started from the first solution, the second is
    exact too, in at most a third of the passes that it takes from zero."""
    rng = np.random.default_rng(5)
    turn = np.linalg.qr(rng.normal(size=(40, 40)) + 1j * rng.normal(size=(40, 40)))[0]
    far = np.r_[np.linspace(-6.0, -3.0, 20), np.full(20, 0.1)]
    b, passes = rng.normal(size=40) + 1j * rng.normal(size=40), []

    def solve(full, size):
        map_, count = size * (turn * far) @ np.conj(turn).T, 0

        def function(x):
            nonlocal count
            count += 1
            return (map_ @ x.ravel() + b).reshape(4, 10)

        found, exact = (
            full.find_fixed_point(function, (4, 10)),
            np.linalg.solve(np.eye(40) - map_, b),
        )
        assert full.solved
        assert np.abs(found.ravel() - exact).max() < 10 * OUTFLOW_TOLERANCE * np.abs(exact).max()
        passes.append(count)

    full = NonlinearComplianceSolver([slice(0, 10)], np.arange(1, 11))
    full.warm_start = True
    solve(full, 1.0)
    solve(full, 1.01)
    solve(NonlinearComplianceSolver([slice(0, 10)], np.arange(1, 11)), 1.01)
    assert passes[1] <= passes[2] / 3


def test_warm_start_skips_a_solution_of_another_shape():
    """After a problem of four positions, one of six that fails, then four again: it is solved."""
    full = NonlinearComplianceSolver([slice(0, 10)], np.arange(1, 11))
    full.warm_start = True
    full.find_fixed_point(lambda x: 1.0 - 3.0 * x, (4, 10))
    full.find_fixed_point(lambda x: np.where(x.real > 0.0, -1.0, 1.0) + 0j, (6, 10))
    assert not full.solved
    found = full.find_fixed_point(lambda x: 1.0 - 3.1 * x, (4, 10))
    assert full.solved
    np.testing.assert_allclose(found, 1.0 / 4.1, rtol=10 * OUTFLOW_TOLERANCE)


def test_a_problem_without_a_solution_is_not_claimed_solved():
    """f(x) = 1 for x <= 0 and -1 above has no fixed point; the next one, f(x) = x/2 + 1, is solved
    all the same, for the history of the first is dropped."""
    full = NonlinearComplianceSolver([slice(0, 10)], np.arange(1, 11))
    full.warm_start = True
    full.find_fixed_point(lambda x: np.where(x.real > 0.0, -1.0, 1.0) + 0j, (4, 10))
    assert not full.solved
    found = full.find_fixed_point(lambda x: 0.5 * x + 1.0, (4, 10))
    assert full.solved
    np.testing.assert_allclose(found, 2.0, rtol=10 * OUTFLOW_TOLERANCE)


def test_a_lump_makes_the_second_harmonic_of_its_flow():
    """A volume of gas amid a lossless, endless pipe: beside its linear part it takes in
    V c_2 x^2, whose flow at twice the frequency s_2 V c_2 (p1/P)^2/2 leaves half of it to either
    side, a pressure of half the impedance times it (analytic, to second order)."""
    volume, curvature, place = 1e-6, -0.4, 0.4 * LENGTH
    line = driven(0.005 * PRESSURE, compliance(curvature, place, place, volume))
    first, second = line.pressure_at([place])[0, :2]
    flow = S[1] * volume * curvature * 0.5 * (first / PRESSURE) ** 2
    assert second == pytest.approx(-0.5 * IMPEDANCE * flow, rel=1e-3)
