"""The page: whole, escaped, without requests, and with the numbers that the results have."""

import base64
import errno
import hashlib
import json
import re
import shlex
from html.parser import HTMLParser
from pathlib import Path

import h5py
import numpy as np
import pytest

from made_results import (
    AMPLITUDES,
    DIAGNOSIS,
    GEOMETRY,
    HOSTILE,
    ORDERS,
    write_results,
)
from rippletwin.case.load import load_case
from rippletwin.cli import main
from rippletwin.errors import InputError
from rippletwin.report.content import WorkflowPart, make_page
from rippletwin.report.page import render, report_case, write_report
from rippletwin.report.results import read_results
from rippletwin.report.tables import Cell, Table, effect_table
from rippletwin.report.verdict_words import remaining_sentences
from rippletwin.report.workflow_tables import answer_table, describe_dataset, timing_table
from rippletwin.twin import twin_file
from rippletwin.twin.twin import Twin

VOID = {"meta", "br", "img", "link", "input", "hr"}


class Parsed(HTMLParser):
    """Tags with their attributes, text outside scripts and styles, and tags that do not match."""

    def __init__(self, html: str):
        super().__init__(convert_charrefs=True)
        self.tags, self.text, self.open, self.wrong = [], [], [], []
        self.feed(html)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.wrong.append(tag)

    def handle_data(self, data):
        if self.open and self.open[-1] not in ("script", "style"):
            self.text.append(data)

    @property
    def words(self) -> str:
        return re.sub(r"\s+", " ", " ".join(self.text)).replace("\u00a0", " ")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_results(tmp_path_factory.mktemp("case"))


@pytest.fixture(scope="module")
def html(folder):
    return render(make_page(read_results(folder)))


@pytest.fixture(scope="module")
def parsed(html):
    return Parsed(html)


def test_every_element_is_closed_and_every_link_leads_somewhere(parsed):
    """A page that a browser has to repair looks different in the next one."""
    assert not parsed.wrong and not parsed.open
    ids = [attrs["id"] for _, attrs in parsed.tags if "id" in attrs]
    links = {attrs["href"] for tag, attrs in parsed.tags if tag == "a"}
    assert len(ids) == len(set(ids)) and links <= {f"#{each}" for each in ids}


def test_nothing_is_requested(html, parsed):
    """No address of another place, nothing loaded, and a policy that forbids it."""
    assert not re.search(r"\bhttps?://|//[a-z0-9.-]+\.[a-z]{2,}|url\(|@import", html)
    sources = [a[k] for _, a in parsed.tags for k in ("src", "srcset", "action") if k in a]
    assert not sources
    policy = next(a["content"] for t, a in parsed.tags if a.get("http-equiv"))
    assert (
        "default-src 'none'" in policy and "unsafe-inline'; script" not in policy.split("script")[1]
    )


def test_the_policy_allows_the_page_s_own_script_alone(html):
    """The digest in the policy is that of the script in the page, as a browser calculates it."""
    script = re.search(r"<script>(.*)</script>", html, re.S).group(1)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    assert f"script-src &#39;sha256-{digest}&#39;".replace("&#39;", "'") in html


def test_a_hostile_label_stays_text(parsed):
    """A recording's label that is markup is shown, and makes no element."""
    assert HOSTILE in parsed.words
    assert not [attrs for tag, attrs in parsed.tags if tag == "img" or "onerror" in attrs]


def test_the_page_says_what_the_results_say(parsed):
    """Against the made results, converted by hand."""
    for words in (
        "Missing physics found and named",
        "viscoelastic wall of segment 2 and gain error of sensor p1",
        "falls from 75 % to 2.2 %",
        "less than one in a million",
        "9.79 to 10.23",
        "3.1 % 2.8 to 3.4",
        "0.61 (0.44 to 0.85) mm²",
        "third piston",
        "worn slipper",
        "1000 r/min, 95 bar",
        "error: calibrated 50 %, corrected 2.0 %",
        "cnn1d_341_100: worn slipper, 90 % of windows and seeds",
    ):
        assert words in parsed.words, words


