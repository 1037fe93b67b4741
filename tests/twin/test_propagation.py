"""Every effect of the library in the time domain against itself in the frequency domain.

The two share the fluid's numbers and nothing of the solution: the method of characteristics at its
default step against chain and harmonic balance (independent verification). The whole registry is
gone through, so that a new effect without a working time-domain twin fails here.
"""

from dataclasses import replace

import numpy as np
import pytest

from rippletwin.errors import InputError
from rippletwin.line.time_domain.weighting_functions import conduction_terms
from rippletwin.spectra.corrected_ripple import CorrectedRipple
from rippletwin.twin import twin_file
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS, candidates
from rippletwin.twin.effects.thermal_boundary_layer import thermal_factor
from rippletwin.twin.operating_point import OperatingCondition, guessed_flow
from rippletwin.twin.propagation import line_in_time, propagate, pump_change
from rippletwin.twin.twin import Twin
from two_domains import ORDERS, PRESSURE, SPEED_HZ, STEPS, both, corrected, misfit, rig, ripple


def every_effect():
    """Each effect at each kind of place: of alike segments and sensors only the last."""
    for load in ("orifice", "open", "anechoic"):
        last = {}
        for named in (True, False):
            for effect, place in candidates(rig(load), named):
                own = load == "anechoic" and effect.name == "end_reflection"
                if load == "orifice" or effect.medium == "gas" or own:
                    last[effect.name, place.form] = effect, place
        for effect, place in last.values():
            yield pytest.param(effect, place, load, id=f"{effect.name}-{place}")


CASES = list(every_effect())


def test_the_whole_registry_is_here():
    """No effect is left out: each of the registry is among the cases."""
    assert {case.values[0].name for case in CASES} == set(EFFECTS)


@pytest.mark.parametrize("effect, place, load", CASES)
def test_effect_is_the_same_in_both_domains(effect, place, load):
    """Readings agree to 0.5 % of the ripple below 5 kHz, of which the effect is far more."""
    twin = corrected((effect, place), load=load)
    moc, chain = both(twin)
    without = corrected(load=load)
    bare = without.respond(
        ripple(1e-5 if load == "open" else 1e-3),
        SPEED_HZ,
        1e5 if load == "open" else PRESSURE,
        ORDERS,
    )
    print(f"{effect.name} {place}: {misfit(moc, chain):.1e} of {misfit(bare, chain):.2g}")
    assert misfit(moc, chain) < 0.005
    assert misfit(bare, chain) > 3 * misfit(moc, chain)


def test_a_sensor_at_the_outlet_reads_behind_the_pump_s_passage():
    """The sensors at 0 m and at 1 um read one pressure, p(0), and both domains read it."""
    effect = EFFECTS["source_impedance"], Place("source", form="volume and passage")
    twin = corrected(effect)
    near = tuple(replace(s, position=x) for s, x in zip(twin.rig.sensors, (0.0, 1e-6)))
    twin = Twin(replace(twin.rig, sensors=near), effects=twin.effects, theta=twin.theta)
    moc, chain = both(twin)
    print(abs(moc[:, 8]), abs(chain[:, 8]))
    assert misfit(chain[0], chain[1]) < 1e-4
    assert misfit(moc[0], chain[0]) < 0.005
    assert misfit(moc[1], chain[1]) < 0.005


def test_effects_together_are_the_same_in_both_domains():
    """Volume, air, branch, spool, unsteady friction and a late sensor at once agree to 0.5 %."""
    names = ("source_impedance", "entrained_air", "unsteady_friction", "side_branch")
    some = {(e.name, p.form or p.element): (e, p) for e, p in candidates(rig())}
    effects = [next(pair for key, pair in some.items() if key[0] == name) for name in names]
    effects += [some["load_dynamics", "spool"], some["sensor_delay", "sensor p2"]]
    moc, chain = both(corrected(*effects))
    print(f"together: {misfit(moc, chain):.1e}")
    assert misfit(moc, chain) < 0.005


