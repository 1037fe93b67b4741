"""Diagnosis of a leaking pump by a twin that knows pump and line only roughly.

Independent truth: the pump coupled to its pipe step by step in time, with known leaks.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import kstest

import leaking_pump
from rippletwin.case.model import Load
from rippletwin.diagnosis.diagnosed_numbers import gather
from rippletwin.diagnosis.diagnoser import Diagnoser, _log_posterior
from rippletwin.diagnosis.diagnosis_file import diagnosis_dict
from rippletwin.diagnosis.evidence import ErrorPrior, _at_best_pitch, compare_healthy
from rippletwin.diagnosis.faults.library import select_faults
from rippletwin.diagnosis.hypothesis import Errors, Hypothesis
from rippletwin.diagnosis.pump_flow import with_fitted_pump
from rippletwin.diagnosis.screening import Screen
from rippletwin.diagnosis.unlike import combine, judge_residual, smaller_of_two
from rippletwin.errors import InputError
from rippletwin.figures import fault_posterior
from rippletwin.pump.faults import Cylinder, Slipper
from rippletwin.spectra.frequency_selection import select_frequencies
from rippletwin.twin.twin import Twin
from rippletwin.twin.twin_file import from_dict, to_dict

DRIFTED = leaking_pump.WAVE_SPEED * 1.003
FIRST_TURN, TURN = 0.3, 2.1  # rad, of the anchor's shaft and of the diagnosed one's

STATES = {
    "healthy": (None, {"wave_speed": DRIFTED}),
    "slipper": (Slipper(1e-7, 2), {"wave_speed": DRIFTED}),
    "cylinder": (Cylinder(4e-7, 5), {"wave_speed": DRIFTED}),
    "slipper+cylinder": ([Slipper(2e-7, 1), Cylinder(3e-7, 6)], {}),
    "unlike": (None, {"wave_speed": 1.08 * leaking_pump.WAVE_SPEED}),
}


@pytest.fixture(scope="module")
def diagnoses():
    """The diagnosis of one recording of each state."""
    rng = np.random.default_rng(0)
    anchor = leaking_pump.record("anchor", turn=FIRST_TURN, rng=rng)
    diagnoser = Diagnoser(Twin(leaking_pump.rig(), [anchor]), select_faults())
    return {
        state: diagnoser(leaking_pump.record(state, fault, TURN, rng, **line), [anchor])
        for state, (fault, line) in STATES.items()
    }


@pytest.mark.parametrize("state", STATES)
def test_the_state_is_right(diagnoses, state):
    """A leak that changes the ripple by 10 % and more, or none, behind a line whose wave speed has
    drifted by 0.3 %; and a line of another wave speed, which is no fault of the pump."""
    assert diagnoses[state].state == state


@pytest.mark.parametrize("state", ["healthy", "slipper", "cylinder", "slipper+cylinder"])
def test_probabilities_are_sure_and_add_up(diagnoses, state):
    """They add up to one, and the true state has nearly all."""
    found = diagnoses[state].probabilities
    assert sum(found.values()) == pytest.approx(1.0)
    assert found[state] > (0.5 if state == "healthy" else 0.95)


@pytest.mark.parametrize("state", ["slipper", "cylinder", "slipper+cylinder"])
def test_leak_areas_lie_in_their_intervals(diagnoses, state):
    """Each true area lies within its 95 % interval, which is no wider than a factor of two."""
    fault, _ = STATES[state]
    for each in fault if isinstance(fault, list) else [fault]:
        found = diagnoses[state].severities[type(each).__name__.lower()]
        assert found.low < each.leak_area < found.high
        assert found.high < 2.0 * found.low


@pytest.mark.parametrize("state", ["slipper", "cylinder"])
def test_the_piston_is_told_from_the_first_sample(diagnoses, state):
    """Pistons are counted as they begin their delivery after the first sample."""
    fault, _ = STATES[state]
    pistons = leaking_pump.PISTONS
    past = TURN / (2 * np.pi) - fault.piston / pistons  # outer dead centre, in revolutions
    assert diagnoses[state].piston == int((-past % 1.0) * pistons)


def test_two_pistons_are_no_single_one(diagnoses):
    """Faults at different pistons: each has its own, and the recording has none."""
    assert diagnoses["slipper+cylinder"].piston is None
    assert set(diagnoses["slipper+cylinder"].pistons) == {"slipper", "cylinder"}


def test_a_changed_line_is_told_from_the_pump(diagnoses):
    """The p-value is small, orders are named, and they are the pistons': the line does not make
    others, a few stand out by noise. No severity is stated."""
    found = diagnoses["unlike"]
    assert found.unlikeness.p_value < 1e-3
    assert found.unlikeness.element == "line"
    own = [order % leaking_pump.PISTONS == 0 for order in found.unlikeness.orders]
    assert len(own) > 5 and np.mean(own) >= 0.75
    assert found.severities == {}


def test_a_line_that_drifts_too_far_is_another_line(diagnoses):
    """Residual and pump being as before, a state of the line five standard deviations off is
    unlike, and the line is what differs; one of a standard deviation is not."""
    found = diagnoses["healthy"]
    drift = np.zeros(len(found.model.line.drifts))
    for size, unlike in ((1.0, False), (5.0, True)):
        drift[0] = size
        best = replace(found.best, mode=replace(found.best.mode, drift=drift))
        judged = judge_residual(found.model, best, ErrorPrior(scatter=0.05, change=4.0))
        assert judged.unlike == unlike
    assert judged.element == "line"


def test_the_line_is_charged_with_its_own_misfit_alone(diagnoses):
    """Behind the true line, a pump that is a tenth wrong is no error of what the line changes; that
    of a line whose waves are 8 % faster is. With one sensor nobody can tell, and all of it counts.
    """
    pump_is_wrong, line_is_wrong = (
        Diagnoser(Twin(leaking_pump.rig(), [anchor]), ()).make_model(anchor, anchor).anchor
        for anchor in (
            leaking_pump.record("anchor"),
            leaking_pump.record("anchor", wave_speed=1.08 * leaking_pump.WAVE_SPEED),
        )
    )
    assert np.median(pump_is_wrong.misfit) > 0.03
    assert np.median(pump_is_wrong.line_misfit) < 0.01
    assert np.median(line_is_wrong.line_misfit) > 0.3
    rig, anchor = leaking_pump.rig(), leaking_pump.record("anchor")
    rig, anchor = replace(rig, sensors=rig.sensors[:1]), leaking_pump.first_sensor(anchor)
    alone = Diagnoser(Twin(rig, [anchor]), ()).make_model(anchor, anchor).anchor
    np.testing.assert_array_equal(alone.line_misfit, alone.misfit)


def test_changes_between_healthy_recordings_are_learned():
    """A healthy recording whose pump delivers another flow than the anchor's, its shaft turned: the
    change is that flow where the pump delivers, and a recording with half of it more is explained.
    """
    rng = np.random.default_rng(3)
    anchor = leaking_pump.record("anchor", rng=rng)
    diagnoser = Diagnoser(Twin(leaking_pump.rig(), [anchor]), ())
    model = diagnoser.make_model(anchor, anchor)
    orders, response = model.orders, model.line.response()[:, : len(model.orders)]
    own = orders % leaking_pump.PISTONS == 0
    extra = 0.06 * own * model.anchor.flow * np.exp(2j * np.pi * rng.uniform(size=len(orders)))

    def changed(label, share):
        values = (anchor.values + share * response * extra) * np.exp(1j * orders * TURN)
        return replace(anchor, label=label, values=values)

    _, learned = compare_healthy(diagnoser.make_model(changed("again", 1.0), anchor), ErrorPrior())
    assert np.linalg.norm(learned - extra) < 0.2 * np.linalg.norm(extra)
    new = changed("new", 1.5)
    p_values = [
        diagnoser(new, healthy).unlikeness.p_value
        for healthy in ([anchor], [anchor, changed("again", 1.0)])
    ]
    assert p_values[0] < 0.01 < 0.3 < p_values[1]


def test_the_pitch_is_judged_by_the_likelihood():
    """A pump of unequal pistons, whose healthy orders beside the pistons' tell the whole shaft
    angle, turned by two pitches and more. Where the rough scores prefer another pitch, the
    likelihood gives the true one back, and that candidate is the first."""
    rng = np.random.default_rng(5)
    anchor, leaking = (
        leaking_pump.record(name, fault, turn, rng)
        for name, fault, turn in (("anchor", None, 0.0), ("slipper", Slipper(1e-7, 2), TURN))
    )
    model = Diagnoser(Twin(leaking_pump.rig(), [anchor]), ()).make_model(anchor, anchor)
    orders, response = model.orders, model.line.response()[:, : len(model.orders)]
    own = orders % leaking_pump.PISTONS == 0
    unequal = np.where(own, 0.0, 1e-8) * np.exp(2j * np.pi * rng.uniform(size=len(orders)))
    anchor = replace(anchor, values=anchor.values + response * unequal)
    turned = response * unequal * np.exp(1j * orders * TURN)
    leaking = replace(leaking, values=leaking.values + turned)
    model = Diagnoser(Twin(leaking_pump.rig(), [anchor]), select_faults()).make_model(
        leaking, anchor
    )
    candidates = Screen(model).screen_one(select_faults()[0])
    apart = np.angle(np.exp(1j * (np.array([c.turn for c in candidates]) - TURN)))
    wrong = next(k for k in range(len(candidates)) if abs(apart[k]) > 0.5)
    preferred = replace(candidates[wrong], score=candidates[0].score + 50.0)
    rest = [c for k, c in enumerate(candidates) if k != wrong]
    found, mode = _at_best_pitch(model, [preferred, *rest], Errors(0.005, 1.0))
    assert abs(np.angle(np.exp(1j * (mode.turn - TURN)))) < 0.05
    assert found[0].turn == mode.turn and found[0].score == max(c.score for c in found)


def test_two_p_values_together_are_uniform_where_each_is():
    """The combined p-value of two independent uniform numbers is uniform. Beside a p-value of 1 a
    small one grows by the factor that Fisher's formula has."""
    pairs = np.random.default_rng(0).uniform(size=(4000, 2))
    combined = [combine(*pair) for pair in pairs]
    assert kstest(combined, "uniform").pvalue > 0.01
    assert combine(1e-6, 1.0) == pytest.approx(1e-6 * (1.0 + np.log(1e6)))
    assert combine(0.0, 0.5) == 0.0


