"""The virtual rig's pipes, nodes and effects against the exact solution in the frequency domain.

The exact solution is written here, with the Bessel functions of Zielke (J. Basic Eng. 90,
1968), and shares nothing with the rig: transfer matrices for what is linear, harmonic balance
for the orifice.
"""

from itertools import pairwise

import numpy as np
import pytest
from scipy.special import ive

from virtualrig.effects import EFFECTS, Draft
from virtualrig.orbit import Bench
from virtualrig.pump import Pump
from virtualrig.rig import Rig, Sensing, lay_out

RHO, NU, MODULUS = 870.0, 3.2e-5, 1.25e9
SEGMENTS = (
    {"length": 1.3, "diameter": 0.0197, "wave_speed": 1023.0},
    {"length": 0.6, "diameter": 0.0231, "wave_speed": 983.0},
    {"length": 0.7, "diameter": 0.0149, "wave_speed": 1308.0},
)
LENGTH = sum(segment["length"] for segment in SEGMENTS)
SENSORS = (0.42, 1.6)
SPEED_RPM, PRESSURE, FLOW = 3000.0, 9.5e6, 7e-4
HARMONICS = np.arange(2, 61, 2)
BASE_NUMERICS = {"frequency": 4500.0}
S = 2j * np.pi * HARMONICS * SPEED_RPM / 60


def source(amplitude):
    """Flow over a revolution, and its complex peak harmonics, each `amplitude` of the mean."""
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
    """Matrices from `start` to `stop`; `fittings` are (position, admittance); pipe keywords as
    above, `wall` and `softness` by segment index of `segments`."""
    segments = pipe.pop("segments", SEGMENTS)
    wall, softness = pipe.pop("wall", {}), pipe.pop("softness", np.ones(len(segments)))
    total = np.tile(np.eye(2, dtype=complex), (len(S), 1, 1))
    edges = np.concatenate([[0.0], np.cumsum([segment["length"] for segment in segments])])
    cuts = sorted({start, stop, *edges, *(at for at, _ in fittings)})
    for at, admittance in fittings:
        if at == start:
            total = total @ shunt_matrix(admittance)
    for a, b in pairwise(cuts):
        if a < start - 1e-12 or b > stop + 1e-12:
            continue
        k = int(np.searchsorted(edges, 0.5 * (a + b))) - 1
        total = total @ pipe_matrix(
            segments[k], b - a, wall=wall.get(k), softness=softness[k], **pipe
        )
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


def bench(flow, *effects, friction="unsteady", tolerance=0.5):
    """Harmonics (sensors, 30) of the settled rig with the source `flow`, and its orbit."""
    draft = Draft(
        Pump(bulk_modulus=MODULUS), [dict(s) for s in SEGMENTS], [{}, {}], friction=friction
    )
    for name, arguments in effects:
        EFFECTS[name](draft, **arguments)
    fluid = {"density": RHO, "kinematic_viscosity": NU}
    network, load = lay_out(draft, list(SENSORS), fluid, BASE_NUMERICS)
    rig = Rig(draft.pump, network, load, {}, tuple(Sensing(**c) for c in draft.sensing))
    valve = FLOW / np.sqrt(PRESSURE)
    orbit = Bench(rig, flow=flow).settle(SPEED_RPM, PRESSURE, valve, tolerance, 200)
    spectrum = np.fft.rfft(orbit.pressure, axis=1) * 2 / orbit.pressure.shape[1]
    return spectrum[:, HARMONICS], orbit


def misfit(rig, truth):
    """Relative misfit of each sensor's ripple."""
    return np.linalg.norm(rig - truth, axis=1) / np.linalg.norm(truth, axis=1)


def orifice_admittance(orbit):
    """dq/dp of the load's orifice at the settled mean pressure."""
    return 0.5 * orbit.valve / np.sqrt(orbit.load_pressure)


@pytest.mark.parametrize("friction", ["steady", "unsteady"])
def test_line_with_small_ripple_is_the_transfer_matrix(friction):
    """Harmonics to 3 kHz at both sensors agree with the exact linear solution to 0.3 %."""
    flow, harmonics = source(1e-3)
    rig, orbit = bench(flow, friction=friction)
    truth = exact(harmonics, orifice_admittance(orbit), friction=friction)
    assert misfit(rig, truth).max() < 3e-3


