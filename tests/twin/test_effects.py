"""The library of effects: what every effect must be, and limits that are known by other means."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from rippletwin.case.model import Fluid, Load, Rig, Segment, Sensor
from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine
from rippletwin.line.frequency_domain.pipe_immittance import series_impedance, shunt_admittance
from rippletwin.line.time_domain.line_elements import Pipe
from rippletwin.twin import twin_file
from rippletwin.twin.effects.base import LineState, Place
from rippletwin.twin.effects.library import EFFECTS, candidates
from rippletwin.twin.priors import Prior, Priors
from rippletwin.twin.twin import Twin

FIXED = {
    "unsteady_friction": "line",
    "viscoelastic_wall": "segment",
    "entrained_air": "line",
    "side_branch": "position",
    "leak": "position",
    "line_volume": "position",
    "gas_volume": "position",
    "load_volume": "load",
    "load_dynamics": "load",
    "source_impedance": "source",
    "piston_spread": "source",
    "speed_fluctuation": "source",
    "sensor_dynamics": "sensor",
    "sensor_gain": "sensor",
    "sensor_delay": "sensor",
    "thermal_boundary_layer": "line",
    "end_radiation": "load",
    "end_reflection": "load",
    "side_hole": "position",
}
FREQUENCY = np.linspace(20.0, 5000.0, 150)
S = 2j * np.pi * FREQUENCY


def rig(gas=False):
    fluid = Fluid(1.2, 1.5e-5, 1.4, 0.71) if gas else Fluid(870.0, 3.2e-5)
    line = (Segment(3.0, 0.02, 1020.0), Segment(1.5, 0.016, 1200.0))
    sensors = (Sensor("p1", 0.4), Sensor("p2", 2.1))
    return Rig(fluid, {"pistons": 9}, line, sensors, Load("open" if gas else "orifice"))


def network(rig, friction="steady"):
    """Line and its state of a rig with a resistance of 3e10 Pa s/m3 at its end."""
    density, viscosity = rig.fluid.density, rig.fluid.kinematic_viscosity
    gas = rig.fluid.is_gas
    series = [
        series_impedance(
            S, density=density, viscosity=viscosity, diameter=s.diameter, friction=friction
        )
        for s in rig.line
    ]
    shunt = [
        shunt_admittance(S, density=density, wave_speed=s.wave_speed, diameter=s.diameter)
        for s in rig.line
    ]
    net = FrequencyDomainLine(
        s=S,
        lengths=np.array([s.length for s in rig.line]),
        series=np.array(series),
        shunt=np.array(shunt),
        load=("open", None) if gas else ("admittance", np.full(len(S), 1 / 3e10)),
        sensor_positions=np.array([s.position for s in rig.sensors]),
    )
    state = LineState(
        density,
        viscosity,
        np.array([s.diameter for s in rig.line]),
        np.array([s.wave_speed for s in rig.line]),
        np.array([s.length for s in rig.line]),
        mean_pressure=1e7,
        load_resistance=3e10,
        heat_capacity_ratio=rig.fluid.heat_capacity_ratio,
        prandtl=rig.fluid.prandtl,
    )
    return net, state


def drawn(effect, place, rig, rng):
    return {p.name: float(p.prior.value(rng.normal())) for p in effect.parameters(rig, place)}


CASES = [
    pytest.param(effect, place, gas, id=f"{effect.name}-{place}-{'gas' if gas else 'oil'}")
    for gas in (False, True)
    for named in (True, False)
    for effect, place in candidates(rig(gas), named)
]


def test_names_and_elements_are_the_fixed_ones():
    """The registry finds the contract's effects on their elements, and no other named ones."""
    named = {e.name: e.element for e in EFFECTS.values() if e.named}
    assert named == FIXED


def test_gas_effects_are_for_gases_only():
    """Thermal boundary layer and radiation are offered for a gas, hoses for a liquid."""
    oil = {e.name for e, _ in candidates(rig())}
    gas = {e.name for e, _ in candidates(rig(gas=True))}
    assert not oil & {"thermal_boundary_layer", "end_radiation"}
    assert {"thermal_boundary_layer", "end_radiation"} <= gas
    assert "viscoelastic_wall" not in gas


