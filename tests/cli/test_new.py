"""rippletwin new: what a test bench knows, in its units, becomes a sheet that check accepts."""

import errno
import json
import os

import numpy as np
import pytest
import yaml
from click.testing import CliRunner

from case_folders import ripple, write_hdf5
from rippletwin.case.load import load_case
from rippletwin.case.new_sheet import _write_whole
from rippletwin.case.rig_yaml import read_sheet
from rippletwin.cli import main
from rippletwin.cli.new import command

FLAGS = {
    "--pistons": ["9"],
    "--viscosity": ["32"],
    "--temperature": ["65"],
    "--flow": ["38"],
    "--segment": ["5950,19.7,2.5", "3000,19.7,850m/s"],
    "--sensor": ["p1,420", "p2,2590"],
    "--recording": ["recordings/a.h5,healthy,1000,95"],
}


def flags(**other):
    """Options of the command line; `other` replaces those of a name."""
    chosen = FLAGS | {f"--{name}": values for name, values in other.items()}
    return [word for name, values in chosen.items() for value in values for word in (name, value)]


def test_units_of_the_bench_become_si(tmp_path, capsys):
    """Independent truth: mm, cSt, bar, L/min and degrees turned by hand. The sheet has no fault,
    and with its recording `check` reads the case."""
    case = tmp_path / "case"
    assert main(["new", str(case), *flags()]) == 0
    sheet = read_sheet(case / "rig.yaml")
    first, second = sheet["line"]["segments"]
    assert (first["length"], first["diameter"]) == (5.95, 0.0197)
    assert second["wave_speed"] == 850
    # sqrt(K/rho) is 1380 m/s, and 2.5 mm of steel take 3.6 % of it
    assert first["wave_speed"] == pytest.approx(1334, abs=5)
    assert sheet["fluid"]["density"] == pytest.approx(870 / 1.035, rel=1e-3)
    assert sheet["fluid"]["kinematic_viscosity"] == pytest.approx(32e-6)
    assert [s["position"] for s in sheet["sensors"]] == [0.42, 2.59]
    assert sheet["load"]["coefficient"] == pytest.approx(38 / 60000 / 9.5e6**0.5, rel=1e-3)
    assert sheet["recordings"][0]["load_pressure"] == 9.5e6
    write_hdf5(case / "recordings" / "a.h5", ripple())
    assert main(["check", str(case)]) == 0


def test_recordings_in_bar_are_read_as_bar(tmp_path):
    """With --unit bar a file of bars is what the file of pascals is without."""
    pressure = ripple()
    for name, options, factor in (("pa", [], 1.0), ("bar", ["--unit", "bar"], 1e-5)):
        assert main(["new", str(tmp_path / name), *flags(), *options]) == 0
        write_hdf5(tmp_path / name / "recordings" / "a.h5", factor * pressure)
    in_bar, in_pa = (load_case(tmp_path / name).recordings[0].pressure for name in ("bar", "pa"))
    np.testing.assert_allclose(in_bar, in_pa, rtol=1e-12)


def test_every_number_is_explained(tmp_path):
    """Uncertainties, pump and wave speeds stand beside a comment."""
    assert main(["new", str(tmp_path / "case"), *flags()]) == 0
    text = (tmp_path / "case" / "rig.yaml").read_text()
    for words in ("generic pump", "2.5 mm of steel", "measured", "standard deviations", "m2/s"):
        assert words in text


def test_questions_ask_for_what_is_missing(tmp_path):
    """Answers give the same sheet as flags; one that makes no sense is asked for again. An empty
    answer says that a number of the pump is not known, and takes 50 °C."""
    answers = [
        "nine",
        "9",
        "17",
        "33.5",
        *[""] * 5,
        "65",
        "32",
        "5950,19.7,2.5",
        "3000,19.7,850m/s",
        "",
        "p1,420",
        "p2",
        "p2,2590",
        "",
    ]
    answers += ["38", "recordings/a.h5,healthy,1000,95", "", "hPa", "bar"]
    run = CliRunner().invoke(
        command, [str(tmp_path / "asked"), "--ask"], input="\n".join(answers) + "\n"
    )
    assert run.exception is None, run.output
    assert "'p2' is not NAME,POSITION" in run.output and "nine is no number" in run.output
    more = ["--unit", "bar", "--piston-diameter", "17", "--pitch-radius", "33.5"]
    assert main(["new", str(tmp_path / "given"), *flags(), *more]) == 0
    asked, given = (
        yaml.safe_load((tmp_path / name / "rig.yaml").read_text()) for name in ("asked", "given")
    )
    assert asked == given