OMEGA = 2 * np.pi * 1150
SIDE = {"length": 0.35, "diameter": 0.012, "wave_speed": 1200.0}
SIDE_MATRIX = pipe_matrix(SIDE, SIDE["length"])
LINEAR = {
    "wall and outlet volume": (
        [
            ("viscoelastic_wall", {"segment": 2, "compliance": 0.2, "time": 2e-4}),
            ("source_impedance", {"volume": 2e-5}),
        ],
        {"wall": {1: (0.2, 2e-4)}, "fittings": [(0.0, S * 2e-5 / MODULUS)]},
    ),
    "volumes in the line and at the load": (
        [
            ("line_volume", {"position": 1.1, "volume": 3e-5}),
            ("load_volume", {"volume": 4e-5}),
        ],
        {"fittings": [(1.1, S * 3e-5 / MODULUS), (LENGTH, S * 4e-5 / MODULUS)]},
    ),
    "leak, resonator and closed branch": (
        [
            ("leak", {"position": 1.4, "conductance": 1e-11}),
            (
                "resonator",
                {"position": 0.9, "frequency_hz": 1150.0, "damping": 0.05, "compliance": 2e-14},
            ),
            ("side_branch", {"position": 2.0, **SIDE}),
        ],
        {
            "fittings": [
                (1.4, 0 * S + 1e-11),
                (0.9, S * 2e-14 / (1 + 0.1 * S / OMEGA + (S / OMEGA) ** 2)),
                (2.0, SIDE_MATRIX[:, 1, 0] / SIDE_MATRIX[:, 0, 0]),
            ]
        },
    ),
}


@pytest.mark.parametrize("name", LINEAR)
def test_linear_effects_are_their_admittances(name):
    """Linear effects change the ripple by over 2 % and agree with the exact solution to 0.3 %."""
    effects, description = LINEAR[name]
    flow, harmonics = source(1e-3)
    rig, orbit = bench(flow, *effects)
    admittance = orifice_admittance(orbit)
    truth = exact(harmonics, admittance, **description)
    assert misfit(exact(harmonics, admittance), truth).min() > 0.02
    assert misfit(rig, truth).max() < 3e-3


@pytest.mark.parametrize(
    "arguments",
    [{"gain": 0.6, "lag": 1e-3}, {"gain": 0.4, "frequency_hz": 300.0, "damping": 0.3}],
)
def test_load_dynamics_is_its_admittance(arguments):
    """A valve that opens with pressure has q0/p0 (1/2 + gain/(1 + lag s + s^2/w^2)), linearised."""
    flow, harmonics = source(1e-3)
    rig, orbit = bench(flow, ("load_dynamics", arguments))
    lag, inertia = arguments.get("lag", 0.0), 0.0
    if "frequency_hz" in arguments:
        omega = 2 * np.pi * arguments["frequency_hz"]
        lag, inertia = 2 * arguments["damping"] / omega, omega**-2
    ratio = orbit.valve / np.sqrt(orbit.load_pressure)
    admittance = ratio * (0.5 + arguments["gain"] / (1 + lag * S + inertia * S**2))
    assert misfit(rig, exact(harmonics, admittance)).max() < 5e-3


def test_air_is_its_tangent_for_small_ripple():
    """Entrained air, linearised at the mean: its compliance adds to every segment's own."""
    flow, harmonics = source(1e-3)
    fraction, n = 2e-3, 1.2
    rig, orbit = bench(flow, ("entrained_air", {"fraction": fraction, "exponent": n}))
    absolute = orbit.pressure.mean() + 1.01325e5
    gas = fraction / n * (1.01325e5 / absolute) ** (1 / n) / absolute
    softness = [1 + gas * RHO * segment["wave_speed"] ** 2 for segment in SEGMENTS]
    admittance = orifice_admittance(orbit)
    truth = exact(harmonics, admittance, softness=softness)
    assert misfit(exact(harmonics, admittance), truth).min() > 0.02
    assert misfit(rig, truth).max() < 4e-3


