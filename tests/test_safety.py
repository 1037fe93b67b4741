"""What a case, a result or a configuration of somebody else's cannot do: run code.

Each file here would leave a mark if it were run.
"""

import ast
import json
import pickle
import re
import shlex
from pathlib import Path

import pytest
import torch

from case_folders import sheet, write_case
from made_results import write_results
from paths import ROOT
from rippletwin.case.load import load_case
from rippletwin.errors import InputError
from rippletwin.learning.kept_networks import load_networks
from rippletwin.twin.twin_file import load_twin
from workflow_copy import make, snakemake

PYTHON = sorted(
    path for folder in ("src", "workflow", "benchmarks") for path in (ROOT / folder).rglob("*.py")
)
FORBIDDEN = {
    "eval", "exec", "os.system", "os.popen", "pickle.load", "pickle.loads", "pd.read_pickle",
    "yaml.unsafe_load", "yaml.full_load", "joblib.load", "dill.load", "marshal.loads",
}  # fmt: skip


class Marks:
    """A pickle of it makes a file where it is loaded."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return Path.touch, (self.path,)


@pytest.fixture
def mark(tmp_path):
    return tmp_path / "mark"


def calls(path):
    """(name as written, keywords) of every call in a source file."""
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Call):
            yield ast.unparse(node.func), {k.arg: ast.unparse(k.value) for k in node.keywords}


def test_no_source_file_loads_or_runs_what_may_be_code():
    """No eval, no pickle, no shell; torch takes tensors only, numpy no objects, YAML safe types."""
    wrong = []
    for path in PYTHON:
        for name, given in calls(path):
            unsafe = name in FORBIDDEN or given.get("shell", "False") != "False"
            unsafe |= name == "torch.load" and given.get("weights_only") != "True"
            unsafe |= given.get("allow_pickle", "False") != "False"
            unsafe |= name == "yaml.load" and given.get("Loader") not in ("Loader", "_Loader")
            if unsafe:
                wrong.append(f"{path.relative_to(ROOT)}: {name}")
    assert len(PYTHON) > 300 and not wrong


def test_every_value_in_a_shell_command_is_quoted():
    """Only the number of threads, which is Snakemake's own, is not."""
    found = []
    for path in sorted((ROOT / "workflow" / "rules").glob("*.smk")):
        for command in re.findall(r"^ +shell:\n((?: +\".*\n)+)", path.read_text(), re.M):
            found += re.findall(r"\{([^}]+)\}", command)
    bare = [each for each in found if not each.endswith(":q") and each != "threads"]
    assert len(found) >= 30 and not bare


def test_a_configuration_cannot_add_a_command(tmp_path):
    """A results folder that is called like a command stays one word of the shell."""
    make(tmp_path / "workflow")
    results = "out; touch mark $(touch mark)"
    overlay = tmp_path / "workflow" / "overlay.yaml"
    overlay.write_text(json.dumps({"results": results, "case": "virtualrig", "seeds": 1}))
    done = snakemake(tmp_path / "workflow", "--dry-run", "--printshellcmds", "explain")
    (line,) = [s for s in done.stdout.splitlines() if "virtualrig record" in s]
    words = shlex.split(line)
    assert words[words.index("--out") + 1] == f"{results}/case"
    assert "touch" not in words


def test_a_twin_cannot_name_a_file_to_run(tmp_path, mark, monkeypatch):
    """A user's effect is run where the command line gives its file, not because twin.json does."""
    write_results(tmp_path)
    path = tmp_path / "explained" / "twin.json"
    twin = json.loads(path.read_text())
    code = tmp_path / "explained" / "own.py"
    code.write_text(f"import pathlib\npathlib.Path({str(mark)!r}).touch()\n")
    twin["effects"] = [{"name": "own", "place": {"element": "line"}, "file": str(code)}]
    path.write_text(json.dumps(twin))
    monkeypatch.chdir(code.parent)
    with pytest.raises(InputError, match="own"):
        load_twin(path)
    assert not mark.exists()


def test_a_case_cannot_name_a_file_to_run(tmp_path, mark):
    """rig.yaml has no key for code."""
    (tmp_path / "own.py").write_text(f"import pathlib\npathlib.Path({str(mark)!r}).touch()\n")
    write_case(tmp_path, sheet() | {"effects": ["own.py"], "faults": ["own.py"]})
    with pytest.raises(InputError, match="unknown key"):
        load_case(tmp_path)
    assert not mark.exists()


def test_networks_are_tensors_and_plain_data(tmp_path, mark):
    """A file that torch wrote with an object in it is refused, and the object is not made."""
    torch.save({"conformal": [], "architecture": Marks(mark)}, tmp_path / "n.pt")
    with pytest.raises(InputError, match="no kept networks"):
        load_networks(tmp_path / "n.pt")
    assert not mark.exists()


def test_a_store_of_objects_is_refused(tmp_path, mark):
    """A zarr array of Python objects, pickled, in the place of pressures."""
    content = sheet()
    content["recordings"][0]["file"] = "r.zarr"
    write_case(tmp_path, content, None)
    array = tmp_path / "r.zarr" / "pressure"
    array.mkdir(parents=True)
    (array.parent / ".zgroup").write_text('{"zarr_format": 2}')
    description = {
        "zarr_format": 2, "shape": [2], "chunks": [2], "dtype": "|O", "fill_value": None,
        "order": "C", "compressor": None, "filters": [{"id": "pickle"}],
    }  # fmt: skip
    (array / ".zarray").write_text(json.dumps(description))
    (array / "0").write_bytes(pickle.dumps([Marks(mark), Marks(mark)]))
    with pytest.raises(InputError):
        load_case(tmp_path)
    assert not mark.exists()
