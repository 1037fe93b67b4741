"""The machinery of `make bench` works on tiny sizes; no time is tested."""

from __future__ import annotations

import ast
import json
import os
import re

import numpy as np
import pytest

from paths import ROOT
from speed import (
    calibration,
    explaining,
    growth,
    images,
    line_frequency_domain,
    line_time_domain,
    machine,
    run_trainings,
    starting,
    training,
    workflow,
)
from speed.page import advantage, known_versions, write
from speed.result import Chart, Claim, Result, Table
from speed.timing import alternate, median_ratio

PEERS_ALONE = {"rthym_moc", "ptsnet", "tsnet", "openwind"}
"""Import names of the programs that only benchmarks and tests may import."""


def record(result: Result) -> dict:
    """What a benchmark's process writes."""
    return {
        "name": "made",
        "machine": machine.describe(),
        "peers": {"other": "1.2"},
        "result": json.loads(json.dumps(result.to_json())),
    }


def test_tasks_are_measured_in_turns_and_long_enough():
    """With a clock that each task advances by its own time: the times are those, in turns, and a
    short task is repeated within a measurement."""
    now, order = [0.0], []

    def task(name, seconds):
        def run():
            now[0] += seconds
            order.append(name)

        return run

    tasks = {"short": task("short", 0.005), "long": task("long", 0.5)}
    times = alternate(tasks, 3, clock=lambda: now[0])
    assert times["short"] == pytest.approx(np.full(3, 0.005))
    assert times["long"] == pytest.approx(np.full(3, 0.5))
    assert median_ratio(times["long"], times["short"]) == pytest.approx(100.0)
    a_round = ["short"] * (order[4:].index("long")) + ["long"]
    assert len(a_round) == 5 and order[4:] == a_round * 3


def test_a_slow_moment_of_the_machine_does_not_move_the_ratio():
    """All tasks of one round take ten times as long: the median of ratios within rounds stays."""
    busy = np.array([1.0, 1.0, 10.0, 1.0, 1.0])
    assert median_ratio(6.0 * busy, 2.0 * busy) == pytest.approx(3.0)


@pytest.mark.parametrize(
    ("claim", "met"),
    [
        (Claim("a", 2.0, 1.5), True),
        (Claim("a", 1.0, 1.5), False),
        (Claim("a", 0.2, 0.5, "s", at_least=False), True),
        (Claim("a", 0.9, 0.5, "s", at_least=False), False),
        (Claim("a", None, 0.5), None),
        (Claim("a", 1.0, None), None),
    ],
)
def test_a_claim_knows_whether_it_is_met(claim, met):
    """Either way round, and undecided without a number or a target."""
    assert claim.met is met
    if met is not None:
        assert (advantage(claim) >= 1) is met


def test_the_page_says_plainly_what_is_missed(tmp_path):
    """A page made of records has a row for each claim with a target, with what is missed and what
    was not measured, the peers' versions and the instructions that the processor has not."""
    claims = [
        Claim("fast thing", 3.0, 2.0),
        Claim("slow thing", 0.7, 0.5, "s", at_least=False),
        Claim("other thing", None, 5.0),
    ]
    table = Table("Times", ["who", "time"], [["we", "1 s"]])
    result = Result(1, "Made", ["Something is compared."], claims, [table], ["It is bound."])
    page, picture = tmp_path / "page.md", tmp_path / "figures" / "benchmarks.svg"
    write([record(result)], page, picture)
    text = page.read_text()
    assert "1 of 3 targets are missed" in text
    assert re.search(r"\| fast thing \| at least 2 times \| 3 times \| yes", text)
    assert re.search(r"\| slow thing \| at most 0.5 s \| 0.7 s \| \*\*no\*\*", text)
    assert re.search(r"\| other thing \| .* \| not measured \| not measured", text)
    assert "other 1.2" in text and "The bound: It is bound." in text and "| we | 1 s |" in text
    lacking = [name for name, there in machine.describe()["instructions"].items() if not there]
    assert all(name in text for name in lacking)
    assert "<svg" in picture.read_text()
    assert Result.from_json(record(result)["result"]) == result


def made_run(folder, jobs):
    """A results folder of jobs "RULE/JOB" or "RULE": the wall seconds that each took, and when it
    ended."""
    for job, (wall, ended) in jobs.items():
        path = folder / "benchmarks" / f"{job}.tsv"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"s\tmax_rss\tcpu_time\n{wall}\t100\t-\n")
        os.utime(path, (ended, ended))
    return folder


