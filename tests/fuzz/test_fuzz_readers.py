"""Files of recordings and tables, damaged at random: refused in words or read, within 1 GiB."""

import json
import shutil

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from case_folders import RATE
from fuzzing import EDITS, TREE_EDITS, edited, edited_tree, little_memory, refused, tried
from good_recordings import PRESSURE, WRITE, Good
from rippletwin.case.tables import read_flow_ripple, read_impedance, read_repeats
from rippletwin.errors import InputError

HEAD = 4096  # bytes in which a file's structure is; half of the damage is done there


@pytest.fixture(scope="module", params=WRITE)
def good(request, tmp_path_factory):
    return Good(tmp_path_factory.mktemp("case"), request.param, WRITE[request.param])


@tried(1)
@given(edits=EDITS, in_head=st.booleans())
def test_bytes_of_a_recording(good, edits, in_head):
    """Any bytes of any format, half of the time those of the head."""
    good.path.write_bytes(edited(good.content, edits, HEAD if in_head else None))
    try:
        with little_memory():
            good.load()
    except InputError as error:
        # scipy allocates what a damaged tag inside a variable claims, and touches no more of it
        # than the file holds
        assert refused(error) or good.path.suffix == ".mat"


@pytest.fixture(scope="module")
def stored(tmp_path_factory):
    """A case with one recording in a zarr store, and the store's own copy."""
    zarr = pytest.importorskip("zarr")

    def write(path):
        store = zarr.open_group(path, mode="w", zarr_format=2)
        array = store.create_array("pressure", data=PRESSURE, chunks=(2, 4096))
        array.attrs["sampling_rate_hz"] = RATE

    folder = tmp_path_factory.mktemp("case")
    return Good(folder, "r.zarr", write), shutil.copytree(folder / "r.zarr", folder / "whole")


@tried(0.5)
@given(edits=EDITS, tree=TREE_EDITS, which=st.integers(0, 50), as_tree=st.booleans())
def test_files_of_a_store(stored, edits, tree, which, as_tree):
    """One of a store's files is damaged, as bytes or, where it is JSON, as a tree."""
    good, whole = stored
    shutil.rmtree(good.path)
    shutil.copytree(whole, good.path)
    files = sorted(path for path in good.path.rglob("*") if path.is_file())
    path = files[which % len(files)]
    content = path.read_bytes()
    if as_tree and path.name.startswith(".z"):
        path.write_text(json.dumps(edited_tree(json.loads(content), tree)))
    else:
        path.write_bytes(edited(content, edits))
    try:
        with little_memory():
            good.load()
    except InputError as error:
        assert refused(error)


ANGLE = np.arange(0.0, 360.0, 2.0)
TABLES = {
    "flow ripple": (
        read_flow_ripple,
        "angle_deg,flow_m3_s\n"
        + "".join(f"{a},{7e-4 + 1e-5 * np.cos(np.radians(9 * a)):.9g}\n" for a in ANGLE),
    ),
    "impedance": (
        read_impedance,
        "frequency_hz,re,im\n" + "".join(f"{f},{1e9 + f},{-f}\n" for f in range(10, 400, 10)),
    ),
    "spectrum": (
        lambda path: read_repeats([path, path], ["p1"]),
        "frequency_hz;p1_re;p1_im\n"
        + "".join(f"{f},5;{f + 0.25};-3\n".replace(".", ",") for f in range(10, 400, 10)),
    ),
    "bare columns": (
        lambda path: read_repeats([path], None),
        "".join(f"{f} {1e9 + f} {-f}\n" for f in range(10, 400, 10)),
    ),
}


@pytest.fixture(scope="module", params=TABLES)
def table(request, tmp_path_factory):
    """What reads a table, where it is, and its good text, which is read without complaint."""
    read, text = TABLES[request.param]
    path = tmp_path_factory.mktemp("table") / "table.csv"
    path.write_text(text)
    read(path)
    return read, path, text.encode()


@tried(1)
@given(edits=EDITS)
def test_text_of_a_table(table, edits):
    """Flow ripples, impedances and spectra as text."""
    read, path, good = table
    path.write_bytes(edited(good, edits))
    try:
        with little_memory():
            read(path)
    except InputError as error:
        assert refused(error)
