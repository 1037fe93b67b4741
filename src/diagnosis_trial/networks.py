"""Networks that a rig's twin teaches, each on its own kind of simulated signals.

    P     one signal a class of fixed severities, from the twin in the time domain (the paper's)
    PR    severities, twins and their errors at random
    PRA   the same, the measured healthy ripple with the twin's change

They learn the operating point that has most healthy recordings and answer there alone.
"""

from __future__ import annotations

from collections import Counter

import numpy as np

from rippletwin.case.model import Case, Recording, Rig
from rippletwin.diagnosis.faults.library import FAULTS
from rippletwin.diagnosis.network_answers import (
    STATE_OF,
    is_at_their_point,
    judge_windows,
    windows_of,
)
from rippletwin.diagnosis.pump_flow import healthy_flow, leak_velocity, with_fitted_pump
from rippletwin.diagnosis.randomised_signals import FAULT_OF, SignalSource, severity_bins
from rippletwin.diagnosis.simulated_fault import simulate_fault
from rippletwin.harmonics import one_period, peak_amplitudes
from rippletwin.learning.architectures import CLASSES
from rippletwin.learning.conformal import fit_conformal
from rippletwin.learning.dataset import augment, each_once
from rippletwin.learning.kept_networks import KeptNetworks
from rippletwin.learning.networks import build
from rippletwin.learning.training import TrainingSettings, activation_statistics, train
from rippletwin.spectra.noise import noise_mad
from rippletwin.spectra.observation import revolutions_of
from rippletwin.twin.twin import Twin

ARCHITECTURE = "cnn1d_150_50"
SAMPLES = 3072  # of a revolution
DRAWS, HELD_OUT = 400, 100  # simulated revolutions of a class, to learn and for p-values
SAMPLES_OF_A_DRAW = 2
FIXED = {"S": 0.26, "C1": 0.26, "C2": 0.77}
"""Class -> the paper's leak on the default pump: its flow over the mean flow of one piston."""
SETTINGS = TrainingSettings(
    batch_size=8, learning_rate=0.003, target_loss=0.05, patience=1, max_epochs=40
)
SEED = 0


def teach_network(kind: str, twin: Twin, covariance: np.ndarray | None, case: Case) -> KeptNetworks:
    """The network of `kind`, P, PR or PRA, that the twin of a case teaches.

    covariance   of the twin's theta, None where it is not known
    """
    recording = _most_recorded(case.healthy)
    revolutions = revolutions_of(recording, case.rig, SAMPLES)
    speed_hz, pressure = float(np.mean(revolutions.speed_hz)), recording.load_pressure
    noise, rng = noise_mad(recording.pressure), np.random.default_rng(SEED)
    if kind == "P":
        signals = _fixed_signals(twin, speed_hz, pressure)
        x, y = augment(signals, DRAWS * SAMPLES_OF_A_DRAW, noise, rng)
        held_out, _ = augment(signals, HELD_OUT, noise, rng)
    else:
        source = SignalSource(twin, covariance, revolutions.windows, speed_hz, pressure)
        bins = _severities(twin, speed_hz, pressure)
        learnt, others = (
            source.draw(bins, CLASSES, count, rng, kind == "PRA").pressure
            for count in (DRAWS, HELD_OUT)
        )
        x, y = augment(learnt, DRAWS * SAMPLES_OF_A_DRAW, noise, rng)
        held_out, _ = each_once(others, noise, rng)
    network, _ = train(build(ARCHITECTURE, x.shape[1]), x, y, SETTINGS, SEED)
    seen, unseen = (activation_statistics(network, samples) for samples in (x, held_out))
    return KeptNetworks(
        architecture=ARCHITECTURE,
        dataset=kind,
        signal="pressure",
        channels=[sensor.name for sensor in case.rig.sensors],
        samples_per_revolution=SAMPLES,
        speed_hz=speed_hz,
        load_pressure=pressure,
        noise_std=noise.tolist(),
        weights=[network.state_dict()],
        conformal=[fit_conformal(seen, y, unseen)],
    )


def ask_network(kept: KeptNetworks, recordings: list[Recording], rig: Rig) -> dict:
    """What a network says, with the keys of diagnosis.json that are scored, of the recordings at
    its operating point. The p-value is that of the middle one of a recording's windows."""
    entries = []
    for recording in recordings:
        if not is_at_their_point(recording, kept):
            continue
        windows = windows_of(recording, rig, kept.samples_per_revolution)
        probabilities = dict.fromkeys(dict.fromkeys(STATE_OF.values()), 0.0)
        for name, share in zip(kept.classes, kept.probabilities(windows), strict=True):
            probabilities[STATE_OF[name]] += float(share)
        said, p_values = kept.answers(windows)
        entries.append(
            {
                "label": recording.label,
                "state": judge_windows(kept.classes, said, p_values)["state"],
                "probabilities": probabilities,
                "unlike": {"p_value": float(np.median(p_values))},
            }
        )
    return {"recordings": entries}


def _most_recorded(recordings: list[Recording]) -> Recording:
    """The first recording of the operating point that most periodic ones have."""
    periodic = [r for r in recordings if r.kind == "periodic"]
    points = Counter((r.speed_rpm, r.load_pressure) for r in periodic)
    point = points.most_common(1)[0][0]
    return next(r for r in periodic if (r.speed_rpm, r.load_pressure) == point)


def _fixed_signals(twin: Twin, speed_hz: float, pressure: float) -> np.ndarray:
    """One revolution (classes, sensors, M) of each class, Pa."""
    velocity, flow = _leak_scale(twin, speed_hz, pressure)
    signals = []
    for name in CLASSES:
        fault = FAULTS[FAULT_OF[name]] if name in FIXED else None
        area = FIXED.get(name, 0.0) * flow / velocity
        run = simulate_fault(twin, fault, area, 60.0 * speed_hz, pressure)
        orders = np.arange(1, min(run.pressure.shape[1], SAMPLES) // 2)
        signals.append(one_period(peak_amplitudes(run.pressure)[:, orders], SAMPLES, orders))
    return np.array(signals)


def _severities(twin: Twin, speed_hz: float, pressure: float) -> dict:
    """Leak areas, m2, of each faulty class: what `diagnose` considers, the cylinder's halved."""
    velocity, flow = _leak_scale(twin, speed_hz, pressure)
    ends = {
        name: [FAULTS[fault].smallest * flow / velocity, FAULTS[fault].largest * flow / velocity]
        for name, fault in (("S", "slipper"), ("C", "cylinder"))
    }
    return severity_bins(ends, float(np.sqrt(np.prod(ends["C"]))))


def _leak_scale(twin: Twin, speed_hz: float, pressure: float) -> tuple[float, float]:
    """Velocity of a leak, m/s, and mean flow of one piston, m3/s."""
    rig = with_fitted_pump(twin).rig
    flow = healthy_flow(rig.pump, rig.fluid, 60.0 * speed_hz, pressure).flow.mean()
    velocity = leak_velocity(rig.pump, rig.fluid, pressure)
    return float(velocity), float(flow) / rig.pump["pistons"]
