"""Values in wrong units and values that contradict each other are refused, with the likely unit."""

import numpy as np
import pytest

from case_folders import refused, sheet, spoilt, write_case
from rippletwin.case.load import load_case
from rippletwin.case.plausibility import PORT_OVERLAP_DEG
from rippletwin.pump.geometry import Geometry

ERRORS = {
    "length in mm": ("line.segments[0].length", 5950, ["looks like mm (5.95 m)", "Give m, not mm"]),
    "length of a planet": ("line.segments[0].length", 1e9, ["implausible"]),
    "diameter in mm": ("line.segments[0].diameter", 19.7, ["looks like mm (0.0197 m)"]),
    "diameter in inches": ("line.segments[0].diameter", 0.75, ["inches (0.01905 m)"]),
    "wave speed of nothing": ("line.segments[0].wave_speed", 1e-300, ["1e-300 m/s"]),
    "wave speed in km/s": ("line.segments[0].wave_speed", 1.02, ["looks like km/s (1020 m/s)"]),
    "density in g/cm3": ("fluid.density", 0.87, ["looks like g/cm3 (870 kg/m3)", "a gas needs"]),
    "density of nothing known": ("fluid.density", 1e308, ["1e+308 kg/m3 is implausible"]),
    "viscosity in cSt": ("fluid.kinematic_viscosity", 32, ["cSt (mm2/s) (3.2e-05 m2/s)"]),
    "viscosity in St": ("fluid.kinematic_viscosity", 0.32, ["St (cm2/s) (3.2e-05 m2/s)"]),
    "temperature in Celsius": ("line.segments[0].temperature", 40, ["Celsius (313.1 K)"]),
    "load pressure in bar": ("recordings[0].load_pressure", 70.8, ["looks like bar (7.08e+06 Pa)"]),
    "load pressure in MPa": ("recordings[0].load_pressure", 7.08, ["MPa (7.08e+06 Pa)"]),
    "back pressure of a star": ("load.back_pressure", 1e9, ["1e+09 Pa is implausible"]),
    "orifice in L/min/sqrt(bar)": ("load.coefficient", 4.0, ["L/min/sqrt(bar)"]),
    "uncertainty in per cent": ("uncertainty.wave_speed", 5, ["looks like per cent (0.05)"]),
    "uncertainty of 1 per cent": ("uncertainty.length", 1, ["looks like per cent (0.01)"]),
    "absurd uncertainty": ("uncertainty.load", 1e300, ["1e+300 is implausible"]),
    "no uncertainty to speak of": ("uncertainty.diameter", 1e-300, ["1e-300 is implausible"]),
    "sensor position known in mm": ("uncertainty.sensor_position", 5, ["mm (0.005 m)"]),
    "speed in Hz": ("recordings[0].speed_rpm", 5, ["looks like Hz (300 r/min)"]),
    "rate in kHz": ("recordings[0].sampling_rate_hz", 51.2, ["looks like kHz (5.12e+04 Hz)"]),
    "rate of no recorder": ("recordings[0].sampling_rate_hz", 1e12, ["implausible"]),
    "relative error in per cent": ("recordings[0].relative_error", 2, ["per cent (0.02)"]),
    "piston in mm": ("pump.piston_diameter", 17, ["mm (0.017 m)"]),
    "pitch radius in mm": ("pump.pitch_radius", 33.5, ["mm (0.0335 m)"]),
    "swash angle in rad": ("pump.swash_angle_deg", 0.26, ["rad (14.9 deg)", "Give deg, not rad"]),
    "port opening in rad": ("pump.port_opening_deg", 0.5, ["rad (28.65 deg)"]),
    "ports that never close": ("pump.port_opening_deg", 180, ["port_overlap_deg 5, its default"]),
    "dead volume in cm3": ("pump.dead_volume", 3.5, ["cm3 (3.5e-06 m3)"]),
    "bulk modulus in bar": ("pump.bulk_modulus", 14000, ["bar (1.4e+09 Pa)"]),
    "bulk modulus in GPa": ("pump.bulk_modulus", 1.4, ["GPa (1.4e+09 Pa)"]),
    "port area in mm2": ("pump.port_area", 120, ["mm2 (0.00012 m2)"]),
    "sensor position in mm": ("sensors[1].position", 2590, ["2590 mm would be 2.59 m"]),
    "two sensors at one place": ("sensors[1].position", 0.4205, ["where p1 is too"]),
    "label that leaves the folder": ("recordings[0].label", "../../x", ["part of a file's name"]),
    "label of 100 letters of three bytes": (
        "recordings[0].label",
        100 * "\u2248",
        ["up to 200 bytes"],
    ),
    "label without a letter": ("recordings[0].label", " ", ["part of a file's name"]),
}


