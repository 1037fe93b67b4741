"""The virtual rig's pipes, nodes and effects against the exact solution in the frequency domain.

The exact solution is written here, with the Bessel functions of Zielke (J. Basic Eng. 90, 1968), and
shares nothing with the rig: transfer matrices for what is linear, harmonic balance for the orifice.
"""

import numpy as np
import pytest
from scipy.special import ive

from virtualrig.effects import EFFECTS, Draft
from virtualrig.orbit import Bench
from virtualrig.profile import velocity_modes
from virtualrig.pump import Pump
from virtualrig.rig import Rig, Sensing, lay_out

RHO, NU, MODULUS = 870.0, 3.2e-5, 1.25e9
SEGMENTS = (
    {"length": 1.9, "diameter": 0.0197, "wave_speed": 1023.0},
    {"length": 0.8, "diameter": 0.0231, "wave_speed": 983.0},
    {"length": 0.9, "diameter": 0.0149, "wave_speed": 1308.0},
)
LENGTH = sum(segment["length"] for segment in SEGMENTS)
SENSORS = (0.42, 2.3)
SPEED_RPM, PRESSURE, FLOW = 6000.0, 9.5e6, 7e-4
HARMONICS = np.arange(1, 41)
S = 2j * np.pi * HARMONICS * SPEED_RPM / 60


def source(amplitude):
    """Flow over a revolution whose harmonics (peak, complex) are known: all 40 of like size."""
    rng = np.random.default_rng(3)
    harmonics = amplitude * FLOW * np.exp(2j * np.pi * rng.uniform(size=len(HARMONICS)))
    turn = np.arange(46080) / 46080
    ripple = sum(np.real(q * np.exp(2j * np.pi * k * turn)) for k, q in zip(HARMONICS, harmonics))
    return FLOW + ripple, harmonics


def pipe_matrix(segment, length, friction="unsteady", wall=None, softness=1.0):
    """Transfer matrices (harmonics, 2, 2) of `length` metres of a segment, [p, q] at its start."""
    area = np.pi / 4 * segment["diameter"] ** 2
    if friction == "unsteady":
        z = np.sqrt(S / NU) * segment["diameter"] / 2
        series = RHO / area * S * ive(0, z) / ive(2, z)
    else:
        series = RHO / area * (S + 32 * NU / segment["diameter"] ** 2)
    shunt = area * S / (RHO * segment["wave_speed"] ** 2) * softness
    if wall is not None:
        shunt = shunt * (1 + wall[0] / (1 + wall[1] * S))
    gamma, zc = np.sqrt(series * shunt), np.sqrt(series / shunt)
    matrix = np.array(
        [[np.cosh(gamma * length), zc * np.sinh(gamma * length)],
         [np.sinh(gamma * length) / zc, np.cosh(gamma * length)]]
    )  # fmt: skip
    return np.moveaxis(matrix, 2, 0)


def shunt_matrix(admittance):
    matrix = np.zeros((len(S), 2, 2), dtype=complex)
    matrix[:, 0, 0] = matrix[:, 1, 1] = 1
    matrix[:, 1, 0] = admittance
    return matrix


def chain(start, stop, fittings=(), **pipe):
    """Matrices from `start` to `stop`; `fittings` are (position, admittance); pipe keywords as above,
    `wall` a dict by segment index."""
    wall = pipe.pop("wall", {})
    total = np.tile(np.eye(2, dtype=complex), (len(S), 1, 1))
    edges = np.concatenate([[0.0], np.cumsum([segment["length"] for segment in SEGMENTS])])
    cuts = sorted({start, stop, *edges, *(at for at, _ in fittings)})
    for at, admittance in fittings:
        if at == start:
            total = total @ shunt_matrix(admittance)
    for a, b in zip(cuts[:-1], cuts[1:]):
        if a < start - 1e-12 or b > stop + 1e-12:
            continue
        k = int(np.searchsorted(edges, 0.5 * (a + b))) - 1
        total = total @ pipe_matrix(SEGMENTS[k], b - a, wall=wall.get(k), **pipe)
        for at, admittance in fittings:
            if abs(at - b) < 1e-12:
                total = total @ shunt_matrix(admittance)
    return total


def exact(flow, load_admittance, fittings=(), **pipe):
    """Pressures (sensors, harmonics) with flow `flow` driven into x = 0."""
    whole = chain(0.0, LENGTH, fittings, **pipe)
    p = flow * (whole[:, 0, 0] + whole[:, 0, 1] * load_admittance)
    p = p / (whole[:, 1, 0] + whole[:, 1, 1] * load_admittance)
    start = np.stack([p, flow], axis=1)
    return np.array(
        [
            np.linalg.solve(chain(0.0, x, fittings, **pipe), start[..., None])[:, 0, 0]
            for x in SENSORS
        ]
    )


