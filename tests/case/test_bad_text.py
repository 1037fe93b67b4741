"""Wrong CSV, text tables and TDMS: each is refused with the line, the column and what to change."""

import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter

from case_folders import RATE, refused, ripple, spoilt

GOOD = ["time_s,p1,p2", *(f"{k / RATE:.9f},{p1:.1f},{p2:.1f}" for k, (p1, p2) in
                          enumerate(ripple(0.3).T))]  # fmt: skip


def text(header=GOOD[0], rows=GOOD[1:], **replaced):
    """A CSV; `replaced` gives other lines by row, as row_5="..."."""
    rows = list(rows)
    for name, line in replaced.items():
        rows[int(name.removeprefix("row_")) - 1] = line
    return "\n".join([header, *rows]) + "\n"


LAST = len(GOOD) - 1
TEXTS = {
    "commas for both": (
        "\n".join(GOOD).replace(".", ","),
        "line 2",
        ["6 fields", "decimal commas"],
    ),
    "no header": ("\n".join(GOOD[1:]), "line 1", ["there is no header", "channels: {p1: 2}"]),
    "header only": (GOOD[0] + "\n", "file", ["no rows"]),
    "blank lines": ("\n\n\n", "line 1", ["empty", "p1,p2"]),
    "nothing": ("", "file", ["empty"]),
    "capital letters": (text("time_s,P1,p2"), "p1", ["Did you mean P1? Give channels: {p1: P1}"]),
    "a unit": (text("time_s,p1 [bar],p2"), "p1", ["channels: {p1: 'p1 [bar]'}", "unit: bar"]),
    "a column twice": (text("p1,p1,p2"), "p1", ["two columns"]),
    "the last row cut short": (
        text(**{f"row_{LAST}": "0.3,9.5e6"}),
        "p2",
        [f"data row {LAST}, the last one: it may be cut short"],
    ),
    "a row cut short": (text(row_7="0.0001,9.5e6"), "p2", ["no number", "data row 7 (line 8)"]),
    "the first row cut short": (text(row_1="0,9.5e6"), "p2", ["data row 1 (line 2)"]),
    "text in the first row": (text(row_1="0,x,9.5e6"), "p1", ["'x' in data row 1"]),
    "far down another encoding": (
        text().encode() + "0.4,1,2°\n".encode("latin-1"),
        "file",
        ["0xb0 far down is not UTF-8"],
    ),
    "a row too long": (text(row_7="0,1,2,3"), "line 8", ["4 fields under a header of 3"]),
    "a row too long far down": (
        text(row_999="0,1,2,3"),
        "file",
        ["line 1000 has 4 fields, not 3"],
    ),
    "time of 1e999": (text(row_5="1e999,9.5e6,9.5e6"), "time_s", ["inf in data row 5"]),
    "pressure of 1e999": (text(row_5="0,9.5e6,-1e999"), "p2", ["-inf in data row 5"]),
    "one row": (text(rows=GOOD[1:2]), "time_s", ["1 row(s) only"]),
    "time that stands": (text(rows=["0,9e6,9e6"] * 99), "time_s", ["not forward"]),
    "UTF-16": (text().encode("utf-16"), "file", ["UTF-16"]),
    "Latin-1": (text("time_s,p1,p2,°C").encode("latin-1"), "file", ["0xb0 in line 1"]),
    "NUL bytes": (text(row_9="\0" * 5000), "file", ["NUL bytes"]),
    "NUL bytes far down": (text(row_9999="0,1" + "\0" * 5000 + ",2"), "p1", ["data row 9999"]),
    "one endless line": ("x" * 10**6, "file", ["first line is longer"]),
}


@pytest.mark.parametrize("name", TEXTS)
def test_csv_that_is_no_recording(tmp_path, name):
    """The real row and column, the separator, the header: and no more than a line of it."""
    content, field, words = TEXTS[name]
    spoilt(tmp_path, lambda c: c["recordings"][0].update(file="r.csv"), pressure=None)
    raw = content if isinstance(content, bytes) else content.encode()
    (tmp_path / "r.csv").write_bytes(raw)
    error = refused(tmp_path, "r.csv", field, *words)
    assert len(str(error)) < 1500 and str(error).isprintable()