def test_oil_of_zero_degrees_is_asked_about_at_zero_degrees(tmp_path):
    """0 °C is a temperature that was given: the question about the viscosity names it."""
    options = flags()
    del options[options.index("--viscosity") : options.index("--viscosity") + 2]
    options[options.index("--temperature") + 1] = "0"
    run = CliRunner().invoke(
        command, [str(tmp_path / "case"), "--ask", *options], input="\n" * 5 + "300\n" + "\n" * 5
    )
    assert "Viscosity at 0 °C" in run.output and "at 50 °C" not in run.output, run.output


def test_what_is_missing_is_told_at_once(tmp_path, capsys):
    """Where nobody can be asked, every missing option is in one message and nothing is written."""
    assert main(["new", str(tmp_path / "case"), "--no-ask"]) == 2
    told = capsys.readouterr().err
    assert all(name in told for name in ("--pistons", "--segment", "--sensor", "--viscosity"))
    assert not (tmp_path / "case" / "rig.yaml").exists()


@pytest.mark.parametrize("given", ["40", "100"])
def test_one_viscosity_of_two_names_the_other(tmp_path, capsys, given):
    """The data sheet's pair is incomplete: it is not the viscosity at work that is missing."""
    options = flags()
    at = options.index("--viscosity")
    options[at : at + 2] = [f"--viscosity-{given}", "46"]
    assert main(["new", str(tmp_path / "case"), "--no-ask", *options]) == 2
    absent = {"40": "100", "100": "40"}[given]
    assert f"--viscosity-{absent}: not given" in capsys.readouterr().err


def test_a_sheet_is_written_whole_or_not_at_all(tmp_path, monkeypatch):
    """A full disk leaves no half rig.yaml and no scratch file; a file system without links has the
    whole sheet, and one that is there stays."""

    def full(number):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)
        assert main(["new", str(tmp_path), *flags()]) == 2
    assert [each.name for each in tmp_path.iterdir()] == ["recordings"]

    def unsupported(*paths):
        raise OSError(errno.EPERM, "Operation not permitted")

    monkeypatch.setattr(os, "link", unsupported)
    assert main(["new", str(tmp_path), *flags()]) == 0
    assert sorted(each.name for each in tmp_path.iterdir()) == ["recordings", "rig.yaml"]
    before = (tmp_path / "rig.yaml").read_text()
    with pytest.raises(FileExistsError):
        _write_whole(tmp_path / "rig.yaml", "other")
    assert (tmp_path / "rig.yaml").read_text() == before


