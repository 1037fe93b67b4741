"""Recordings of the virtual rig: sensing, noise, wander, case folders and what they conceal."""

from dataclasses import replace

import h5py
import numpy as np
import pytest
import yaml

from virtualrig.cli import POINTS, main
from virtualrig.orbit import Bench, Orbit
from virtualrig.recorder import (
    SAMPLING_RATE_HZ,
    Point,
    compose_from_orbits,
    draw_speed_wander,
    record,
    sensed_pressure,
)
from virtualrig.rig import SEAL, SHEET, RigError, Sensing, build, read_rig, read_yaml

QUICK = {
    "line": {"segments": [{"length": 1.2, "diameter": 0.0197, "wave_speed": 1023.0}]},
    "sensors": [0.41],
    "numerics": {"frequency": 3000.0},
}


def orbit(harmonic, speed_rpm=1000.0, sensors=1, delay=0.0):
    """An orbit whose pressure is a cosine of 1 Pa about 5 Pa."""
    turn = np.arange(4608) / 4608
    pressure = 5 + np.cos(2 * np.pi * harmonic * (turn - delay * speed_rpm / 60))
    pressure = np.tile(pressure, (sensors, 1))
    return Orbit(speed_rpm, pressure, turn, turn, 0.0, 0.0)


def test_sensor_gain_delay_and_resonance_are_those_of_the_formulae():
    """A cosine at 450 Hz is sensed with gain, delay and second-order response at 450 Hz."""
    sensing = (Sensing(gain=1.1, delay=2e-4, resonance=(900.0, 0.2)),)
    out = sensed_pressure(orbit(27), sensing)[0]
    got = 2 * np.fft.rfft(out)[27] / 4608
    response = 1 / (1 - 0.25 + 2j * 0.2 * 0.5)
    assert got == pytest.approx(1.1 * response * np.exp(-2j * np.pi * 450 * 2e-4), rel=1e-9)
    assert out.mean() == pytest.approx(1.1 * 5)


def test_wander_is_slow_and_has_the_stated_deviation():
    """The speed has the stated deviation over many seconds and hardly varies in a revolution."""
    rng = np.random.default_rng(0)
    runs = np.array([draw_speed_wander(256000, 1e-3, 0.8, rng) for _ in range(20)])
    assert runs.std() == pytest.approx(1e-3, rel=0.15)
    assert (runs[:, 3072:] - runs[:, :-3072]).std() < 0.2e-3


def test_recording_follows_the_crank_and_the_line_between_orbits():
    """A delay of 2 ms in the line is 2 ms at all speeds between the orbits, at 300 Hz to 1e-4."""
    speeds = np.linspace(998.0, 1002.0, 20000)
    turns = 0.3 + np.cumsum(speeds) / 60 / SAMPLING_RATE_HZ
    orbits = [orbit(18, s, delay=2e-3) for s in (998.0, 1000.0, 1002.0)]
    got = compose_from_orbits(orbits, (Sensing(),), speeds, turns)[0]
    truth = 5 + np.cos(2 * np.pi * 18 * (turns - 2e-3 * speeds / 60))
    assert np.abs(got - truth).max() < 1e-4
    one = compose_from_orbits(orbits[1:2], (Sensing(),), speeds, turns)[0]
    assert np.abs(one - truth).max() > 5e-3


@pytest.fixture(scope="module")
def case(tmp_path_factory):
    """A short recording of a small rig with a seal of its own, and the true flow beside it."""
    folder = tmp_path_factory.mktemp("rig")
    seal = QUICK | {"noise": 777.0, "effects": [{"name": "source_impedance", "volume": 1.23e-5}]}
    (folder / "seal.yaml").write_text(yaml.safe_dump(seal))
    point = {"label": "a", "speed_rpm": 3000.0, "load_pressure": 8.0e6, "seconds": 0.5}
    (folder / "points.yaml").write_text(yaml.safe_dump({"points": [point]}))
    arguments = ["record", "--out", str(folder / "case"), "--true-flow", str(folder / "truth")]
    arguments += [
        "--flow-ripple",
        "--sealed",
        str(folder / "seal.yaml"),
        "--points",
        str(folder / "points.yaml"),
    ]
    assert main(arguments) == 0
    return folder