def test_walls_creep_under_the_liquid_alone_wherever_air_was_found():
    """Air before the wall or after it: one prediction, and that of the time domain, where the wall
    creeps under the liquid."""
    air = EFFECTS["entrained_air"], Place("line")
    wall = EFFECTS["viscoelastic_wall"], Place("segment 2", 1)
    orders = [corrected(*pair) for pair in ((air, wall), (wall, air))]
    theta = dict(orders[0].values())
    assert orders[1].values() == theta
    chains = [twin.respond(ripple(), SPEED_HZ, PRESSURE, ORDERS) for twin in orders]
    np.testing.assert_allclose(chains[0], chains[1], rtol=1e-9)
    moc, chain = both(orders[0])
    assert misfit(moc, chain) < 0.005


def test_effects_see_the_line_s_friction_in_both_domains():
    """The state that an effect is given in time has the friction law of the line with its effects,
    as in the frequency domain."""
    seen = []

    def look(line, state, values, place):
        seen.append(state.friction)

    watcher = replace(EFFECTS["line_volume"], apply=look, apply_in_time=look)
    twin = corrected((EFFECTS["unsteady_friction"], Place("line")), (watcher, Place("position")))
    line_in_time(twin, ripple().flow, ripple().flow, SPEED_HZ, PRESSURE)
    twin.respond(ripple(), SPEED_HZ, PRESSURE, ORDERS)
    assert set(seen) == {"unsteady"} and len(seen) >= 2


def test_a_guessed_load_stays_with_another_flow():
    """The fitted factor belongs to the guessed mean flow: both domains keep that orifice, whatever
    flow is simulated."""
    twin = Twin(rig(), guessed_load=True)
    twin = twin.with_(theta=np.where(np.equal(list(twin.index), "load"), 0.5, 0.0))
    factor = twin.values()["load"]
    for mean in (1e-3, 4e-4):
        condition = OperatingCondition.at_orders(ORDERS, SPEED_HZ, PRESSURE, ripple(mean))
        coefficient = factor * twin.operating_point(condition).coefficient
        flow = ripple(mean).flow
        line = line_in_time(twin, flow, flow, SPEED_HZ, PRESSURE)
        assert line.end.coefficient == pytest.approx(coefficient)
        assert coefficient == pytest.approx(factor * guessed_flow(rig()) / np.sqrt(PRESSURE))


def test_a_pump_cannot_deliver_into_a_closed_end():
    """A mean flow into a closed end is refused in words."""
    flow = ripple().flow
    with pytest.raises(InputError, match="no way out of a closed end"):
        line_in_time(Twin(rig("closed")), flow, flow, SPEED_HZ, PRESSURE)


def test_air_stiffens_in_the_crests():
    """A ripple of a tenth of the mean in oil with 1.7 % of air: substitution along the line agrees
    with the method of characteristics, which follows the law in time, to 0.15 %; the linear law is
    off by more than 1 %."""
    air = next((e, p) for e, p in candidates(rig()) if e.name == "entrained_air")
    twin, wave = corrected(air, strength=1.0), ripple()
    moc = propagate(twin, wave.flow, wave.flow, SPEED_HZ, 6e6, steps=STEPS, tolerance=1e-4)
    chain = twin.respond(wave, SPEED_HZ, 6e6, ORDERS)
    small = replace(wave, flow=1e-3 + 1e-3 * (wave.flow - 1e-3))
    linear = 1e3 * twin.respond(small, SPEED_HZ, 6e6, ORDERS)
    assert misfit(moc.harmonics(ORDERS), chain) < 0.0015
    assert misfit(linear, chain) > 0.01