def test_the_smaller_of_two_p_values_is_judged_as_such():
    """Of two independent uniform numbers its p-value is uniform; a tiny one doubles."""
    pairs = np.random.default_rng(1).uniform(size=(4000, 2))
    assert kstest([smaller_of_two(*pair) for pair in pairs], "uniform").pvalue > 0.01
    assert smaller_of_two(1e-20, 0.3) == pytest.approx(2e-20)
    assert smaller_of_two(1.0, 1.0) == pytest.approx(1.0)


def test_known_states_are_not_unlike(diagnoses):
    """A drift of the line's state is no reason to call a recording unlike."""
    assert all(diagnoses[s].unlikeness.p_value > 0.05 for s in STATES if s != "unlike")


def test_shaft_angles_that_the_twin_has_fitted_count_for_nothing():
    """The angle of the anchor's shaft in the twin is the calibration's. A twin that has fitted one
    brings the anchor to the next recording as one that has not, and that recording is the truth."""
    rng = np.random.default_rng(0)
    anchor, again = (leaking_pump.record(name, rng=rng) for name in ("anchor", "again"))
    twin = Twin(leaking_pump.rig(), [anchor])
    angle = np.equal(list(twin.index), "angle[anchor]")
    for each in (twin, twin.with_(theta=200.0 * angle)):
        model = Diagnoser(each, ()).make_model(again, anchor)
        nothing = Hypothesis((), (), (), 0.0, np.zeros(len(model.line.drifts)))
        model.linearise_line(nothing)
        left = model.values - model.predict(nothing).healthy
        assert np.linalg.norm(left) < 1e-3 * np.linalg.norm(model.values)


