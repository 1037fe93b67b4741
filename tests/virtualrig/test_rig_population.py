"""Populations of rigs: draws, recordings, and that the case folder does not give the truth away."""

from dataclasses import replace

import h5py
import numpy as np
import pytest

from virtualrig.draw import draw_case
from virtualrig.draw_nuisance import EACH_SEGMENT, EACH_SENSOR, NUISANCE
from virtualrig.draw_population import STATES, draw_rig
from virtualrig.faults import Leak
from virtualrig.nuisance import true_pump
from virtualrig.population import delivering_piston, equivalent_areas, record_rig
from virtualrig.pump import Pump
from virtualrig.rig import read_yaml

PINNED = {
    "segment": {"diameter": 0.01497, "length": 1.219, "wave_speed": 1293.0},
    "timing_deg": -0.5354591446173669,
    "kind": "single",
}
"""Of case 0 of 6, commit "fixed-commit", number 3."""

RIGS = [draw_rig("commit", 1000, k) for k in range(12)]


def test_draws_follow_from_commit_number_and_rig():
    """The same three give the same rig, another one gives another."""
    assert draw_rig("commit", 1000, 3) == RIGS[3]
    others = [draw_rig("other", 1000, 3), draw_rig("commit", 1001, 3), RIGS[4]]
    assert all(other.sheet != RIGS[3].sheet for other in others)


def test_every_rig_has_all_nuisance_physics_in_its_range():
    """Nothing is left out, sizes lie between the ends, and signed ones come with both signs."""
    for name, given in NUISANCE.items():
        if name == "laminar":
            values = [f.laminar for rig in RIGS for p in rig.recordings for f in p.faults
                      if isinstance(f, Leak)]  # fmt: skip
        else:
            values = [rig.nuisance[name] for rig in RIGS]
        values = np.concatenate([np.atleast_1d(v) for v in values])
        size = np.abs(values) if given.scale == "signed" else values
        assert size.min() >= given.low and size.max() <= given.high, name
        if given.scale == "signed":
            assert (values > 0).any() and (values < 0).any(), name
    for rig in RIGS:
        assert all(len(rig.nuisance[name]) == len(rig.sheet["sensors"]) for name in EACH_SENSOR)
        segments = rig.sheet["line"]["segments"]
        assert all(len(rig.nuisance[name]) == len(segments) for name in EACH_SEGMENT)


def test_cylinders_have_room():
    """Neighbours on the pitch circle, a chord apart, do not overlap in any of fifty pumps."""
    for k in range(50):
        pump = draw_rig("commit", 1000, k).sheet["pump"]
        chord = 2.0 * pump["pitch_radius"] * np.sin(np.pi / pump["pistons"])
        assert chord > 1.1 * pump["piston_diameter"]


def test_the_true_pump_differs_in_more_than_four_numbers():
    """And shuts its chambers off over the angle of the data sheet, groove included."""
    for rig in RIGS:
        known, true = rig.sheet["pump"], true_pump(rig.sheet["pump"], rig.nuisance)
        different = [key for key, value in true.items() if value != known.get(key, 0.0)]
        assert len(different) >= 8
        shut = true["port_overlap_deg"] - 2 * true["groove_deg"]
        assert shut == pytest.approx(known["port_overlap_deg"])


def test_states_come_in_every_order_and_severities_span_two_decades():
    """All states of unknown recordings in each rig, shuffled; leaks over two decades of flow."""
    orders = {tuple(p.state for p in rig.recordings if "unknown" in p.point.label) for rig in RIGS}
    assert len(orders) == len(RIGS)
    assert all(sorted(order) == sorted(STATES) for order in orders)
    areas = [f.leak_area for rig in RIGS for p in rig.recordings for f in p.faults
             if isinstance(f, Leak)]  # fmt: skip
    assert np.max(areas) / np.min(areas) > 100