@pytest.mark.parametrize("effect, place, gas", CASES)
def test_effect_is_passive(effect, place, gas):
    """An effect on line, position or load keeps Re Z_in >= 0 (energy), for any parameters."""
    if effect.element in ("sensor", "source"):
        pytest.skip("acts on readings or on the source, not on the line's impedance")
    if effect.name == "load_dynamics" and place.form == "spool":
        pytest.skip("a spool is active: it is moved by the mean flow")
    rng = np.random.default_rng(1)
    for _ in range(20):
        net, state = network(rig(gas))
        effect.apply(net, state, drawn(effect, place, rig(gas), rng), place)
        z = net.input_impedance()
        assert np.all(z.real >= -1e-9 * np.abs(z))


@pytest.mark.parametrize("effect, place, gas", CASES)
def test_batch_equals_single(effect, place, gas):
    """Values of shape (B, 1) give what B single calls give: elementwise, as the fit relies on."""
    if effect.name in ("piston_spread", "speed_fluctuation"):
        pytest.skip("acts at shaft orders that are not fitted")
    rng = np.random.default_rng(2)
    base = rig(gas)
    sets = [drawn(effect, place, base, rng) for _ in range(3)]
    for values in sets:
        values.update({k: sets[0][k] for k in values if k == "position"})
    batch = {k: np.array([[v[k]] for v in sets]) for k in sets[0]}
    if "position" in batch:
        batch["position"] = sets[0]["position"]
    net, state = network(base)
    net.series = np.repeat(net.series[:, None], 3, axis=1)
    net.shunt = np.repeat(net.shunt[:, None], 3, axis=1)
    effect.apply(net, state, batch, place)
    for k, values in enumerate(sets):
        one, state = network(base)
        effect.apply(one, state, values, place)
        np.testing.assert_allclose(net.series[:, k], one.series, rtol=1e-12)
        np.testing.assert_allclose(net.shunt[:, k], one.shunt, rtol=1e-12)
        for many, single in zip(net.inserts, one.inserts):
            y = np.broadcast_to(many[2], (3, len(S)))[k]
            np.testing.assert_allclose(y, np.broadcast_to(single[2], len(S)), rtol=1e-12)
        many = np.broadcast_to(net.sensor_factor, (2, 3, len(S)))[:, k]
        np.testing.assert_allclose(many, np.broadcast_to(one.sensor_factor, (2, len(S))))


@pytest.mark.parametrize(
    "prior", [Prior("normal", 2.0, 0.5), Prior("lognormal", 2.0, 0.5), Prior("uniform", 1.0, 3.0)]
)
def test_prior_coordinate_inverts_value(prior):
    """coordinate(value(u)) = u."""
    u = np.linspace(-2, 2, 9)
    np.testing.assert_allclose(prior.coordinate(prior.value(u)), u, atol=1e-9)


def test_unsteady_friction_replaces_steady():
    """The effect on a steady line equals the line built with Zielke's impedance at once."""
    net, state = network(rig())
    EFFECTS["unsteady_friction"].apply(net, state, {}, Place("line"))
    np.testing.assert_allclose(net.series, network(rig(), "unsteady")[0].series, rtol=1e-10)


def test_walls_that_creep_alike_are_those_of_every_segment():
    """Creep of the whole line equals the same creep put into one segment after the other, in the
    frequency domain and in the pipes of the time domain. A line of one segment has no such
    place."""
    wall, everywhere = EFFECTS["viscoelastic_wall"], Place("line")
    assert everywhere in wall.places(rig()) and wall.usual(rig(), everywhere)
    assert everywhere not in wall.places(replace(rig(), line=rig().line[:1]))
    values = {"compliance_ratio": 0.01, "retardation_time": 2e-4}
    one, state = network(rig())
    each, _ = network(rig())
    pipes = [Pipe(s.length, s.diameter, s.wave_speed) for s in rig().line]
    at_once, in_turn = SimpleNamespace(pipes=[*pipes]), SimpleNamespace(pipes=[*pipes])
    wall.apply(one, state, values, everywhere)
    wall.apply_in_time(at_once, state, values, everywhere)
    for place in wall.places(rig())[:2]:
        wall.apply(each, state, values, place)
        wall.apply_in_time(in_turn, state, values, place)
    np.testing.assert_allclose(one.shunt, each.shunt, rtol=1e-12)
    assert at_once.pipes == in_turn.pipes and at_once.pipes[1].creep == ((0.01, 2e-4),)


