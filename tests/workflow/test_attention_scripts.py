"""Scripts of the attention stage on tiny inputs: from simulated seeds to the page."""

import numpy as np
import pandas as pd
import pytest
import torch
import xarray as xr

from rippletwin import store
from rippletwin.learning.architectures import CLASSES
from rippletwin.learning.networks import build
from run_script import run_script

POINTS = 3072
NETWORKS = ("cnn1d_341_100", "cnn1d_150_50", "cnn1d_3_1")


@pytest.fixture(autouse=True)
def one_thread():
    before = torch.get_num_threads()
    yield
    torch.set_num_threads(before)


@pytest.fixture
def cells(tmp_path):
    """Seeds whose faults are pulses at known places, recordings, and untrained networks of two
    training seeds, through `noise_free_probes` and `attention`: paths of stores, one a network."""
    signal = np.tile(np.sin(2 * np.pi * 9 * np.arange(POINTS) / POINTS), (4, 1, 1))
    for k in range(1, 4):
        signal[k, 0, 100 * k : 100 * k + 40] += k
    store.save(
        xr.Dataset(
            {"signal": (("state", "channel", "time"), signal, {"units": "Pa"})},
            coords={"state": list(CLASSES), "channel": ["p1"]},
            attrs={"speed_hz": 16.7},
        ),
        tmp_path / "seeds.zarr",
    )
    windows = np.repeat(signal[[0, 1, 3]], 4, axis=0)
    store.save(
        xr.Dataset(
            {"signal": (("window", "channel", "time"), windows)},
            coords={
                "state": ("window", np.repeat(["H", "S", "C"], 4)),
                "recording": ("window", np.repeat(np.arange(3), 4)),
            },
        ),
        tmp_path / "recorded.zarr",
    )
    probes = tmp_path / "probes.zarr"
    wildcards = {"dataset": "CFD-MOC-P", "revolutions": "1"}
    seeds = tmp_path / "seeds.zarr"
    run_script("noise_free_probes", tmp_path, {"o": probes}, wildcards, {}, signals=seeds)
    torch.manual_seed(0)
    for name in NETWORKS:
        torch.save([build(name, 1).state_dict() for _ in range(2)], tmp_path / f"{name}.pt")
        run_script(
            "attention",
            tmp_path,
            {"o": tmp_path / f"{name}.zarr"},
            {"dataset": "CFD-MOC-P", "architecture": name},
            {"gpu": False},
            probes=probes,
            recorded=tmp_path / "recorded.zarr",
            weights=tmp_path / f"{name}.pt",
        )
    return [tmp_path / f"{name}.zarr" for name in NETWORKS]


def test_from_seeds_to_the_page(tmp_path, cells):
    """By construction: each fault's region lies within its pulse and is at most as wide; a row a
    network with the accuracies given; one group of three networks has a rank correlation."""
    cell = store.load(cells[0])
    for k, fault in enumerate(CLASSES[1:], start=1):
        inside = np.flatnonzero(cell.fault_region.sel(state=fault).values)
        assert inside.min() >= 100 * k and inside.max() < 100 * k + 40
    assert not cell.fault_region.sel(state="H").any()
    assert cell.attended.shape == (2, 3) and cell.recording.values.tolist() == ["H", "S", "C"]
    assert np.nanmax(np.abs(cell.recorded_heat.mean("time") - 1)) < 1e-5

    results = pd.DataFrame(
        dict(dataset="CFD-MOC-P", architecture=name, seed=s, accuracy=a, accuracy_either=a)
        for name, a in zip(NETWORKS, (90.0, 60.0, 30.0))
        for s in range(2)
    )
    results.to_csv(tmp_path / "accuracy.csv", index=False)
    output = {name: tmp_path / name for name in ("table", "ranks", "page")}
    run_script(
        "attention_table",
        tmp_path,
        output,
        {},
        {"cells": [("CFD-MOC-P", name) for name in NETWORKS]},
        attention=cells,
        table=tmp_path / "accuracy.csv",
    )
    assert pd.read_csv(output["table"]).accuracy.tolist() == [90, 60, 30]
    ranks = pd.read_csv(output["ranks"])
    assert ranks.input.tolist() == ["time", "time"] and (ranks.networks == 3).all()
    assert "| CFD-MOC-P | CNN1D (3@1) |" in output["page"].read_text()