def test_time_of_a_run_by_hand(tmp_path, monkeypatch):
    """Imports take 1 s. Two trainings of 2 and 10 s and a recording of 12 s, which runs no script;
    the last ends 30 s after the recording began: half a minute, half of the shorter training is
    imports, 2 of 12 s in all. A job of 0.5 s is nothing but imports. Chart and table have the same
    numbers. In a copy, all of whose files are of one moment, two cores take 12 s at least."""
    monkeypatch.setattr(workflow, "script_seconds", lambda path: 1.0)
    monkeypatch.delenv(workflow.DEFAULT_RUN, raising=False)
    jobs = {"train/a": (2.0, 114), "train/b": (10.0, 130), "record": (12.0, 112)}
    monkeypatch.setenv(workflow.SMOKE_RUN, str(made_run(tmp_path / "first", jobs)))
    result = workflow.run()
    default, smoke, largest, whole = result.claims
    assert default.result is None and len(result.notes) == 1
    assert smoke.result == pytest.approx(0.5) and smoke.target == 3.0 and smoke.met
    assert (largest.result, largest.met) == (50.0, False) and "1 of 2 jobs" in largest.note
    assert whole.result == pytest.approx(100 * 2 / 12)
    (chart,) = result.charts
    assert sorted(zip(chart.labels, chart.values, chart.parts)) == [
        ("record", 12.0, 0.0),
        ("train", 12.0, 2.0),
    ]
    (table,) = result.tables
    assert {row[0]: row[-2:] for row in table.rows} == {
        "train": ["2.0", "50 %"],
        "record": ["–"] * 2,
    }
    monkeypatch.setenv(workflow.SMOKE_RUN, str(made_run(tmp_path / "short", {"claims": (0.5, 9)})))
    assert workflow.run().claims[2].result == 100.0
    copied = made_run(tmp_path / "copy", {job: (wall, 200) for job, (wall, _) in jobs.items()})
    assert workflow.minutes_of(workflow.jobs_of(copied)) == pytest.approx(0.2)


def test_an_interruption_is_not_in_the_length_of_a_run(tmp_path):
    """A job from 100 to 160 s holds another of 20 s; the next begins 40 s after it, which Snakemake
    took, and lasts to 230 s. An hour later the last job takes 50 s: 180 s in all."""
    jobs = {"train/a": (60, 160), "b": (20, 140), "c": (30, 230), "d": (50, 230 + 3650)}
    taken = workflow.minutes_of(workflow.jobs_of(made_run(tmp_path, jobs)))
    assert taken == pytest.approx((60 + 40 + 30 + 50) / 60)


def test_costs_and_operations_of_trainings_by_hand(tmp_path):
    """CNN1D 341@100, two channels. The first kernel has 59 places on a window (the paper's table),
    30 after pooling, with 64 maps: 2 x 59 x 64 x 2 x 341 operations, and 2 x 30 x 64 x 64 x 3 in
    the second layer. A step needs twice those of the first layer and three times those of the
    second; a fifth of the samples is predicted. Two seeds have three epochs of 400 samples, of the
    randomised dataset one of 1600. Recordings count in the seconds alone."""
    made_run(
        tmp_path, {f"train/{d}/cnn1d_341_100": (10.0, 9) for d in ("CFD-MOC-P", "experimental")}
    )
    made_run(tmp_path, {"train/CFD-MOC-PR/cnn1d_341_100": (25.0, 9)})
    for dataset, epochs in {"CFD-MOC-P": (1, 2), "CFD-MOC-PR": (1,), "experimental": (5,)}.items():
        path = tmp_path / "models" / dataset / "cnn1d_341_100.json"
        path.parent.mkdir(parents=True)
        path.write_text(json.dumps([{"validation_loss": [1.0] * n} for n in epochs]))
    seconds = run_trainings.training_seconds(tmp_path)
    table = run_trainings.training_table("made", seconds)
    assert table.rows[-1] == ["all", "10", "25", "10", "45"]
    first, second = 2 * 59 * 64 * 2 * 341, 2 * 30 * 64 * 64 * 3
    sample = 0.8 * (2 * first + 3 * second) + 0.2 * (first + second)
    found = run_trainings.operations_of_run(tmp_path)
    assert found == pytest.approx((3 * 400 + 1600) * sample)


@pytest.mark.parametrize(("has", "minutes"), [(False, 100.0), (True, 60.0)])
def test_target_of_the_default_run_is_that_of_the_processor(has, minutes, monkeypatch):
    """With either instruction for bfloat16 products an hour, without both 100 minutes."""
    there = {"instructions": {"avx512_bf16": False, "amx_bf16": has, "avx2": True}}
    monkeypatch.setattr(workflow, "describe", lambda: there)
    assert workflow.default_minutes() == minutes


def test_every_rule_with_a_benchmark_file_and_a_script_is_found():
    """A rule with its script's name, one made from another rule, and one that runs a program."""
    assert workflow.script_of("train").name == "train.py"
    assert workflow.script_of("synchrosqueeze_seeds").name == "synchrosqueeze.py"
    assert workflow.script_of("record") is None


def test_charts_are_drawn_and_shown(tmp_path):
    """The page names the file, which has both rules' names; a record without charts is read."""
    chart = Chart("made.svg", "Where?", ["slow", "fast"], [3.0, 1.0], [1.0, 0.5], "seconds")
    result = Result(1, "Made", ["It is timed."], [Claim("a", 1.0, 1.0)], charts=[chart])
    (tmp_path / "figures").mkdir()
    write([record(result)], tmp_path / "page.md", tmp_path / "figures" / "benchmarks.svg")
    assert "![Where?](figures/made.svg)" in (tmp_path / "page.md").read_text()
    assert (tmp_path / "figures" / "made.svg").stat().st_size > 1000
    assert Result.from_json(record(result)["result"]) == result
    old = {k: v for k, v in result.to_json().items() if k != "charts"}
    assert Result.from_json(old).charts == []