def bench(flow, *effects, friction="unsteady", valve=None, amplitude_tolerance=0.3):
    """Harmonics (sensors, 40) of the settled rig driven by `flow`, and its orbit."""
    draft = Draft(
        Pump(bulk_modulus=MODULUS), [dict(s) for s in SEGMENTS], [{}, {}], friction=friction
    )
    for name, arguments in effects:
        EFFECTS[name](draft, **arguments)
    fluid = {"density": RHO, "kinematic_viscosity": NU}
    network, load = lay_out(draft, list(SENSORS), fluid, {})
    rig = Rig(draft.pump, network, load, {}, tuple(Sensing(**c) for c in draft.sensing))
    orbit = Bench(rig, flow=flow).settle(SPEED_RPM, PRESSURE, valve, amplitude_tolerance, 200)
    spectrum = np.fft.rfft(orbit.pressure, axis=1) * 2 / orbit.pressure.shape[1]
    return spectrum[:, HARMONICS], orbit


def misfit(rig, truth):
    """Relative misfit of each sensor's ripple."""
    return np.linalg.norm(rig - truth, axis=1) / np.linalg.norm(truth, axis=1)


def orifice_admittance(orbit):
    """dq/dp of the load's orifice at the settled mean pressure (from its own coefficient)."""
    return 0.5 * orbit.valve / np.sqrt(PRESSURE)


def test_velocity_modes_are_the_bessel_admittance_and_passive():
    """Ten lags hold Zielke's friction to 0.2 % over the band used; weights and rates are positive."""
    rates, weights = velocity_modes(10)
    s = 1j * np.geomspace(150, 1e5, 400)  # 16 Hz to 5 kHz in these pipes
    z = np.sqrt(s)
    exact_friction = s * ive(0, z) / ive(2, z) - s
    friction = 1 / (weights / (s[:, None] + rates)).sum(axis=1) - s
    assert np.abs(friction / exact_friction - 1).max() < 2e-3
    assert (weights > 0).all() and (rates > 0).all()
    assert 1 / (weights / rates).sum() == pytest.approx(8, rel=1e-10)


@pytest.mark.parametrize("friction", ["steady", "unsteady"])
def test_line_with_small_ripple_is_the_transfer_matrix(friction):
    """40 harmonics to 4 kHz at both sensors agree with the exact linear solution to 0.3 %."""
    flow, harmonics = source(1e-3)
    rig, orbit = bench(flow, friction=friction)
    truth = exact(harmonics, orifice_admittance(orbit), friction=friction)
    assert misfit(rig, truth).max() < 3e-3


SMALL = {
    "viscoelastic_wall": (
        {"segment": 2, "compliance": 0.2, "time": 2e-4},
        {"wall": {1: (0.2, 2e-4)}},
    ),
    "line_volume": (
        {"position": 1.1, "volume": 3e-5},
        {"fittings": [(1.1, S * 3e-5 / MODULUS)]},
    ),
    "load_volume": ({"volume": 4e-5}, {"fittings": [(LENGTH, S * 4e-5 / MODULUS)]}),
    "source_impedance": ({"volume": 2e-5}, {"fittings": [(0.0, S * 2e-5 / MODULUS)]}),
    "leak": ({"position": 1.4, "conductance": 1e-11}, {"fittings": [(1.4, 0 * S + 1e-11)]}),
    "resonator": (
        {"position": 2.1, "frequency_hz": 1150.0, "damping": 0.05, "compliance": 2e-14},
        {
            "fittings": [
                (2.1, S * 2e-14 / (1 + 0.1 * S / (2300 * np.pi) + (S / (2300 * np.pi)) ** 2))
            ]
        },
    ),
    "moving_bend": (
        {"position": 2.7, "frequency_hz": 700.0, "damping": 0.1, "compliance": 1e-14},
        {
            "fittings": [
                (2.7, S * 1e-14 / (1 + 0.2 * S / (1400 * np.pi) + (S / (1400 * np.pi)) ** 2))
            ]
        },
    ),
}


@pytest.mark.parametrize("name", SMALL)
def test_linear_effect_is_its_admittance(name):
    """Each linear effect moves the ripple by percents, and lands on the exact solution to 0.3 %."""
    arguments, description = SMALL[name]
    flow, harmonics = source(1e-3)
    rig, orbit = bench(flow, (name, arguments))
    admittance = orifice_admittance(orbit)
    truth = exact(harmonics, admittance, **description)
    assert misfit(exact(harmonics, admittance), truth).min() > 0.02
    assert misfit(rig, truth).max() < 3e-3


def test_side_branch_is_a_closed_pipe():
    """A dead-end pipe at 1.5 m: input admittance tanh(gamma l)/Zc with the same unsteady friction."""
    branch = {"length": 0.35, "diameter": 0.012, "wave_speed": 1200.0}
    matrix = pipe_matrix(branch, branch["length"])
    flow, harmonics = source(1e-3)
    rig, orbit = bench(flow, ("side_branch", {"position": 1.5, **branch}))
    fittings = [(1.5, matrix[:, 1, 0] / matrix[:, 0, 0])]
    truth = exact(harmonics, orifice_admittance(orbit), fittings)
    assert misfit(rig, truth).max() < 3e-3


