"""Stores hold what was saved, whole or not at all."""

import ast
import errno
import os
import resource
import subprocess
import sys
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from paths import ROOT
from rippletwin import store
from rippletwin.cli import main, program


def dataset(value):
    return xr.Dataset(
        {
            "values": (("sensor", "frequency"), np.full((2, 5), value), {"units": "Pa"}),
            "label": (("sensor",), np.array(["p1", "p2"])),
        },
        coords={"frequency": ("frequency", np.arange(5.0), {"units": "Hz"})},
        attrs={"source": "test"},
    )


@pytest.mark.parametrize("compressed", [True, False])
def test_round_trip(tmp_path, compressed):
    """Complex values, text, units and attributes come back identical."""
    saved = dataset(1 + 2j)
    store.save(saved, tmp_path / "deep" / "a.zarr", compressed=compressed)
    with store.load(tmp_path / "deep" / "a.zarr") as loaded:
        xr.testing.assert_identical(loaded.load(), saved)
    assert [path.name for path in (tmp_path / "deep").iterdir()] == ["a.zarr"]


def test_saving_replaces_the_whole_store(tmp_path):
    """Variables of an earlier save are gone; a store read from disk can be saved elsewhere."""
    path = tmp_path / "a.zarr"
    store.save(dataset(1.0).assign(extra=3), path)
    store.save(dataset(2.0), path)
    assert "extra" not in store.load(path)
    store.save(store.load(path), tmp_path / "b.zarr", compressed=False)
    xr.testing.assert_identical(store.load(tmp_path / "b.zarr").load(), dataset(2.0))


def test_a_failed_save_leaves_the_old_store_and_nothing_else(tmp_path):
    """A value that cannot be written stops the save; what was there is still whole."""
    path = tmp_path / "a.zarr"
    store.save(dataset(1.0), path)
    with pytest.raises(Exception, match=r".+"):
        store.save(dataset(2.0).assign(bad=((), object())), path)
    xr.testing.assert_identical(store.load(path).load(), dataset(1.0))
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.zarr"]


def test_a_store_that_is_not_there(tmp_path):
    with pytest.raises(FileNotFoundError):
        store.load(tmp_path / "nowhere.zarr")


def test_a_failed_writer_leaves_the_old_file_and_nothing_else(tmp_path):
    """A table, a text and what any writer writes: an error half-way, and the old file is there."""
    path = tmp_path / "deep" / "a.csv"
    store.write_table(path, pd.DataFrame({"a": [1, 2]}))
    with pytest.raises(RuntimeError), store.whole(path) as scratch:
        scratch.write_text("half")
        assert scratch.suffix == ".csv"
        raise RuntimeError
    assert path.read_text() == "a\n1\n2\n"
    assert [entry.name for entry in path.parent.iterdir()] == ["a.csv"]


FULL = """
import resource, sys
from rippletwin import store
resource.setrlimit(resource.RLIMIT_FSIZE, (4096, resource.RLIM_INFINITY))
store.write_text(sys.argv[1], "x" * 100_000)
"""


@pytest.mark.skipif(not hasattr(resource, "RLIMIT_FSIZE"), reason="no limit of a file's size here")
def test_a_disk_without_room_loses_nothing(tmp_path):
    """A limit of a file's size stands in for a full disk: the write stops half-way with an error of
    the system. The old file is whole, and nothing else is left."""
    path = tmp_path / "verdict.json"
    store.write_text(path, "old")
    done = subprocess.run(
        [sys.executable, "-c", FULL, path], capture_output=True, text=True, check=False
    )
    assert done.returncode == 1 and "OSError: [Errno 27]" in done.stderr
    assert path.read_text() == "old" and [e.name for e in tmp_path.iterdir()] == ["verdict.json"]


FULL_TEXTS = """
import resource, sys
from rippletwin import store
resource.setrlimit(resource.RLIMIT_FSIZE, (4096, resource.RLIM_INFINITY))
store.write_texts(sys.argv[1], {"twin.json": "new", "verdict.json": "x" * 100_000})
"""


