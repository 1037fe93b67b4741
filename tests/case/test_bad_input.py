"""Bad input is an InputError that names file, field and remedy; each test spoils a good case once.

`test_load.py` shows that the unspoilt case is read, so it is the spoiling that is refused.
"""

import numpy as np
import pytest

from case_folders import (
    RATE,
    errors_of,
    refused,
    ripple,
    sheet,
    spoilt,
    told,
    write_case,
    write_hdf5,
)
from rippletwin.case.load import load_case
from rippletwin.errors import InputError

# the sheet


def test_no_sheet(tmp_path):
    refused(tmp_path, "rig.yaml", "rig.yaml", "not there")


def test_malformed_yaml(tmp_path):
    (tmp_path / "rig.yaml").write_text("fluid: {density: 870\nline: [")
    refused(tmp_path, "rig.yaml", "line 2, column 5", "not YAML")


def test_key_given_twice(tmp_path):
    write_case(tmp_path, sheet())
    with open(tmp_path / "rig.yaml", "a") as file:
        file.write("load: {kind: open}\n")
    with pytest.raises(InputError, match="'load' is given twice"):
        load_case(tmp_path)


def test_unknown_key(tmp_path):
    spoilt(tmp_path, lambda c: c["line"]["segments"][1].update(wavespeed=1000))
    refused(tmp_path, "rig.yaml", "line.segments[1].wavespeed", "unknown key", "mean wave_speed?")


def test_missing_key(tmp_path):
    spoilt(tmp_path, lambda c: c["fluid"].pop("density"))
    refused(tmp_path, "rig.yaml", "fluid.density", "missing", "kg/m3")


def test_number_as_text(tmp_path):
    spoilt(tmp_path, lambda c: c["fluid"].update(density="870 kg/m3"))
    refused(tmp_path, "rig.yaml", "fluid.density", "870 kg/m3")


def test_number_that_is_not_finite(tmp_path):
    spoilt(tmp_path, lambda c: c["fluid"].update(density=float("nan")))
    refused(tmp_path, "rig.yaml", "fluid.density", "finite")


def test_segment_of_zero_length(tmp_path):
    spoilt(tmp_path, lambda c: c["line"]["segments"][0].update(length=0))
    refused(tmp_path, "rig.yaml", "line.segments[0].length", "0")


def test_unknown_state_label(tmp_path):
    spoilt(tmp_path, lambda c: c["recordings"][0].update(state="worn"))
    refused(tmp_path, "rig.yaml", "recordings[0].state", "'worn'", "healthy, slipper, cylinder")


def test_sensor_outside_the_line(tmp_path):
    spoilt(tmp_path, lambda c: c["sensors"][1].update(position=9.2))
    refused(tmp_path, "rig.yaml", "sensors[1].position", "9.2 m", "8.95 m")


def test_two_sensors_of_one_name(tmp_path):
    spoilt(tmp_path, lambda c: c["sensors"][1].update(name="p1"))
    refused(tmp_path, "rig.yaml", "sensors[1].name", "p1 is the name of sensors[0] too")


@pytest.mark.parametrize("key", ["file", "flow_ripple"])
def test_missing_file(tmp_path, key):
    spoilt(tmp_path, lambda c: c["recordings"][0].update({key: "nowhere.csv"}), pressure=None)
    if key == "flow_ripple":
        write_hdf5(tmp_path / "healthy_0.h5", ripple())
    refused(tmp_path, "rig.yaml", f"recordings[0].{key}", "nowhere.csv")


def test_missing_repeat(tmp_path):
    spectrum_case(tmp_path, "100 1 2 3 4\n", repeats=["nowhere.csv"])
    refused(tmp_path, "rig.yaml", "recordings[0].repeats[0]", "nowhere.csv")


def test_periodic_recording_without_a_pump(tmp_path):
    spoilt(tmp_path, lambda c: c.pop("pump"))
    refused(tmp_path, "rig.yaml", "pump", "missing", "pistons")