def test_parameters_stand_beside_the_data_sheet_in_units_of_a_person(parsed):
    """One tolerance below 1020 m/s of 5 %: 1020/exp(0.05), and 0.2 tolerances either way."""
    row = next(
        line for line in parsed.words.split("wave speed of ") if line.startswith("segment 1")
    )
    assert "1020 m/s" in row and "970 m/s" in row and "951 to 989" in row and "−4.9 %" in row
    assert "19.7 mm" in parsed.words


def test_a_chart_carries_the_ripple_of_its_amplitudes(parsed):
    """What the pointer shows is the sum of cosines at that angle."""
    charts = [json.loads(a["data-chart"]) for t, a in parsed.tags if "data-chart" in a]
    first = next(c for c in charts if c["xLabel"] == "shaft angle / degrees")
    measured = next(s for s in first["series"] if s["name"] == "measured")
    x = np.deg2rad(first["x"])
    by_hand = sum(w.real / 1e5 * np.cos(k * x) for k, w in zip(ORDERS, AMPLITUDES[0]))
    np.testing.assert_allclose(measured["y"], by_hand, rtol=0.002, atol=0.002)


def test_the_order_spectrum_is_that_of_the_recording(parsed):
    """The made recording has 1 bar at the first pumping order, and noise between."""
    charts = [json.loads(a["data-chart"]) for t, a in parsed.tags if "data-chart" in a]
    first = next(c for c in charts if c["yLabel"] == "amplitude / bar")
    pumping = next(s for s in first["series"] if s["name"] == "pumping orders")["y"]
    assert pumping[8] == pytest.approx(3e5 / 9**0.5 / 3 / 1e5, rel=0.02)
    assert pumping[0] is None and pumping[17] is not None


def test_the_line_is_to_scale(parsed):
    """Places of the sensors are in proportion to their distances, in both drawings."""
    heads = [a["d"] for t, a in parsed.tags if a.get("class") == "sensor-head"]
    pipes = [a for t, a in parsed.tags if a.get("class") == "pipe"]
    assert len(heads) == len(pipes) == 4
    for k in (0, 2):
        p1, p2 = (float(re.match(r"M([\d.]+)", head).group(1)) for head in heads[k : k + 2])
        pump, joint = (float(pipe["x"]) for pipe in pipes[k : k + 2])
        scale = (joint - pump) / 5.95
        assert (p1 - pump) / scale == pytest.approx(0.42, abs=0.02)
        assert (p2 - pump) / scale == pytest.approx(2.59, abs=0.02)


def test_a_generic_pump_is_a_warning(tmp_path, parsed):
    """Where rig.yaml gives only `pistons` the page warns; with geometry it does not."""
    assert "Warning. pump: only pistons is given" in parsed.words
    known = write_results(tmp_path, pump=GEOMETRY)
    words = Parsed(render(make_page(read_results(known)))).words
    assert "generic pump" not in words


def test_support_and_remainder_are_shown_where_the_verdict_has_them(tmp_path):
    """Newer verdicts say how well each effect is supported, and what is left."""
    effects = [
        {"name": "unsteady_friction", "element": "line", "support": "established"},
        {"name": "leak", "element": "position", "support": "suggested"},
    ]
    remainder = {
        "misfit": 0.03, "model_error": 0.01, "element": "between p1 and p2",
        "position_m": [1.0, 2.0], "bands_hz": [[900.0, 1500.0]], "conditions": [0],
        "law": "a leak or a resistance (flat and real)", "stand_in": None,
    }  # fmt: skip
    folder = write_results(tmp_path, effects=effects, remainder=remainder)
    page = make_page(read_results(folder))
    assert page.sentence.endswith("of the ripple between p1 and p2 (1.00 to 2.00 m from the pump).")
    words = Parsed(render(page)).words
    for said in (
        "what its data sheet does not say: unsteady friction. ",
        "Suggested only: leak.",
        "It behaves like a leak or a resistance (flat and real).",
        "What remains is 3.0 % of the ripple between p1 and p2 (1.00 to 2.00 m from the pump).",
        "It stands out at 900 to 1500 Hz.",
        "what remains, between p1 and p2, 1.00 to 2.00 m",
    ):
        assert said in words, said


