"""Cases come in from every format, and what comes in is what was written."""

import shutil

import h5py
import numpy as np
import pytest
import scipy.io
from nptdms import ChannelObject, TdmsWriter

from case_folders import RATE, ripple, sheet, write_case, write_hdf5
from paths import MEASURED, ROOT
from rippletwin.case.load import load_case
from rippletwin.case.schema_errors import schema
from rippletwin.cli import main
from rippletwin.spectra.observation import observe

CYLINDER = MEASURED / "cylinder"


def write_csv(path, pressure):
    time = np.arange(pressure.shape[1]) / RATE
    np.savetxt(
        path,
        np.column_stack([time, *pressure]),
        delimiter=",",
        header="time_s,p1,p2",
        comments="",
        fmt="%.10g",
    )


def write_matlab5(path, pressure):
    scipy.io.savemat(path, {"pressure": pressure, "sampling_rate_hz": RATE})


def write_matlab73(path, pressure):
    """MATLAB's v7.3 files are HDF5 behind a 512-byte header, arrays transposed."""
    with h5py.File(path, "w", userblock_size=512) as file:
        file["pressure"] = pressure.T
        file["sampling_rate_hz"] = [[RATE]]
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


def write_tdms(path, pressure):
    with TdmsWriter(path) as writer:
        properties = {"wf_increment": 1 / RATE}
        writer.write_segment(
            [
                ChannelObject("rig", name, row, properties)
                for name, row in zip(("p2", "p1"), pressure[::-1])
            ]
        )


@pytest.mark.parametrize(
    ("name", "write"),
    [
        ("r.h5", write_hdf5),
        ("r.csv", write_csv),
        ("r.mat", write_matlab5),
        ("v73.mat", write_matlab73),
        ("r.tdms", write_tdms),
    ],
)
def test_every_format_gives_the_same_recording(tmp_path, name, write):
    """The arrays read are the arrays written, in the rig's sensor order, at the right rate."""
    content = sheet()
    content["recordings"][0]["file"] = name
    write_case(tmp_path, content, pressure=None)
    pressure = ripple()
    write(tmp_path / name, pressure)
    case = load_case(tmp_path)
    np.testing.assert_allclose(case.recordings[0].pressure, pressure, rtol=1e-9)
    assert case.recordings[0].sampling_rate_hz == pytest.approx(RATE, rel=1e-6)


@pytest.mark.parametrize(
    ("keys", "pascals"),
    [({"unit": "bar"}, 1e5), ({"unit": "kPa", "scale": -2.0}, -2e3), ({"scale": 600.0}, 600.0)],
)
def test_unit_and_scale_of_a_recording(tmp_path, keys, pascals):
    """A file in bar, one of inverted half kPa and one of counts of 600 Pa each: all come in as the
    pressure that was there."""
    content = sheet()
    content["recordings"][0].update(keys)
    pressure = ripple()
    write_case(tmp_path, content, pressure / pascals)
    np.testing.assert_allclose(load_case(tmp_path).recordings[0].pressure, pressure, rtol=1e-9)


def test_the_sheet_arrives_in_the_dataclasses(tmp_path):
    """Every key of a sheet is found under its own name, 9.5e6 as a number."""
    content = sheet()
    content["recordings"][0]["flow_ripple"] = "flow.csv"
    content["line"]["segments"][0]["temperature"] = 313.0
    content["uncertainty"] = {"length": 0.02}
    write_case(tmp_path, content)
    angle = np.arange(0, 360, 2.0)
    flow = 5e-4 + 1e-5 * np.cos(np.radians(9 * angle))
    np.savetxt(
        tmp_path / "flow.csv",
        np.column_stack([angle, flow]),
        delimiter=",",
        header="angle_deg,flow_m3_s",
        comments="",
    )
    text = (tmp_path / "rig.yaml").read_text().replace("9500000.0", "9.5e6")
    assert "9.5e6" in text
    (tmp_path / "rig.yaml").write_text(text)
    case = load_case(tmp_path)
    assert case.rig.line[0].temperature == 313.0
    assert case.rig.uncertainty.length == 0.02 and case.rig.uncertainty.diameter == 0.03
    assert [sensor.position for sensor in case.rig.sensors] == [0.42, 2.59]
    (recording,) = case.healthy
    assert recording.load_pressure == 9.5e6 and recording.state_code == "H"
    np.testing.assert_allclose(recording.flow_ripple.flow, flow)
    assert case.rig.displacement == pytest.approx(5e-4 / (recording.speed_rpm / 60.0))
    assert observe(recording, case.rig).source == "nominal"


