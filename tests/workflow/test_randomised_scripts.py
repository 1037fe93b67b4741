"""From a twin to kept networks by the scripts that the workflow runs."""

import json

import numpy as np
import pandas as pd
import torch
import xarray as xr

import leaking_pump
from rippletwin import store
from rippletwin.diagnosis.network_answers import find_networks, judge_windows
from rippletwin.harmonics import one_period
from rippletwin.pump.faults import Slipper
from rippletwin.twin import twin_file
from rippletwin.twin.twin import Twin
from run_script import run_script

SAMPLES, DATASET, NETWORK = 3072, "CFD-MOC-PR", "cnn1d_341_100"
TRAINING = {
    "batch_size": 8, "learning_rate": 0.003, "validation_fraction": 0.2, "target_loss": 0.05,
    "patience": 1, "plateau": 10, "min_improvement": 0.01, "max_epochs": 25,
}  # fmt: skip


def record(folder):
    """Windows of a healthy pump, of a worn slipper, and of a line that somebody changed."""
    rng, windows = np.random.default_rng(0), []
    for fault, line in ((None, {}), (Slipper(6e-7, 2), {}), (None, {"wave_speed": 900.0})):
        observation = leaking_pump.record("a", fault, 0.3, **line)
        period = one_period(observation.values, SAMPLES, observation.orders)
        windows.append(period + 300.0 * rng.standard_normal((10, *period.shape)))
    store.save(
        xr.Dataset(
            {
                "signal": (("window", "channel", "time"), np.concatenate(windows), {"units": "Pa"}),
                "noise_std": ("channel", [300.0, 300.0]),
            },
            coords={
                "state": ("window", np.repeat(["H", "S", "?"], 10)),
                "recording": ("window", np.repeat([0, 1, 2], 10)),
                "channel": ["p1", "p2"],
            },
            attrs={
                "speed_hz": leaking_pump.SPEED / 60,
                "load_pressure": leaking_pump.LOAD,
                "source": "healthy.h5, slipper.h5, changed.h5",
                "labels": ["healthy", "slipper, worn", "changed"],
            },
        ),
        folder / "recorded.zarr",
    )


def test_networks_of_a_range_of_severities_are_kept_and_used(tmp_path):
    """A twin of the sheet, a pump in time that differs: a slipper of a severity that nobody chose
    is named, and a line of another wave speed is unlike what was simulated."""
    before = torch.get_num_threads()
    record(tmp_path)
    twin = Twin(leaking_pump.rig())
    covariance = {"covariance": (1e-4 * np.eye(len(twin.theta))).tolist()}
    (tmp_path / "twin.json").write_text(json.dumps(twin_file.to_dict(twin) | covariance))
    wildcards = {"dataset": DATASET, "architecture": NETWORK}
    stores = {name: tmp_path / f"{name}.zarr" for name in ("learnt", "held_out")}
    run_script(
        "randomised_signals",
        tmp_path,
        stores,
        wildcards,
        {
            "signal": "pressure", "anchored": False, "draws": 200, "limit": 3.46e-7,
            "severity": {"S": [1e-7, 2e-6], "C": [1e-7, 2e-6]},
            "bandwidth_hz": 1500, "learnt_share": 0.8,
        },
        recorded=tmp_path / "recorded.zarr",
        twin=tmp_path / "twin.json",
    )  # fmt: skip
    learnt = store.load(stores["learnt"])
    assert learnt.signal.shape == (4, 200, 2, SAMPLES) and (learnt.leak_area[0] == 0).all()
    assert not np.array_equal(learnt.signal, store.load(stores["held_out"]).signal)
    run_script(
        "augment",
        tmp_path,
        {"seed": tmp_path / "samples.zarr"},
        wildcards | {"revolutions": "1"},
        {"samples_per_class": 200, "noise": 0.15},
        signals=stores["learnt"],
        recorded=tmp_path / "recorded.zarr",
    )
    run_script(
        "train",
        tmp_path,
        {"weights": tmp_path / "weights.pt", "history": tmp_path / "history.json"},
        wildcards,
        {"seeds": 1, "settings": TRAINING, "learnt_share": 0.0, "cylinder": None}
        | {"gpu": False, "precision": "float32"},
        samples=[tmp_path / "samples.zarr"],
    )
    folder = tmp_path / "networks" / DATASET
    folder.mkdir(parents=True)
    outputs = {"networks": folder / f"{NETWORK}.pt", "rates": folder / f"{NETWORK}.csv"}
    run_script(
        "keep_networks",
        tmp_path,
        outputs,
        wildcards,
        {"signal": "pressure", "noise": 0.15, "learnt_share": 0.0, "gpu": False},
        **stores,
        recorded=tmp_path / "recorded.zarr",
        weights=tmp_path / "weights.pt",
    )
    run_script(
        "unlike_table",
        tmp_path,
        {"page": tmp_path / "unlike.md"},
        {},
        {"cells": [(DATASET, NETWORK)]},
        rates=[outputs["rates"]],
        recorded=tmp_path / "recorded.zarr",
    )
    torch.set_num_threads(before)
    assert "| healthy | slipper, worn | changed |" in (tmp_path / "unlike.md").read_text()
    (kept,) = find_networks(tmp_path, leaking_pump.rig()).values()
    signal = store.load(tmp_path / "recorded.zarr").signal.values
    answers = [judge_windows(kept.classes, *kept.answers(signal[k : k + 10])) for k in (0, 10, 20)]
    print(answers)
    assert answers[1]["state"] == "slipper" and answers[1]["share"] == 1.0
    rates = pd.read_csv(outputs["rates"]).set_index("truth").unlike
    assert rates["?"] > 0.9 and rates["H"] < 0.2


def test_all_recordings_are_in_the_table_and_unknown_ones_are_not(tmp_path):
    """Two slippers of one state are two recordings, called by their labels, in which a comma
    separates nothing; an unknown recording is not scored. The training did not converge, and the
    page says so."""
    said = {"seed": 0, "window": range(6), "recording": [0, 0, 1, 1, 2, 2]}
    said |= {"truth": list("SSSS??"), "predicted": ["S", "S", "H", "H", "S", "S"]}
    pd.DataFrame(said).to_csv(tmp_path / "said.csv", index=False)
    names = {"labels": ["run 1, hot", "run 2", "found"]}
    store.save(xr.Dataset({"signal": ("window", [0.0])}, attrs=names), tmp_path / "w.zarr")
    ended = {"architecture": NETWORK, "dataset": DATASET, "accuracy": [50.0], "converged": False}
    pd.DataFrame(ended).to_csv(tmp_path / "accuracy.csv", index=False)
    table, page = tmp_path / "recordings.csv", tmp_path / "recordings.md"
    run_script(
        "recording_table",
        tmp_path,
        {"table": table, "page": page},
        {},
        {"cells": [(DATASET, NETWORK)], "datasets": [DATASET]},
        predictions=[tmp_path / "said.csv"],
        recorded=tmp_path / "w.zarr",
        accuracy=tmp_path / "accuracy.csv",
    )
    rows = pd.read_csv(table)
    assert rows.recording.tolist() == ["run 1, hot", "run 2"]
    assert rows.right.tolist() == [True, False]
    text = page.read_text()
    assert "All 2 recordings" in text and "| 50 ± 0 (1 of 2, 1 to 99) † |" in text