def test_a_hose_creeps_as_it_says_beside_walls_that_creep():
    """A line whose walls all creep and whose second segment is a hose is the line whose segments
    each have their own creep: the hose's is not added to that of all walls. In the frequency domain
    and in the pipes of the time domain."""
    wall = EFFECTS["viscoelastic_wall"]
    line, first, second = Place("line"), Place("segment 1", 0), Place("segment 2", 1)
    steel = {"compliance_ratio": 0.01, "retardation_time": 2e-4}
    hose = {"compliance_ratio": 0.2, "retardation_time": 4e-4}

    def changed(*effects):
        net, state = network(rig())
        pipes = [Pipe(s.length, s.diameter, s.wave_speed) for s in rig().line]
        state.effects = [(wall, place) for place, _ in effects]
        in_time = SimpleNamespace(pipes=pipes)
        for place, values in effects:
            wall.apply(net, state, values, place)
            wall.apply_in_time(in_time, state, values, place)
        return net.shunt, in_time.pipes

    shunt, pipes = changed((line, steel), (second, hose))
    expected_shunt, expected_pipes = changed((first, steel), (second, hose))
    np.testing.assert_allclose(shunt, expected_shunt, rtol=1e-12)
    assert pipes == expected_pipes


def test_short_branch_is_a_volume():
    """A branch much shorter than the wave stores like its volume (Wylie & Streeter, sec. 12.5)."""
    values = {"position": 1.0, "length": 0.01, "diameter": 0.01, "viscosity_ratio": 1.0}
    volume = 0.25 * np.pi * 0.01**2 * 0.01
    readings = []
    for name, own in (
        ("side_branch", values),
        ("line_volume", {"position": 1.0, "volume": volume}),
    ):
        net, state = network(rig())
        EFFECTS[name].apply(net, state, own, Place("position"))
        readings.append(net.inserts[0][2])
    low = FREQUENCY < 1000.0
    np.testing.assert_allclose(readings[0][low], readings[1][low], rtol=2e-2)


def test_a_leaking_pump_drives_a_matched_line_less():
    """Into its characteristic impedance Zc the pump's flow Q makes p = Q/(1/Zc + G): the leakage is
    a resistance parallel to the line (Kirchhoff)."""
    base, leakage = rig(), 3e-11
    one = Rig(base.fluid, base.pump, base.line[:1], base.sensors[:1], base.load)
    net, state = network(one, friction="none")
    zc = 870.0 * 1020.0 / state.area(0)
    net.load = "impedance", np.full(len(S), zc)
    place = Place("source", form="leakage")
    EFFECTS["source_impedance"].apply(net, state, {"conductance": leakage}, place)
    np.testing.assert_allclose(np.abs(net.readings()), 1.0 / (1.0 / zc + leakage), rtol=1e-9)


def test_an_orifice_passes_what_a_leak_leaves():
    """A laminar leak G takes G p of the mean flow Q; the orifice then passes q = Q - G p, and the
    slope of its square law at p is q/(2 p)."""
    net, state = network(rig())
    flow, leak = 1e-3, 2e-11
    pressure = state.mean_pressure  # it drains to the atmosphere
    net.load = "admittance", np.full(len(S), flow / (2 * pressure))
    state.mean_flow, state.load_passes_flow = flow, True
    values = {"position": 1.0, "conductance": leak, "pressure_exponent": 0.0}
    EFFECTS["leak"].apply(net, state, values, Place("position"))
    np.testing.assert_allclose(net.load[1], (flow - leak * pressure) / (2 * pressure), rtol=1e-12)
    # A coefficient from the data sheet stands.
    net, state = network(rig())
    before = net.load[1].copy()
    EFFECTS["leak"].apply(net, state, values, Place("position"))
    np.testing.assert_array_equal(net.load[1], before)


def test_air_slows_the_wave_as_wood_does():
    """Wave speed with air equals Wood's from the mixture's compressibility (1930)."""
    net, state = network(rig())
    values = {"gas_fraction": 1e-2, "polytropic_exponent": 1.4}
    EFFECTS["entrained_air"].apply(net, state, values, Place("line"))
    pressure = 1e7 + 101325.0  # absolute
    fraction = 1e-2 * (101325.0 / pressure) ** (1 / 1.4)
    oil = 1 / (870.0 * 1020.0**2)
    wood = 1 / np.sqrt(870.0 * (oil + fraction / (1.4 * pressure)))
    area = state.area(0)
    speed = np.sqrt((S * area / 870.0) / net.shunt[0])
    np.testing.assert_allclose(speed.real, wood, rtol=1e-12)