def test_periodic_recording_without_speed(tmp_path):
    spoilt(tmp_path, lambda c: c["recordings"][0].pop("speed_rpm"))
    refused(tmp_path, "rig.yaml", "recordings[0].speed_rpm", "missing")


def test_simulated_pump_without_load_pressure(tmp_path):
    """A pump whose geometry is given is simulated against the load pressure, whatever the load is;
    with its pistons alone, or with a flow ripple, the pressure may be absent."""

    def unstated(content):
        content["load"]["kind"] = "unknown"
        del content["recordings"][0]["load_pressure"]

    def simulated(content):
        unstated(content)
        content["pump"]["piston_diameter"] = 0.02

    spoilt(tmp_path, unstated)
    load_case(tmp_path)
    spoilt(tmp_path, simulated)
    refused(tmp_path, "rig.yaml", "recordings[0].load_pressure", "missing", "simulated against")


def test_random_recording_of_one_sensor(tmp_path):
    def spoil(content):
        content["sensors"].pop()
        content["recordings"][0]["kind"] = "random"

    spoilt(tmp_path, spoil, ripple()[:1])
    refused(tmp_path, "rig.yaml", "sensors", "two or more")


@pytest.mark.parametrize(
    ("kind", "key", "value"),
    [
        ("spectrum", "channels", {"p1": 2, "p2": 1}),
        ("input_impedance", "unit", "bar"),
        ("input_impedance", "scale", 1000.0),
    ],
)
def test_key_of_sampled_recordings_at_a_table(tmp_path, kind, key, value):
    """It would be ignored without a word; the unit of a table would be wrong by 1e5."""

    def spoil(content):
        content["recordings"][0] |= {"kind": kind, key: value}

    spoilt(tmp_path, spoil)
    words = f"means nothing for a recording of kind {kind}"
    refused(tmp_path, "rig.yaml", f"recordings[0].{key}", words)


def test_file_name_that_is_too_long_to_be_a_label(tmp_path):
    """Results of a recording without a label are called after its file, with more words around."""
    name = 70 * "\u2248" + ".h5"
    spoilt(tmp_path, lambda c: c["recordings"][0].update(file=name))
    refused(tmp_path, "rig.yaml", "recordings[0].label", "210 bytes", "Give the recording a label")
    spoilt(tmp_path, lambda c: c["recordings"][0].update(file=name, label="short"))
    assert load_case(tmp_path).recordings[0].label == "short"


def test_load_impedance_without_its_file(tmp_path):
    spoilt(tmp_path, lambda c: c.update(load={"kind": "impedance"}))
    refused(tmp_path, "rig.yaml", "load.impedance", "missing")


# files


def test_unknown_format(tmp_path):
    spoilt(tmp_path, lambda c: c["recordings"][0].update(file="r.doc"), pressure=None)
    (tmp_path / "r.doc").touch()
    refused(tmp_path, "r.doc", "file", ".doc", ".h5")


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.99])
def test_hdf5_cut_short(tmp_path, share):
    write_case(tmp_path, sheet())
    path = tmp_path / "healthy_0.h5"
    path.write_bytes(path.read_bytes()[: int(share * path.stat().st_size)])
    refused(tmp_path, "healthy_0.h5", "file", "cut short")


@pytest.mark.parametrize("name", ["r.mat", "r.tdms"])
def test_file_that_is_not_what_its_name_says(tmp_path, name):
    spoilt(tmp_path, lambda c: c["recordings"][0].update(file=name), pressure=None)
    (tmp_path / name).write_bytes(b"This is no recording at all. " * 40)
    refused(tmp_path, name, "file", "cannot be read")


def test_hdf5_without_pressure(tmp_path):
    import h5py

    write_case(tmp_path, sheet(), pressure=None)
    with h5py.File(tmp_path / "healthy_0.h5", "w") as file:
        file["druck"] = ripple()
    refused(tmp_path, "healthy_0.h5", "pressure", "druck")


