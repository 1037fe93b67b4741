"""A rig.yaml that is no sheet at all: each row of the table is refused in one clear line."""

import os
import tempfile
import tracemalloc
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
import yaml

from case_folders import refused, sheet, spoilt, write_case
from rippletwin.case.load import load_case
from rippletwin.errors import InputError, InputErrors

GOOD = yaml.safe_dump(sheet())


def nested_aliases(levels=12, width=10):
    """A sensor's name that aliases expand to `width ** levels` words."""
    text = f"x0: &x0 [{','.join(['word'] * width)}]\n"
    for level in range(1, levels):
        text += f"x{level}: &x{level} [{','.join([f'*x{level - 1}'] * width)}]\n"
    return text + f"sensors: [{{name: *x{levels - 1}, position: 0.1}}]\n"


TEXTS = {
    "empty": ("", "the whole file", ["the file is empty"]),
    "comments only": ("# nothing yet\n", "the whole file", ["the file is empty"]),
    "a list": ("- 1\n- 2\n", "the whole file", ["a list, not a mapping"]),
    "a word": ("rig", "the whole file", ["'rig', not a mapping"]),
    "a tab": ("fluid:\n\tdensity: 870\n", "line 2, column 1", ["a tab", "spaces"]),
    "a control character": ("fluid: \x07\n", "line 1", [r"'\x07'"]),
    "nested 3000 deep": ("a: " + "[" * 3000, "line 1, column 23", ["nested more than 20 deep"]),
    "aliases of aliases": (nested_aliases(), "line 5, column 10", ["more than 20000 values"]),
    "an alias to itself": ("a: &a [*a]", "line 1, column 8", ["contains itself"]),
    "too long": ("a: 1\n" + "# x\n" * 60000, "the whole file", ["240005 bytes", "200000"]),
    "a key twice": ("a: 1\na: 2\n", "line 2, column 1", ["'a' is given twice", "Keep one"]),
    "a list as key": ("? [1, 2]\n: 3\n", "line 1, column 3", ["stands as a key"]),
    "a Python object": ("a: !!python/object:os.system x", "line 1, column 4", ["not YAML"]),
    "no truth": ("a: !!bool maybe", "the whole file", ["not YAML", "maybe", "Correct the tag"]),
    "no character": ('a: "\\U00110000"', "the whole file", ["not YAML", "escaped character"]),
    "no number": ('a: "\\UFFFFFFFF"', "the whole file", ["not YAML", "escaped character"]),
    "UTF-16": (GOOD.encode("utf-16"), "the whole file", ["UTF-16, not UTF-8", "Save it"]),
    "Latin-1": (
        GOOD.replace("healthy_0.h5", "öl.h5").encode("latin-1"),
        "line 17",
        ["0xf6 is not UTF-8", "Latin-1", "Save it"],
    ),
    "two documents": (GOOD + "---\n" + GOOD, "line 26, column 1", ["not YAML"]),
}


@pytest.mark.parametrize("name", TEXTS)
def test_text_that_is_no_sheet(tmp_path, name):
    """Refused with the place and the remedy, and with little memory: aliases are not expanded."""
    text, field, words = TEXTS[name]
    raw = text if isinstance(text, bytes) else text.encode()
    (tmp_path / "rig.yaml").write_bytes(raw)
    tracemalloc.start()
    try:
        error = refused(tmp_path, "rig.yaml", field, *words)
        assert tracemalloc.get_traced_memory()[1] < 40e6
    finally:
        tracemalloc.stop()
    assert len(str(error)) < 1500 and "\n" not in str(error)


VALUES = {
    "a date as state": (("recordings", 0, "state"), "2020-13-45", ["'2020-13-45' is not known"]),
    "a capital letter": (("recordings", 0, "state"), "Healthy", ["Did you mean healthy?"]),
    "base 60": (("fluid", "density"), "1:30", ["'1:30'", "base 60"]),
    "decimal comma": (("line", "segments", 0, "length"), "5,95", ["decimal point: 5.95"]),
    "with unit": (("fluid", "density"), "870 kg/m3", ["the number alone, as 870"]),
    "not a number": (("fluid", "density"), ".nan", ["not a finite number"]),
    "infinite": (("line", "segments", 0, "length"), "1e400", ["not finite"]),
    "400 digits": (("fluid", "density"), "8" * 400, ["not finite"]),
    "5000 digits": (("pump", "pistons"), "9" * 5000, ["inf is not a whole number"]),
    "nothing": (("fluid", "density"), "", ["nothing is given"]),
    "hexadecimal": (("fluid", "density"), "0x366", ["'0x366' is not a number"]),
    "yes as a name": (("sensors", 0, "name"), "yes", ["quotes", "true or false"]),
    "a number as name": (("sensors", 0, "name"), "1", ['quotes: "1"']),
    "a name of a mapping": (("sensors", 0, "name"), "{a: 1}", ["a mapping is not text"]),
    "half a piston": (("pump", "pistons"), "9.5", ["9.5 is not a whole number"]),
    "a very long file name": (("recordings", 0, "file"), "x" * 5000, ["File name too long"]),
    "a NUL in a file name": (("recordings", 0, "file"), r'"a\0b"', [r"a\x00b cannot be opened"]),
    "a folder as file": (("recordings", 0, "file"), ".", [". is a folder"]),
    "a gas without Prandtl": (("fluid", "heat_capacity_ratio"), "1.4", ["needs prandtl"]),
}
FIELDS = {"a gas without Prandtl": "fluid.prandtl"}