def test_gas_yields_as_a_polytrope_of_its_mean_pressure():
    """Its admittance is s dV/dp of p V^n = const, by differences of volumes at each pressure; a
    volume of liquid yields alike at both."""
    n, gas = 1.3, 2e-7  # m3 at 10 MPa
    given = {"position": 1.0, "gas_volume": gas, "polytropic_exponent": n}
    for pressure in (4e6, 1.6e7):
        net, state = network(rig())
        state.mean_pressure = pressure
        EFFECTS["gas_volume"].apply(net, state, given, Place("position"))

        def volume(p):
            return gas * (1e7 / (p + 101325.0)) ** (1 / n)

        slope = (volume(pressure - 1e3) - volume(pressure + 1e3)) / 2e3
        np.testing.assert_allclose(net.inserts[-1].immittance, S * slope, rtol=1e-6)


def test_thermal_layer_goes_from_isothermal_to_adiabatic():
    """Compressibility is gamma times adiabatic in a narrow tube, adiabatic in a wide one."""
    from rippletwin.twin.effects.thermal_boundary_layer import thermal_factor

    narrow = thermal_factor(S[:1], 1.5e-5, 1e-5, 1.4, 0.71)
    wide = thermal_factor(S[-1:], 1.5e-5, 10.0, 1.4, 0.71)
    np.testing.assert_allclose(narrow, 1.4, rtol=1e-3)
    np.testing.assert_allclose(wide, 1.0, rtol=1e-3)


def test_creep_compliance_fades_with_frequency():
    """A hose is 1 + kappa times softer at rest and as soft as its elastic wall far above 1/tau."""
    net, state = network(rig())
    before = net.shunt.copy()
    values = {"compliance_ratio": 0.2, "retardation_time": 1.0}
    EFFECTS["viscoelastic_wall"].apply(net, state, values, Place("segment 2", 1))
    np.testing.assert_array_equal(net.shunt[0], before[0])
    np.testing.assert_allclose(net.shunt[1], before[1], rtol=2e-3)
    net, state = network(rig())
    values["retardation_time"] = 1e-9
    EFFECTS["viscoelastic_wall"].apply(net, state, values, Place("segment 2", 1))
    np.testing.assert_allclose(net.shunt[1], 1.2 * before[1], rtol=1e-4)


def test_effect_in_a_twin_survives_plain_data():
    """A corrected twin written as plain data and read back predicts the same."""
    effects = ((EFFECTS["line_volume"], Place("position")),)
    twin = Twin(rig(), effects=effects)
    twin = twin.with_(theta=np.linspace(-0.3, 0.3, len(twin.parameters)))
    again = twin_file.from_dict(twin_file.to_dict(twin))
    assert again.effects[0][0].name == "line_volume"
    np.testing.assert_array_equal(again.theta, twin.theta)


def test_half_sine_harmonics_and_equal_pistons():
    """Nine equal half sines cancel at all but multiples of nine; one has its Fourier series."""
    from rippletwin.twin.effects.piston_spread import half_sine

    angle = 2 * np.pi * np.arange(4096) / 4096
    wave = np.pi * np.maximum(np.sin(angle), 0.0)
    exact = 2 * np.fft.rfft(wave)[1:20] / 4096
    np.testing.assert_allclose(half_sine(np.arange(1, 20)), exact, atol=1e-5)


def test_priors_at_once_are_those_one_by_one():
    """Values of parameters of every kind, mixed."""
    priors = [
        Prior("normal", 2.0, 0.5),
        Prior("lognormal", 3.0, 0.2),
        Prior("uniform", 1.0, 3.0),
        Prior("lognormal", 0.1, 1.0),
        Prior("bounded", 0.0, 0.4),
    ]
    u = np.random.default_rng(0).normal(size=5)
    assert np.allclose(Priors(priors).value(u), [p.value(x) for p, x in zip(priors, u)])


def test_the_volume_of_a_pump_known_by_its_ripple_is_about_its_displacement():
    """A pump of 40 cm3 per revolution: 95 % from a quarter to four times that, whatever the bore.
    Without a stated ripple the prior goes with the cube of the bore."""

    def volume(of):
        own = EFFECTS["source_impedance"].parameters(of, Place("source", form="volume"))
        return next(p for p in own if p.name == "volume")

    stated = replace(rig(), displacement=4e-5)
    assert volume(stated).value(0.0) == pytest.approx(4e-5)
    low, high = volume(stated).value(-2.0) / 4e-5, volume(stated).value(2.0) / 4e-5
    assert 0.2 < low < 0.3 and 3.5 < high < 5.0
    narrow = replace(rig(), line=(Segment(3.0, 0.01, 1020.0),))
    assert volume(narrow).value(0.0) == pytest.approx(volume(rig()).value(0.0) / 8)
