"""The next experiment: what each candidate recording is expected to discriminate."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from made_fits import made_fit
from rippletwin.calibration.fit import Fit
from rippletwin.calibration.frequency_continuation import refine
from rippletwin.explanation.verdict import next_experiment
from rippletwin.explanation.verdict.candidate_recordings import (
    _at_operating_point,
    further_sensors,
    list_candidate_recordings,
)
from rippletwin.explanation.verdict.decision import equivalent_places, rival_fits
from rippletwin.explanation.verdict.next_experiment import (
    expected_loss,
    propose_recording,
    propose_sensor_position,
    transfer_twin,
)
from rippletwin.harmonics import flow_harmonics
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from synthetic_observations import make

HOSE = ((EFFECTS["viscoelastic_wall"], Place("segment 2", 1)),)
AIR = ((EFFECTS["entrained_air"], Place("line")),)
TRUTH = {
    "viscoelastic_wall@segment 2.compliance_ratio": 0.2,
    "viscoelastic_wall@segment 2.retardation_time": 3e-4,
    "entrained_air@line.gas_fraction": 5e-3,
}
PLACE = Place("position")
POINTS = ((1000, 9.5e6),)
PUMP = {"pistons": 9, "port_opening_deg": 20.0, "port_overlap_deg": 2.0, "bulk_modulus": 1.3e9}


@pytest.fixture(scope="module")
def hose():
    """Observations of a line with a hose, and the fit with the hose."""
    bench, observations, truth = make(np.random.default_rng(11), HOSE, TRUTH, points=POINTS)
    base = Twin(bench, observations)
    return base, observations, refine(base, HOSE, observations, [truth.theta])


@pytest.fixture(scope="module")
def uncertain_pump():
    """A fit whose twin has pump parameters, at known coordinates, and its observations."""
    bench, observations, _ = make(np.random.default_rng(11), points=POINTS)
    twin = Twin(replace(bench, pump=PUMP), observations, uncertain_pump=True)
    theta = np.random.default_rng(2).normal(size=len(twin.theta))
    twin = twin.with_(theta=theta)
    covariance = 0.01 * np.eye(len(theta))
    return Fit((), twin, 0.0, 0.0, covariance, 0.004, 0.01, 0.01), observations


def test_an_explanation_loses_nothing_to_itself(hose):
    """The accepted explanation itself loses nothing on any recording, and another loses something
    on every one."""
    base, observations, fit = hose
    air = refine(base, AIR, observations, [np.zeros(len(base.with_(effects=AIR).parameters))])
    for _, rig, observation in list_candidate_recordings(fit.twin, observations)[::4]:
        assert expected_loss(fit, fit, rig, observation) < 1e-6
        assert expected_loss(fit, air, rig, observation) > 1e-3


def test_another_operating_point_discriminates_air_from_a_slower_wave():
    """At one pressure air and a slower wave are equivalent. Another speed and pressure are expected
    to discriminate better than the same recording again."""
    bench, observations, truth = make(np.random.default_rng(4), AIR, TRUTH, points=POINTS)
    base = Twin(bench, observations)
    air = refine(base, AIR, observations, [truth.theta])
    plain = refine(base, (), observations, [np.zeros(len(base.parameters))])
    proposal = propose_recording(air, [plain], observations)
    assert proposal.loss > expected_loss(air, plain, bench, observations[0])
    assert propose_recording(air, [air], observations) is None


def test_no_recording_is_proposed_where_none_is_possible(hose):
    """An input impedance of a line whose effect is at its end: the end cannot be another one, and
    there is no sensor. Proves that the verdict then goes without a proposal."""
    base, observations, fit = hose
    twin = base.with_(effects=((EFFECTS["load_volume"], Place("load")),))
    accepted = replace(fit, twin=twin, hypothesis=twin.effects)
    impedance = replace(observations[0], kind="input_impedance")
    assert list_candidate_recordings(twin, [impedance]) == []
    assert propose_recording(accepted, [fit], [impedance]) is None


def test_only_the_best_recordings_are_compared_with_the_pump(uncertain_pump, monkeypatch):
    """Every recording is compared with the pump's numbers held, and as many as stated with its
    numbers free, those of the largest losses; the loss that is told is one with them free."""
    fit, observations = uncertain_pump
    losses: dict[bool, list[float]] = {True: [], False: []}

    def loss(accepted, rival, rig, observation, free):
        losses[free].append(observation.frequency_hz[0] + len(rig.sensors))
        return losses[free][-1]

    monkeypatch.setattr(next_experiment, "expected_loss", loss)
    proposal = propose_recording(fit, [replace(fit, evidence=-1.0)], observations)
    assert len(losses[False]) == len(list_candidate_recordings(fit.twin, observations))
    assert losses[True] == sorted(losses[False], reverse=True)[: next_experiment.COMPARED_WITH_PUMP]
    assert proposal.loss == max(losses[True])


def test_all_common_parameters_are_carried_to_the_new_recording(uncertain_pump):
    """The twin of a periodic candidate has every parameter of the fit but the old shaft angle, with
    the fitted coordinates, those of the pump included."""
    fit, observations = uncertain_pump
    index = fit.twin.index
    carried = {name for name in index if not name.startswith("angle")}
    assert {"bulk_modulus", "port_timing"} < carried
    periodic = [
        (rig, o) for _, rig, o in list_candidate_recordings(fit.twin, observations) if o.speed_hz
    ]
    assert len(periodic) > 5
    for rig, observation in periodic:
        twin = transfer_twin(fit, rig, observation)
        assert carried <= set(twin.index)
        for name in carried:
            assert twin.theta[twin.index[name]] == fit.twin.theta[index[name]]


def test_a_rival_with_another_pump_is_expected_to_lose(uncertain_pump):
    """A rival that differs in the pump's bulk modulus and port timing alone predicts another
    ripple, so it loses log evidence at another speed."""
    fit, observations = uncertain_pump
    theta = fit.twin.theta.copy()
    for name in ("bulk_modulus", "port_timing"):
        theta[fit.twin.index[name]] += 3.0
    rival = replace(fit, twin=fit.twin.with_(theta=theta))
    _, rig, observation = next(
        c
        for c in list_candidate_recordings(fit.twin, observations)
        if c[0].startswith("another operating point")
    )
    assert expected_loss(fit, rival, rig, observation) > 1.0
    assert expected_loss(fit, fit, rig, observation) < 1e-6


def test_a_proposed_recording_is_modulated_once(uncertain_pump):
    """A shaft that turns unevenly: the ripple at another speed is that of the recording in
    proportion to the speed, at every harmonic."""
    fit, (near, *_) = uncertain_pump
    near = replace(near, modulation=0.02 + 0.0j)
    own = fit.twin.operating_point(near).ripple
    new = _at_operating_point(fit.twin, near, 1.1 * near.speed_hz, near.load_pressure)
    ripple = fit.twin.operating_point(new).ripple
    orders = 9 * np.arange(1, 20)
    assert np.allclose(flow_harmonics(ripple, orders), 1.1 * flow_harmonics(own, orders))


def test_the_scaled_ripple_keeps_everything_but_its_size(uncertain_pump):
    """The ripple at another speed is that of the recording in proportion to the speed, by a shaft
    with the same phase modulation."""
    fit, observations = uncertain_pump
    old = replace(observations[0].flow_ripple, modulation=0.003 + 0.001j)
    observations = [replace(observations[0], flow_ripple=old)]
    for recording, _, o in list_candidate_recordings(fit.twin, observations):
        if recording.startswith("another operating point"):
            scale = o.speed_hz / observations[0].speed_hz
            np.testing.assert_allclose(o.flow_ripple.flow, scale * old.flow)
            assert o.flow_ripple.modulation == old.modulation


@pytest.mark.parametrize(
    "networks",
    [
        [("passive_network", Place("position", form="shunt", number=k)) for k in (1, 2)],
        [("passive_network", Place("position", form="series")), ("passive_piece", PLACE)],
    ],
)
def test_a_further_sensor_narrows_the_newest_network(monkeypatch, networks):
    """Of two networks, whatever their kind, the newest is moved to either end of its interval, and
    nothing else is; the sensor that tells the ends apart best is proposed."""
    bench, observations, _ = make(np.random.default_rng(11), points=POINTS)
    hypothesis = tuple((EFFECTS[name], place) for name, place in networks)
    twin = Twin(bench, observations, effects=hypothesis)
    fit = Fit(hypothesis, twin, 0.0, 0.0, 0.01 * np.eye(len(twin.theta)), 0.004, 0.01, 0.01)
    moved = []

    def loss(one, other, rig, observation):
        moved.append((one.twin.values(), other.twin.values()))
        return float(rig.sensors[-1].position)

    monkeypatch.setattr(next_experiment, "expected_loss", loss)
    proposal = propose_sensor_position(fit, observations, 2.0, 6.0)
    (name, place), unmoved = networks[-1], twin.values()
    newest = f"{name}@{place}.position"
    for one, other in moved:
        assert one[newest] == pytest.approx(2.0) and other[newest] == pytest.approx(6.0)
        assert one == unmoved | {newest: one[newest]}
        assert other == unmoved | {newest: other[newest]}
    assert proposal.loss == max(rig.sensors[-1].position for _, rig, _ in
                                further_sensors(twin, observations))  # fmt: skip


def test_gains_of_two_sensors_are_one_class():
    """Places of one effect with nearly equal evidence are a class; another effect is not in it."""

    def fit(name, sensor, evidence):
        return made_fit(evidence, (EFFECTS[name], Place(f"sensor {sensor}")))

    best = fit("sensor_gain", "p1", 100.0)
    others = [fit("sensor_gain", "p2", 99.0), fit("sensor_delay", "p2", 10.0)]
    search = SimpleNamespace(best=best, rivals=[best, *others], other_positions=[])
    assert equivalent_places(search) == (("sensor_gain at sensor p1", "sensor_gain at sensor p2"),)
    assert rival_fits(search) == others[:1]


def test_no_recording_below_the_back_pressure_of_the_load_is_proposed():
    """An orifice passes flow from the line alone: 0.4 of 9.5 MPa is less than 4 MPa behind it.
    Every candidate that is left has an operating point."""
    bench, observations, _ = make(np.random.default_rng(4), points=POINTS)
    rig = replace(bench, load=replace(bench.load, back_pressure=4e6))
    twin = Twin(rig, observations)
    others = [o for _, _, o in list_candidate_recordings(twin, observations) if o.load_pressure]
    pressures = {o.load_pressure for o in others}
    assert len(pressures) > 1 and min(pressures) > 4.2e6
    assert all(twin.operating_point(o).mean_flow > 0.0 for o in others)


def test_no_speed_is_proposed_at_which_no_harmonic_is_used():
    """At 20000 r/min 1.4 times the speed has its first harmonic above the highest that counts."""
    bench, observations, _ = make(np.random.default_rng(4), points=((20000, 9.5e6),))
    twin = Twin(bench, observations)
    speeds = [o.speed_hz for _, _, o in list_candidate_recordings(twin, observations) if o.speed_hz]
    assert max(speeds) * twin.rig.pump["pistons"] <= 4000.0