REFUSED = {
    "a temperature in K": ("temperature", "323", "up to 200 °C is possible. Give °C"),
    "a length of text": ("segment", "long,20,2", "no length"),
    "a bore below zero": ("segment", "5950,-20,2", "-20 is no bore. Give a positive number of mm"),
    "a bore in m": ("segment", "5.95,0.0197,2", "possible; it looks like m (19.7 mm). Give mm"),
    "pistons in words": ("pistons", "nine", "Give a whole number from 3 to 15"),
    "a piston in m": ("piston-diameter", "0.017", "it looks like m (17 mm). Give mm"),
    "an area in m2": ("port-area", "1.2e-4", "it looks like m2 (120 mm2). Give mm2"),
    "a viscosity in m2/s": ("viscosity", "3.2e-5", "it looks like m2/s (32 cSt). Give cSt"),
    "pistons that overlap": ("pitch-radius", "11", "overlap on a circle"),
    "a wall of cheese": ("segment", "5950,20,2,cheese", "no known modulus"),
    "a sensor behind the pump": ("sensor", "p1,-4", "no position"),
    "a state nobody knows": ("recording", "a.h5,worn,1000,95", "worn is no state"),
    "a sensor beyond the line": ("sensor", "p1,42000", "outside the line"),
    "a pressure in Pa": ("recording", "a.h5,healthy,1000,9.5e6", "implausible"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_makes_no_sense(tmp_path, capsys, name):
    """Refused with the option or the field, and no rig.yaml is left."""
    option, value, words = REFUSED[name]
    pump = {"piston-diameter": ["17"]} | {option: [value]}
    assert main(["new", str(tmp_path / "case"), *flags(**pump)]) == 2
    assert words in capsys.readouterr().err
    assert not (tmp_path / "case" / "rig.yaml").exists()


def test_a_flow_without_a_recording_sets_no_orifice(tmp_path):
    """The load pressure of the example in the sheet is nobody's: the flow, 38 L/min, stands in a
    comment that says what to do with it."""
    assert main(["new", str(tmp_path), *flags(recording=[])]) == 0
    assert read_sheet(tmp_path / "rig.yaml")["load"] == {"kind": "orifice"}
    assert "# divide 6.333e-04 m3/s by the root" in (tmp_path / "rig.yaml").read_text()


def test_an_invented_recording_is_said_to_be_one(tmp_path, capsys):
    """Without --recording the sheet has an example, which no one took."""
    assert main(["new", str(tmp_path / "case"), *flags(recording=[])]) == 0
    assert "1000 r/min and 95 bar, is an example; correct it" in capsys.readouterr().err
    assert main(["new", str(tmp_path / "other"), *flags()]) == 0
    assert "example" not in capsys.readouterr().err


def test_files_of_one_name_in_two_folders(tmp_path):
    """Each has a label of its own, made of its path; a name that is there once needs none. Two
    files that differ by their suffix are told by that."""
    files = ("mon/a.h5", "tue/a.h5", "b.h5", "wed/c.h5", "wed/c.csv")
    given = flags(recording=[f"{file},healthy,1000,95" for file in files])
    assert main(["new", str(tmp_path), *given]) == 0
    recordings = read_sheet(tmp_path / "rig.yaml")["recordings"]
    assert [entry["file"] for entry in recordings] == list(files)
    labels = [entry.get("label") for entry in recordings]
    assert labels == ["mon_a", "tue_a", None, "wed_c.h5", "wed_c.csv"]


def test_two_sensors_of_one_name(tmp_path, capsys):
    """Neither of them is dropped: the command line is refused, and can be given again."""
    case = str(tmp_path / "case")
    assert main(["new", case, *flags(sensor=["p1,420", "p1,900"])]) == 2
    assert "p1 is the name of sensors[0] too" in capsys.readouterr().err
    assert main(["new", case, *flags(sensor=["p1,420", "p2,900"])]) == 0


def test_the_catalogue_s_pump(tmp_path, capsys):
    """A pump of nine pistons of 17 mm on a radius of 33.5 mm at 17 degrees displaces 41.8 cm3: nine
    times pi/4 17^2 times twice 33.5 mm times tan(17°). Its numbers are in the sheet in SI units,
    those that are not given as comments, and nothing warns of a generic pump."""
    case = tmp_path / "case"
    catalogue = {"piston-diameter": "17", "pitch-radius": "33.5", "swash-angle": "17"}
    catalogue |= {"port-area": "110"}
    options = flags(**{name: [value] for name, value in catalogue.items()})
    assert main(["new", str(case), *options]) == 0
    said = capsys.readouterr()
    assert "pump: 41.8 cm3 per revolution" in said.out and "generic" not in said.err
    pump = read_sheet(case / "rig.yaml")["pump"]
    assert pump == {
        "pistons": 9,
        "piston_diameter": 0.017,
        "pitch_radius": 0.0335,
        "swash_angle_deg": 17,
        "port_area": 1.1e-4,
    }
    text = (case / "rig.yaml").read_text()
    (case / "rig.yaml").write_text(text.replace("# port_opening_deg", "port_opening_deg"))
    assert read_sheet(case / "rig.yaml")["pump"]["port_opening_deg"] == 30
    assert main(["new", str(tmp_path / "b"), *flags()]) == 0
    assert "generic pump" in capsys.readouterr().err


def test_nothing_is_overwritten(tmp_path, capsys):
    """A rig.yaml that is there stays as it is."""
    (tmp_path / "rig.yaml").write_text("mine")
    assert main(["new", str(tmp_path), *flags()]) == 2
    assert (tmp_path / "rig.yaml").read_text() == "mine"


def test_what_the_data_must_have(tmp_path, capsys):
    """Sensors 2.17 m apart on 1334 m/s are half a wave apart at 307 Hz; one point, two sensors and
    the band are told. A pair 0.1 m apart and a second pressure and speed leave less to tell."""
    options = ["new", str(tmp_path / "a"), *flags(), "--json"]
    assert main(options) == 0
    advice = json.loads(capsys.readouterr().out)["advice"]
    assert any("from 307 Hz on" in line for line in advice)
    assert any("second pressure" in line for line in advice)
    assert any("10 kHz" in line for line in advice)
    better = flags(
        sensor=["p1,420", "p2,520", "p3,2590"],
        recording=["a.h5,healthy,1000,95", "b.h5,healthy,1200,60"],
    )
    assert main(["new", str(tmp_path / "b"), *better, "--json"]) == 0
    assert [line[:9] for line in json.loads(capsys.readouterr().out)["advice"]] == ["Sample at"]