@pytest.mark.parametrize("name", VALUES)
def test_value_that_no_key_may_have(tmp_path, name):
    """The field is named and the value is shown, shortened where it is long."""
    keys, text, words = VALUES[name]
    content = sheet()
    place = content
    for key in keys[:-1]:
        place = place[key]
    place[keys[-1]] = "PLACEHOLDER"
    field = "".join(f"[{k}]" if isinstance(k, int) else f".{k}" for k in keys).lstrip(".")
    write_case(tmp_path, sheet())
    (tmp_path / "rig.yaml").write_text(yaml.safe_dump(content).replace("PLACEHOLDER", text))
    error = refused(tmp_path, "rig.yaml", FIELDS.get(name, field), *words)
    assert len(str(error)) < 1500


@pytest.mark.parametrize(("text", "value"), [("9.0", 9), ("09", 9), ("+9", 9)])
def test_whole_numbers_are_taken_as_written(tmp_path, text, value):
    """Nine pistons are nine, also with a decimal point or a leading zero (octal in YAML 1.1)."""
    write_case(tmp_path, sheet())
    path = tmp_path / "rig.yaml"
    path.write_text(path.read_text().replace("pistons: 9", f"pistons: {text}"))
    pistons = load_case(tmp_path).rig.pump["pistons"]
    assert pistons == value and isinstance(pistons, int)


def test_all_errors_of_a_sheet_are_told_at_once(tmp_path):
    """Six mistakes of different kinds, six lines, each with its field."""

    def spoil(content):
        content["fluid"]["density"] = 0.87
        content["fluid"]["color"] = "red"
        content["line"]["segments"][1]["wave_speed"] = "fast"
        content["sensors"][1]["position"] = 12.0
        content["recordings"][0]["state"] = "worn"
        del content["recordings"][0]["speed_rpm"]

    spoilt(tmp_path, spoil)
    with pytest.raises(InputErrors) as caught:
        load_case(tmp_path)
    assert {error.field for error in caught.value.errors} == {
        "fluid.density",
        "fluid.color",
        "line.segments[1].wave_speed",
        "sensors[1].position",
        "recordings[0].state",
        "recordings[0].speed_rpm",
    }
    assert len(str(caught.value).splitlines()) == 6
    assert caught.value.file.endswith("rig.yaml") and caught.value.remedy


def test_all_missing_and_unknown_keys_are_told_at_once(tmp_path):
    """Two keys missing and two unknown in one mapping are four errors."""

    def spoil(content):
        content["line"]["segments"][0] = {"length": 5.95, "diametre": 0.02, "speed": 1000}

    spoilt(tmp_path, spoil)
    with pytest.raises(InputErrors) as caught:
        load_case(tmp_path)
    first = "line.segments[0]."
    told = [error.field.removeprefix(first) for error in caught.value.errors]
    assert sorted(told) == ["diameter", "diametre", "speed", "wave_speed"]


def test_the_sheet_may_be_named_instead_of_its_folder(tmp_path):
    """CASE/rig.yaml is the case in CASE."""
    write_case(tmp_path, sheet())
    assert load_case(tmp_path / "rig.yaml").folder == tmp_path
    with pytest.raises(InputError, match="the case is a file"):
        load_case(tmp_path / "healthy_0.h5")
    with pytest.raises(InputError, match="no such folder"):
        load_case(tmp_path / "nowhere")
    with pytest.raises(InputError, match="cannot be opened"):
        load_case(tmp_path / ("x" * 5000))


@contextmanager
def another_user():
    """Not root, to whom every file is open."""
    root = os.geteuid() == 0
    if root:
        os.seteuid(65534)
    try:
        yield
    finally:
        if root:
            os.seteuid(0)


@pytest.mark.parametrize(
    ("name", "field"),
    [("rig.yaml", "the whole file"), ("healthy_0.h5", "file"), ("flow.csv", "file")],
)
def test_file_that_may_not_be_read(name, field):
    """A file without permission is told as such, not as damaged."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        folder.chmod(0o755)
        angle = np.arange(360.0)
        flow = 5e-4 + 1e-5 * np.cos(np.radians(9 * angle))
        header = "angle_deg,flow_m3_s"
        table = np.column_stack([angle, flow])
        np.savetxt(folder / "flow.csv", table, delimiter=",", header=header, comments="")
        spoilt(folder, lambda c: c["recordings"][0].update(flow_ripple="flow.csv"))
        assert load_case(folder).recordings
        (folder / name).chmod(0)
        with another_user():
            refused(folder, name, field, "not allowed to read", "permissions")