def test_without_the_healthy_recording_the_twin_s_misfit_is_an_error(diagnoses):
    """Healthy and leaking recordings are told by the twin's own ripple too, and the leak lies in
    its interval. What the twin gets wrong of the healthy ripple is then among the errors."""
    rng = np.random.default_rng(0)
    anchor = leaking_pump.record("anchor", turn=FIRST_TURN, rng=rng)
    alone = Diagnoser(Twin(leaking_pump.rig(), [anchor]), select_faults(), anchored=False)
    healthy = leaking_pump.record("again", None, TURN, rng)
    assert alone(healthy, [anchor]).state == "healthy"
    fault = Slipper(1e-7, 2)
    found = alone(leaking_pump.record("slipper", fault, TURN, rng), [anchor])
    assert found.state == "slipper"
    assert found.severities["slipper"].low < fault.leak_area < found.severities["slipper"].high
    own = found.model.orders % leaking_pump.PISTONS == 0
    errors = [
        np.mean(d.anchor.variance[:, own]) + np.mean(d.anchor.unsure[:, own])
        for d in (found, diagnoses["slipper"])
    ]
    assert errors[0] > 100.0 * errors[1]


def test_a_user_s_fault_is_diagnosed(tmp_path):
    """Two worn slippers side by side, of a user's file: the state, its probability and the leak
    area of both together are told under the user's name."""
    path = tmp_path / "own.py"
    path.write_text(
        "from rippletwin.diagnosis.faults.base import Fault\n"
        "from rippletwin.pump.faults import Slipper\n"
        "FAULT = Fault('two_slippers', 'two worn slippers', lambda area, piston, pistons: [\n"
        "    Slipper(area / 2, piston), Slipper(area / 2, piston + 1)], 'inspection')\n"
    )
    rng = np.random.default_rng(0)
    anchor = leaking_pump.record("anchor", turn=FIRST_TURN, rng=rng)
    leaks = [Slipper(2e-7, 2), Slipper(2e-7, 3)]
    recording = leaking_pump.record("worn", leaks, TURN, rng)
    diagnoser = Diagnoser(Twin(leaking_pump.rig(), [anchor]), select_faults([path]))
    (entry,) = diagnosis_dict([diagnoser(recording, [anchor])])["recordings"]
    assert entry["state"] == "two_slippers" and entry["probabilities"]["two_slippers"] > 0.95
    low, high = entry["severity"]["two_slippers"]["ci95"]
    assert low < 4e-7 < high