@pytest.mark.parametrize(
    ("verdict", "changed", "said"),
    [
        ("consistent", {"effects": []}, "within the tolerances of the data sheet"),
        ("calibration_only", {"effects": []}, "outside the stated tolerances"),
        ("unexplained", {"effects": []}, "no effect of the library explains it"),
        ("bad_data", {"effects": [], "sentence": "p1 is inverted."}, "p1 is inverted."),
        (
            "ambiguous",
            {"equivalents": [["leak", "side_branch"]], "next_recording": "a third sensor"},
            "leak and side branch",
        ),
    ],
)
def test_every_verdict_is_one_plain_sentence(tmp_path, verdict, changed, said):
    """No verdict leaves the head of the page empty, or with an identifier."""
    page = make_page(read_results(write_results(tmp_path, verdict=verdict, **changed)))
    assert said in page.sentence and "_" not in page.headline + page.sentence
    assert page.following


def test_a_corrected_flow_ripple_is_told(tmp_path):
    """A small error that needs a corrected ripple of the pump is not claimed for the line alone."""
    folder = write_results(tmp_path)
    path = folder / "explained" / "verdict.json"
    verdict = json.loads(path.read_text())
    verdict["fit"]["nominal_ripple"] = {"held_out": 0.345}
    said = " ".join(remaining_sentences(verdict))
    assert "with the ripple of its data sheet the error is 34 %" in said
    verdict["fit"]["nominal_ripple"] = dict(verdict["fit"]["after"])
    assert "data sheet" not in " ".join(remaining_sentences(verdict))


def test_what_is_missing_is_said_with_the_command_that_makes_it(tmp_path):
    """A bare case has a page too; it says which command to run."""
    folder = write_results(tmp_path)
    for name in ("explained", "diagnosed"):
        (folder / name).rename(tmp_path / f"{name}_elsewhere")
    results = read_results(folder)
    words = Parsed(render(make_page(results))).words
    assert f"rippletwin explain {folder} --out {folder / 'explained'}" in words
    assert f"rippletwin diagnose {folder} --out {folder / 'diagnosed'}" in words
    elsewhere = read_results(
        folder, tmp_path / "explained_elsewhere", tmp_path / "diagnosed_elsewhere"
    )
    assert not elsewhere.missing and elsewhere.verdict and elsewhere.diagnosis


def test_the_commands_that_are_advised_work(tmp_path):
    """A folder with a brace and a space in its name, named by its rig.yaml: the command is quoted
    and writes beside the sheet. Of known faults alone diagnose takes those that are named."""
    folder = tmp_path / "rig {2} a"
    folder.mkdir()
    write_results(folder)
    for name in ("explained", "diagnosed"):
        (folder / name).rename(tmp_path / f"{name}_elsewhere")
    explain, diagnose = read_results(folder / "rig.yaml").missing
    command = ["rippletwin", "explain", str(folder), "--out", str(folder / "explained")]
    assert shlex.split(explain.partition(": ")[2]) == command
    assert "--recording" not in diagnose
    sheet = folder / "rig.yaml"
    sheet.write_text(sheet.read_text().replace("state: unknown", "state: slipper"))
    words = shlex.split(read_results(folder).missing[1].partition(": ")[2])
    assert words[words.index("--recording") + 1] == HOSTILE


def test_an_at_sign_in_a_name_is_no_effect(tmp_path):
    """The label hot@95bar is legal and part of the parameters' names: they are read and shown."""
    folder = write_results(tmp_path)
    path = folder / "explained" / "twin.json"
    sheet = folder / "rig.yaml"
    sheet.write_text(sheet.read_text().replace("name: p1", "name: p1@in"))
    for name in ("healthy_0.h5", "unknown.h5"):
        with h5py.File(folder / name, "a") as file:
            file["pressure"].attrs["sensors"] = ["p1@in", "p2"]
    path.write_text(json.dumps(twin_file.to_dict(Twin(load_case(folder).rig))))
    results = read_results(folder)
    assert len(results.twin.theta) == len(json.loads(path.read_text())["theta"])
    rows = make_page(results).parameters.rows
    assert any("p1@in" in row[0].text for row in rows)


