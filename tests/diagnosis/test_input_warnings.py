"""What speaks against trusting the diagnoses of a case, told beside them."""

from dataclasses import replace

import numpy as np
import pytest

from case_folders import ripple, sheet, write_case, write_hdf5
from rippletwin.case.load import load_case
from rippletwin.cli import main
from rippletwin.diagnosis.input_warnings import find_warnings
from rippletwin.twin.twin import Twin

SIZE = {"piston_diameter": 0.017, "pitch_radius": 0.0335, "swash_angle_deg": 17.0}


@pytest.fixture
def case(tmp_path):
    """A case with a pump of known size, of which nothing is to be told."""
    write_case(tmp_path, sheet() | {"pump": {"pistons": 9} | SIZE})
    return load_case(tmp_path)


def test_nothing_is_told_of_a_case_and_its_own_twin(case):
    """The twin is of the same data sheet, the ripple is not clipped."""
    assert find_warnings(case, Twin(case.rig), case.recordings, {"verdict": "named"}) == []


def test_a_data_sheet_that_was_corrected_after_the_twin(case):
    """The twin's line counts, and the warning names what differs; a tolerance alone is no other
    rig."""
    first, *others = case.rig.line
    longer = replace(case.rig, line=(replace(first, length=6.2), *others))
    (told,) = find_warnings(case, Twin(longer), ())
    assert told.startswith("rig.yaml: the twin was made with other values of line, and these count")
    loose = replace(case.rig, uncertainty=replace(case.rig.uncertainty, length=0.1))
    assert find_warnings(case, Twin(loose), ()) == []


def clipped():
    """Amplifiers that end where the signal is a fifth of the time, with noise behind them."""
    noise = np.random.default_rng(1).normal(scale=30.0, size=ripple().shape)
    whole = ripple()
    return np.minimum(whole, np.quantile(whole, 0.8, axis=1, keepdims=True)) + noise


def test_a_clipped_recording(case):
    """No two extremes are equal, but the samples crowd at the top: `check` and a diagnosis say
    which sensor."""
    write_hdf5(case.folder / "healthy_0.h5", clipped())
    read = load_case(case.folder)
    told = find_warnings(read, Twin(case.rig), read.recordings)
    said = [f"sensor {name} is clipped at the top" for name in ("p1", "p2")]
    assert [each.partition(" in ")[0] for each in told] == said


def test_check_tells_a_clipped_recording(case, capsys):
    """On standard error, and as a warning of --fail-on."""
    write_hdf5(case.folder / "healthy_0.h5", clipped())
    assert main(["check", str(case.folder), "--fail-on", "warning"]) == 3
    assert "sensor p1 is clipped at the top" in capsys.readouterr().err