def test_gas_and_stiffening_are_their_tangents_for_small_ripple():
    """A volume of gas and a modulus that grows with pressure, linearised at the mean."""
    flow, harmonics = source(1e-3)
    gas = {"position": 1.2, "gas_volume": 2e-7, "gas_pressure": 6e6, "exponent": 1.3}
    growth = {"per_pascal": 5e-9, "reference": 0.0}
    rig, orbit = bench(flow, ("gas_volume", gas), ("stiffening_liquid", growth))
    local = np.interp(1.2, SENSORS, orbit.pressure.mean(axis=1)) + 1.01325e5  # absolute
    volume = 2e-7 * (6e6 / local) ** (1 / 1.3)
    fittings = [(1.2, S * volume / (1.3 * local))]
    softness = [1 / (1 + 5e-9 * orbit.pressure.mean())] * 3
    admittance = orifice_admittance(orbit)
    truth = exact(harmonics, admittance, fittings, softness=softness)
    assert misfit(exact(harmonics, admittance, fittings), truth).min() > 0.02
    assert misfit(exact(harmonics, admittance, softness=softness), truth).min() > 0.02
    assert misfit(rig, truth).max() < 5e-3


def test_a_soft_piece_is_a_pipe_of_another_wave_speed():
    """A stretch of a third of the wave speed is, by transfer matrices, a pipe as soft as that
    between its ends; one end is moved to the joint that is 3 cm away."""
    flow, harmonics = source(1e-3)
    joint = SEGMENTS[0]["length"]
    piece = {"position": joint + 0.13, "length": 0.2, "speed_ratio": 1 / 3}
    draft = Draft(Pump(bulk_modulus=MODULUS), [dict(s) for s in SEGMENTS], [{}, {}])
    EFFECTS["soft_piece"](draft, **piece)
    assert [s["length"] for s in draft.segments[:3]] == pytest.approx(
        [joint, 0.23, SEGMENTS[1]["length"] - 0.23]
    )
    assert sum(s["length"] for s in draft.segments) == pytest.approx(LENGTH)
    rig, orbit = bench(flow, ("soft_piece", piece))
    admittance = orifice_admittance(orbit)
    truth = exact(harmonics, admittance, segments=draft.segments)
    assert misfit(exact(harmonics, admittance), truth).min() > 0.02
    assert misfit(rig, truth).max() < 3e-3


def test_full_amplitude_orifice_is_harmonic_balance():
    """At full ripple the square-law load agrees with Newton's harmonic balance to 3e-4, from which
    the linearised load differs by 5e-3 and more."""
    flow, harmonics = source(0.25 * np.minimum(1, (4 / HARMONICS) ** 1.5))
    rig, orbit = bench(flow, tolerance=5.0)
    whole = chain(0.0, LENGTH)
    # p(L) = (q(0) - d q(L))/c, from [p, q](0) = T [p, q](L)
    drive, d = harmonics / whole[:, 1, 0], whole[:, 1, 1] / whole[:, 1, 0]
    samples = 512
    turn = np.arange(samples) / samples
    basis = np.exp(2j * np.pi * np.outer(HARMONICS, turn))
    mean, load = orbit.load_pressure, np.zeros(len(S), dtype=complex)
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
    linear = exact(harmonics, orifice_admittance(orbit))
    assert misfit(linear, truth).min() > 5e-3
    assert misfit(rig, truth).max() < 3e-4


def test_turbulent_friction_is_darcys_pressure_drop():
    """A steady flow loses Hagen-Poiseuille's pressure and f (l/D) rho v^2/2 between the sensors."""
    factor = 0.05
    _, orbit = bench(np.full(2, FLOW), ("turbulent_friction", {"factor": factor}))
    drop, at = 0.0, 0.0
    for segment in SEGMENTS:
        inside = min(at + segment["length"], SENSORS[1]) - max(at, SENSORS[0])
        at += segment["length"]
        diameter = segment["diameter"]
        speed = FLOW / (np.pi / 4 * diameter**2)
        laminar = 32 * RHO * NU * speed / diameter**2
        drop += max(inside, 0) * (laminar + factor * RHO * speed**2 / (2 * diameter))
    means = orbit.pressure.mean(axis=1)
    assert means[0] - means[1] == pytest.approx(drop, rel=1e-3)
