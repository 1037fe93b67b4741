"""rippletwin simulate: the sensors' readings against the twin in the frequency domain."""

import csv
import json
from dataclasses import dataclass

import numpy as np
import pytest

from leaking_pump import LOAD, SPEED, rig
from rippletwin.case.model import FlowRipple
from rippletwin.cli import main
from rippletwin.harmonics import peak_amplitudes
from rippletwin.pump.faults import Slipper
from rippletwin.pump.outlets import ConstantPressure, Pipe
from rippletwin.pump.simulation import simulate
from rippletwin.spectra.corrected_ripple import CorrectedRipple
from rippletwin.twin.twin import Twin
from rippletwin.twin.twin_file import to_dict

ORDERS = np.arange(9, 181, 9)
POINT = ["--speed", f"{SPEED:g}", "--pressure", f"{LOAD / 1e5:g}"]


@pytest.fixture(scope="module")
def twin_file(tmp_path_factory):
    """A twin of the data sheet."""
    path = tmp_path_factory.mktemp("twin") / "twin.json"
    path.write_text(json.dumps(to_dict(Twin(rig()))))
    return str(path)


def rows_of(path) -> list[dict]:
    with open(path) as file:
        return list(csv.DictReader(file))


def test_healthy_is_what_the_twin_responds(tmp_path, twin_file):
    """Method of characteristics and chain of matrices share no solution. Harmonics of the file
    below 3 kHz are within 1 % of the ripple those of `Twin.respond` for the sheet's pump with its
    chambers as a capacitance, and within 3 % those with the ports' loss too."""
    out = tmp_path / "healthy.csv"
    assert main(["simulate", "healthy", "--twin", twin_file, *POINT, "--out", str(out)]) == 0
    rows = rows_of(out)
    assert list(rows[0]) == ["time_s", "p1", "p2"]
    pressure = np.array([[float(row[name]) for row in rows] for name in ("p1", "p2")])
    step = float(rows[1]["time_s"])
    assert step * len(rows) == pytest.approx(60.0 / SPEED)
    ripple = simulate(rig().pump, rig().fluid, SPEED, ConstantPressure(LOAD))
    capacitance = ripple.source_capacitance(9 * SPEED / 60.0)
    found = peak_amplitudes(pressure)[:, ORDERS]
    for source, most in ((Capacitive(ripple.angle_deg, ripple.flow, LOAD, 0.0, capacitance), 0.01),
                         (ripple, 0.03)):  # fmt: skip
        expected = Twin(rig()).respond(source, SPEED / 60.0, LOAD, ORDERS)
        assert np.linalg.norm(found - expected) < most * np.linalg.norm(expected)


def test_the_corrected_ripple_drives_healthy_and_faulty_pump_alike(tmp_path, capsys, twin_file):
    """A corrected ripple of 1.3 times the nominal one at every order: harmonics of the healthy pump
    are 1.3 times those of the twin without it, to 2 % of the ripple. The change by a leak is the
    same, to 2 % of the change."""
    ripple = CorrectedRipple({"a": ORDERS}, {"a": np.full(len(ORDERS), 1.3 + 0j)}, {"a": 0.0})
    corrected = tmp_path / "twin.json"
    corrected.write_text(json.dumps(to_dict(Twin(rig(), ripple=ripple))))

    def harmonics(twin, *fault):
        assert main(["simulate", *fault, "--twin", str(twin), *POINT, "--json"]) == 0
        (run,) = json.loads(capsys.readouterr().out)["severities"]
        return peak_amplitudes(np.array(list(run["pressure_pa"].values())))[:, 1:181]

    leak = "slipper", "--severity", "0.5mm2"
    nominal, healthy = harmonics(twin_file, "healthy"), harmonics(corrected, "healthy")
    assert np.linalg.norm(healthy - 1.3 * nominal) < 0.02 * np.linalg.norm(nominal)
    change, expected = harmonics(corrected, *leak) - healthy, harmonics(twin_file, *leak) - nominal
    assert np.linalg.norm(change - expected) < 0.02 * np.linalg.norm(expected)


@dataclass(frozen=True)
class Capacitive(FlowRipple):
    """A flow with a capacitance (m3/Pa) beside it."""

    capacitance: float = 0.0

    def source_admittance(self, s):
        return self.capacitance * np.asarray(s)


def test_leak_is_that_of_a_pump_coupled_to_its_line(capsys, twin_file):
    """The change by a leak of 0.5 mm2 is within 10 % that which a pump makes that is solved
    together with its pipe step by step; a leak of half the area is more than 30 % off it."""
    areas = ["--severity", "0.25mm2", "--severity", "5e-7m2"]
    assert main(["simulate", "slipper", "--twin", twin_file, *areas, *POINT, "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert [s["area_m2"] for s in result["severities"]] == pytest.approx([2.5e-7, 5e-7])
    assert main(["simulate", "healthy", "--twin", twin_file, *POINT, "--json"]) == 0
    healthy = json.loads(capsys.readouterr().out)["severities"][0]
    low = np.arange(1, 61)

    def harmonics(run):
        return peak_amplitudes(np.array(list(run["pressure_pa"].values())))[:, low]

    truth = coupled(Slipper(5e-7)) - coupled()
    misfit = [
        np.linalg.norm(harmonics(run) - harmonics(healthy) - truth[:, low])
        / np.linalg.norm(truth[:, low])
        for run in result["severities"]
    ]
    print(misfit)
    assert misfit[1] < 0.1 and misfit[0] > 0.3
    assert result["severities"][1]["mean_flow_m3_s"] < healthy["mean_flow_m3_s"]


def coupled(fault=None):
    """Sensors' harmonics of the sheet's pump solved together with its pipe."""
    line, orifice = rig().line[0], None
    places = tuple(s.position for s in rig().sensors)
    run = simulate(rig().pump, rig().fluid, SPEED, Pipe(line, places, load_pressure=LOAD))
    if fault is not None:
        orifice = run.orifice
        run = simulate(rig().pump, rig().fluid, SPEED, Pipe(line, places, orifice=orifice), fault)
    return peak_amplitudes(run.sensor_pressure)


REFUSED = {
    "no unit": (["slipper", "--severity", "0.2"], "no unit"),
    "no area": (["slipper", "--severity", "-1mm2"], "no leak area"),
    "missing": (["slipper"], "missing"),
    "healthy leak": (["healthy", "--severity", "0.2mm2"], "no leak"),
    "no such fault": (["worn", "--severity", "0.2mm2"], "neither a known fault nor a file"),
    "no speed": (["healthy", "--speed", "0"], "no speed"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_makes_no_sense_is_refused(tmp_path, capsys, twin_file, name):
    """Exit code 2, one line that says why, and no file."""
    options, words = REFUSED[name]
    out = tmp_path / "out.csv"
    arguments = ["--twin", twin_file, *POINT, "--out", str(out)]
    assert main(["simulate", options[0], *arguments, *options[1:]]) == 2
    told = capsys.readouterr()
    assert words in told.err and len(told.err.splitlines()) == 1
    assert told.out == "" and not out.exists()


def test_a_leak_that_diagnose_does_not_consider_is_a_warning(capsys, twin_file):
    """1e-4 mm2 passes next to nothing; the line on standard error says how little."""
    command = ["simulate", "slipper", "--twin", twin_file, *POINT, "--severity", "1e-4mm2"]
    assert main([*command, "--json"]) == 0
    told = capsys.readouterr()
    assert "times the mean flow of one piston" in told.err
    assert json.loads(told.out)["fault"] == "slipper"
