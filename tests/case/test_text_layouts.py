"""Text files as recorders and spreadsheets write them are read without a word about it."""

import numpy as np
import pytest

from case_folders import RATE, refused, sheet, write_case
from recorder_files import PRESSURE, TIME, read, same
from rippletwin.case.load import load_case


def rows(separator=",", decimal=".", end=""):
    table = zip(TIME, *PRESSURE)
    texts = (separator.join((f"{t:.9f}", f"{a:.1f}", f"{b:.1f}")) + end for t, a, b in table)
    return "\n".join(text.replace(".", decimal) for text in texts)


TEXTS = {
    "semicolons": "time_s;p1;p2\n" + rows(";"),
    "decimal commas": "time_s;p1;p2\n" + rows(";", ","),
    "tabs": "time_s\tp1\tp2\n" + rows("\t"),
    "tabs and decimal commas": "time_s\tp1\tp2\n" + rows("\t", ","),
    "spaces": "time_s p1 p2\n" + rows("  "),
    "spaces and decimal commas": " time_s   p1  p2\n" + rows(" ", ","),
    "vertical bars": "time_s|p1|p2\n" + rows("|"),
    "a separator at the end": "time_s;p1;p2;\n" + rows(";", ",", ";"),
    "an unnamed separator at the end": "time_s;p1;p2\n" + rows(";", ",", ";"),
    "a preamble": 'Recorder 7, pipe 3/4"\nStart: 9:30\n\nChannels: 3\ntime_s,p1,p2\n' + rows(),
    "a row of units": "time_s;p1;p2\ns;Pa;Pa\n" + rows(";", ","),
    "quotes": '"time_s","p1","p2"\n' + rows(),
    "spaces after commas": "time_s, p1, p2\n" + rows(", "),
    "Windows line ends": ("time_s;p1;p2\n" + rows(";", ",")).replace("\n", "\r\n"),
    "a byte order mark": "\ufefftime_s;p1;p2\n" + rows(";"),
}


@pytest.mark.parametrize("name", TEXTS)
def test_text_as_recorders_and_spreadsheets_write_it(tmp_path, name):
    """Separator, decimal sign and preamble are found out without a word in rig.yaml."""
    same(read(tmp_path, "r.csv", lambda path: path.write_bytes(TEXTS[name].encode())), 1e-6)


def test_text_with_names_and_unit_of_its_own(tmp_path):
    """`Time [s]`, `P1 [bar]` and a column number, in bar with decimal commas."""
    table = zip(TIME, *(PRESSURE / 1e5))
    text = "Time [s];P1 [bar];Outlet\n" + "\n".join(
        f"{t:.9f};{a:.7f};{b:.7f}".replace(".", ",") for t, a, b in table
    )
    entry = {"time": "Time [s]", "unit": "bar", "channels": {"p1": "P1 [bar]", "p2": 3}}
    same(read(tmp_path, "r.txt", lambda path: path.write_text(text), **entry), 1e-6)


def test_text_without_a_header(tmp_path):
    """Columns by number, the rate from rig.yaml."""
    entry = {"sampling_rate_hz": RATE, "channels": {"p1": 2, "p2": 3}}
    same(read(tmp_path, "r.csv", lambda path: path.write_text(rows(";", ",")), **entry), 1e-6)


def test_a_bad_cell_under_decimal_commas_is_named(tmp_path):
    """The cell as the file has it, with the file's own line behind two lines of preamble."""
    lines = rows(";", ",").splitlines()
    lines[4] = lines[4].rsplit(";", 1)[0] + ";over,load"
    content = sheet()
    content["recordings"][0].update(file="r.csv")
    write_case(tmp_path, content, pressure=None)
    (tmp_path / "r.csv").write_text("\n".join(["a", "b", "time_s;p1;p2", *lines]))
    refused(tmp_path, "r.csv", "p2", "'over,load' in data row 5 is not a finite number (line 8)")


def test_flow_ripple_with_semicolons_and_decimal_commas(tmp_path):
    """Tables of a case are read as recordings are."""
    angle = np.arange(360.0)
    flow = 5e-4 + 1e-5 * np.cos(np.radians(9 * angle))
    content = sheet()
    content["recordings"][0]["flow_ripple"] = "q.csv"
    write_case(tmp_path, content)
    text = "\n".join(f"{a:g};{q:.9f}".replace(".", ",") for a, q in zip(angle, flow))
    (tmp_path / "q.csv").write_text("angle_deg;flow_m3_s\n" + text)
    found = load_case(tmp_path).recordings[0].flow_ripple.flow
    np.testing.assert_allclose(found, flow, atol=1e-9)