def test_the_file_has_the_contract_s_keys(diagnoses):
    """diagnosis.json, key by key."""
    (entry,) = diagnosis_dict([diagnoses["slipper"]])["recordings"]
    assert list(entry) == [
        "label", "state", "probabilities", "severity", "piston", "unlike", "networks", "sentence",
        "doubts",
    ]  # fmt: skip
    assert list(entry["probabilities"]) == ["healthy", "slipper", "cylinder", "slipper+cylinder"]
    assert set(entry["severity"]["slipper"]) == {"value", "ci95", "unit"}
    assert entry["severity"]["slipper"]["unit"] == "m2"
    assert set(entry["unlike"]) == {"p_value", "where"}
    assert entry["unlike"]["where"] == {"orders": [], "element": None}
    assert entry["networks"] == {} and entry["doubts"] == []
    assert "slipper" in entry["sentence"] and entry["label"] in entry["sentence"]


def test_both_pictures_of_every_state_are_written(diagnoses, tmp_path):
    """Also of a recording that is unlike all states, and of the healthy one, which has no leak;
    and the numbers behind them."""
    numbers = [gather(each) for each in diagnoses.values()]
    written = fault_posterior.draw(numbers, tmp_path, [".svg"])
    assert len(written) == 2 * len(STATES) + 1
    assert all(path.stat().st_size > 1000 for path in written)