def test_displacement_of_uneven_angles(tmp_path):
    """The mean of 5e-4 - 4e-4 cos is 5e-4 m3/s, though most rows are where the flow is small: the
    rows' own mean would make the pump a third of its size."""
    content = sheet()
    content["recordings"][0]["flow_ripple"] = "flow.csv"
    write_case(tmp_path, content)
    angle = np.unique([*np.arange(0.0, 360.0, 2.0), *np.arange(0.0, 60.0, 0.1)])
    flow = 5e-4 - 4e-4 * np.cos(np.radians(angle))
    table = np.column_stack([angle, flow])
    np.savetxt(
        tmp_path / "flow.csv", table, delimiter=",", header="angle_deg,flow_m3_s", comments=""
    )
    assert load_case(tmp_path).rig.displacement == pytest.approx(3e-5, rel=1e-4)


def test_a_ripple_without_its_mean_states_no_displacement(tmp_path):
    """A mean that is the rounding of a table is none: it would make the pump a millionth of its
    size. An anechoic end needs no mean flow."""
    content = sheet() | {"load": {"kind": "anechoic"}}
    content["recordings"][0]["flow_ripple"] = "flow.csv"
    write_case(tmp_path, content)
    angle = np.arange(0.0, 360.0, 2.0)
    table = np.column_stack([angle, 3e-12 + 1e-5 * np.cos(np.radians(9 * angle))])
    np.savetxt(
        tmp_path / "flow.csv", table, delimiter=",", header="angle_deg,flow_m3_s", comments=""
    )
    assert load_case(tmp_path).rig.displacement is None


@pytest.mark.parametrize(
    ("angles", "stated", "highest"), [(180, None, 89), (180, 1200.0, 72), (720, None, 299)]
)
def test_a_recording_is_used_as_far_as_its_flow_ripple_resolves(tmp_path, angles, stated, highest):
    """180 angles resolve order 89 (1.48 kHz at 1000 r/min): above it the nominal ripple is unknown,
    a warning says so, and names the angles that 5 kHz need. A lower stated band stays."""
    content = sheet()
    content["recordings"][0] |= {"flow_ripple": "flow.csv"} | (
        {"max_frequency_hz": stated} if stated else {}
    )
    write_case(tmp_path, content)
    angle = np.arange(angles) * 360.0 / angles
    flow = 5e-4 + 1e-5 * np.cos(np.radians(9 * angle))
    table = np.column_stack([angle, flow])
    np.savetxt(
        tmp_path / "flow.csv", table, delimiter=",", header="angle_deg,flow_m3_s", comments=""
    )
    case = load_case(tmp_path)
    observed = observe(case.recordings[0], case.rig)
    assert observed.orders[-1] == pytest.approx(highest, abs=1)
    warned = [w for w in case.warnings if "flow_ripple" in w]
    assert len(warned) == (angles == 180 and stated is None)
    assert not warned or ("healthy_0" in warned[0] and "602 even angles" in warned[0])


def test_only_the_asked_states_are_read(tmp_path):
    """A recording of a state not asked for is not opened: this one would not open."""
    content = sheet()
    content["recordings"].append(
        {**content["recordings"][0], "file": "broken.h5", "state": "cylinder"}
    )
    write_case(tmp_path, content)
    (tmp_path / "broken.h5").write_bytes(b"nothing")
    assert len(load_case(tmp_path, states={"healthy"}).recordings) == 1
    with pytest.raises(ValueError, match="unknown states"):
        load_case(tmp_path, states={"H"})