def test_case_folder_is_complete_and_says_nothing_of_the_truth(case):
    """rig.yaml has the data sheet and the recordings; no name or number of the seal is in it."""
    sheet, written = read_yaml(SHEET), read_yaml(case / "case" / "rig.yaml")
    assert {key: written[key] for key in sheet} == sheet
    (entry,) = written["recordings"]
    assert entry == {
        "file": "recordings/a.h5", "speed_rpm": 3000.0, "load_pressure": 8e6, "state": "healthy",
        "flow_ripple": "flow_ripple_a.csv",
    }  # fmt: skip
    files = {p.relative_to(case / "case").as_posix() for p in (case / "case").rglob("*.*")}
    assert files == {"rig.yaml", "recordings/a.h5", "flow_ripple_a.csv"}
    text = (case / "case" / "rig.yaml").read_text()
    assert not any(word in text for word in ("source_impedance", "1.23e-05", "777", "noise"))
    with h5py.File(case / "case" / entry["file"]) as file:
        assert file.attrs["sampling_rate_hz"] == 51200
        assert file["pressure"].shape == (1, 25600)
        assert list(file) == ["pressure"]
        assert file["pressure"][:].mean() == pytest.approx(8e6, rel=0.01)


def test_noise_is_what_the_seal_says(case):
    """Above 15 kHz, where there is no ripple, the recording is white noise of 777 Pa."""
    with h5py.File(case / "case" / "recordings" / "a.h5") as file:
        pressure = file["pressure"][0]
    power = np.abs(np.fft.rfft(pressure - pressure.mean())) ** 2 / len(pressure)
    top = power[int(len(power) * 0.8) :]
    assert np.sqrt(top.mean()) == pytest.approx(777, rel=0.05)


def test_truth_is_the_outlet_flow_of_the_recording(case):
    """The true flow has the mean that the valve passes, and lies outside the case folder."""
    with h5py.File(case / "truth" / "a.h5") as file:
        flow, pressure = file["outlet_flow"][:], file["outlet_pressure"][:]
        assert len(file["turns"]) == 25600
        turned = file["turns"][-1] - file["turns"][0]
    assert turned == pytest.approx(0.5 * 50, rel=0.01)
    _, rig = read_rig()
    assert flow.mean() == pytest.approx(rig.pump.displacement * 50, rel=0.03)
    assert 0.01 < flow.std() / flow.mean() < 0.3 and pressure.std() > 1e4


def test_nominal_flow_ripple_is_the_sheets_and_not_the_true_one(case):
    """One revolution of the data sheet pump's flow: the right mean, not the true ripple."""
    table = np.loadtxt(case / "case" / "flow_ripple_a.csv", delimiter=",", skiprows=1)
    with h5py.File(case / "truth" / "a.h5") as file:
        true = file["outlet_flow"][:]
    assert table[0, 0] == 0 and table[-1, 0] == pytest.approx(360 * (1 - 1 / len(table)))
    assert table[:, 1].mean() == pytest.approx(true.mean(), rel=0.02)
    spectra = [np.abs(np.fft.rfft(flow)[9:100:9]) for flow in (table[:, 1], true)]
    assert np.linalg.norm(spectra[0] - spectra[1]) > 0.02 * np.linalg.norm(spectra[1])


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--sealed", "nowhere.yaml"], "nowhere.yaml"),
        (["--points", "nowhere.yaml"], "nowhere.yaml"),
        (["--seconds", "-1"], "--seconds"),
        (["--true-flow", "OUT/truth"], "--true-flow"),
        (["--sealed", "BAD"], "magic"),
        (["--sealed", "EMPTY_KEY"], "empty_key.yaml"),
        (["--sheet", "BYTES"], "not text"),
        (["--points", "TWICE"], "label a is there twice"),
        (["--points", "BACKWARDS"], "a: seconds must be above zero"),
        (["--processes", "0"], "--processes 0"),
        (["--seed", "-1"], "--seed -1"),
        (["--sealed", "FAULTLESS"], "faults"),
    ],
)
def test_wrong_input_is_named(arguments, words, tmp_path, capsys):
    """Wrong input ends with status 2, one line that names file, field or option, and no case."""
    (tmp_path / "bad.yaml").write_text("effects: [{name: magic}]")
    (tmp_path / "faultless.yaml").write_text("noise: 1.0")
    out = tmp_path / "out"
    (tmp_path / "empty_key.yaml").write_text("speed:\n")
    (tmp_path / "bytes.yaml").write_bytes(b"\x89HDF\xff\xfe")
    point = "{label: a, speed_rpm: 1000, load_pressure: 9.5e6, seconds: "
    (tmp_path / "twice.yaml").write_text(f"points: [{point}1}}, {point}2}}]")
    (tmp_path / "backwards.yaml").write_text(f"points: [{point}-1}}]")
    names = {
        "BAD": "bad.yaml",
        "FAULTLESS": "faultless.yaml",
        "EMPTY_KEY": "empty_key.yaml",
        "BYTES": "bytes.yaml",
        "TWICE": "twice.yaml",
        "BACKWARDS": "backwards.yaml",
    }
    arguments = [str(tmp_path / names[a]) if a in names else a for a in arguments]
    arguments = [a.replace("OUT", str(out)) for a in arguments]
    assert main(["record", "--out", str(out), *arguments]) == 2
    assert words in capsys.readouterr().err
    assert not (out / "recordings").exists()


