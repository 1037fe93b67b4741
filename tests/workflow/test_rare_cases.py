"""Scripts of the workflow on cases that are rare: what they refuse, and what they let pass."""

from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from case_folders import sheet, write_case
from rippletwin import store
from rippletwin.errors import InputError
from rippletwin.learning import recording_accuracy
from rippletwin.learning.training import History
from run_script import run_script

SAMPLES = 1024


def test_a_line_that_does_not_settle_names_the_key_of_its_tolerance(tmp_path, monkeypatch):
    """One line says which key is too strict, by how much, and what else to look at."""
    told = SimpleNamespace(periods=200, change=3e-4, worst_position=1.0, converged=False)
    monkeypatch.setattr("rippletwin.twin.propagation.propagate", lambda *_: told)
    monkeypatch.setattr("rippletwin.twin.twin_file.load_twin", lambda *_: None)
    pump = xr.Dataset({"source_flow": ("time", np.ones(4))}, attrs={"source_capacitance_m3_pa": 0})
    store.save(pump, tmp_path / "pump.zarr")
    point = xr.Dataset({"signal": ("time", np.ones(4))}, attrs={"speed_hz": 1, "load_pressure": 1})
    store.save(point, tmp_path / "recorded.zarr")
    with pytest.raises(InputError) as refused:
        run_script(
            "propagate",
            tmp_path,
            {"o": tmp_path / "propagated.zarr"},
            {"twin": "corrected", "state": "H"},
            {"steps": 8, "tolerance": 1e-6},
            recordings=tmp_path / "recorded.zarr",
            flow=tmp_path / "pump.zarr",
            healthy=tmp_path / "pump.zarr",
            twin=tmp_path / "twin.json",
        )
    assert str(refused.value) == (
        "config: propagation.tolerance: 1e-06: after 200 revolutions the line still changes by "
        "0.0003 of its ripple from one to the next. Raise it, or check in rig.yaml what damps the "
        "line: load and viscosity"
    )


def test_a_short_recording_that_nobody_learns_from_does_not_stop_a_training(tmp_path, monkeypatch):
    """Networks of recordings learn from the first one of each state: a second slipper of two
    windows, which would be too few, is left out; the first one of two windows is refused."""
    learnt = []

    def train(network, x, y, *_):
        learnt.append(y.tolist())
        return network, History([0.5], [0.9], 0, True, "target")

    monkeypatch.setattr("rippletwin.learning.training.train_stepwise", train)
    monkeypatch.setattr("rippletwin.learning.side_by_side.train_all", lambda made, _: made)

    def run(*recordings):
        state = np.concatenate([[name] * count for name, count in recordings])
        number = np.concatenate([[k] * count for k, (_, count) in enumerate(recordings)])
        store.save(
            xr.Dataset(
                {"signal": (("window", "channel", "time"), np.zeros((len(state), 1, SAMPLES)))},
                coords={"state": ("window", state), "recording": ("window", number)},
                attrs={"labels": [f"{name}{k}" for k, (name, _) in enumerate(recordings)]},
            ),
            tmp_path / "recorded.zarr",
        )
        run_script(
            "train",
            tmp_path,
            {"weights": tmp_path / "weights.pt", "history": tmp_path / "history.json"},
            {"dataset": "experimental", "architecture": "cnn1d_341_100"},
            {"seeds": 1, "settings": {}, "learnt_share": 0.8, "cylinder": "C1"}
            | {"gpu": False, "precision": "float32"},
            samples=[tmp_path / "recorded.zarr"],
        )

    run(("H", 5), ("S", 5), ("S", 2), ("C", 5), ("?", 1))
    assert learnt == [[0] * 4 + [1] * 4 + [2] * 4]
    with pytest.raises(InputError, match="recording S1: file: makes 2 windows"):
        run(("H", 5), ("S", 2), ("S", 5))