def test_a_valve_opens_on_the_pressure_that_there_is():
    """What a valve opens passes the flow of the pressure then over it: at a ripple of an eighth of
    the mean, substitution agrees with the method of characteristics to 0.3 %, where a valve whose
    flow is linear in the pressure misses by more than 1 %."""
    spool = next((e, p) for e, p in candidates(rig()) if p.form == "spool")

    def without_opening(network, *state):
        spool[0].apply(network, *state)
        network.opening = None

    linear = replace(spool[0], apply=without_opening)
    wave, pressure = ripple(), 3e6
    full, bent = corrected(spool, strength=0.5), corrected((linear, spool[1]), strength=0.5)
    moc = propagate(full, wave.flow, wave.flow, SPEED_HZ, pressure, steps=STEPS, tolerance=1e-4)
    moc = moc.harmonics(ORDERS)
    chain, without = (t.respond(wave, SPEED_HZ, pressure, ORDERS) for t in (full, bent))
    print(f"{misfit(moc, chain):.1e}, flow linear in the pressure {misfit(moc, without):.1e}")
    assert misfit(moc, chain) < 0.003
    assert misfit(moc, without) > 0.01


def test_faulty_pump_draws_on_the_same_leak():
    """A pump that delivers 5 % less: the mean falls in orifice and leak as their slopes say."""
    leak = EFFECTS["leak"], Place("position")
    healthy, flow = np.full(3072, 1e-3), np.full(3072, 0.95e-3)
    twin = corrected(leak, strength=-0.5)
    values = twin.effect_values(twin.theta)[0][2]
    conductance = values["conductance"] * 0.95 ** -values["pressure_exponent"]
    moc = propagate(twin, flow, healthy, SPEED_HZ, PRESSURE, steps=2048, tolerance=1e-9)
    fall = PRESSURE - moc.pressure[-1].mean()
    exponent = values["pressure_exponent"]
    slope = values["conductance"] * (PRESSURE / 1e7) ** -exponent
    passed = 1e-3 - slope * PRESSURE / (1.0 - exponent)
    assert passed > 0.5e-3
    orifice = passed / (2.0 * PRESSURE)
    assert conductance > 0.1 * orifice
    assert fall == pytest.approx(0.05e-3 / (orifice + conductance), rel=0.05)


def test_conducting_terms_are_the_boundary_layer():
    """Ten positive terms stand for the factor of Bessel functions to 0.2 % (analytic)."""
    for radius in (0.5e-3, 4e-3, 20e-3):
        # |r| from 0.1 to 1000
        s = 1j * np.geomspace(1e-2, 1e6, 60) * 1.5e-5 / (0.71 * radius**2)
        terms = conduction_terms(1.5e-5 / (0.71 * radius**2), 1.4)
        summed = 1.0 + sum(kappa / (1.0 + s * tau) for kappa, tau in terms)
        exact = thermal_factor(s, 1.5e-5, 2.0 * radius, 1.4, 0.71)
        assert np.max(np.abs(summed - exact) / np.abs(exact - 1.0)) < 0.002
        assert min(kappa for kappa, _ in terms) > 0.0


def test_simulations_take_the_corrected_ripple():
    """The harmonics at the piston orders of a healthy pump are those of the nominal one times the
    ratio, by Fourier analysis of the flow that drives the line; a faulty pump gets the same flow
    on top, and a twin.json keeps the ratio."""
    orders = 9 * np.arange(1, 20)
    ratio = 1.0 - 0.01 * np.arange(1, 20) * np.exp(0.1j * np.arange(1, 20))
    ripple_ratio = CorrectedRipple({"healthy": orders}, {"healthy": ratio}, {"healthy": 0.0})
    twin = twin_file.from_dict(twin_file.to_dict(corrected().with_(ripple=ripple_ratio)))
    healthy, point = ripple().flow, (SPEED_HZ, PRESSURE)
    change, _ = pump_change(twin, healthy, *point)
    driven = np.fft.rfft(line_in_time(twin, healthy, healthy, *point).flow)
    plain = np.fft.rfft(line_in_time(corrected(), healthy, healthy, *point).flow)
    np.testing.assert_allclose(driven[orders], ratio * plain[orders], rtol=1e-9)
    np.testing.assert_allclose(driven[[0, 3, 10]], plain[[0, 3, 10]], atol=1e-9 * abs(plain[0]))
    faulty = 0.9 * healthy
    np.testing.assert_allclose(
        line_in_time(twin, faulty, healthy, *point).flow
        - line_in_time(corrected(), faulty, healthy, *point).flow,
        change,
        atol=1e-9 * np.max(healthy),
    )