def test_equivalent_area_passes_the_leaks_flow_with_the_sheets_coefficient():
    """Of the data sheet's orifice equation at the operating pressure; laminar share included."""
    plan = next(p for p in RIGS[0].recordings if p.state == "slipper")
    leak, pressure = plan.faults[0], plan.point.load_pressure
    assert leak.reference == pressure  # there the laminar share changes nothing
    true = Pump(**RIGS[0].sheet["pump"] | true_pump(RIGS[0].sheet["pump"], RIGS[0].nuisance))
    flow = true.discharge_coefficient * leak.leak_area * np.sqrt(2 * pressure / 870.0)
    known = RIGS[0].sheet["pump"]["discharge_coefficient"]
    area = equivalent_areas(RIGS[0], plan)["slipper"]
    assert known * area * np.sqrt(2 * pressure / 870.0) == pytest.approx(flow)


def test_pistons_are_counted_in_the_order_of_their_delivery():
    """Against a list of the turns at which each of nine pistons begins to deliver: chamber k is k
    pitches ahead, and a scratched block is told by the piston that delivers first."""
    for turn in (0.03, 0.2, 0.55, 0.97):
        begins = [(np.ceil(turn + k / 9) - k / 9, k) for k in range(9)]
        order = [k for _, k in sorted(begins)]
        for chamber in range(9):
            leak = Leak("slipper", 1e-8, chamber=chamber)
            assert delivering_piston(leak, 9, turn) == order.index(chamber)
            ahead = order.index((chamber + 1) % 9)
            assert delivering_piston(replace(leak, kind="cylinder"), 9, turn) == ahead


def test_a_recorded_case_tells_nothing(tmp_path, monkeypatch):
    """rig.yaml says healthy or unknown, labels are numbers, all files are of one size; the truth
    has the change, which grows with the leak. On a coarse mesh, at a steady speed."""
    monkeypatch.setattr("virtualrig.nuisance.NUMERICS", {"frequency": 1500.0})
    rig = replace(RIGS[0], nuisance=RIGS[0].nuisance | {"wander": 0.0})
    point = replace(rig.recordings[0].point, seconds=0.3)
    plans = [replace(rig.recordings[0], point=point)]
    for k, scale in enumerate((1.0, 4.0)):
        leak = Leak("slipper", scale * 3e-8, 0.4, point.load_pressure)
        at = replace(point, label=f"unknown_{k:02d}")
        plans.append(replace(rig.recordings[0], point=at, state="slipper", faults=(leak,)))
    truth = record_rig(
        replace(rig, recordings=tuple(plans)), tmp_path / "case", np.random.default_rng(0)
    )
    sheet = read_yaml(tmp_path / "case" / "rig.yaml")
    assert [entry["state"] for entry in sheet["recordings"]] == ["healthy", "unknown", "unknown"]
    text = (tmp_path / "case" / "rig.yaml").read_text()
    assert not any(word in text for word in ("slipper", "leak_area", "nuisance", "kelvin"))
    files = sorted((tmp_path / "case" / "recordings").iterdir())
    shapes = set()
    for file in files:
        with h5py.File(file) as opened:
            shapes.add(opened["pressure"].shape)
            assert set(opened.attrs) == {"sampling_rate_hz"}
    assert len(shapes) == 1
    rows = truth["recordings"]
    assert rows["healthy_0_0"]["change"] == 0
    small, large = rows["unknown_00"]["change"], rows["unknown_01"]["change"]
    assert 0.001 < small < large
    assert large / small == pytest.approx(4.0, rel=0.3)


def test_cases_of_the_concealed_trial_are_as_before():
    """Numbers of a concealed case: a change of the virtual rig draws the same ones."""
    case = draw_case(6, "fixed-commit", 3, 0)
    assert case.sheet["line"]["segments"][0] == PINNED["segment"]
    assert case.seal["pump"]["timing_deg"] == pytest.approx(PINNED["timing_deg"], rel=1e-9)
    assert case.truth["kind"] == PINNED["kind"]