def test_results_without_figures_have_a_page(tmp_path):
    """explain --no-figures writes no numbers behind figures: the page says so."""
    folder = write_results(tmp_path)
    for name in ("explained/figures/explain.json", "diagnosed/figures/diagnose.json"):
        (folder / name).unlink()
    page = make_page(read_results(folder))
    assert "without --no-figures" in " ".join(page.missing) and not page.ripples
    assert "what is missing: segment 2" in str(page.line_wide)


def test_a_folder_that_holds_no_verdict_is_bad_input(folder, tmp_path):
    """A typing error must not make an empty report."""
    with pytest.raises(InputError, match=r"holds no verdict\.json"):
        read_results(folder, explained=tmp_path)
    (tmp_path / "verdict.json").write_text("{")
    with pytest.raises(InputError, match="is no JSON"):
        read_results(folder, explained=tmp_path)


def test_a_dataset_is_named_in_words():
    """What its row of config/datasets.tsv says; a name without a row stays as it is."""
    row = {"signal": "pressure", "line": "twin", "twin": "corrected"}
    row |= {"randomised": "yes", "anchored": "no"}
    rig = row | {"line": "rig", "twin": "none", "randomised": "no"}
    datasets = {"CFD-MOC-PR": row, "experimental": rig}
    said = "pressure of the corrected twin, range of severities (CFD-MOC-PR)"
    assert describe_dataset("CFD-MOC-PR", datasets) == said
    assert describe_dataset("experimental", datasets) == "recordings of all states (experimental)"
    assert describe_dataset("mine", datasets) == "mine"


def test_a_dataset_of_the_pump_alone_names_no_twin_for_its_samples():
    """The twin of CFD-Q serves the flow of the recordings; networks learn from the lumped pump."""
    row = {"signal": "flow", "line": "pipe", "twin": "calibrated", "randomised": "no"}
    row |= {"anchored": "no"}
    datasets = {"CFD-Q": row, "CFD-P": row | {"signal": "pressure", "twin": "none"}}
    said = "flow of the pump alone, recordings through the line of the calibrated twin (CFD-Q)"
    assert describe_dataset("CFD-Q", datasets) == said
    assert describe_dataset("CFD-P", datasets) == "pressure of the pump alone, on a pipe (CFD-P)"


def test_what_networks_say_is_told_in_words():
    """Not in the identifiers of networks.json."""
    said = {"share": 0.9, "unlike": 0.1}
    answers = {"new": {"a": said | {"state": "slipper"}, "b": said | {"state": "unlike"}}}
    states = [row[2].text for row in answer_table(answers).rows]
    assert states == ["worn slipper", "unlike everything that was tried"]


def test_workflow_parts_are_shown(folder):
    """Accuracy beside the paper's, pictures, configuration."""
    row = [Cell("CNN", "CNN"), Cell("99.1 ± 0.2", 99.1)]
    part = WorkflowPart(
        tables=[Table("Accuracy", ["Network", "Accuracy"], [False, True], [row])],
        pictures=[("attention", "data:image/png;base64,AAAA")],
        configuration="seed: <0>",
    )
    parsed = Parsed(render(make_page(read_results(folder), part)))
    assert "99.1 ± 0.2" in parsed.words and "seed: <0>" in parsed.words
    assert [a["alt"] for t, a in parsed.tags if t == "img"] == ["attention"]


def test_the_command_writes_the_page(folder, tmp_path, capsys):
    """`rippletwin report CASE --out FILE` prints where the page is; a folder is no file."""
    out = tmp_path / "deep" / "report.html"
    assert main(["report", str(folder), "--out", str(out)]) == 0
    assert capsys.readouterr().out.strip() == str(out)
    assert out.read_text().startswith("<!doctype html>") and not list(out.parent.glob(".*"))
    assert main(["report", str(folder), "--out", str(tmp_path)]) == 2
    assert "is a folder" in capsys.readouterr().err


def test_the_command_tells_programs_what_is_missing(tmp_path, capsys):
    """--json names the page and what it lacks; --fail-on missing then ends with 3."""
    folder = write_results(tmp_path)
    command = ["report", str(folder), "--out", str(tmp_path / "report.html"), "--json"]
    assert main([*command, "--fail-on", "missing"]) == 0
    assert json.loads(capsys.readouterr().out)["missing"] == []
    (folder / "diagnosed" / "diagnosis.json").unlink()
    assert main([*command, "--fail-on", "missing"]) == 3
    (said,) = json.loads(capsys.readouterr().out)["missing"]
    assert "rippletwin diagnose" in said and main(command) == 0