@pytest.mark.parametrize("which", ["now", "anchor"])
def test_a_band_below_the_pistons_is_refused(which):
    """Eight orders of a pump of nine pistons, of the recording or of its anchor: the message names
    it and the key: a diagnosis smooths over a pitch of orders."""
    records = {label: leaking_pump.record(label) for label in ("now", "anchor")}
    twin = Twin(leaking_pump.rig(), [records["anchor"]])
    records[which] = select_frequencies(records[which], slice(8))
    keys = "min_frequency_hz, max_frequency_hz"
    with pytest.raises(InputError, match=rf"recording {which}: {keys}: .* 133.3 Hz") as e:
        Diagnoser(twin, ()).make_model(records["now"], records["anchor"])
    assert "150 Hz" in e.value.problem and e.value.remedy


def high_passed(observation, corners_hz):
    """As sensors that pass no static pressure read it, with the band that they leave."""
    ratio = 1j * observation.frequency_hz / np.array(corners_hz)[:, None]
    passed = observation.values * ratio / (1.0 + ratio)
    return replace(observation, values=passed, min_frequency_hz=100.0)


def test_orders_below_the_band_do_not_count():
    """Two sensors that pass no static pressure, one of them from 100 Hz: what they do to the orders
    below is no fault of the pump. The same recordings with the whole band are unlike everything."""
    rng = np.random.default_rng(0)
    corners = 20.0, 60.0
    anchor = high_passed(leaking_pump.record("anchor", turn=FIRST_TURN, rng=rng), corners)
    leaking = high_passed(leaking_pump.record("now", Slipper(4e-7, 2), TURN, rng), corners)
    diagnoser = Diagnoser(Twin(leaking_pump.rig(), [anchor]), select_faults())
    found = diagnoser(leaking, [anchor])
    assert found.model.orders[0] == 6 and found.model.orders[-1] == leaking_pump.ORDERS[-1]
    assert found.state == "slipper"
    whole = [replace(o, min_frequency_hz=0.0) for o in (leaking, anchor)]
    assert diagnoser(whole[0], whole[1:]).unlikeness.p_value < found.unlikeness.p_value


def test_bands_without_a_common_order_of_the_pistons_are_refused():
    """One recording to 600 Hz, its anchor from 700 Hz on."""
    low, high = (leaking_pump.record(label) for label in ("low", "high"))
    twin = Twin(leaking_pump.rig(), [high])
    low = select_frequencies(low, low.frequency_hz <= 600.0)
    high = replace(high, min_frequency_hz=700.0)
    with pytest.raises(InputError, match="700 to 3000 Hz together with that of recording low"):
        Diagnoser(twin, ()).make_model(low, high)


def test_changes_between_repeats_are_told_by_order():
    """A repeat whose band begins at 100 Hz says nothing of the orders below; above they are what a
    repeat with the whole band says, to a quarter."""
    anchor = leaking_pump.record("anchor", turn=FIRST_TURN)
    rng = np.random.default_rng(4)
    repeat = leaking_pump.record("repeat", Slipper(3e-8, 2), TURN, rng)
    diagnoser = Diagnoser(Twin(leaking_pump.rig(), [anchor]), ())
    _, whole = diagnoser._learn_errors([anchor, repeat])
    _, banded = diagnoser._learn_errors([anchor, replace(repeat, min_frequency_hz=100.0)])
    assert np.all(banded[:, :6] == 0.0) and np.all(whole[:, 1:6] != 0.0)
    assert np.linalg.norm(banded[:, 6:] - whole[:, 6:]) < 0.25 * np.linalg.norm(whole[:, 6:])


