"""The sealed benchmark: what is drawn, what the tool can read, what counts as right."""

import ast
import json
import os
import subprocess
import sys
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest

from concealed.commitments import digests
from concealed.jail import landlock_version
from concealed.oracle import worth_in
from concealed.score import score
from concealed.summary import Rate, failed, rate, scores
from concealed.tool import NOTHING, crash
from paths import ROOT
from rippletwin.explanation.thresholds import ACCEPT
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from synthetic_observations import make
from virtualrig.conceal import compared
from virtualrig.draw import MIX, UNCERTAINTY, draw, generator, kinds
from virtualrig.draw_effects import Bare, load_dynamics
from virtualrig.pump import Pump
from virtualrig.rig import build

SOURCE = ROOT / "src"
confined = pytest.mark.skipif(landlock_version() < 1, reason="this kernel has no Landlock")


# ---- drawing --------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [60, 400])
def test_mix_is_the_stated_one(count):
    """Counts of each kind are the stated shares of the number of cases, exactly where they can."""
    counts = Counter(kind for kind, _ in kinds(count, "a", 1))
    assert counts == {kind: round(share * count) for kind, share in MIX.items()}


def test_cases_follow_from_commit_and_number_and_from_nothing_else():
    """The same twice; another commit or number gives other cases and another order."""
    first, again = draw(60, "a", 1, 5), draw(60, "a", 1, 5)
    assert first.sheet == again.sheet and first.truth == again.truth
    assert draw(60, "b", 1, 5).sheet != first.sheet != draw(60, "a", 2, 5).sheet
    assert kinds(60, "a", 1) != kinds(60, "b", 1)
    streams = [generator("a", 1, "case", k).uniform() for k in range(50)]
    assert len(set(streams)) == 50


@pytest.fixture(scope="module")
def drawn():
    return [draw(60, "a", 1, k) for k in range(60)]


def test_drawn_rigs_are_what_is_promised(drawn):
    """Two to four segments, two or three sensors, one to three points, noise of 0.5 to 4 kPa, and
    every rig can be built."""
    assert {len(d.sheet["line"]["segments"]) for d in drawn} == {2, 3, 4}
    assert {len(d.sheet["sensors"]) for d in drawn} == {2, 3}
    assert {len(d.points) for d in drawn} == {1, 2, 3}
    assert all(500 <= d.seal["noise"] <= 4000 for d in drawn)
    for d in drawn:
        rig = build(d.sheet, d.seal)
        assert len(rig.sensing) == len(d.sheet["sensors"])


def test_nominal_values_are_off_by_their_stated_uncertainty(drawn):
    """Over all cases wave speeds deviate by one standard deviation, in `off` cases by two to
    three."""
    pulls = {True: [], False: []}
    for d in drawn:
        pairs = zip(d.sheet["line"]["segments"], d.seal["line"]["segments"], strict=True)
        for sheet, true in pairs:
            pull = np.log(true["wave_speed"] / sheet["wave_speed"]) / UNCERTAINTY["wave_speed"]
            pulls[d.truth["kind"] == "off"].append(pull)
    assert np.std(pulls[False]) == pytest.approx(0.95, abs=0.2)
    assert (np.abs(pulls[True]) >= 2).all() and (np.abs(pulls[True]) <= 3).all()


def test_drawn_valves_feed_the_line_at_no_frequency():
    """The real part of flow over pressure is positive at all frequencies, by evaluation, also of
    the strongest; an active valve may chatter instead of settling into a ripple."""
    ratio = np.linspace(0.01, 10.0, 5000)  # of the valve's own frequency
    for k in range(300):
        valve = load_dynamics(Bare(np.random.default_rng(k), [], 2, 870.0, 1.5e9, 1e-3, 1e7), 1.0)
        gain, damping = valve.arguments["gain"], valve.arguments["damping"]
        assert np.min((0.5 + gain / (1 - ratio**2 + 2j * damping * ratio)).real) > 0.0