def test_the_page_is_the_same_each_time(folder, tmp_path):
    """No time, no random order: a workflow that makes it again has nothing to do after it."""
    one, two = (write_report(read_results(folder), tmp_path / name) for name in ("1", "2"))
    assert one.read_bytes() == two.read_bytes()


def test_an_effect_of_a_user_s_file_needs_no_file(tmp_path):
    """The parameters of the line are shown though the twin has an effect that is not at hand."""
    folder = write_results(tmp_path)
    path = folder / "explained" / "twin.json"
    data = json.loads(path.read_text())
    count = len(data["theta"])
    data["effects"] = [{"name": "mine", "file": "mine.py", "place": {"element": "line"}}]
    data["values"]["mine@line.size"] = 3.0
    data["theta"].append(0.5)
    data["covariance"] = np.eye(count + 1).tolist()
    path.write_text(json.dumps(data))
    results = read_results(folder)
    assert len(results.twin.parameters) == count == len(results.covariance)
    assert make_page(results).parameters.rows


def widened(folder, scale):
    """Results of a case whose twin was fitted with `scale` times the sheet's tolerances."""
    write_results(folder)
    path = folder / "explained" / "twin.json"
    data = json.loads(path.read_text())
    data["rig"]["tolerance_scale"] = scale
    data["rig"]["uncertainty"] = {
        name: value if name == "sensor_gain" else scale * value
        for name, value in data["rig"]["uncertainty"].items()
    }
    path.write_text(json.dumps(data))
    return read_results(folder)


def test_tolerances_are_those_of_the_sheet_where_explain_widened_them(tmp_path):
    """One widened tolerance of the wave speed is three that rig.yaml states: the table and its band
    say three, and the note says what the * compares with."""
    page = make_page(widened(tmp_path, 3.0))
    row = next(r for r in page.parameters.rows if r[0].text == "wave speed of segment 1")
    assert row[-1] == Cell("−3.0", -3.0, -3.0)
    assert "3 times the sheet's tolerances" in page.tolerance
    assert "its widened tolerance" in Parsed(render(page)).words


def test_tolerances_that_nothing_widened_need_no_word(folder):
    """One tolerance is one, and the note speaks of no other."""
    page = make_page(read_results(folder))
    row = next(r for r in page.parameters.rows if r[0].text == "wave speed of segment 1")
    assert row[-1].pull == -1.0 and "widened" not in page.tolerance


def test_a_diagnosis_of_nothing_that_was_tried_is_no_fault(tmp_path):
    """A change that is like no fault counts as neither healthy nor faulty, on the tile and on its
    card; a fault beside it counts."""
    folder = write_results(tmp_path)
    path = folder / "diagnosed" / "diagnosis.json"
    where = {"orders": [9, 18], "element": "line"}
    unlike = DIAGNOSIS | {"state": "unlike", "severity": {}, "unlike": {"where": where}}
    path.write_text(json.dumps({"recordings": [unlike, DIAGNOSIS]}))
    page = make_page(read_results(folder))
    tile = next(t for t in page.tiles if t.name == "Diagnosed as faulty")
    assert tile.value == "1 of 2" and "unlike everything that was tried" in tile.note
    parsed = Parsed(render(page))
    cards = [a["class"] for tag, a in parsed.tags if tag == "article"]
    assert cards == ["card unlike", "card faulty"]
    changed = "Something else has changed in the line or at the load, most at shaft orders 9, 18"
    assert changed in parsed.words  # the line is that with its load, as the sentence has it


def test_effects_are_sorted_by_the_widths_of_their_intervals():
    """The column of intervals: the narrowest first, whatever the values are."""
    effects = [
        {
            "name": "leak",
            "parameters": {"area": {"value": value, "ci95": [low, high], "unit": "m2"}},
        }
        for value, low, high in ((5e-7, 1e-7, 9e-7), (9e-7, 8e-7, 1e-6))
    ]
    wide, narrow = (row[3] for row in effect_table(effects).rows)
    assert narrow.value < wide.value


