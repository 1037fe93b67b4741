"""Concealed cases on rigs with nuisance physics."""

from dataclasses import replace

import numpy as np
import pytest
import yaml

from virtualrig.draw import case_kinds, random_generator
from virtualrig.nuisance import seal_at
from virtualrig.nuisance_case import (
    draw_nuisance_case,
    floor_of,
    nuisance_effects,
    record_nuisance_case,
    true_ripples,
)
from virtualrig.pump import Pump
from virtualrig.rig import build

COUNT, COMMIT, NUMBER = 60, "fixed", 1


def cases(kind):
    """Cases of a kind, drawn and not recorded."""
    kinds = case_kinds(COUNT, COMMIT, NUMBER)
    return [
        draw_nuisance_case(COUNT, COMMIT, NUMBER, k)
        for k, (own, _) in enumerate(kinds)
        if own == kind
    ]


def test_the_same_commit_and_number_give_the_same_case():
    """Nobody can draw again until a case suits."""
    first, again = (draw_nuisance_case(COUNT, COMMIT, NUMBER, 5) for _ in range(2))
    assert first.rig.sheet == again.rig.sheet and first.truth == again.truth
    assert draw_nuisance_case(COUNT, "other", NUMBER, 5).rig.sheet != first.rig.sheet


def test_a_concealed_effect_comes_on_top_of_the_nuisance_physics():
    """Every seal has unsteady friction and the sensors' cavities; a concealed wall replaces the
    weak one of its segment, and other effects are appended."""
    for case in cases("single"):
        rig = case.rig
        seal = seal_at(rig.sheet, rig.true, rig.nuisance)
        names = [effect["name"] for effect in seal["effects"]]
        assert "unsteady_friction" in names and names.count("sensor_dynamics") >= 2
        (effect,) = case.truth["effects"]
        if effect["name"] == "viscoelastic_wall":
            walls = {piece["wall"] for piece in seal["line"]["segments"]}
            assert (effect["arguments"]["compliance"], effect["arguments"]["time"]) in walls
        else:
            assert effect["name"] in names


def test_no_fitting_leaves_a_sliver_of_pipe():
    """Time steps follow from the shortest pipe, so a millimetre between a fitting and a change of
    temperature would cost hours. Effects keep their distance, and no other pipe is as short."""
    for kind in ("single", "pair", "outside"):
        for case in cases(kind):
            rig = case.rig
            network = build(rig.sheet, seal_at(rig.sheet, rig.true, rig.nuisance)).network
            assert min(pipe.length for pipe in network.pipes) > 0.03, case.truth["effects"]


def test_nuisance_physics_is_part_of_the_truth():
    """A tool that names it is right: each place of the rig has its effects."""
    (case, *_) = cases("none")
    rig = case.rig
    listed = nuisance_effects(rig.sheet, rig.true)
    places = {(effect["name"], effect["element"]) for effect in listed}
    assert {("unsteady_friction", "line"), ("viscoelastic_wall", "line")} <= places
    assert ("viscoelastic_wall", "segment 2") in places
    assert all(("sensor_gain", f"sensor {s['name']}") in places for s in rig.sheet["sensors"])
    volumes = [e["position"] for e in listed if e["name"] == "line_volume"]
    assert volumes == list(rig.true["sensors"])


def test_the_floor_is_of_the_true_line_with_the_sheets_pump(monkeypatch):
    """Volumes of liquid are stated with the true pump's bulk modulus: that of the sheet's would
    make another line, and the floor would be an error of the line too."""
    settled = []
    monkeypatch.setattr(
        "virtualrig.nuisance_case.settled_ripple",
        lambda bench, _: settled.append(bench.rig) or np.ones((1, 4)),
    )
    monkeypatch.setattr("virtualrig.nuisance_case.ripple_difference", lambda *_: 0.0)
    for case in cases("single"):
        rig = case.rig
        settled.clear()
        true_ripples(rig)
        floor_of(rig, [None] * len(rig.recordings))
        true, nominal = settled[: len(rig.recordings)], settled[len(rig.recordings) :]
        for one, other in zip(true, nominal, strict=True):
            assert other.network == one.network and other.sensing == one.sensing
            assert other.pump == Pump(**rig.sheet["pump"]) != one.pump


@pytest.mark.parametrize("geometry", [True, False])
def test_the_case_folder_says_nothing_of_the_truth(tmp_path, monkeypatch, geometry):
    """rig.yaml has the data sheet's values; where it gives no geometry there are flow ripples. The
    floor is the error of the sheet's pump: without it none can fit better. On a coarse mesh, at a
    steady speed."""
    monkeypatch.setattr("virtualrig.nuisance.NUMERICS", {"frequency": 1500.0})
    case = next(c for c in cases("none") if c.geometry is geometry and c.truth["points"] == 1)
    case = replace(case, rig=replace(case.rig, nuisance=case.rig.nuisance | {"wander": 0.0}))
    truth = record_nuisance_case(case, tmp_path / "case", random_generator(COMMIT, NUMBER, "r"))
    sheet = yaml.safe_load((tmp_path / "case/rig.yaml").read_text())
    assert (set(sheet["pump"]) == {"pistons"}) is not geometry
    assert ("flow_ripple" in sheet["recordings"][0]) is not geometry
    assert sheet["line"] == case.rig.sheet["line"]
    assert truth["change"] == 0.0 and truth["floor"] > 0.02
    same = case.rig.nuisance | {
        "dead_volume": 0.0, "port_area": 0.0, "bulk_modulus": 0.0, "timing_deg": 0.0, "air": 0.0,
        "case_leakage": 1.0, "groove_deg": 0.0, "groove_share": 0.0, "bore_spread": 0.0,
        "angle_spread_deg": 0.0,
        "discharge_coefficient": case.rig.sheet["pump"]["discharge_coefficient"],
    }  # fmt: skip
    right = type(case.rig)(case.rig.sheet, case.rig.true, same, case.rig.recordings)
    assert np.isfinite(truth["floor"])
    assert floor_of(right, true_ripples(right)) < 0.1 * truth["floor"]