def test_flow_ripple_is_wrong_by_what_was_drawn():
    """The true pump's ripple, by this test's own spectrum and search for the angle, differs from
    the nominal one by the stated 1 to 4 %."""
    from virtualrig.source import constant_pressure_flow

    d = draw(60, "a", 1, 3)
    point, density = d.points[0], d.sheet["fluid"]["density"]
    pump = Pump(**d.sheet["pump"])
    true = pump.changed(d.seal["pump"]["relative"], d.seal["pump"]["timing_deg"])
    flows = [
        constant_pressure_flow(p, density, point.speed_rpm, point.load_pressure)
        for p in (true, pump)
    ]
    top = int(4000 / (point.speed_rpm / 60))
    order = np.arange(pump.pistons, top + 1, pump.pistons)
    a, b = (np.fft.fft(flow)[order] for flow in flows)
    angles = np.radians(np.linspace(-2, 2, 4001))
    misfits = [np.linalg.norm(a - b * np.exp(-1j * order * x)) for x in angles]
    assert 0.01 <= d.truth["source_error"] <= 0.04
    assert min(misfits) / np.linalg.norm(b) == pytest.approx(d.truth["source_error"], rel=0.1)


@pytest.mark.long
def test_floor_is_what_the_wrong_pump_leaves(drawn):
    """A true pump that is the sheet's leaves nothing, exactly; the one drawn leaves an error of the
    size of its flow's, which a line's resonances turn into a few times more or less."""
    d = next(d for d in drawn if d.truth["kind"] == "none" and len(d.points) == 1)
    right = replace(d, seal=d.seal | {"pump": {}})
    exact = compared(right)
    assert exact == {"change": 0.0, "floor": 0.0}
    wrong = compared(d)
    assert d.truth["source_error"] / 5 < wrong["floor"] < 5 * d.truth["source_error"]


def test_flow_into_a_constant_pressure_is_displacement_less_losses():
    """Mean flow against the swept volume less leakage and compression, worked out by hand."""
    from virtualrig.source import constant_pressure_flow

    pump = Pump(dead_volume=2e-6, case_leakage=3e-13)
    flow = constant_pressure_flow(pump, 870.0, 1000.0, 9.5e6)
    swept = pump.displacement * 1000 / 60
    leaked = pump.pistons * 3e-13 * 9.5e6 / 2  # half the turn at high pressure
    stroke = pump.displacement / pump.pistons
    lost = (9.5e6 - 2e5) / pump.bulk_modulus * (2e-6 + stroke) * pump.pistons * 1000 / 60
    held = (9.5e6 - 2e5) / pump.bulk_modulus * 2e-6 * pump.pistons * 1000 / 60
    assert swept - leaked - lost - 0.01 * swept < flow.mean() < swept - leaked - 0.0 * held


def test_a_changed_verdict_changes_its_digest(tmp_path):
    """Digests are SHA-256 of the bytes, by `sha256sum`."""
    path = tmp_path / "verdict.json"
    path.write_text("{}")
    told = subprocess.run(["sha256sum", path], capture_output=True, text=True, check=True).stdout
    before = digests([str(path)])
    assert before == {str(path): told.split()[0]}
    path.write_text("{ }")
    assert digests([str(path)]) != before


def test_neither_side_imports_the_scorer_and_what_runs_the_tool_not_the_rig():
    """Imports of every file: rippletwin and virtualrig know nothing of `concealed`, and of it only
    the page's scripts meet the rig."""

    def imports(folder):
        for file in (SOURCE / folder).rglob("*.py"):
            for node in ast.walk(ast.parse(file.read_text())):
                if isinstance(node, ast.Import):
                    yield from (alias.name.split(".")[0] for alias in node.names)
                elif isinstance(node, ast.ImportFrom) and node.module:
                    yield node.module.split(".")[0]

    assert "concealed" not in {*imports("rippletwin"), *imports("virtualrig")}
    assert "virtualrig" not in set(imports("concealed"))


# ---- scoring --------------------------------------------------------------------------------


def truth(**changes):
    leak = {
        "name": "leak",
        "element": "position",
        "position": 3.0,
        "position_nominal": 3.1,
        "segment": 2,
        "level": 0.5,
        "parameters": {"position": 3.0, "conductance": 2.0},
    }
    base = {
        "kind": "single", "effects": [leak], "classes": [], "change": 0.2, "noise": 1e3,
        "points": 1, "sensors": 2, "length": 5.0, "floor": 0.03, "mesh": None,
        "segments": [{"delay": 1.0, "impedance": 4.0}],
    }  # fmt: skip
    return base | changes