@pytest.mark.parametrize(
    ("seal", "key", "words"),
    [("old", "new", "--seal"), ("new", "old", "--key"), ("same", "same", "is the file of --seal")],
)
def test_no_seal_and_no_key_is_replaced(seal, key, words, tmp_path, capsys):
    """Refused before anything is recorded: an older key fits its seal alone."""
    (tmp_path / "old").write_text("precious")
    files = ["--seal", str(tmp_path / seal), "--key", str(tmp_path / key)]
    drawn = ["--commit", "0" * 40, "--number", "1000", "--rig", "0"]
    assert main(["population", "--out", str(tmp_path / "out"), *files, *drawn]) == 2
    assert words in capsys.readouterr().err
    assert (tmp_path / "old").read_text() == "precious" and not (tmp_path / "out").exists()


def test_full_folder_is_not_overwritten(tmp_path, capsys):
    """A folder with content is not changed."""
    (tmp_path / "precious").write_text("")
    assert main(["record", "--out", str(tmp_path)]) == 2
    assert "not empty" in capsys.readouterr().err


def test_wrong_arguments_of_effects_are_named():
    """Errors name an unknown parameter, a position outside the line and two effects that set the
    same element."""
    known = read_yaml(SHEET)
    length = sum(segment["length"] for segment in known["line"]["segments"])
    for effect, words in (
        ({"name": "leak", "position": 99.0, "conductance": 1e-12}, "outside the line"),
        ({"name": "leak", "place": 1.0}, "place"),
        ({"name": "leak", "position": length, "orifice": 1e-9}, "at the load"),
        ({"name": "sensor_gain", "sensor": 0, "gain": 1.1}, "sensors count from 1"),
        ({"name": "viscoelastic_wall", "segment": 0, "compliance": 0.1, "time": 1e-3},
         "segments count from 1"),
        ({"name": "resonator", "position": 0.0, "frequency_hz": 1e3, "damping": 0.1,
          "compliance": 1e-14}, "outlet"),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=words):
            build(known, {"effects": [effect]})


def test_built_in_rig_reads_and_differs_from_its_sheet_within_the_stated_uncertainty():
    """The true line is within 2.5 stated deviations of the data sheet's; faults have one size."""
    known, rig = read_rig(SHEET, SEAL)
    stated = known["uncertainty"]
    true = read_yaml(SEAL)["line"]["segments"]
    for nominal, real in zip(known["line"]["segments"], true, strict=True):
        for key, deviation in nominal.items():
            assert abs(real[key] / deviation - 1) < 2.5 * stated[key]
    assert set(rig.faults) == {"slipper", "cylinder"}


def test_recording_at_constant_speed_repeats_every_revolution():
    """Without noise, wander and speed error all revolutions are equal."""
    rig = build(read_yaml(SHEET), QUICK)
    take = record(rig, Point("a", 3000.0, 8e6, 0.2), np.random.default_rng(1))
    revolutions = take.pressure[0].reshape(10, 1024)
    assert np.abs(revolutions - revolutions[0]).max() < 1e-3


def test_unreadable_yaml_is_named(tmp_path):
    """Errors for broken YAML and for a list instead of keys name the file."""
    for text in ("a: [1", "- 1"):
        (tmp_path / "x.yaml").write_text(text)
        with pytest.raises(RigError, match=r"x\.yaml"):
            read_yaml(tmp_path / "x.yaml")