@pytest.mark.parametrize(
    "arguments",
    [{"gain": 0.6, "lag": 1e-3}, {"gain": 0.4, "frequency_hz": 300.0, "damping": 0.3}],
)
def test_load_dynamics_is_its_admittance(arguments):
    """The valve that opens with pressure, linearised: q0/p0 (1/2 + gain/(1 + lag s + s^2/w^2))."""
    flow, harmonics = source(1e-3)
    rig, orbit = bench(flow, ("load_dynamics", arguments))
    lag, inertia = arguments.get("lag", 0.0), 0.0
    if "frequency_hz" in arguments:
        omega = 2 * np.pi * arguments["frequency_hz"]
        lag, inertia = 2 * arguments["damping"] / omega, omega**-2
    ratio = orbit.valve / np.sqrt(PRESSURE)
    admittance = ratio * (0.5 + arguments["gain"] / (1 + lag * S + inertia * S**2))
    assert misfit(rig, exact(harmonics, admittance)).max() < 5e-3


def test_air_and_gas_and_stiffening_are_their_tangents_for_small_ripple():
    """Entrained air, an accumulator and a pressure-dependent modulus, linearised at the mean."""
    flow, harmonics = source(1e-3)
    absolute = PRESSURE + 1.01325e5
    fraction, n = 2e-3, 1.2
    rig, orbit = bench(flow, ("entrained_air", {"fraction": fraction, "exponent": n}))
    truth = [
        fraction / n * (1.01325e5 / absolute) ** (1 / n) / absolute * RHO * s["wave_speed"] ** 2
        for s in SEGMENTS
    ]
    assert max(truth) > 1e-4
    # one softness for all segments would be wrong: air adds the same compliance to each
    rig_air = misfit(rig, _exact_soft(harmonics, orifice_admittance(orbit), truth))
    assert rig_air.max() < 4e-3

    gas = {"position": 1.2, "gas_volume": 5e-6, "gas_pressure": 6e6, "exponent": 1.3}
    rig, orbit = bench(flow, ("accumulator", gas))
    volume = 5e-6 * (6e6 / PRESSURE) ** (1 / 1.3)
    fittings = [(1.2, S * volume / (1.3 * PRESSURE))]
    assert misfit(rig, exact(harmonics, orifice_admittance(orbit), fittings)).max() < 5e-3

    growth = {"per_pascal": 1e-8, "reference": 0.0}
    rig, orbit = bench(flow, ("stiffening_liquid", growth))
    softer = [1 / (1 + 1e-8 * PRESSURE) - 1] * 3
    truth = _exact_soft(harmonics, orifice_admittance(orbit), softer)
    assert misfit(rig, truth).max() < 5e-3


def _exact_soft(flow, admittance, extra):
    """exact() with the shunt admittance of segment k times 1 + extra[k]."""
    edges = np.concatenate([[0.0], np.cumsum([s["length"] for s in SEGMENTS])])

    def upto(x):
        total = np.tile(np.eye(2, dtype=complex), (len(S), 1, 1))
        for k, segment in enumerate(SEGMENTS):
            length = min(max(x - edges[k], 0.0), segment["length"])
            total = total @ pipe_matrix(segment, length, softness=1 + extra[k])
        return total

    whole = upto(LENGTH)
    p = flow * (whole[:, 0, 0] + whole[:, 0, 1] * admittance)
    p = p / (whole[:, 1, 0] + whole[:, 1, 1] * admittance)
    start = np.stack([p, flow], axis=1)[..., None]
    return np.array([np.linalg.solve(upto(x), start)[:, 0, 0] for x in SENSORS])


def test_full_amplitude_orifice_is_harmonic_balance():
    """At 8 % ripple the square-law load agrees with Newton's harmonic balance to 0.4 %, not with its
    own linearisation."""
    flow, harmonics = source(8e-3)
    rig, orbit = bench(flow)
    whole = chain(0.0, LENGTH)
    # p(L) = (q(0) - d q(L))/c, from [p, q](0) = T [p, q](L)
    drive, d = harmonics / whole[:, 1, 0], whole[:, 1, 1] / whole[:, 1, 0]
    samples = 512
    turn = np.arange(samples) / samples
    basis = np.exp(2j * np.pi * np.outer(HARMONICS, turn))
    mean, load = PRESSURE, np.zeros(len(S), dtype=complex)
    for _ in range(60):
        pressure = mean + np.real(load @ basis)
        through = orbit.valve * np.sqrt(pressure)
        q = 2 * (through * basis.conj()).mean(axis=1)
        slope = orbit.valve / (2 * np.sqrt(mean))
        load = load - (load - drive + d * q) / (1 + d * slope)
        mean *= (FLOW / through.mean()) ** 2
    assert np.abs(load - drive + d * q).max() < 1e-6 * np.abs(load).max()
    at_load = np.stack([load, q], axis=1)[..., None]
    truth = np.array([(chain(x, LENGTH) @ at_load)[:, 0, 0] for x in SENSORS])
    linear = exact(harmonics, 0.5 * orbit.valve / np.sqrt(PRESSURE))
    assert misfit(linear, truth).min() > 8e-3
    assert misfit(rig, truth).max() < 4e-3