def put(content, field, value):
    """Set a field written as in messages."""
    *place, last = field.replace("[", ".[").split(".")
    for key in place:
        index = int(key[1:-1]) if key.startswith("[") else key
        content = content[index] if isinstance(index, int) else content.setdefault(index, {})
    content[last] = value


@pytest.mark.parametrize("name", ERRORS)
def test_value_in_a_wrong_unit(tmp_path, name):
    """One value of a good sheet is spoilt; the error names it and says what it looks like."""
    field, value, words = ERRORS[name]

    def spoil(content):
        put(content, field, value)
        if "relative_error" in field:
            put(content, "recordings[0].kind", "spectrum")

    spoilt(tmp_path, spoil)
    refused(tmp_path, "rig.yaml", field, *words)


def test_the_default_overlap_is_the_pump_s():
    """The check of a sheet without port_overlap_deg uses what the simulated pump has."""
    assert Geometry().port_overlap_deg == PORT_OVERLAP_DEG


WARNINGS = {
    "a soft hose": ("line.segments[0].wave_speed", 150.0, "150 m/s is unusual"),
    "a very thin line": ("line.segments[0].diameter", 1.5e-3, "0.0015 m is unusual"),
    "a very long line": ("line.segments[0].length", 120.0, "120 m is unusual"),
    "back pressure in bar": ("load.back_pressure", 5.0, "looks like bar (5e+05 Pa)"),
    "30 per cent of wave speed": ("uncertainty.wave_speed", 0.4, "unusual"),
}


@pytest.mark.parametrize("name", WARNINGS)
def test_value_that_is_possible_but_unusual(tmp_path, name):
    """Possible values are read, and a warning names the field."""
    field, value, words = WARNINGS[name]
    spoilt(tmp_path, lambda c: put(c, field, value))
    (warning,) = (
        w
        for w in load_case(tmp_path).warnings
        if not w.startswith("pump: ") and "travel too" not in w
    )
    assert warning.startswith(field) and words in warning


def test_a_good_sheet_has_no_warnings(tmp_path):
    """Nothing of the tests' oil line is called unusual, with a pump of its own. With a number of
    pistons only, faults would be those of another pump: one warning says so. Numbers that do not
    give its size leave it that of another pump too."""
    size = {"piston_diameter": 0.017, "pitch_radius": 0.0335, "swash_angle_deg": 17.0}
    spoilt(tmp_path, lambda c: c["pump"].update(size))
    assert load_case(tmp_path).warnings == ()
    spoilt(tmp_path, lambda c: c["pump"].update(piston_diameter=0.017, port_opening_deg=15.0))
    (warning,) = load_case(tmp_path).warnings
    assert warning.startswith("pump: pitch_radius, swash_angle_deg not given")
    write_case(tmp_path, sheet())
    (warning,) = (w for w in load_case(tmp_path).warnings if "travel too" not in w)
    assert "generic pump of 42 cm3" in warning