@pytest.mark.skipif(not hasattr(resource, "RLIMIT_FSIZE"), reason="no limit of a file's size here")
def test_files_that_belong_together_are_all_written_or_none(tmp_path):
    """The second of two files does not fit: the first keeps its old text too, so that no verdict
    stands beside the twin of another run."""
    old = {"twin.json": "old", "verdict.json": "old"}
    store.write_texts(tmp_path / "out", old)
    done = subprocess.run(
        [sys.executable, "-c", FULL_TEXTS, tmp_path / "out"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1 and "OSError: [Errno 27]" in done.stderr
    assert "verdict.json" in done.stderr
    assert {e.name: e.read_text() for e in (tmp_path / "out").iterdir()} == old


FULL_STORE = """
import resource, sys
import numpy as np, xarray as xr
from rippletwin import store
resource.setrlimit(resource.RLIMIT_FSIZE, (4096, resource.RLIM_INFINITY))
values = np.random.default_rng(0).normal(size=100_000)  # nothing to compress
try:
    store.save(xr.Dataset({"a": ("x", values)}), sys.argv[1])
except OSError as error:
    print(error.errno, error.filename)
"""


@pytest.mark.skipif(not hasattr(resource, "RLIMIT_FSIZE"), reason="no limit of a file's size here")
def test_a_store_without_room_loses_nothing(tmp_path):
    """The array does not fit: an error of the system names the store, the old one is whole, and
    nothing is beside it."""
    path = tmp_path / "a.zarr"
    store.save(dataset(1.0), path)
    done = subprocess.run(
        [sys.executable, "-c", FULL_STORE, path], capture_output=True, text=True, check=False
    )
    assert done.stdout == f"{errno.EFBIG} {path}\n", done.stderr
    xr.testing.assert_identical(store.load(path).load(), dataset(1.0))
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.zarr"]


def test_a_store_that_cannot_be_moved_into_place_loses_nothing(tmp_path, monkeypatch):
    """The disk has no room for the new name, when the old store has already been moved away: it is
    moved back."""
    path = tmp_path / "a.zarr"
    store.save(dataset(1.0), path)
    move = os.replace

    def full(source, target):
        if Path(source).name == "new":
            raise OSError(errno.ENOSPC, "No space left on device", str(source))
        move(source, target)

    with monkeypatch.context() as disk:
        disk.setattr(os, "replace", full)
        with pytest.raises(OSError, match="No space left") as caught:
            store.save(dataset(2.0), path)
    assert caught.value.filename == str(path)
    xr.testing.assert_identical(store.load(path).load(), dataset(1.0))
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.zarr"]


@pytest.mark.parametrize("code", [errno.ENOSPC, errno.EROFS])
def test_a_command_that_cannot_write_says_so_in_a_line(monkeypatch, capsys, code):
    """The file, the reason and the remedy; exit code 2 and no traceback."""

    def fail(argv):
        raise OSError(code, "why", "out/verdict.json")

    monkeypatch.setattr(program, "_run", fail)
    assert main([]) == 2
    said = capsys.readouterr().err
    assert said.startswith("rippletwin: out/verdict.json: not written: why. ")
    assert said.count("\n") == 1 and "run it again; what was finished is kept" in said


WRITERS = {"write_text", "write_bytes", "to_csv", "savefig", "savemat", "savez", "savetxt"}
WHOLE = ("store", "scratch")  # names through which a file is whole or absent
NOT_RESULTS = {
    "job.py",  # a job's log
}


def writes_directly(call: ast.Call) -> bool:
    """Whether a call opens a file to write, or writes one, under its final name."""
    text = ast.unparse(call)
    name = ast.unparse(call.func).split(".")[-1]
    modes = [*call.args, *(word.value for word in call.keywords if word.arg == "mode")]
    opens = name == "open" and any(
        isinstance(mode, ast.Constant) and str(mode.value)[:1] in ("w", "x", "a") for mode in modes
    )
    return (opens or name in WRITERS) and not any(word in text for word in WHOLE)


def test_every_result_is_written_whole_or_not_at_all():
    """No source file writes a result under its final name: all go through `store`. A kill between
    the first and the last byte would else leave a file that looks whole."""
    folders = ("src/rippletwin", "src/concealed", "src/diagnosis_trial", "workflow/scripts")
    files = [path for folder in folders for path in sorted((ROOT / folder).rglob("*.py"))]
    found = [
        f"{path.relative_to(ROOT)}:{call.lineno}"
        for path in files
        if path.name not in NOT_RESULTS
        for call in ast.walk(ast.parse(path.read_text()))
        if isinstance(call, ast.Call) and writes_directly(call)
    ]
    assert len(files) > 200 and not found, found
    assert writes_directly(ast.parse('open(path, "w")').body[0].value)
    assert writes_directly(ast.parse("path.write_text(text)").body[0].value)