@pytest.mark.long
def test_built_in_rig_is_converged_to_a_tenth_of_its_noise():
    """Finer elements, a third of the time step and more velocity modes move the pressures below
    5 kHz by less than 150 Pa rms at either sensor."""
    _, rig = read_rig()
    fine = replace(rig, network=replace(rig.network, points=9.0, frequency=8000.0, modes=14))
    valve = 2.25e-7
    coarse = Bench(rig).settle(1000.0, 9.5e6, valve, tolerance=3.0).pressure
    finer = Bench(fine, step_divisor=2).settle(1000.0, 9.5e6, valve, tolerance=3.0).pressure
    change = np.fft.rfft(coarse - finer, axis=1)[:, 1:300] / coarse.shape[1]
    assert np.sqrt(2 * (np.abs(change) ** 2).sum(axis=1)).max() < 0.1 * rig.noise


@pytest.fixture(scope="module")
def driven():
    """A short line between a given flow and the valve, with a wandering speed."""
    sheet = read_yaml(SHEET) | {"sensors": [{"name": "p1", "position": 0.41}]}
    seal = QUICK | {"speed": {"error": 0.0, "wander": 1e-3, "correlation_s": 0.3}}
    turn = 2 * np.pi * np.arange(4608) / 4608
    flow = 8e-4 * (1 + sum(0.1 / k * np.cos(9 * k * turn + k**2) for k in range(1, 6)))
    return build(sheet, seal), flow


def test_a_march_at_even_speed_repeats_the_orbit(driven):
    """Without a deviation of the speed two more revolutions are two orbits."""
    rig, flow = driven
    bench = Bench(rig, flow=flow)
    orbit = bench.settle(1500.0, 8e6, tolerance=1.0)
    marched = bench.march(1500.0, np.zeros(2 * orbit.pressure.shape[1]))
    twice = np.roll(np.tile(orbit.pressure, 2), -1, axis=1)
    assert np.abs(marched - twice).max() < 5.0


def test_a_march_agrees_with_composed_orbits_where_transients_decay_fast(driven):
    """On a short line at the valve, recordings marched and composed of orbits differ by less than
    0.1 % of the ripple; from one at constant speed they differ by more than 0.3 %."""
    rig, flow = driven
    point = Point("a", 1500.0, 8e6, 0.4)
    march, composed, even = (
        record(each, point, np.random.default_rng(2), lambda s: flow * s / 1500.0, 5.0, 1, marched)
        for each, marched in ((rig, True), (rig, False), (replace(rig, wander=1e-9), False))
    )
    np.testing.assert_array_equal(march.turns, composed.turns)
    ripple = composed.pressure.std()
    assert (march.pressure - composed.pressure).std() < 1e-3 * ripple
    assert (march.pressure - even.pressure).std() > 3e-3 * ripple


def test_a_point_may_have_a_leak_of_its_own():
    """The lost mean flow is that of the point's leak: twice the area, twice the loss within 3 %;
    and of the sealed area where the point has none."""
    rig = build(read_yaml(SHEET), QUICK | {"faults": {"slipper": {"leak_area": 2e-7}}})

    def mean_flow(state="slipper", area=None):
        point = Point("a", 3000.0, 8e6, 0.02, state, area)
        return record(rig, point, np.random.default_rng(0)).orbit.outlet_flow.mean()

    healthy = mean_flow("healthy")
    lost = {area: healthy - mean_flow(area=area) for area in (None, 1e-7, 2e-7)}
    assert lost[None] == lost[2e-7]
    assert lost[2e-7] / lost[1e-7] == pytest.approx(2.0, rel=0.03) and lost[1e-7] > 0


def test_severities_are_added_behind_the_other_points():
    """Random numbers follow from a point's place in the list: the first nine are where they were.
    Either fault is recorded with five leaks, the sealed one included, evenly in the logarithm."""
    labels = [point.label for point in POINTS["full"]]
    assert labels[:3] == ["healthy_1000_95", "slipper_1000_95", "cylinder_1000_95"]
    assert all(label.startswith("healthy") for label in labels[3:9])
    assert not any(label.startswith("healthy") for label in labels[9:])
    _, rig = read_rig()
    for state in ("slipper", "cylinder"):
        areas = [
            point.rig_with_leak(rig).faults[state].leak_area
            for point in POINTS["full"]
            if point.state == state
        ]
        ratios = np.diff(np.log(np.sort(areas)))
        assert len(areas) == 5 and np.allclose(ratios, np.log(1.8), atol=0.02)