@pytest.mark.parametrize("turned", [False, True])
def test_a_version_that_one_record_knows_is_kept(turned):
    """In either order: a program of another Python is measured by one benchmark alone."""
    records = [{"machine": {"versions": {"a": "1"}}, "peers": {"b": peer}} for peer in ("2", None)]
    assert known_versions(records[:: -1 if turned else 1]) == {"a": "1", "b": "2"}


def test_the_page_of_the_docs_is_that_of_the_results(tmp_path):
    """docs/benchmarks.md is what the kept results give; else run `python benchmarks/bench.py
    --page-only`."""
    kept = sorted((ROOT / "benchmarks" / "results").glob("*.json"))
    assert kept
    write([json.loads(path.read_text()) for path in kept], tmp_path / "p.md", tmp_path / "p.svg")
    assert (tmp_path / "p.md").read_text() == (ROOT / "docs" / "benchmarks.md").read_text()


def test_the_peers_are_no_requirement_of_the_tool():
    """Nothing of src/ imports a program that is measured beside the tool (openwind is under the
    GPL), environment.txt has none of them, and each is pinned for `make bench`."""
    for path in (ROOT / "src").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            names += [n.name for n in node.names] if isinstance(node, ast.Import) else []
            assert not PEERS_ALONE & {name.split(".")[0] for name in names}, path

    def pins(name):
        lines = (ROOT / name).read_text().lower().splitlines()
        return {line.split("==")[0] for line in lines if "==" in line}

    own = pins("environment.txt")
    bench = pins("environment-bench.txt") | pins("environment-bench-numpy1.txt")
    alone = {name.replace("_", "-") for name in PEERS_ALONE}
    assert not alone & own and alone <= bench
    assert set(machine.PEERS) <= own | bench


def test_rises_are_compared_away_from_the_fronts():
    """Two square waves one step apart differ nowhere; one of another height does."""
    cells, count = 50, 400
    wave = np.where(np.arange(count) // (2 * cells) % 2 == 0, 1.0, -1.0)
    late = np.roll(wave, 1)
    assert line_time_domain.difference(wave, late, cells) == 0.0
    assert line_time_domain.difference(wave, 1.1 * wave, cells) == pytest.approx(0.1)


def test_operations_of_a_network_are_those_counted_by_hand():
    """CNN2D (3x3@1) on 8 pixels: 64 maps of 2 x 9 taps at 64 places, then 64 x 9 taps at 16; the
    first layer has no gradient of its input."""
    from rippletwin.learning.networks import build

    torch = pytest.importorskip("torch")
    first, second = 2 * 64 * 18 * 64, 2 * 64 * 576 * 16
    step, forward = training.operations(build("cnn2d_3_1", 2), torch.zeros(1, 2, 8, 8))
    assert forward == first + second
    assert step == 2 * first + 3 * second


def test_plain_networks_are_the_same_networks():
    """As many parameters as the tool's, in one and two dimensions, with residual blocks."""
    from rippletwin.learning.architectures import ARCHITECTURES
    from rippletwin.learning.networks import build
    from speed.training_loops import plain_network

    for name in ("cnn1d_341_100", "cnn2d_7_2", "resnet18_1d", "resnet18_2d"):
        plain, own = plain_network(ARCHITECTURES[name], 2), build(name, 2)
        assert sum(p.numel() for p in plain.parameters()) == sum(
            p.numel() for p in own.parameters()
        )


@pytest.mark.parametrize("benchmark", [line_time_domain, growth, workflow])
def test_a_benchmark_runs_on_tiny_sizes(benchmark, monkeypatch):
    """Its result has claims and texts, and can be written as JSON."""
    monkeypatch.delenv(line_time_domain.NETWORK_PYTHON, raising=False)
    monkeypatch.delenv(workflow.DEFAULT_RUN, raising=False)
    monkeypatch.delenv(workflow.SMOKE_RUN, raising=False)
    result = benchmark.run(quick=True)
    assert result.claims and result.what
    assert Result.from_json(json.loads(json.dumps(result.to_json()))) == result


@pytest.mark.long
@pytest.mark.parametrize(
    "benchmark",
    [line_frequency_domain, calibration, explaining, images, training, starting],
)
def test_a_longer_benchmark_runs_on_tiny_sizes(benchmark, monkeypatch):
    """The same for those that take half a minute; training and starting in their processes."""
    paths = [str(ROOT / "benchmarks"), str(ROOT / "src")]
    monkeypatch.setenv("PYTHONPATH", ":".join(paths))
    result = benchmark.run(quick=True)
    assert result.claims and result.what
    assert Result.from_json(json.loads(json.dumps(result.to_json()))) == result


def test_rates_of_the_machine_are_numbers():
    """Copying and multiplying give positive, finite rates."""
    for rate in (machine.copy_rate(2**14, rounds=1), machine.product_rate(rounds=1)):
        assert 0 < rate < np.inf