def test_hdf5_without_sampling_rate(tmp_path):
    import h5py

    write_case(tmp_path, sheet(), pressure=None)
    with h5py.File(tmp_path / "healthy_0.h5", "w") as file:
        file["pressure"] = ripple()
    refused(tmp_path, "healthy_0.h5", "sampling_rate_hz", "missing", "time: NAME")


def test_missing_sensor_row(tmp_path):
    write_case(tmp_path, sheet(), ripple()[:1])
    refused(tmp_path, "healthy_0.h5", "pressure", "1 channel(s)", "lists 2 sensor(s)")


def csv_case(folder, header="time_s,p1,p2", columns=None, **entry):
    spoilt(folder, lambda c: c["recordings"][0].update(file="r.csv", **entry), pressure=None)
    pressure = ripple(0.3)
    table = np.column_stack([np.arange(pressure.shape[1]) / RATE, *pressure])
    table = table if columns is None else columns(table)
    np.savetxt(folder / "r.csv", table, delimiter=",", header=header, comments="", fmt="%.10g")


def test_missing_sensor_column(tmp_path):
    csv_case(tmp_path, header="time_s,p1,p3")
    refused(tmp_path, "r.csv", "p2", "time_s, p1, p3")


def test_text_in_a_column(tmp_path):
    csv_case(tmp_path)
    lines = (tmp_path / "r.csv").read_text().splitlines()
    lines[5] = lines[5].rsplit(",", 1)[0] + ",overload"
    (tmp_path / "r.csv").write_text("\n".join(lines))
    refused(tmp_path, "r.csv", "p2", "'overload' in data row 5")


def test_rate_that_disagrees_with_the_time_column(tmp_path):
    csv_case(tmp_path, sampling_rate_hz=50000)
    refused(tmp_path, "r.csv", "sampling_rate_hz", "50000 Hz", "51200 Hz")


def test_time_column_with_a_gap(tmp_path):
    def gap(table):
        table[5000:, 0] += 0.01
        return table

    csv_case(tmp_path, columns=gap)
    refused(tmp_path, "r.csv", "time_s", "not evenly spaced")


def test_times_in_milliseconds(tmp_path):
    """They are not taken for a sampling rate in kHz."""
    csv_case(tmp_path, columns=lambda table: table * [1000.0, 1.0, 1.0])
    words = "51.2 Hz", "looks like times in ms", "Give times in seconds"
    refused(tmp_path, "r.csv", "sampling_rate_hz", *words)


def test_times_that_are_rounded_to_more_than_a_step(tmp_path):
    """Three decimals at 51.2 kHz: no sample was dropped."""
    csv_case(tmp_path, columns=lambda table: np.column_stack([table[:, 0].round(3), table[:, 1:]]))
    refused(tmp_path, "r.csv", "time_s", "rounded to more than a step", "with more digits")


def test_a_time_column_of_a_file_without_a_header(tmp_path):
    """No column has that name: gaps in the times would not be seen."""
    numbered = {"channels": {"p1": 2, "p2": 3}, "time": "t", "sampling_rate_hz": 51200.0}
    csv_case(tmp_path, header="", **numbered)
    text = (tmp_path / "r.csv").read_text()
    (tmp_path / "r.csv").write_text(text.lstrip("\n"))
    refused(tmp_path, "r.csv", "time", "the file has no header")