def test_load_impedance_and_spectrum(tmp_path):
    """A measured load impedance and a two-sensor spectrum with a repeat keep their numbers."""
    frequency = np.arange(100.0, 1000.0, 100.0)
    rng = np.random.default_rng(1)
    parts = rng.normal(size=(4, frequency.size))
    for name, factor in (("s1.csv", 1.0), ("s2.csv", 1.1)):
        np.savetxt(
            tmp_path / name,
            np.column_stack([frequency, *(factor * parts)]),
            delimiter=",",
            header="frequency_hz,p1_re,p1_im,p2_re,p2_im",
            comments="",
        )
    np.savetxt(
        tmp_path / "load.csv",
        np.column_stack([frequency, *parts[:2]]),
        delimiter=",",
        header="frequency_hz,re,im",
        comments="",
    )
    content = sheet()
    content["load"] = {"impedance": "load.csv"}
    content["recordings"] = [
        {"file": "s1.csv", "kind": "spectrum", "state": "healthy", "repeats": ["s2.csv"]}
    ]
    write_case(tmp_path, content, pressure=None)
    case = load_case(tmp_path)
    np.testing.assert_allclose(case.rig.load.impedance, parts[0] + 1j * parts[1])
    (recording,) = case.recordings
    assert recording.spectra.shape == (2, 2, frequency.size)
    np.testing.assert_allclose(recording.spectra[1, 1], 1.1 * (parts[2] + 1j * parts[3]))


def test_every_key_of_the_schema_is_described():
    """No property of rig.schema.yaml is without a description."""

    def undescribed(node, path):
        for name, child in node.get("properties", {}).items():
            if not child.get("description"):
                yield f"{path}.{name}"
            yield from undescribed(child, f"{path}.{name}")
        if "items" in node:
            yield from undescribed(node["items"], f"{path}[]")

    assert list(undescribed(schema(), "")) == []


def test_the_example_of_the_documentation_is_valid():
    """The complete sheet of docs/reference/rig_yaml.md passes the schema and names every key but
    the exclusive."""
    import jsonschema

    from rippletwin.case.yaml_limits import parse_yaml

    text = (ROOT / "docs" / "reference" / "rig_yaml.md").read_text()
    example = parse_yaml(text.split("```yaml")[1].split("```")[0])
    jsonschema.Draft202012Validator(schema()).validate(example)
    properties = schema()["properties"]
    assert set(example) == set(properties)
    assert set(example["pump"]) == set(properties["pump"]["properties"])
    given = set().union(*example["recordings"])
    assert given == set(properties["recordings"]["items"]["properties"])


def test_check_reports_a_case(tmp_path, capsys):
    """rippletwin check prints revolutions, speed, both noises and harmonics, and ends with 0.

    Truth: the signal has 1 kPa of noise and five piston harmonics, and turns at 1000 r/min.
    """
    write_case(tmp_path, sheet())
    assert main(["check", str(tmp_path)]) == 0
    text = capsys.readouterr().out
    assert "revolutions at 1000." in text and "noise 0.010" in text
    assert "mean 9" in text and "scatter of the revolutions 0.0" in text
    assert "5 of 33 piston harmonics" in text


def test_check_ends_with_2_on_bad_input(tmp_path, capsys):
    """Bad input is told on standard error, with nothing on standard output."""
    assert main(["check", str(tmp_path)]) == 2
    told = capsys.readouterr()
    assert "rig.yaml" in told.err and told.out == ""