@pytest.mark.parametrize("name", ["wave_speed", "load", "viscosity"])
def test_a_line_drifts_though_the_data_sheet_is_exact(name):
    """Readings after a drift are the same whether the data sheet states a tolerance or none."""
    anchor = leaking_pump.record("anchor")
    rig = leaking_pump.rig()
    exact = replace(rig, uncertainty=replace(rig.uncertainty, **{name: 0.0}))
    drift = np.array([1.0, -0.5, 2.0])
    one, other = (
        Diagnoser(Twin(each, [anchor]), ()).make_model(anchor, anchor).line for each in (rig, exact)
    )
    assert np.allclose(one.response(drift), other.response(drift), rtol=1e-6)
    assert not np.allclose(one.response(drift), one.response(), rtol=1e-3)
    assert np.allclose(one.response(), other.response(), rtol=1e-6)


def test_a_load_that_the_twin_has_fitted_stays_though_the_data_sheet_is_exact():
    """Without a mean flow the orifice's coefficient is guessed, and its factor fitted: a diagnosis
    takes the fitted factor, whatever tolerance the data sheet states."""
    anchor = leaking_pump.record("anchor")
    rig = leaking_pump.rig()
    lines = []
    for sd in (0.0, 0.05):
        sheet = replace(rig, uncertainty=replace(rig.uncertainty, load=sd))
        twin = Twin(sheet, [anchor], guessed_load=True)
        theta = twin.theta.copy()
        theta[twin.index["load"]] = np.log(0.5)
        lines.append(Diagnoser(twin.with_(theta=theta), ()).make_model(anchor, anchor).line)
    exact, stated = (line.response() for line in lines)
    np.testing.assert_allclose(exact, stated, rtol=1e-9)


def test_uncertain_gains_stay_with_the_twin():
    """A data sheet with uncertain sensitivities: the twin of recordings has a gain of every sensor,
    and so has the one that a diagnosis takes, read from a file too."""
    anchor = leaking_pump.record("anchor")
    rig = leaking_pump.rig()
    rig = replace(rig, uncertainty=replace(rig.uncertainty, sensor_gain=0.02))
    twin = Twin(rig, [anchor])
    theta = np.zeros(len(twin.parameters))
    theta[[twin.index["gain[p1]"], twin.index["gain[p2]"]]] = 1.0, -1.0
    kept = from_dict(to_dict(with_fitted_pump(twin.with_(theta=theta))))
    assert kept.values()["gain[p1]"] == pytest.approx(np.exp(0.02))
    assert kept.values()["gain[p2]"] == pytest.approx(np.exp(-0.02))
    line = Diagnoser(kept, ()).make_model(anchor, anchor).line
    plain = Diagnoser(Twin(leaking_pump.rig(), [anchor]), ()).make_model(anchor, anchor).line
    gains = line.response() / plain.response()
    assert np.allclose(gains, np.exp([[0.02], [-0.02]]), rtol=1e-9)


def test_a_state_whose_likelihood_overflows_is_impossible():
    """One state without a finite evidence leaves the others their probabilities."""
    anchor = leaking_pump.record("anchor")
    healthy = Diagnoser(Twin(leaking_pump.rig(), [anchor]), ())(anchor, [anchor]).best
    slipper = select_faults()[0]
    lost = replace(healthy, state=(slipper,), log_evidence=np.nan)
    assert _log_posterior([healthy, lost]) == {"healthy": 0.0, "slipper": -np.inf}


def test_a_load_that_was_not_measured_in_the_band_is_refused():
    """A table to 2 kHz behind harmonics to 3 kHz: of the upper third nothing is known."""
    table = np.array([50.0, 2000.0])
    load = Load("impedance", frequency_hz=table, impedance=np.full(2, 4e9 + 0j))
    anchor = leaking_pump.record("anchor")
    diagnoser = Diagnoser(Twin(replace(leaking_pump.rig(), load=load), [anchor]), ())
    with pytest.raises(InputError, match=r"to 2000 Hz, but anchor is fitted .* to 3000 Hz"):
        diagnoser.make_model(anchor, anchor)
    within = select_frequencies(anchor, slice(120))
    assert len(diagnoser.make_model(within, within).anchor.orders) == 120