def test_points_of_thousands_beside_decimal_commas(tmp_path):
    """12.345 is twelve thousand there, not twelve: the cell is told."""
    csv_case(tmp_path)
    lines = [
        line.replace(",", ";").replace(".", ",")
        for line in (tmp_path / "r.csv").read_text().splitlines()
    ]
    lines[7] = lines[7].rpartition(";")[0] + ";9.500.000,5"
    (tmp_path / "r.csv").write_text("\n".join(lines))
    refused(tmp_path, "r.csv", "p2", "'9.500.000,5' in data row 7")
    lines[7] = lines[7].rpartition(";")[0] + ";9500.123"
    (tmp_path / "r.csv").write_text("\n".join(lines))
    refused(tmp_path, "r.csv", "p2", "'9500.123' in data row 7")


# signals


def test_nan(tmp_path):
    pressure = ripple()
    pressure[1, 777:780] = np.nan
    write_case(tmp_path, sheet(), pressure)
    refused(tmp_path, "healthy_0.h5", "p2", "3 of 51200 samples", "first at 777")


@pytest.mark.parametrize("start", [0, 40000])
def test_stuck_channel(tmp_path, start):
    pressure = ripple()
    pressure[0, start:] = pressure[0, start]
    write_case(tmp_path, sheet(), pressure)
    refused(tmp_path, "healthy_0.h5", "p1", "stuck", f"from sample {start}")


@pytest.mark.parametrize("bottom", [False, True])
def test_clipped_signal(tmp_path, bottom):
    """Two per cent of the samples at the limiter are enough, at the top or at the bottom."""
    pressure = ripple()
    limits = np.quantile(pressure[1], [0.02, 0.98])
    pressure[1] = (
        np.maximum(pressure[1], limits[0]) if bottom else np.minimum(pressure[1], limits[1])
    )
    write_case(tmp_path, sheet(), pressure)
    refused(tmp_path, "healthy_0.h5", "p2", "clipped at the " + ("bottom" if bottom else "top"))


def test_coarse_steps_are_not_clipping(tmp_path):
    """A recorder with steps of 5 kPa, noise-free to the eye, is no limiter: this one is read."""
    write_case(tmp_path, sheet(), np.round(ripple() / 5e3) * 5e3)
    assert load_case(tmp_path).recordings[0].pressure.shape == (2, 51200)


@pytest.mark.parametrize(("unit", "scale"), [("bar", 1e5), ("MPa", 1e6), ("kPa", 1e3)])
def test_wrong_units(tmp_path, unit, scale):
    write_case(tmp_path, sheet(), ripple() / scale)
    for name, error in zip(("p1", "p2"), errors_of(tmp_path), strict=True):
        told(error, "healthy_0.h5", name, "implausible", unit, f"multiply by {scale:g}")


def test_wrong_units_of_an_ac_coupled_sensor(tmp_path):
    pressure = ripple()
    write_case(tmp_path, sheet(), (pressure - pressure.mean(axis=1, keepdims=True)) / 1e5)
    for name, error in zip(("p1", "p2"), errors_of(tmp_path), strict=True):
        told(error, "healthy_0.h5", name, "implausible")


def test_ac_coupled_sensors_are_fine(tmp_path):
    """Without a mean the ripple alone is judged: this one is read."""
    pressure = ripple()
    write_case(tmp_path, sheet(), pressure - pressure.mean(axis=1, keepdims=True))
    assert load_case(tmp_path).recordings


def test_shorter_than_four_revolutions(tmp_path):
    write_case(tmp_path, sheet(), ripple(0.2))
    refused(tmp_path, "healthy_0.h5", "pressure", "3.3 revolutions")


@pytest.mark.parametrize("rpm", [500, 980, 1020, 1500, 2000])
def test_speed_that_disagrees_with_the_piston_frequency(tmp_path, rpm):
    spoilt(tmp_path, lambda c: c["recordings"][0].update(speed_rpm=rpm))
    refused(tmp_path, "healthy_0.h5", "speed_rpm", f"{rpm} r/min with 9 pistons disagrees")