def test_a_gas_has_ranges_of_its_own(tmp_path):
    """Air in a duct 1 m wide at 40 Pa of load is possible; the same values of a liquid are not."""

    def spoil(content):
        content["fluid"] = {
            "density": 1.2,
            "kinematic_viscosity": 1.5e-5,
            "heat_capacity_ratio": 1.4,
            "prandtl": 0.71,
        }
        content["line"]["segments"] = [{"length": 9.0, "diameter": 0.8, "wave_speed": 343.0}]
        content["load"] = {"kind": "open"}
        content["recordings"] = [{"file": "z.csv", "kind": "input_impedance", "state": "healthy"}]

    spoilt(tmp_path, spoil, pressure=None)
    table = np.column_stack([np.arange(100.0, 500.0), np.ones((400, 2))])
    np.savetxt(tmp_path / "z.csv", table)
    assert load_case(tmp_path).rig.fluid.is_gas


def test_exact_values_are_possible_one_by_one(tmp_path):
    """An uncertainty of 0 is an exact value; only a line of exact values cannot be fitted."""
    spoilt(tmp_path, lambda c: c.update(uncertainty={"length": 0.0, "diameter": 0.0}))
    assert load_case(tmp_path).rig.uncertainty.length == 0.0
    zeros = {"length": 0, "diameter": 0, "wave_speed": 0}
    spoilt(tmp_path, lambda c: c.update(uncertainty=zeros))
    refused(tmp_path, "rig.yaml", "uncertainty", "nothing of the line can be fitted")


def test_length_and_diameter_that_contradict_each_other(tmp_path):
    """A hair of 6 m: each value is possible by itself."""
    spoilt(tmp_path, lambda c: c["line"]["segments"][0].update(diameter=2.1e-4))
    refused(tmp_path, "rig.yaml", "line.segments[0].length", "2.83e+04 diameters")


def test_back_pressure_above_the_load_pressure(tmp_path):
    """Flow would run backwards."""
    spoilt(tmp_path, lambda c: c["load"].update(back_pressure=1.2e7))
    refused(tmp_path, "rig.yaml", "recordings[0].load_pressure", "not above", "1.2e+07 Pa")


def test_sensor_position_less_certain_than_the_line_is_long(tmp_path):
    """0.9 m on a line of 1 m says nothing of the position."""

    def spoil(content):
        content["line"]["segments"] = [{"length": 1.0, "diameter": 0.02, "wave_speed": 1000.0}]
        content["sensors"][1]["position"] = 0.9
        content["uncertainty"] = {"sensor_position": 0.9}

    spoilt(tmp_path, spoil)
    refused(tmp_path, "rig.yaml", "uncertainty.sensor_position", "more than half of the line")


@pytest.mark.parametrize(
    ("values", "field", "words"),
    [
        ({"piston_diameter": 0.03, "pitch_radius": 0.02}, "piston_diameter", "overlap"),
        ({"port_opening_deg": 100, "port_overlap_deg": 5}, "port_opening_deg", "half a revol"),
    ],
)
def test_pump_that_cannot_be_built(tmp_path, values, field, words):
    """Pistons that overlap, ports that are open all round."""
    spoilt(tmp_path, lambda c: c["pump"].update(values))
    refused(tmp_path, "rig.yaml", f"pump.{field}", words)


def test_the_same_label_twice(tmp_path):
    """Two files of one name in two folders are called the same unless labels tell them apart."""

    def spoil(content, **second):
        entry = content["recordings"][0]
        content["recordings"] = [
            {**entry, "file": "day1/run.h5"},
            {**entry, "file": "day2/run.h5", **second},
        ]

    for day in ("day1", "day2"):
        (tmp_path / day).mkdir()
        write_case(tmp_path, {**sheet(), "recordings": [{"file": f"{day}/run.h5"}]})
    spoilt(tmp_path, spoil, pressure=None)
    refused(tmp_path, "rig.yaml", "recordings[1].label", "'run'", "recordings[0]", "label of its")
    spoilt(tmp_path, lambda c: spoil(c, label="second day"), pressure=None)
    assert [r.label for r in load_case(tmp_path).recordings] == ["run", "second day"]
