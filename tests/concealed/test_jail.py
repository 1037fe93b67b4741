"""The confinement of the tool: what it can open and what it cannot."""

import ast
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest

from concealed.jail import landlock_version
from paths import ROOT

SOURCE = ROOT / "src"
HELPERS = ROOT / "tests" / "helpers"
pytestmark = pytest.mark.skipif(landlock_version() < 1, reason="this kernel has no Landlock")

READER = """
import os, subprocess, sys
case, out, seal, key, source = sys.argv[1:]
assert open(case + "/rig.yaml").read() == "sheet"
open(out + "/verdict.json", "w").write("verdict")
for secret in (seal, key, source + "/virtualrig/draw.py", source + "/virtualrig/sealed.yaml"):
    try:
        open(secret).read()
    except PermissionError:
        pass
    else:
        sys.exit(f"read {secret}")
    if subprocess.run(["cat", secret], capture_output=True).returncode == 0:
        sys.exit(f"a child read {secret}")
try:
    os.listdir(os.path.dirname(seal))
    sys.exit("listed the seals")
except PermissionError:
    pass
try:
    import virtualrig.draw
    sys.exit("imported the rig")
except (ImportError, PermissionError):
    pass
try:
    open(case + "/rig.yaml", "a")
    sys.exit("wrote into the case")
except PermissionError:
    pass
"""

DEVICES = """
import sys
for path in sys.argv[1:]:
    for mode in ("rb", "r+b"):
        try:
            with open(path, mode, buffering=0):
                print(path, mode)
        except OSError as error:
            assert isinstance(error, PermissionError), (path, error)
"""

TOOL = """
import os, subprocess
import numpy as np
import concealed.tool
from synthetic_observations import make
subprocess.run(["true"], check=True, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
open("/dev/urandom", "rb", buffering=0).read(8)
open(os.devnull, "w").write("nothing")
_, observations, twin = make(np.random.default_rng(1))
print(np.isfinite(twin.predict(observations)[0]).all())
"""


def run_confined(program, *arguments, read=(), write=(), **environment):
    """The finished process of a Python program that runs where the tool does."""
    paths = [word for path in read for word in ("--read", str(path))]
    paths += [word for path in write for word in ("--write", str(path))]
    command = [sys.executable, "-m", "concealed.jail", *paths, "--"]
    command += [sys.executable, "-c", program, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, env=os.environ | environment)


def test_what_runs_the_tool_does_not_import_the_rig():
    """No file of the package `concealed` imports `virtualrig`: only the workflow's scripts know
    both."""
    for file in (SOURCE / "concealed").glob("*.py"):
        nodes = list(ast.walk(ast.parse(file.read_text())))
        names = [
            alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names
        ]
        names += [node.module or "" for node in nodes if isinstance(node, ast.ImportFrom)]
        assert not any(name.split(".")[0] == "virtualrig" for name in names), file


def test_the_truth_cannot_be_read(tmp_path):
    """A program tries every way to the truth, itself and by a child: it reads its case and writes
    its verdict, and it can open neither seal nor key nor the rig's source. Without confinement the
    same program reads the seal."""
    for name in ("case", "out", "seals"):
        (tmp_path / name).mkdir()
    case, out, seal, key = (
        tmp_path / name for name in ("case", "out", "seals/0.json", "seals/0.key")
    )
    (case / "rig.yaml").write_text("sheet")
    seal.write_text("truth")
    key.write_text("key")
    inside = run_confined(READER, case, out, seal, key, SOURCE, read=[case], write=[out])
    assert inside.returncode == 0, inside.stderr
    assert (out / "verdict.json").read_text() == "verdict"
    command = [sys.executable, "-c", READER, *map(str, (case, out, seal, key, SOURCE))]
    outside = subprocess.run(command, capture_output=True, text=True)
    assert outside.returncode != 0 and f"read {seal}" in outside.stderr


def devices():
    """Device files that this user could open, without those whose opening has an effect."""
    names = ("kmsg", "mem", "zero", "full", "random", "kvm", "fuse", "loop0", "vda", "sda")
    return [path for name in names if os.access(path := f"/dev/{name}", os.R_OK)]


def test_other_devices_and_shared_memory_cannot_be_opened():
    """Of the device files neither one that is not needed nor shared memory can be opened, for
    reading or writing: a file in shared memory could carry the truth from one process to another.
    """
    shared = "/dev/shm" if os.path.isdir("/dev/shm") else None
    with tempfile.NamedTemporaryFile(dir=shared) as file:
        inside = run_confined(DEVICES, file.name, *devices())
    assert inside.returncode == 0, inside.stderr
    assert inside.stdout == ""


def test_the_tool_runs_inside(tmp_path):
    """The tool's modules can be imported, a child can be started with the null device, random
    numbers can be read, and a twin predicts; compiled code goes to the folder it may write."""
    program = f"import sys; sys.path.append({str(HELPERS)!r})\n{TOOL}"
    result = run_confined(
        program, read=[HELPERS], write=[tmp_path], NUMBA_CACHE_DIR=str(tmp_path), NUMBA_OPT="0",
        TMPDIR=str(tmp_path),
    )  # fmt: skip
    assert result.returncode == 0, result.stderr
    assert result.stdout.strip() == "True"
    assert any(tmp_path.iterdir())
    assert Path("/dev/null").is_char_device()  # it was written to, not replaced
