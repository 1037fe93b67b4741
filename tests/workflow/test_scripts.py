"""Scripts of the workflow on tiny inputs: what rules and library alone do not show."""

import json
from dataclasses import asdict, replace

import numpy as np
import pandas as pd
import pytest
import torch
import xarray as xr
import yaml

from paper_rig import paper_rig
from rippletwin import store
from rippletwin.case.model import Fluid
from rippletwin.errors import InputError
from rippletwin.flow_sensor.estimate import band_limit
from rippletwin.flow_sensor.line_response import line_factory
from rippletwin.learning.synchrosqueezing import SstSettings, amplitude_scale, sst_images
from rippletwin.learning.training import History
from rippletwin.pump.faults import Cylinder, Slipper
from rippletwin.pump.outlets import ConstantPressure
from rippletwin.pump.simulation import simulate
from rippletwin.twin import twin_file
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from run_script import run_script
from synthetic_recordings import flow_ripple
from workflow_copy import RIG

SST = dict(size=32, min_frequency_hz=12, max_frequency_hz=1500, voices=32, k=1.0)
SPEED, PRESSURE, SAMPLES = 1000 / 60, 9.5e6, 1024
TITLES = [f"<!-- {state} -->" for state in ("H", "S", "C1", "C2", "S+C1")]  # in an SVG


@pytest.fixture(autouse=True)
def one_thread():
    before = torch.get_num_threads()
    yield
    torch.set_num_threads(before)


def sheet(folder):
    """rig.yaml of a case whose recordings nobody reads."""
    folder = folder / "case"
    folder.mkdir(exist_ok=True)
    (folder / "rig.yaml").write_text(RIG)
    for recording in yaml.safe_load(RIG)["recordings"]:
        (folder / recording["file"]).write_text("time_s,p1\n")
    return folder / "rig.yaml"


def predictions(path, truth, said):
    """A predictions file of two seeds; windows of one recording a state, in order of appearance."""
    order = {state: k for k, state in enumerate(dict.fromkeys(truth))}
    tables = [
        pd.DataFrame(
            {
                "seed": seed,
                "window": range(len(truth)),
                "recording": [order[state] for state in truth],
                "truth": truth,
                "predicted": said,
            }
        )
        for seed in (0, 1)
    ]
    pd.concat(tables).to_csv(path, index=False)


def reported(folder, truth, said):
    """(accuracy.csv, accuracy.md) of one network on one dataset."""
    predictions(folder / "said.csv", truth, said)
    history = asdict(History([0.5], [0.9], 0, True, "target"))
    (folder / "ended.json").write_text(json.dumps([history, history]))
    paper = folder / "paper.csv"
    pd.DataFrame(columns=["architecture", "dataset", "mean", "std"]).to_csv(paper, index=False)
    table, page = folder / "accuracy.csv", folder / "accuracy.md"
    run_script(
        "accuracy_table",
        folder,
        {"table": table, "page": page},
        {},
        {
            "cells": [("CFD-Q+", "cnn1d_3_1")],
            "severity": {"pressure": "C1", "flow": "C2"},
            "recordings": "made up",
            "columns": ["CFD-Q+"],
            "signals": {"CFD-Q+": "flow"},
            "randomised": [],
        },
        predictions=[folder / "said.csv"],
        histories=[folder / "ended.json"],
        paper=paper,
    )
    return pd.read_csv(table), page.read_text()


def test_report_scores_what_is_known(tmp_path):
    """By hand: both healthy windows right, those of unknown state do not count."""
    truth = ["H", "H", "?", "?", "?", "?"]
    rows, page = reported(tmp_path, truth, ["H", "H", "S", "S", "C1", "S"])
    assert rows.accuracy.tolist() == [100, 100] and rows.windows.tolist() == [2, 2]
    assert "100.0 ± 0.0" in page and "nan" not in page


def test_page_on_the_cost_names_the_physics_taken_in(tmp_path):
    """The corrected twin of `explain` is read as it writes it, and its effects are told."""
    rig = paper_rig(2, 1)
    place = EFFECTS["unsteady_friction"].places(rig)[0]
    twin = Twin(rig, effects=[(EFFECTS["unsteady_friction"], place)])
    (tmp_path / "twin.json").write_text(json.dumps(twin_file.to_dict(twin)))
    fit = {"before": {"held_out": 0.45}, "after": {"held_out": 0.03}}
    (tmp_path / "verdict.json").write_text(json.dumps({"verdict": "named", "fit": fit}))
    cells = [("CFD-Q", 0, 40.0), ("CFD-Q+", 0, 90.0)]
    columns = ["dataset", "seed", "accuracy"]
    rows = pd.DataFrame(cells, columns=columns).assign(architecture="cnn1d_3_1")
    rows.assign(accuracy_either=rows.accuracy).to_csv(tmp_path / "a.csv", index=False)
    page = tmp_path / "cost.md"
    run_script(
        "report_cost",
        tmp_path,
        {"page": page},
        {},
        {"pairs": [("CFD-Q", "CFD-Q+")]},
        table=tmp_path / "a.csv",
        verdict=tmp_path / "verdict.json",
        twin=tmp_path / "twin.json",
    )
    text = page.read_text()
    assert "unsteady friction (line)" in text and "45.0% before,\n3.0% after" in text
    assert "| 40.0 ± 0.0 | 90.0 ± 0.0 | +50.0 |" in text


