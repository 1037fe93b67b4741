"""Errors of the virtual flow sensors against the virtual rig's true outlet flow.

    python benchmarks/flow_sensor_truth.py FOLDER [--steps 300] [--seconds 3]

Records healthy, slipper and cylinder states with three sensors into FOLDER, the truth beside the
case. Calibrates a twin with the paper's physics and explains the case, with the first two sensors
and with all. Then scores the flow that each sensor estimates at the pump's outlet. Results that
FOLDER already holds are used again; FOLDER/2/calibrated.json and FOLDER/2/corrected.json may be
twins from elsewhere. Times are processor times of one thread for one window, in batches of all.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import h5py
import numpy as np
import torch
import yaml

from rippletwin.calibration.calibrate import Settings, calibrate
from rippletwin.case.load import load_case
from rippletwin.case.model import Case
from rippletwin.explanation.explain import explain
from rippletwin.flow_sensor import pinn
from rippletwin.flow_sensor.estimate import band_limit
from rippletwin.flow_sensor.line_response import line_factory
from rippletwin.flow_sensor.spectral_inversion import estimate_flow
from rippletwin.harmonics import peak_amplitudes
from rippletwin.learning.dataset import augment
from rippletwin.learning.networks import build
from rippletwin.learning.training import TrainingSettings, predict, train
from rippletwin.pump.faults import Cylinder, Slipper
from rippletwin.pump.outlets import ConstantPressure
from rippletwin.pump.simulation import simulate
from rippletwin.spectra.angular_resampling import cut_revolutions
from rippletwin.spectra.noise import noise_cycle_scatter, noise_mad
from rippletwin.spectra.observation import observe
from rippletwin.twin import twin_file
from rippletwin.twin.twin import Twin
from rippletwin.twin.twin_file import load_twin

RIG = Path(__file__).resolve().parent.parent / "src" / "virtualrig"
THIRD_POSITION, THIRD_ERROR = 4.6, 0.012  # m: the third sensor on the data sheet, its error
BAND, SAMPLES, WINDOWS = 1510.0, 3072, 40  # Hz: includes the tenth pumping harmonic
EDGES = (0.0, 500.0, 1000.0, BAND)  # Hz
EXTRA_NOISE = 4000.0  # Pa
SEEDS = 2  # networks whose accuracies are averaged
FAULTS = {"H": None, "S": Slipper(2e-7), "C1": Cylinder(2e-7), "C2": Cylinder(6e-7)}


def record(folder: Path, seconds: float) -> None:
    """Record the built-in rig with a third sensor; the truth goes beside the case."""
    for name, entry in (
        ("sheet", {"name": "p3", "position": THIRD_POSITION}),
        ("sealed", THIRD_POSITION + THIRD_ERROR),
    ):
        data = yaml.safe_load((RIG / f"{name}.yaml").read_text())
        data["sensors"] = [*data["sensors"], entry]
        (folder / f"{name}.yaml").write_text(yaml.safe_dump(data))
    subprocess.run(
        [
            str(Path(sys.executable).with_name("virtualrig")), "record", "--points", "smoke",
            "--out", folder / "case", "--true-flow", folder / "truth", "--seconds", str(seconds),
            "--sheet", folder / "sheet.yaml", "--sealed", folder / "sealed.yaml",
        ],
        check=True,
    )  # fmt: skip


def with_sensors(case: Case, count: int) -> Case:
    """The case with only the first `count` sensors."""
    rig = replace(case.rig, sensors=case.rig.sensors[:count])
    kept = [replace(r, pressure=r.pressure[:count]) for r in case.recordings]
    return replace(case, rig=rig, recordings=tuple(kept))


def lines(case: Case, folder: Path) -> dict[str, Twin]:
    """The calibrated twin, the corrected twin, and the latter with all wave speeds 1 % high."""
    folder.mkdir(exist_ok=True)

    def load_or_make(name, make):
        path = folder / f"{name}.json"
        if not path.exists():
            print(f"making {path}", file=sys.stderr, flush=True)
            path.write_text(json.dumps(twin_file.to_dict(make())))
        return load_twin(path)

    def calibrated():
        observations = [observe(r, case.rig, piston_harmonics_only=True) for r in case.healthy]
        return calibrate(Twin(case.rig, observations), observations, Settings()).twin

    paper = load_or_make("calibrated", calibrated)
    corrected = load_or_make("corrected", lambda: explain(case, 2).twin)
    theta = corrected.theta.copy()
    for k, parameter in enumerate(corrected.parameters):
        if parameter.name.startswith("wave_speed"):
            theta[k] += np.log(1.01) / parameter.prior.scale
    return {
        "paper's physics": paper,
        "corrected": corrected,
        "corrected, wave speeds 1 % high": corrected.with_(theta=theta),
    }


def windows_of(recording, pistons: int, truth: Path):
    """Pressure (n, S, M), speeds (n,), and the true outlet flow's harmonics (n, orders)."""
    with h5py.File(truth) as file:
        turns, flow = file["turns"][:], file["outlet_flow"][:]
    # The crank angle is resampled as two more channels, too small to affect the search for angles.
    crank = 1e-6 * np.array([np.cos(2 * np.pi * turns), np.sin(2 * np.pi * turns)])
    cut = cut_revolutions(
        np.concatenate([recording.pressure, crank]),
        recording.sampling_rate_hz,
        pistons,
        recording.speed_rpm,
        SAMPLES,
    )
    windows = cut.windows[:WINDOWS]
    start = np.angle(windows[:, -2, 0] + 1j * windows[:, -1, 0])
    orders = np.arange(1, int(BAND / cut.speed_hz.mean()) + 1)
    harmonics = peak_amplitudes(flow)[orders]
    return (
        windows[:, :-2],
        cut.speed_hz[:WINDOWS],
        harmonics * np.exp(1j * np.outer(start, orders)),
    )