def claim(name, element="position", position=(2.9, 3.2), **parameters):
    values = {key: {"value": sum(ci) / 2, "ci95": list(ci)} for key, ci in parameters.items()}
    if position is not None:
        values["position"] = {"value": sum(position) / 2, "ci95": list(position)}
    return {"name": name, "element": element, "parameters": values, "probability": 0.9}


def verdict(kind, *claims, equivalents=()):
    where = {"element": "between p1 and p2", "position_m": [2.9, 3.2]} if claims else None
    misfits = {"in_sample": 0.1, "held_out": 0.1}
    return {
        "verdict": kind, "effects": list(claims), "equivalents": [list(e) for e in equivalents],
        "mismatch": {"present": bool(claims), "where": where}, "sentence": "",
        "fit": {"before": misfits, "after": misfits},
        "without": [{"effect": "leak", "evidence": 20.0}],
    }  # fmt: skip


def marked(truth_, verdict_, worth=None, **changes):
    rows = [{"delay": 1.1, "delay_sd": 0.05, "impedance": 4.0, "impedance_sd": 1.0}]
    baselines = {
        "nominal": 0.5, "calibrated": 0.1, "corrected": 0.01, "bic": None, "sparse": None,
        "segments": {"calibrated": rows, "corrected": rows}, "seconds": 1.0,
    }  # fmt: skip
    return score(truth_, verdict_, baselines | changes, worth)


def test_right_name_place_and_interval():
    """A leak named at its place with an interval that holds the truth; then each a little off."""
    row = marked(truth(), verdict("named", claim("leak", conductance=(1.5, 2.5))))
    assert row["right"] and row["clean"] and row["in_place"] == [True] and failed(row) is None
    assert row["intervals"] == [True] and row["stated"] == [(0.9, True)]
    assert row["evidence"] == [20.0]
    assert row["swallowed"] == pytest.approx(0.8)
    far = marked(truth(), verdict("named", claim("leak", position=(4.0, 4.5), conductance=(3, 4))))
    assert far["right"] and far["in_place"] == [False] and far["intervals"] == [False]
    assert failed(far) == "wrong place"


def test_what_the_truth_is_worth_parts_what_data_hold_from_what_they_do_not():
    """A hose wall that changes the ripple is worth far more than chance gives; where a line without
    made the data the same claim is worth nothing; what the library has not has no worth."""
    hose = ((EFFECTS["viscoelastic_wall"], Place("segment 2", 1)),)
    strength = {"compliance_ratio": 0.2, "retardation_time": 3e-4}
    values = {f"viscoelastic_wall@segment 2.{name}": x for name, x in strength.items()}
    true = {"name": "viscoelastic_wall", "element": "segment 2", "position": None}
    found = []
    for made in (hose, ()):
        bench, data, twin = make(np.random.default_rng(1), made, values)
        effects = [true | {"parameters": strength}]
        found.append(worth_in(Twin(bench, data), data, effects, twin.values()))
    assert found[0] > 5 * ACCEPT and found[1] < ACCEPT
    unknown = {"name": "accumulator", "element": "position", "position": 1.0, "parameters": {}}
    assert worth_in(Twin(bench, data), data, [unknown], {}) is None


def test_rows_say_whether_the_data_hold_the_effect():
    """A missed plain effect counts against the tool, and is left out where the truth itself is
    worth less than chance gives."""
    rows = [
        marked(truth(), verdict("consistent"), worth=2.0),
        marked(truth(), verdict("named", claim("leak", conductance=(1.5, 2.5))), worth=30.0),
    ]
    rates = {what: str(found) for what, _, found in scores(rows)}
    assert rates["Plain single effects: right effect or class named"].startswith("50%")
    assert rates["Of these, worth 8 of log evidence to one who knows: right effect"].startswith(
        "100% (1 of 1"
    )