def test_flow_sensor_by_either_method_finds_the_flow(tmp_path):
    """Pressure made by a twin from a known flow: the spectral sensor and the physics-informed one
    give it back, with the twin in either of the two files that the workflow has. The speeds of the
    windows differ by 0.4 %, at which a line's readings differ by several per cent; the network
    takes their mean."""
    rig = paper_rig(3, 1)
    twin, ripple = Twin(rig), flow_ripple()
    orders = np.arange(1, SAMPLES // 2)
    flow = np.interp(np.arange(SAMPLES) * 360 / SAMPLES, ripple.angle_deg, ripple.flow)
    speeds = SPEED * np.array([0.998, 0.998, 1.002, 1.002])
    spectra = np.zeros((4, 3, SAMPLES // 2 + 1), complex)
    for spectrum, speed in zip(spectra, speeds):
        network = line_factory(twin, PRESSURE)(speed, orders)
        spectrum[:, orders] = network.readings() * np.fft.rfft(flow)[orders]
    pressure = np.fft.irfft(spectra, SAMPLES)
    noise = 50.0
    windows = pressure + noise * np.random.default_rng(0).standard_normal(pressure.shape)
    store.save(
        xr.Dataset(
            {
                "signal": (("window", "channel", "time"), windows),
                "noise_std": ("channel", np.full(3, noise)),
            },
            coords={
                "state": ("window", ["H"] * 4),
                "recording": ("window", [0] * 4),
                "window_speed_hz": ("window", speeds),
            },
            attrs={"speed_hz": SPEED, "load_pressure": PRESSURE, "source": "made.csv"},
        ),
        tmp_path / "recorded.zarr",
    )
    made_by = {
        "calibrated": {"twin": twin_file.to_dict(twin)},
        "corrected": twin_file.to_dict(twin),
    }
    bandwidth = 400.0
    truth = band_limit(flow, SPEED, bandwidth)
    for (name, file), method in zip(made_by.items(), ("spectral", "pinn"), strict=True):
        (tmp_path / "twin.json").write_text(json.dumps(file))
        run_script(
            "flow_sensor",
            tmp_path,
            {"flow": tmp_path / f"flow_{name}.zarr"},
            {"twin": name},
            {"bandwidth_hz": bandwidth, "method": method, "width": 16, "steps": 40},
            recorded=tmp_path / "recorded.zarr",
            twin=tmp_path / "twin.json",
        )
        found = store.load(tmp_path / f"flow_{name}.zarr")
        assert (
            f"{method} flow sensor, {name} line" in found.source
            and found.signal.attrs["units"] == "m3/s"
        )
        wrong = found.signal.values[:, 0] - truth
        assert np.sqrt(np.mean(wrong**2) / np.mean(truth**2)) < 0.03


@pytest.mark.parametrize("states", ["SH", "SS"])
def test_images_are_scaled_by_the_healthy_window_or_the_first(tmp_path, states):
    """A case whose healthy recordings are all at another operating point has no healthy window:
    the first one scales the images, as a healthy one does elsewhere."""
    noise = np.random.default_rng(0).standard_normal((2, 1, SAMPLES)) * [[[1.0]], [[3.0]]]
    windows = xr.Dataset(
        {"signal": (("window", "channel", "time"), noise)},
        coords={"state": ("window", list(states))},
        attrs={"speed_hz": SPEED},
    )
    store.save(windows, tmp_path / "reference.zarr")
    double = windows.assign(signal=(("window", "channel", "time"), np.tile(noise, 2)))
    store.save(double, tmp_path / "samples.zarr")
    run_script(
        "synchrosqueeze",
        tmp_path,
        {"images": tmp_path / "images.zarr"},
        {},
        {"sst": SST},
        samples=[tmp_path / "samples.zarr"],
        reference=tmp_path / "reference.zarr",
    )
    settings, scaling = SstSettings(**SST), np.tile(noise[max(states.find("H"), 0)][None], 2)
    rate = SAMPLES * SPEED
    settings = replace(settings, scale=amplitude_scale(scaling, rate, settings))
    expected = sst_images(np.tile(noise, 2), rate, settings)
    np.testing.assert_allclose(store.load(tmp_path / "images.zarr").signal, expected, rtol=1e-5)


def simulate_fault(folder, state, leak_area, pipe_length):
    """The store that the script writes for a recording of `SAMPLES` points a revolution."""
    store.save(
        xr.Dataset(
            {"signal": ("time", np.zeros(SAMPLES))},
            attrs={"speed_hz": SPEED, "load_pressure": PRESSURE},
        ),
        folder / "recorded.zarr",
    )
    run_script(
        "simulate_fault",
        folder,
        {"flow": folder / "fault.zarr"},
        {"state": state},
        {"leak_area": leak_area, "pipe_length": pipe_length},
        rig=sheet(folder),
        recordings=folder / "recorded.zarr",
    )
    return store.load(folder / "fault.zarr")


def test_a_compound_fault_is_both_faults_at_once(tmp_path):
    """The state S+C1 against the pump model with both leaks given by hand; it is neither alone."""
    rig = yaml.safe_load(RIG)

    def by_hand(*faults):
        outlet, fluid = ConstantPressure(PRESSURE), Fluid(**rig["fluid"])
        return simulate(rig["pump"], fluid, 60 * SPEED, outlet, faults, SAMPLES).flow

    flow = simulate_fault(tmp_path, "S+C1", {"S": 2e-7, "C1": 3e-7}, 5.0).source_flow.values
    np.testing.assert_allclose(flow, by_hand(Slipper(2e-7), Cylinder(3e-7)), rtol=1e-9)
    ripple = np.std(flow)
    for alone in (Slipper(2e-7), Cylinder(3e-7)):
        assert np.std(flow - by_hand(alone)) > 0.02 * ripple


def test_a_pipe_that_ends_before_a_sensor_is_refused(tmp_path):
    """One line names the configuration's key, the sensor beyond the end and the least length."""
    [sensor] = yaml.safe_load(RIG)["sensors"]
    with pytest.raises(InputError) as refused:
        simulate_fault(tmp_path, "H", {}, sensor["position"] - 0.01)
    assert str(refused.value) == (
        "config: faults.pipe_length: 0.41 m ends before sensor p1 at 0.42 m. Give at least 0.42"
    )
    assert not (tmp_path / "fault.zarr").exists()


def test_compound_ripples_stand_below_their_parts(tmp_path):
    """The picture of S+C1 has three panels, the single faults first; that of a dataset's own
    states has one each and no more."""
    rng = np.random.default_rng(0)
    for name, states in (("own", ["H", "S", "C1", "C2"]), ("compound", ["S+C1"])):
        signal = rng.standard_normal((len(states), 1, SAMPLES))
        store.save(
            xr.Dataset(
                {"signal": (("state", "channel", "time"), signal, {"units": "Pa"})},
                coords={"state": states, "channel": ["p1"]},
                attrs={"speed_hz": SPEED},
            ),
            tmp_path / f"{name}.zarr",
        )
    for name, titles in (("own", ["H", "S", "C1", "C2"]), ("compound", ["S", "C1", "S+C1"])):
        names = "ripple", "ripple_svg", "sst", "sst_svg"
        files = dict(zip(names, ("r.png", "r.svg", "s.png", "s.svg"), strict=True))
        run_script(
            "plot_seeds",
            tmp_path,
            {key: tmp_path / f"{name}_{file}" for key, file in files.items()},
            {"dataset": "CFD-P"},
            {"sst": {"min_frequency_hz": 12, "max_frequency_hz": 1500, "voices": 8, "k": 1.0}},
            rig=sheet(tmp_path),
            seeds=tmp_path / f"{name}.zarr",
            reference=tmp_path / "own.zarr",
        )
        svg = (tmp_path / f"{name}_r.svg").read_text()
        assert [line.strip() for line in svg.splitlines() if line.strip() in TITLES] == [
            f"<!-- {title} -->" for title in titles
        ]


def test_images_name_the_recording_that_scales_them(tmp_path):
    """No healthy recording is there: the scale of the colours is that of the first state that was
    recorded, and the picture says so."""
    angle = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    signal = np.sin(9 * angle) + np.arange(4)[:, None, None] * np.sin(angle)
    state = {"state": ["H", "S", "C1", "C2"]}
    dims = ("state", "channel", "time")
    store.save(xr.Dataset({"signal": (dims, signal)}, coords=state), tmp_path / "seeds.zarr")
    store.save(
        xr.Dataset(
            {"signal": (("window", "channel", "time"), np.repeat(signal[1:2], 4, axis=0))},
            coords={"state": ("window", ["S"] * 4), "recording": ("window", [0] * 4)},
            attrs={"speed_hz": SPEED},
        ),
        tmp_path / "recorded.zarr",
    )
    output = {name: tmp_path / f"o.{name}" for name in ("png", "svg")}
    run_script(
        "compare_sst",
        tmp_path,
        output | {"table": tmp_path / "o.csv"},
        {},
        {"titles": ["calibrated"], "sst": SST},
        rig=sheet(tmp_path),
        recorded=tmp_path / "recorded.zarr",
        seeds=[tmp_path / "seeds.zarr"],
    )
    assert "<!-- amplitude over the largest of S: recorded -->" in output["svg"].read_text()