def relative_errors(estimate: np.ndarray, truth: np.ndarray, speed_hz: float) -> list[float]:
    """Relative rms error of harmonics (n, F) in each band, and in all."""
    frequency_hz = speed_hz * np.arange(1, estimate.shape[1] + 1)
    bands = [(low < frequency_hz) & (frequency_hz <= high) for low, high in pairwise(EDGES)]
    wrong, right = np.sum(np.abs(estimate - truth) ** 2, axis=0), np.sum(np.abs(truth) ** 2, axis=0)
    return [float(np.sqrt(wrong[b].sum() / right[b].sum())) for b in (*bands, frequency_hz > 0)]


def classifiers(rig, speed_hz: float, load_pressure: float, noise: float):
    """Networks (the paper's CNN1D 341@100), trained on the simulated source flow."""
    outlet = ConstantPressure(load_pressure)
    states = np.array(
        [simulate(rig.pump, rig.fluid, 60 * speed_hz, outlet, f).flow for f in FAULTS.values()]
    )
    states = band_limit(states, speed_hz, BAND)[:, None]
    settings = TrainingSettings(batch_size=16, learning_rate=0.003, max_epochs=40)
    for seed in range(SEEDS):
        x, y = augment(states, 150, np.array([noise]), np.random.default_rng(seed))
        yield train(build("cnn1d_341_100", channels=1), x, y, settings, seed)[0]


def accuracy_of(networks, flows: dict[str, np.ndarray]) -> float:
    """Share of windows that are given the right state, a cylinder fault of either severity."""
    hits = []
    for state, flow in flows.items():
        for network in networks:
            states = np.array(list(FAULTS))[predict(network, flow[:, None].astype(np.float32))[0]]
            hits += [name[0] == state for name in states]
    return float(np.mean(hits))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--steps", type=int, default=300, help="of training a trunk")
    parser.add_argument("--seconds", type=float, default=3.0, help="of a recording")
    options = parser.parse_args()
    torch.set_num_threads(1)
    options.folder.mkdir(parents=True, exist_ok=True)
    if not (options.folder / "truth").is_dir():
        record(options.folder, options.seconds)
    whole = load_case(options.folder / "case")

    print("| sensors | line | noise | method | 0-0.5 kHz | 0.5-1 | 1-1.5 | all | ms | CFD-Q |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for count in (2, 3):
        case = with_sensors(whole, count)
        pistons = case.rig.pump["pistons"]
        point = next(r for r in case.recordings if r.state != "healthy")
        taken = {
            r.state_code: (r, *windows_of(r, pistons, options.folder / f"truth/{r.file.stem}.h5"))
            for r in case.recordings
            if (r.speed_rpm, r.load_pressure) == (point.speed_rpm, point.load_pressure)
        }
        own = noise_mad(taken["H"][0].pressure)
        speed = np.concatenate([speeds for _, _, speeds, _ in taken.values()])
        truth = np.concatenate([harmonics for *_, harmonics in taken.values()])
        pressure = np.concatenate([windows for _, windows, *_ in taken.values()])
        states = np.repeat(list(taken), [len(windows) for _, windows, *_ in taken.values()])
        for name, twin in lines(case, options.folder / str(count)).items():
            line_at = line_factory(twin, point.load_pressure)
            trunk, _ = pinn.train(line_at, speed.mean(), BAND, pinn.Settings(steps=options.steps))
            for noise in (0.0, EXTRA_NOISE):
                extra = noise * np.random.default_rng(0).standard_normal(pressure.shape)
                noise_level = np.hypot(own, noise)
                for method, run, trained in (
                    ("spectral", estimate_flow, ()),
                    ("PINN", pinn.estimate_flow, (trunk,)),
                ):
                    given = (pressure + extra, speed, line_at, *trained, noise_level, BAND)
                    started = time.process_time()
                    estimate = run(*given, of="outlet").harmonics
                    spent = 1e3 * (time.process_time() - started) / len(pressure)
                    accuracy = "–"
                    if not noise:
                        source = run(*given, of="source").flow
                        flows = {s: source[states == s] for s in taken}
                        scatter = noise_cycle_scatter(flows["H"][:, None])[0]
                        networks = classifiers(case.rig, speed.mean(), point.load_pressure, scatter)
                        accuracy = f"{100 * accuracy_of(list(networks), flows):.0f} %"
                    errors = [
                        f"{100 * e:.1f} %" for e in relative_errors(estimate, truth, speed.mean())
                    ]
                    cells = [
                        str(count), name, "the rig's" if not noise else f"+ {noise / 1e3:g} kPa",
                        method, *errors, f"{spent:.1f}", accuracy,
                    ]  # fmt: skip
                    print("| " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