def test_claims_take_a_label_for_text(tmp_path, monkeypatch):
    """Recordings called None, 1 and 01 are three: none is a gap in the table, and no two are one
    number. Two networks are compared on each of them."""
    write_case(tmp_path, sheet())
    labels = ["None", "1", "01"]
    networks = ("cnn1d_341_100", "cnn1d_3_1")
    cells = [dict(architecture=name, dataset="CFD-P", seed=0) for name in networks]
    rows = [cell | dict(recording=label, share=1.0) for cell in cells for label in labels]
    pd.DataFrame(rows).to_csv(tmp_path / "recordings.csv", index=False)
    scores = dict(accuracy=100.0, accuracy_either=100.0, converged=True)
    pd.DataFrame([cell | scores for cell in cells]).to_csv(tmp_path / "accuracy.csv", index=False)
    paper = pd.DataFrame(columns=["architecture", "dataset", "mean", "std"])
    paper.to_csv(tmp_path / "paper.csv", index=False)
    seen, shares_of = [], recording_accuracy.recording_shares

    def keep(rows):
        seen.append(shares_of(rows))
        return seen[-1]

    monkeypatch.setattr(recording_accuracy, "recording_shares", keep)
    monkeypatch.setattr("rippletwin.figures.style.save", lambda *_: None)
    outputs = ("table", "comparisons", "page", "png", "svg")
    run_script(
        "claims",
        tmp_path,
        {name: tmp_path / f"claims.{name}" for name in outputs},
        {},
        {"datasets": ["CFD-P"], "samples_per_revolution": 3072},
        rig=tmp_path / "rig.yaml",
        table=tmp_path / "accuracy.csv",
        recordings=tmp_path / "recordings.csv",
        paper=tmp_path / "paper.csv",
    )
    assert sorted(seen[0].index) == sorted(labels) and seen[0].notna().all(axis=None)


def calibrate(folder, monkeypatch, **changed):
    """The ripples that the scripts `calibrate` and `plot_calibration` make and draw of a case with
    one recording, some of its keys changed; nothing is fitted."""
    content = sheet()
    content["recordings"][0] |= changed
    write_case(folder, content)
    fit = SimpleNamespace(relative=0.1, theil=0.1)

    def fitted(twin, *_, **__):
        return SimpleNamespace(warnings=(), before=fit, after=fit, twin=twin, nominal=twin)

    monkeypatch.setattr("rippletwin.calibration.calibrate.calibrate", fitted)
    monkeypatch.setattr("rippletwin.calibration.report.save", lambda *_: None)
    ripples, pictures = folder / "ripples.zarr", folder / "pictures"
    run_script(
        "calibrate",
        folder,
        {"ripples": ripples, "twin": folder / "twin.json"},
        {},
        {"method": "map", "friction": "steady", "max_frequency_hz": None},
        rig=folder / "rig.yaml",
    )
    run_script("plot_calibration", folder, {"o": pictures}, {}, {}, ripples=ripples)
    return store.load(ripples), list(pictures.iterdir())


@pytest.mark.parametrize(("kind", "count"), [("periodic", 1), ("random", 0)])
def test_a_case_without_a_healthy_ripple_is_calibrated(tmp_path, monkeypatch, kind, count):
    """Of a random excitation there is no ripple to draw: the store is empty and has the rig's
    sensors, and the folder of pictures, which Snakemake asks for, is there."""
    ripples, pictures = calibrate(tmp_path, monkeypatch, kind=kind)
    assert dict(ripples.sizes) == {"point": count, "channel": 2, "time": 1024}
    assert len(pictures) == 2 * count and ripples.point.size == count
    assert ripples.channel.values.tolist() == ["p1", "p2"]
    assert ripples.angle_deg.values[512] == 180.0


def test_a_case_without_a_healthy_recording_is_refused(tmp_path, monkeypatch):
    """With the words of the command line."""
    with pytest.raises(InputError, match="recordings: none has state: healthy"):
        calibrate(tmp_path, monkeypatch, state="slipper")
