"""The two halves of a recording: one state is no drift, however short the recording is."""

from pathlib import Path

import numpy as np
import pytest

from paper_rig import paper_rig
from rippletwin.case.model import Recording
from rippletwin.explanation.checks.alarms import drift_p_value
from rippletwin.explanation.stages.preparation import observe_whole_and_halves

RIG = paper_rig(2)


def halves_of(revolutions, seed, change=0.0):
    """The halves of a recording at 1000 r/min with 2 kPa of white noise, of a ripple with random
    phases that is larger by `change` in the second half."""
    rng = np.random.default_rng(seed)
    turns = np.arange(int(revolutions * 1200) + 1) / 1200.0  # 20 kHz
    phase = rng.uniform(0.0, 2.0 * np.pi, 20)
    ripple = sum(1e5 / k * np.cos(18 * np.pi * k * turns + phase[k]) for k in range(1, 20))
    ripple = ripple * np.where(turns > 0.5 * turns[-1], 1.0 + change, 1.0)
    noise = rng.normal(0.0, 2e3, (2, len(turns)))
    pressure = 9.5e6 + np.stack([ripple, 0.7 * np.roll(ripple, 13)]) + noise
    recording = Recording(
        Path("a.h5"), "periodic", "healthy", "a", 1000.0, 9.5e6, 20000.0, pressure
    )
    _, *halves = observe_whole_and_halves(recording, RIG)
    return halves


@pytest.mark.parametrize("revolutions", [9.8, 12.2, 30.0])
def test_noise_is_no_drift(revolutions):
    """Statistics: of six steady recordings a p-value below 1 % is expected in one of 17 tries."""
    for seed in range(6):
        early, late = halves_of(revolutions, seed)
        assert drift_p_value([early], [late], RIG.delay)[0] > 0.01


@pytest.mark.parametrize("revolutions", [10.3, 30.0])
def test_a_step_between_the_halves_is_a_drift(revolutions):
    """A ripple that grows by 30 %, so that the test above can fail."""
    early, late = halves_of(revolutions, 0, 0.3)
    assert drift_p_value([early], [late], RIG.delay)[0] < 1e-6


def test_a_recording_of_few_revolutions_is_not_divided():
    """Three revolutions a half do not tell their scatter."""
    assert halves_of(6.2, 0) == []
