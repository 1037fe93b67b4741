"""Networks that a rig's twin teaches, each on its own kind of simulated signals.

    P     pressure: one signal a class of fixed severities, from the twin in the time domain (the
          paper's)
    PR    severities, twins and their errors at random
    PRA   the same, the measured healthy ripple with the twin's change
    Q     flow: one signal a class of fixed severities; recordings become flow at the pump's outlet
          by the twin's line
    QR    severities and errors of the flow at random

They learn the operating point that has most healthy recordings and answer there alone.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from diagnosis_trial.taught_signals import fixed_signals, leak_bins
from rippletwin.case.model import Case, Recording, Rig
from rippletwin.diagnosis.diagnosis import odds_against_healthy
from rippletwin.diagnosis.network_answers import (
    STATE_OF,
    cut_windows,
    is_at_their_point,
    judge_windows,
)
from rippletwin.diagnosis.pump_flow import simulate_healthy_pump, with_fitted_pump
from rippletwin.diagnosis.randomised_signals import SignalSource
from rippletwin.flow_sensor.estimate import band_limit, keep_orders
from rippletwin.flow_sensor.line_response import line_factory
from rippletwin.flow_sensor.methods import noise_of_flow
from rippletwin.flow_sensor.spectral_inversion import estimate_flow
from rippletwin.learning.architectures import CLASSES
from rippletwin.learning.conformal import fit_conformal
from rippletwin.learning.dataset import augment, each_once
from rippletwin.learning.kept_networks import KeptNetworks
from rippletwin.learning.networks import build
from rippletwin.learning.training import TrainingSettings, activation_statistics, train
from rippletwin.spectra.noise import noise_mad
from rippletwin.spectra.observation import revolutions_of
from rippletwin.twin.twin import Twin

ARCHITECTURE = "cnn1d_341_100"
SAMPLES = 3072  # of a revolution
DRAWS, HELD_OUT = 1600, 100  # simulated revolutions of a class, to learn and for p-values
FIXED_KINDS, FLOW_KINDS = ("P", "Q"), ("Q", "QR")
BANDWIDTH_HZ = 1500.0  # of the estimated flow, the workflow's default
EPOCHS = 30  # no plateau ends a training before its learning rate has fallen: most is learnt then
SETTINGS = TrainingSettings(
    batch_size=16,
    falling_rate=True,
    target_loss=0.05,
    patience=1,
    plateau=EPOCHS,
    max_epochs=EPOCHS,
)
SEED = 0


def teach_network(kind: str, twin: Twin, covariance: np.ndarray | None, case: Case) -> KeptNetworks:
    """The network of `kind`, P, PR, PRA, Q or QR, that the twin of a case teaches.

    covariance   of the twin's theta, None where it is not known
    """
    recording = _most_recorded(case.healthy)
    revolutions = revolutions_of(recording, case.rig, SAMPLES)
    speed_hz, pressure = float(np.mean(revolutions.speed_hz)), recording.load_pressure
    rng = np.random.default_rng(SEED)
    if kind in FIXED_KINDS:
        once = fixed_signals(kind, twin, SAMPLES, speed_hz, pressure)
        learnt, others = (_repeated(once, count) for count in (DRAWS, HELD_OUT))
    else:
        source = SignalSource(twin, covariance, revolutions.windows, speed_hz, pressure)
        bins, anchored = leak_bins(twin, speed_hz, pressure), kind == "PRA"
        drawn = [source.draw(bins, CLASSES, n, rng, anchored) for n in (DRAWS, HELD_OUT)]
        learnt, others = (each.flow if kind == "QR" else each.pressure for each in drawn)
    signal, channels = "pressure", [sensor.name for sensor in case.rig.sensors]
    noise = noise_mad(recording.pressure)
    if kind in FLOW_KINDS:
        signal, channels = "flow", ["outlet"]
        learnt, others = (band_limit(s, speed_hz, BANDWIDTH_HZ) for s in (learnt, others))
        flow = _flow_windows(recording, case.rig, twin, speed_hz)[:, 0]
        noise = noise_of_flow(flow, np.zeros(len(flow)), np.ones(len(flow), bool))
    x, y = augment(learnt, DRAWS, noise, rng)
    held_out, _ = each_once(others, noise, rng)
    network, _ = train(build(ARCHITECTURE, x.shape[1]), x, y, SETTINGS, SEED)
    seen, unseen = (activation_statistics(network, samples) for samples in (x, held_out))
    return KeptNetworks(
        architecture=ARCHITECTURE,
        dataset=kind,
        signal=signal,
        channels=channels,
        samples_per_revolution=SAMPLES,
        speed_hz=speed_hz,
        load_pressure=pressure,
        weights=[network.state_dict()],
        conformal=[fit_conformal(seen, y, unseen)],
    )


def ask_network(kept: KeptNetworks, recordings: list[Recording], rig: Rig, twin: Twin) -> dict:
    """What a network says, with the keys that are scored, of the recordings at its operating point.
    The p-value is that of the middle one of a recording's windows; below the least rank it falls in
    inverse proportion to the nonconformity, so that it ranks recordings. A network that judges flow
    is asked about the flow by the line of `twin`."""
    entries = []
    for recording in recordings:
        if not is_at_their_point(recording, kept):
            continue
        if kept.signal == "flow":
            windows = _flow_windows(recording, rig, twin, kept.speed_hz)
        else:
            windows = cut_windows(recording, rig, kept.samples_per_revolution)
        log_shares = _by_state(kept.classes, kept.log_probabilities(windows))
        said, p_values = kept.answers(windows)
        beyond = max(float(np.median(kept.strangeness(windows))), 1.0)
        entries.append(
            {
                "label": recording.label,
                "state": judge_windows(kept.classes, said, p_values)["state"],
                "probabilities": {name: float(np.exp(v)) for name, v in log_shares.items()},
                "log_odds": odds_against_healthy(log_shares),
                "unlike": {"p_value": float(np.median(p_values)) / beyond},
            }
        )
    return {"recordings": entries}


def _by_state(classes: Sequence[str], log_shares: np.ndarray) -> dict[str, float]:
    """Logarithm of the probability of each state, of those of the classes."""
    found: dict[str, float] = {}
    for name, value in zip(classes, log_shares, strict=True):
        state = STATE_OF[name]
        found[state] = float(np.logaddexp(found.get(state, -np.inf), value))
    return found


def _repeated(signals: np.ndarray, count: int) -> np.ndarray:
    """Each of signals (classes, channels, M) so often: (classes, count, channels, M)."""
    return np.broadcast_to(signals[:, None], (len(signals), count, *signals.shape[1:]))


def _most_recorded(recordings: list[Recording]) -> Recording:
    """The first recording of the operating point that most periodic ones have."""
    periodic = [r for r in recordings if r.kind == "periodic"]
    points = Counter((r.speed_rpm, r.load_pressure) for r in periodic)
    point = points.most_common(1)[0][0]
    return next(r for r in periodic if (r.speed_rpm, r.load_pressure) == point)


def _flow_windows(recording: Recording, rig: Rig, twin: Twin, learnt_speed_hz: float) -> np.ndarray:
    """Flow (R, 1, M) of the source by the twin's line in windows of one revolution, m3/s, at the
    shaft orders that a network has learnt."""
    revolutions = revolutions_of(recording, rig, SAMPLES)
    fitted, pressure = with_fitted_pump(twin), recording.load_pressure
    ripple = simulate_healthy_pump(fitted.rig.pump, fitted.rig.fluid, recording.speed_rpm, pressure)
    found = estimate_flow(
        revolutions.windows,
        revolutions.speed_hz,
        line_factory(fitted, pressure, ripple),
        noise_mad(recording.pressure),
        keep_orders(BANDWIDTH_HZ, learnt_speed_hz, revolutions.speed_hz, SAMPLES),
    )
    return found.flow[:, None]