def test_a_tool_that_ended_with_an_error_is_scored():
    """It has named nothing, rang, and is a failure; what it writes is all that scoring asks for."""
    row = score(truth(), crash(ValueError("no")), NOTHING | {"seconds": 1.0})
    assert row["verdict"] == "crashed" and not row["right"] and row["alarm"]
    assert failed(row) is not None


def test_wrong_names_and_names_beside_right_ones_are_told_apart():
    """Another effect is wrong; the right one with another beside it is right and not clean."""
    wrong = marked(truth(), verdict("named", claim("line_volume")))
    assert not wrong["right"] and wrong["wrong"] == "line_volume" and failed(wrong) == "wrong name"
    both = marked(truth(), verdict("named", claim("leak"), claim("unsteady_friction", "line")))
    assert both["right"] and not both["clean"]
    assert both["stated"] == [(0.9, True), (0.9, False)]


def test_a_stated_class_that_holds_the_truth_is_right_and_another_is_not():
    """Named within `equivalents`, or within a class declared beforehand."""
    said = verdict("ambiguous", claim("line_volume"), equivalents=[("leak", "line_volume")])
    assert marked(truth(), said)["right"]
    said = verdict("ambiguous", claim("line_volume"), equivalents=[("side_branch", "line_volume")])
    assert not marked(truth(), said)["right"]
    declared = truth(classes=[["leak", "line_volume"]], kind="indistinguishable")
    assert marked(declared, verdict("named", claim("line_volume")))["right"]


def test_no_effect_and_effects_outside_the_library():
    """Silence is right without an effect; abstention, not a name, is right outside the library."""
    none = truth(kind="none", effects=[], change=0.0)
    assert failed(marked(none, verdict("consistent"))) is None
    assert failed(marked(none, verdict("calibration_only"))) is None
    assert failed(marked(none, verdict("unexplained"))) == "false alarm"
    outside = truth(kind="outside")
    outside["effects"][0]["name"] = "accumulator"
    assert failed(marked(outside, verdict("unexplained"))) is None
    assert failed(marked(outside, verdict("named", claim("leak")))) == "misnamed"
    assert failed(marked(outside, verdict("consistent"))) == "not noticed"


def test_bias_is_against_the_true_line():
    """10 % of delay at a stated 5 % is two deviations; the impedance is exact."""
    delay, impedance = marked(truth(), verdict("consistent"))["bias"]["calibrated"]
    assert delay["relative"] == pytest.approx(0.1) and delay["z"] == pytest.approx(2.0)
    assert impedance["relative"] == 0.0


def test_intervals_of_rates_are_the_exact_ones():
    """Clopper and Pearson's limits make the observed count just 2.5 % likely on either side,
    by the binomial distribution itself."""
    from scipy.stats import binom

    low, high = Rate(7, 20).interval
    assert binom.sf(6, 20, low) == pytest.approx(0.025)
    assert binom.cdf(7, 20, high) == pytest.approx(0.025)
    assert rate([]).interval == (0.0, 1.0)
    assert rate([True, True]).interval[1] == 1.0


# ---- all of it ------------------------------------------------------------------------------


@pytest.mark.long
@confined
def test_two_cases_from_drawing_to_the_page(tmp_path):
    """The target runs, and what it scored is what the verdicts say."""
    (tmp_path / "two.yaml").write_text(
        f"results: {tmp_path}/out\nconcealed: {{cases: 2, number: 1}}\n"
    )
    command = [sys.executable, "-m", "snakemake", "--cores", "2", "--configfile"]
    command += [str(tmp_path / "two.yaml"), "--directory", str(SOURCE.parent), "concealed"]
    environment = os.environ | {"OMP_NUM_THREADS": "1"}
    result = subprocess.run(
        command, cwd=SOURCE.parent, capture_output=True, text=True, env=environment
    )
    assert result.returncode == 0, result.stderr
    rows = json.loads((tmp_path / "out/concealed/rows.json").read_text())
    assert len(rows) == 2
    for row in rows:
        path = tmp_path / f"out/concealed/explained/{row['case']:03d}/verdict.json"
        assert row["verdict"] == json.loads(path.read_text())["verdict"]
    assert "## Failures" in (tmp_path / "out/concealed/report.md").read_text()