def test_a_benchmark_that_is_being_written_counts_for_nothing(tmp_path):
    """A row without its last fields, as a job that has not ended leaves it."""
    (tmp_path / "explain.tsv").write_text("s\th:m:s\tmax_rss\n12.5\t0:00:12\t300\n")
    (tmp_path / "diagnose.tsv").write_text("s\th:m:s\tmax_rss\n12.3\n")
    rows = [[cell.text for cell in row] for row in timing_table(tmp_path).rows]
    assert rows == [["explain", "1", "12.5", "300"], ["diagnose", "1", "12.3", "0"]]


def test_the_verdict_is_that_of_the_folder_explained(tmp_path):
    """diagnose without a twin writes a verdict too: the report takes it where there is no other."""
    folder = write_results(tmp_path)
    other = (folder / "explained" / "verdict.json").read_text().replace("named", "unexplained")
    (folder / "diagnosed" / "verdict.json").write_text(other)
    assert read_results(folder).verdict["verdict"] == "named"
    (folder / "explained").rename(folder / "elsewhere")
    assert read_results(folder).verdict["verdict"] == "unexplained"


def still_pump(folder):
    """Results of a case whose unknown recording is noise about the mean pressure."""
    write_results(folder)
    with h5py.File(folder / "unknown.h5", "a") as file:
        shape = file["pressure"].shape
        file["pressure"][...] = 9.5e6 + np.random.default_rng(1).normal(scale=1e3, size=shape)
    return folder


def test_a_recording_of_a_pump_that_stands_still_has_no_chart(tmp_path, capsys):
    """No ripple repeats with the shaft: the page is written without that order spectrum, with the
    other one, and says why."""
    folder = still_pump(tmp_path)
    assert main(["report", str(folder), "--out", str(folder / "report.html")]) == 0
    said = "no ripple repeats with the shaft at 1000 r/min. Correct speed_rpm or pump.pistons"
    assert said in capsys.readouterr().err
    parsed = Parsed((folder / "report.html").read_text())
    charts = [json.loads(a["data-chart"]) for tag, a in parsed.tags if "data-chart" in a]
    assert sum(chart["yLabel"] == "amplitude / bar" for chart in charts) == 2
    assert f"There is no order spectrum of {HOSTILE}: {said}" in parsed.words


def test_only_results_are_called_foreign(folder, monkeypatch):
    """What fails on a recording is no fault of the results: it stays the error that it is."""

    def fail(*arguments):
        raise ValueError("of the recording")

    monkeypatch.setattr("rippletwin.report.charts.order_spectrum", fail)
    with pytest.raises(ValueError, match=r"^of the recording$"):
        report_case(folder, folder / "report.html")


@pytest.mark.parametrize("name", ["twin.json", "verdict.json"])
def test_results_that_no_command_wrote_are_refused(tmp_path, name):
    """A twin that fails as it is read, and a verdict that fails as it is shown."""
    folder = write_results(tmp_path, effects=[3] if name == "verdict.json" else [])
    if name == "twin.json":
        (folder / "explained" / name).write_text("{}")
    with pytest.raises(InputError, match="are not as the commands write them"):
        report_case(folder, folder / "report.html")


@pytest.mark.parametrize(
    "name",
    ["explained/verdict.json", "explained/figures/explain.json", "diagnosed/diagnosis.json"],
)
def test_a_result_that_may_not_be_read_is_told_as_such(folder, tmp_path, monkeypatch, capsys, name):
    """It is no page that could not be written: the file and the reason are named. A test that runs
    as root may read everything, so that the refusal of the operating system is made up."""
    read_text = Path.read_text

    def refuse(path, *arguments, **options):
        if path == folder / name:
            raise PermissionError(errno.EACCES, "Permission denied", str(path))
        return read_text(path, *arguments, **options)

    monkeypatch.setattr(Path, "read_text", refuse)
    assert main(["report", str(folder), "--out", str(tmp_path / "report.html")]) == 2
    said = capsys.readouterr().err
    assert f"{folder / name}: results: cannot be read (Permission denied)" in said
    assert "not written" not in said