def test_speed_holds_where_a_resonance_lifts_high_even_harmonics(tmp_path):
    """Twice the speed would hold most of this ripple in its own first six piston harmonics."""
    turns = np.arange(51200) / 51200 * 1000 / 60
    sizes = {1: 0.1, 2: 0.3, 3: 0.05, 8: 1.0, 10: 1.0}
    wave = sum(a * np.cos(2 * np.pi * 9 * h * turns) for h, a in sizes.items())
    write_case(tmp_path, sheet(), 9.5e6 + 2e5 * np.stack([wave, 0.8 * wave]))
    assert load_case(tmp_path).recordings[0].speed_rpm == 1000


def test_wrong_number_of_pistons(tmp_path):
    spoilt(tmp_path, lambda c: c["pump"].update(pistons=7))
    refused(tmp_path, "healthy_0.h5", "speed_rpm", "7 pistons disagrees")


def test_no_ripple_at_all(tmp_path):
    noise = 9.5e6 + np.random.default_rng(1).normal(scale=2e3, size=(2, 51200))
    write_case(tmp_path, sheet(), noise)
    refused(tmp_path, "healthy_0.h5", "speed_rpm", "no piston frequency")


# tables


def flow_case(folder, angle, flow):
    spoilt(folder, lambda c: c["recordings"][0].update(flow_ripple="q.csv"))
    table = np.column_stack([angle, flow])
    np.savetxt(folder / "q.csv", table, delimiter=",", header="angle_deg,flow_m3_s", comments="")


def test_flow_ripple_of_half_a_revolution(tmp_path):
    flow_case(tmp_path, np.arange(180.0), np.full(180, 5e-4))
    refused(tmp_path, "q.csv", "angle_deg", "not one revolution")


def test_flow_ripple_in_litres_a_minute(tmp_path):
    flow_case(tmp_path, np.arange(360.0), np.full(360, 30.0))
    refused(tmp_path, "q.csv", "flow_m3_s", "divide L/min by 60000")


def spectrum_case(folder, text, **entry):
    def spoil(content):
        content["recordings"] = [
            {"file": "s.csv", "kind": "spectrum", "state": "healthy", **entry},
        ]

    spoilt(folder, spoil, pressure=None)
    (folder / "s.csv").write_text(text)


def test_spectrum_without_a_sensor(tmp_path):
    spectrum_case(tmp_path, "frequency_hz,p1_re,p1_im\n100,1,2\n200,1,2\n")
    refused(tmp_path, "s.csv", "p2_re", "missing")


def test_spectrum_out_of_order(tmp_path):
    spectrum_case(tmp_path, "200 1 2 3 4\n100 1 2 3 4\n")
    refused(tmp_path, "s.csv", "frequency_hz", "100 in row 2")


def test_spectrum_that_is_zero_at_all_sensors(tmp_path):
    """Errors are relative to the power of a row, by which a fit divides. A row
    at 0 Hz is not used, and one sensor may be zero alone."""
    spectrum_case(tmp_path, "0 0 0 0 0\n100 1 2 0 0\n200 0 0 0 0\n300 1 2 3 4\n")
    refused(tmp_path, "s.csv", "p1_re, p1_im, p2_re, p2_im", "1 row(s)", "row 3 at 200 Hz")
    spectrum_case(tmp_path, "0 0 0 0 0\n100 1 2 0 0\n300 1 2 3 4\n")
    assert len(load_case(tmp_path).recordings[0].frequency_hz) == 3


def test_spectrum_with_a_gap(tmp_path):
    spectrum_case(tmp_path, "100 1 2 3 4\n200 1 nan 3 4\n")
    refused(tmp_path, "s.csv", "p1_im", "first in row 2")


def test_repeats_at_other_frequencies(tmp_path):
    spectrum_case(tmp_path, "100 1 2 3 4\n200 1 2 3 4\n", repeats=["s2.csv"])
    (tmp_path / "s2.csv").write_text("150 1 2 3 4\n250 1 2 3 4\n")
    refused(tmp_path, "s2.csv", "frequency_hz", "no frequency in common")