def test_every_missing_column_is_told(tmp_path):
    """Two sensors of another name are two errors."""
    from rippletwin.case.load import load_case
    from rippletwin.errors import InputErrors

    spoilt(tmp_path, lambda c: c["recordings"][0].update(file="r.csv"), pressure=None)
    (tmp_path / "r.csv").write_text(text("time_s,P1,P2"))
    with pytest.raises(InputErrors) as caught:
        load_case(tmp_path)
    assert [error.field for error in caught.value.errors] == ["p1", "p2"]


ANGLE = np.arange(360.0)
FLOW = 5e-4 + 1e-5 * np.cos(np.radians(9 * ANGLE))


def table(flow, header="angle_deg,flow_m3_s", separator=","):
    rows = [f"{angle}{separator}{value}" for angle, value in zip(ANGLE, flow)]
    return "\n".join([header, *rows])


FLOWS = {
    "a ripple of zeros": (table(0 * FLOW), "flow_m3_s", ["without any ripple"]),
    "no ripple": (table(0 * FLOW + 5e-4), "flow_m3_s", ["without any ripple"]),
    "flow towards the pump": (table(-FLOW), "flow_m3_s", ["negative", "change the sign"]),
    "ripple without a mean": (table(FLOW - 5e-4), "flow_m3_s", ["mean flow is zero"]),
    "a mean of rounding": (table(FLOW - 5e-4 - 3e-12), "flow_m3_s", ["mean flow is zero"]),
    "kg/s": (table(900 * FLOW), "flow_m3_s", ["1.48e+03 m/s in the narrowest", "by the density"]),
    "other letters": (table(FLOW, "Angle_deg,flow_m3_s"), "angle_deg", ["Did you mean Angle_deg"]),
    "header only": ("angle_deg,flow_m3_s\n", "file", ["no rows"]),
    "nothing": ("", "file", ["empty"]),
}


@pytest.mark.parametrize("name", FLOWS)
def test_flow_ripple_that_is_none(tmp_path, name):
    """A source that cannot be one is refused, with its sign, its mean or its separator."""
    content, field, words = FLOWS[name]
    spoilt(tmp_path, lambda c: c["recordings"][0].update(flow_ripple="q.csv"))
    (tmp_path / "q.csv").write_text(content)
    refused(tmp_path, "q.csv", field, *words)


PROPERTIES = {"wf_increment": 1 / RATE}


def channel(name, values=None, group="rig", **properties):
    values = ripple(0.3)[0] if values is None else values
    return ChannelObject(group, name, values, PROPERTIES | properties)


CHANNELS = {
    "other letters": ([channel("P1"), channel("p2")], "p1", ["Did you mean P1?"]),
    "a channel in two groups": (
        [channel("p1"), channel("p1", group="old"), channel("p2")],
        "p1",
        ["groups old, rig"],
    ),
    "words": ([channel("p1"), channel("p2", ["a", "b"])], "p2", ["not all numbers"]),
    "other rates": (
        [channel("p1"), channel("p2", wf_increment=1e-3)],
        "wf_increment",
        ["differs between sensors"],
    ),
    "a negative step": (
        [channel(name, wf_increment=-1e-3) for name in ("p1", "p2")],
        "wf_increment",
        ["-0.001 s"],
    ),
}


@pytest.mark.parametrize("name", CHANNELS)
def test_tdms_channel_that_is_wrong(tmp_path, name):
    """The channel or its property is named."""
    channels, field, words = CHANNELS[name]
    spoilt(tmp_path, lambda c: c["recordings"][0].update(file="r.tdms"), pressure=None)
    with TdmsWriter(tmp_path / "r.tdms") as writer:
        writer.write_segment(channels)
    refused(tmp_path, "r.tdms", field, *words)


@pytest.mark.parametrize("raw", [b"\0" * 4096, b"TDSm" + b"\xff" * 4096, b"time_s,p1\n0,1\n"])
def test_file_that_is_no_tdms(tmp_path, raw):
    """Garbage is told as such, not as a file that has nothing."""
    spoilt(tmp_path, lambda c: c["recordings"][0].update(file="r.tdms"), pressure=None)
    (tmp_path / "r.tdms").write_bytes(raw)
    refused(tmp_path, "r.tdms", "file", "cannot be read", "TDMS")
