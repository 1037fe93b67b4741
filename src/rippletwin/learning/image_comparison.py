"""How alike the images of simulated and recorded revolutions are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from rippletwin.learning.dataset import remove_mean
from rippletwin.learning.synchrosqueezing import SstSettings, image_similarity, sst_images
from rippletwin.learning.windows import pair_windows

RECORDED = "recorded"  # source of the row that compares a recording with itself
SILENCE = 1.0  # of a pixel without energy, exp(0)


def recorded_pairs(
    windows: np.ndarray,
    state: np.ndarray,
    recording: np.ndarray,
    simulated: Sequence[str],
    count: int,
) -> dict[str, tuple[str, np.ndarray]]:
    """Simulated state -> the recordings' name of it, and windows of two revolutions.

    windows : (n, channels, M) recorded, one revolution each; state, recording : (n,) of each.
    At most `count` windows (n, channels, 2 M) a state, each of one recording; a state that nobody
    recorded is left out. The name is C where the recordings' cylinder fault has no severity.
    """
    first, second = pair_windows(recording)
    pairs = {}
    for wanted in simulated:
        name = wanted if wanted in state else wanted[0]
        of_state = np.flatnonzero(state[first] == name)[:count]
        if len(of_state):
            halves = windows[first[of_state]], windows[second[of_state]]
            pairs[wanted] = name, np.concatenate(halves, axis=-1)
    return pairs


def two_revolutions(revolution: np.ndarray) -> np.ndarray:
    """(1, channels, 2 M) without its mean, from one simulated revolution (channels, M)."""
    return np.tile(remove_mean(revolution)[None], 2)


def compare_images(
    recorded: Mapping[str, np.ndarray],
    simulated: Mapping[str, Mapping[str, np.ndarray]],
    sampling_rate_hz: float,
    settings: SstSettings,
) -> pd.DataFrame:
    """Similarity and amplitude ratio of every simulated image with the recorded ones of its state.

    recorded : state -> windows (n, channels, 2 M), n at least 1; simulated : source -> state ->
    windows (1, channels, 2 M). A row a state and source: mean and standard deviation of
    `synchrosqueezing.image_similarity` over the recorded windows. The source `RECORDED` compares
    the last recorded window with those before it, which is as alike as a simulation can be.
    """
    rows = []
    for state, windows in recorded.items():
        seen = sst_images(windows, sampling_rate_hz, settings) - SILENCE
        compared = {RECORDED: (seen[:-1], seen[-1])} if len(seen) > 1 else {}
        for source, states in simulated.items():
            image = sst_images(states[state], sampling_rate_hz, settings)[0] - SILENCE
            compared[source] = seen, image
        for source, (references, image) in compared.items():
            alike, amplitude = np.array([image_similarity(one, image) for one in references]).T
            rows.append(
                dict(state=state, source=source, windows=len(references))
                | dict(similarity=alike.mean(), similarity_std=alike.std())
                | dict(amplitude=amplitude.mean(), amplitude_std=amplitude.std())
            )
    return pd.DataFrame(rows)
