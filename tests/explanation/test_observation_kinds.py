"""Every kind of observation and of load, liquid and gas, from synthetic data to the verdict."""

import json
from dataclasses import replace

import numpy as np
import pytest

from case_folders import sheet, write_case
from rippletwin.case.model import Fluid, Load, Rig, Segment, Sensor, Uncertainty
from rippletwin.cli import main
from rippletwin.explanation.explain import explain_observations
from rippletwin.explanation.verdict.verdict_file import verdict_dict
from rippletwin.figures import explained_numbers
from rippletwin.figures.explanation import draw
from rippletwin.report.charts import chart_residuals, chart_ripples
from rippletwin.report.svg import draw_chart
from rippletwin.spectra.observation import Observation
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from synthetic_observations import ripple

OIL, AIR = Fluid(870.0, 3.2e-5), Fluid(1.204, 1.51e-5, 1.402, 0.707)
LINES = {OIL: (4.0, 0.02, 1000.0), AIR: (0.8, 0.01, 343.4)}
HOSE = (EFFECTS["viscoelastic_wall"], Place("segment 1", 0))
FRICTION = (EFFECTS["unsteady_friction"], Place("line"))
THERMAL = (EFFECTS["thermal_boundary_layer"], Place("line"))
GAIN = (EFFECTS["sensor_gain"], Place("sensor p2", 1))
VALUES = {
    "viscoelastic_wall@segment 1.compliance_ratio": 0.3,
    "sensor_gain@sensor p2.gain_error": 0.2,
}
GRID = np.linspace(40.0, 2000.0, 80)
IMPEDANCE = Load(
    "impedance", frequency_hz=np.array([0.0, 1e4]), impedance=np.array([4e9 + 0j, 4e9 + 4e9j])
)
# kind, source, fluid, load, true effect, competing effect
CASES = {
    "periodic with ripple, orifice": ("periodic", "nominal", OIL, Load("orifice"), HOSE, GAIN),
    "periodic without ripple, closed": ("periodic", "free", OIL, Load("closed"), HOSE, GAIN),
    "random, anechoic": ("random", "free", OIL, Load("anechoic"), GAIN, HOSE),
    "random, impedance": ("random", "free", OIL, IMPEDANCE, HOSE, GAIN),
    "spectrum, open": ("spectrum", "free", OIL, Load("open"), HOSE, GAIN),
    "spectrum of a gas, closed": ("spectrum", "free", AIR, Load("closed"), FRICTION, THERMAL),
    "impedance, closed": ("input_impedance", "known", OIL, Load("closed"), HOSE, FRICTION),
    "impedance of a gas, open": ("input_impedance", "known", AIR, Load("open"), FRICTION, THERMAL),
}
CHEAP = ("spectrum, open",)


def synthetic(kind, source, fluid, load, effect):
    """Rig and one observation with 0.2 % of noise, nominal values off by their uncertainty."""
    rng = np.random.default_rng(3)
    length, diameter, wave_speed = LINES[fluid]
    impedance = kind == "input_impedance"
    places = () if impedance else (0.1 * length, 0.45 * length, 0.8 * length)
    sensors = tuple(Sensor(f"p{k + 1}", x) for k, x in enumerate(places))
    sheet = Uncertainty(0.003, 0.01, 0.02, 0.05, 0.05, 0.003)
    line = (Segment(length, diameter, wave_speed),)
    rig = Rig(fluid, {"pistons": 9}, line, sensors, load, sheet)
    periodic = kind == "periodic"
    orders = 9 * np.arange(1, 27) if periodic else None
    frequency = orders * 1000 / 60 if periodic else GRID
    rows = max(len(sensors), 1)
    blank = Observation(
        kind, "one", frequency, orders, np.ones((rows, len(frequency)), complex),
        np.zeros((len(frequency), rows, rows), complex), np.full(rows, 9.5e6),
        1000 / 60 if periodic else None, 9.5e6 if fluid is OIL else None, source,
        ripple(1000 / 60, 9.5e6) if source == "nominal" else None, sensors, impedance,
    )  # fmt: skip
    twin = Twin(rig, [blank], effects=(effect,))
    theta = 0.7 * rng.normal(size=len(twin.theta))
    for k, p in enumerate(twin.parameters):
        theta[k] = p.prior.coordinate(VALUES[p.name]) if p.name in VALUES else theta[k]
    (h,) = twin.predict([blank], theta)
    if source == "free":
        h = h * (1.0 + rng.uniform(size=len(frequency))) * np.exp(1j * rng.uniform(size=h.shape[1]))
    if impedance:
        h = (1 + h) / (1 - h)
    size = np.abs(h + 1) ** 2 / 2 if impedance else np.abs(h)
    noise = rng.normal(size=(*h.shape, 2)) @ np.array([1, 1j]) / np.sqrt(2)
    covariance = np.einsum("sf,st->fst", (2e-3 * size) ** 2, np.eye(rows)).astype(complex)
    return rig, [replace(blank, values=h + 2e-3 * size * noise, covariance=covariance)]


@pytest.mark.parametrize(
    "case", [pytest.param(c, marks=() if c in CHEAP else pytest.mark.long) for c in CASES]
)
def test_each_kind_is_explained_end_to_end(case, monkeypatch, tmp_path):
    """The true effect is named against a competing one, and the misfit falls to less than half.

    Verdict, figures and charts of the page are made for every kind of observation."""
    *kind, effect, rival = CASES[case]
    library = [effect, rival]
    monkeypatch.setattr(
        "rippletwin.explanation.search.stepwise_search.applicable_candidates", lambda *_: library
    )
    monkeypatch.setattr("rippletwin.explanation.explain.fit_passive_networks", lambda *_: [])
    explanation = explain_observations(*synthetic(*kind, effect), processes=1)
    result = verdict_dict(explanation)
    named = {e["name"] for e in result["effects"]}
    assert effect[0].name in named, (result["verdict"], result["sentence"])
    assert result["fit"]["after"]["in_sample"] < 0.5 * result["fit"]["before"]["in_sample"]
    drawn = {path.stem for path in draw(explanation, tmp_path, [".svg"])}
    assert {"explain", "explain_ripple", "explain_residuals", "explain_evidence"} <= drawn
    numbers = explained_numbers.load(tmp_path)
    charts = [draw_chart(each) for each in chart_ripples(numbers) + chart_residuals(numbers)]
    assert len(charts) == len(numbers.points[0].measured) + 1


def test_pressures_beside_an_input_impedance(tmp_path, capsys):
    """explain and diagnose refuse them at once and name both, check reads them and says why it has
    no outlook: they have different numbers of rows, and their errors different units."""
    content = sheet()
    content["recordings"] += [
        {"file": "z.csv", "kind": "input_impedance", "state": "healthy"},
        content["recordings"][0] | {"label": "now", "state": "unknown"},
    ]
    write_case(tmp_path, content)
    (tmp_path / "z.csv").write_text("frequency_hz,re,im\n100,1e9,1e9\n200,1e9,2e9\n")
    told = "explain takes either pressures (healthy_0) or input impedances (z)"
    for command in ("explain", "diagnose"):
        assert main([command, str(tmp_path), "--out", str(tmp_path / "out")]) == 2
        assert told in capsys.readouterr().err
    assert main(["check", str(tmp_path), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["effects"] == [] and any(told in each for each in found["advice"])