@pytest.mark.parametrize("command", ["check", "export"])
def test_recordings_of_a_pump_that_stands_still_are_refused(tmp_path, capsys, command):
    """Recordings without a ripple that repeats with the shaft are told with their files; check
    tells all of them at once, and still shows what it can read."""
    content = sheet()
    for k in (1, 2):
        still = content["recordings"][0] | {"file": f"still_{k}.h5", "state": "unknown"}
        content["recordings"].append(still)
        noise = np.random.default_rng(k).normal(scale=1e3, size=(2, int(RATE)))
        write_hdf5(tmp_path / f"still_{k}.h5", 9.5e6 + noise)
    write_case(tmp_path, content)
    out = ["--out", str(tmp_path / "out")] if command == "export" else []
    assert main([command, str(tmp_path), *out]) == 2
    told = capsys.readouterr()
    said = "speed_rpm: no ripple repeats with the shaft at 1000 r/min"
    assert told.err.count(said) == (2 if command == "check" else 1)
    assert "still_1.h5" in told.err and "Traceback" not in told.err
    assert command == "export" or "5 of 33 piston harmonics" in told.out


@pytest.mark.skipif(not CYLINDER.is_dir(), reason="the measured cylinder is not on this machine")
def test_the_measured_cylinder_comes_in(tmp_path):
    """Two runs of a real tube's input impedance, bare columns, at the frequencies both have.

    Truth: its README: 1 Hz steps, runs that differ by 6.25 % in the reflection coefficient; so the
    mean of two has a relative standard deviation of half of that.
    """
    for run in ("measured_1.txt", "measured_2.txt"):
        shutil.copy(CYLINDER / run, tmp_path)
    content = {
        "fluid": {
            "density": 1.204,
            "kinematic_viscosity": 1.51e-5,
            "heat_capacity_ratio": 1.4,
            "prandtl": 0.71,
        },
        "line": {"segments": [{"length": 0.436, "diameter": 0.0039, "wave_speed": 343.2}]},
        "load": {"kind": "open"},
        "recordings": [
            {
                "file": "measured_1.txt",
                "kind": "input_impedance",
                "state": "healthy",
                "normalised": True,
                "repeats": ["measured_2.txt"],
            }
        ],
    }
    write_case(tmp_path, content, pressure=None)
    case = load_case(tmp_path)
    (recording,) = case.healthy
    assert recording.spectra.shape == (2, 1, 2950)
    assert recording.frequency_hz[[0, -1]] == pytest.approx([50, 2999])
    seen = observe(recording, case.rig)
    reflection = (recording.spectra - 1) / (recording.spectra + 1)
    gap = np.linalg.norm(reflection[0] - reflection[1]) / np.linalg.norm(reflection[0])
    assert gap == pytest.approx(0.0625, abs=0.001)
    deviation = np.sqrt(seen.covariance[:, 0, 0].real) / (np.abs(seen.values[0] + 1) ** 2 / 2)
    size = np.sqrt(np.mean(np.abs(reflection) ** 2))
    assert np.sqrt(np.mean(deviation**2)) / size == pytest.approx(gap / 2, rel=0.15)
    assert seen.source == "known" and seen.normalised and case.rig.fluid.is_gas


def test_a_flow_ripple_beside_a_spectrum_limits_nothing(tmp_path):
    """A spectrum has no shaft speed, and its source is free: the key is read and not used."""
    content = sheet()
    content["recordings"] = [
        {"file": "s.csv", "kind": "spectrum", "state": "healthy", "flow_ripple": "flow.csv"}
    ]
    write_case(tmp_path, content)
    (tmp_path / "s.csv").write_text(
        "frequency_hz,p1_re,p1_im,p2_re,p2_im\n100,1,2,3,4\n5000,1,2,3,4\n"
    )
    rows = "".join(f"{angle},{5e-4 + 1e-6 * (angle % 40)}\n" for angle in range(0, 360, 5))
    (tmp_path / "flow.csv").write_text("angle_deg,flow_m3_s\n" + rows)
    case = load_case(tmp_path)
    assert case.recordings[0].max_frequency_hz is None
    assert not any("flow_ripple" in warning for warning in case.warnings)
