"""What fuzzing has found: each damaged file that once ended in a traceback or in gigabytes."""

import json
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

import fuzzing
from fuzzing import edited, little_memory, refused, tried
from good_recordings import WRITE, Good
from made_results import write_results
from rippletwin.case.load import load_case
from rippletwin.errors import InputError
from rippletwin.learning.kept_networks import load_networks
from rippletwin.report.page import report_case
from rippletwin.twin.twin_file import load_twin

FOUND = {
    "HDF5, heads moved": ("r.h5", [("repeat", 0.0, 48)]),
    "MATLAB 4, a name of 2 GiB": ("r.mat", [("write", 0.0, b"\x00")]),
    "TDMS, a text of 3 GiB": ("r.tdms", [("repeat", 0.0, 23)]),
    "WAV, samples of 1 GiB": ("r.wav", [("cut", 0.3, 0), ("repeat", 5e-324, 54)]),
}


@pytest.mark.parametrize("name", FOUND)
def test_a_recording(tmp_path, name):
    """Refused in words; no library allocates what a damaged header claims."""
    file, edits = FOUND[name]
    good = Good(tmp_path, file, WRITE[file])
    good.path.write_bytes(edited(good.content, edits))
    with pytest.raises(InputError) as caught, little_memory():
        load_case(tmp_path)
    assert refused(caught.value)


def test_a_column_name_that_is_no_text(tmp_path):
    """A byte of a Parquet file's column name is changed to one that UTF-8 does not know."""
    good = Good(tmp_path, "r.parquet", WRITE["r.parquet"])
    good.path.write_bytes(good.content.replace(b"p1", b"p\xf0"))
    with pytest.raises(InputError, match="cannot be read"):
        load_case(tmp_path)


def test_networks_in_the_older_format_of_torch(tmp_path):
    """A text of 3.7 GiB in 59 bytes: refused before torch allocates it."""
    path = tmp_path / "networks.pt"
    path.write_bytes(b"X" + 58 * b"\xdf")
    with pytest.raises(InputError, match="no kept networks") as caught, little_memory():
        load_networks(path)
    assert refused(caught.value)


@pytest.mark.parametrize("content", [[], 5, None, {"rig": []}, {"twin": []}, {"twin": {"rig": 1}}])
def test_a_twin_that_is_other_json(tmp_path, content):
    """Well-formed JSON of another shape is no twin."""
    (tmp_path / "twin.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match="holds no twin"):
        load_twin(tmp_path / "twin.json")


@pytest.mark.parametrize("content", [[], {}, {"verdict": "named", "effects": 3}])
def test_a_verdict_that_is_other_json(tmp_path, content):
    """The page is not made of it, and no traceback is shown."""
    write_results(tmp_path)
    (tmp_path / "explained" / "verdict.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match="not as the commands write them"):
        report_case(tmp_path, tmp_path / "report.html")
    assert not (tmp_path / "report.html").exists()


def test_an_input_that_hangs_is_found(monkeypatch):
    """A reader that waits for ever, and catches every exception, is ended at the limit of time; an
    input within it is no finding."""
    monkeypatch.setattr(fuzzing, "SECONDS", 0.2)

    @tried(0.01)
    @given(st.just(30.0))
    def hang(seconds):
        try:
            time.sleep(seconds)
        except Exception:
            pass

    with pytest.raises(fuzzing.Hung):
        hang()

    @tried(0.01)
    @given(st.just(0.0))
    def answer(seconds):
        time.sleep(seconds)

    answer()
