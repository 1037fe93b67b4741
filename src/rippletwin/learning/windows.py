"""Windows of one revolution put together: pairs, probes without noise, a few of a recording."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from rippletwin.errors import InputError
from rippletwin.learning.dataset import UNKNOWN, remove_mean, split_by_time


def check_window_counts(counts: Mapping[str, int], share: float, validation: float) -> None:
    """Raise InputError where a recording, by its label, has too few windows to learn from the early
    `share`, of which a share of `validation` is held out, and to test the rest."""
    for label, count in counts.items():
        early = round(share * count)
        if not (early < count and 0 < round(validation * early) < early):
            raise InputError(
                f"recording {label}",
                "file",
                f"makes {count} windows, too few to learn from the early ones, hold some of them "
                "out and test the rest",
                "Record ten revolutions or more, or leave the dataset experimental out",
            )


def pair_windows(recording: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Indices of the first and of the second windows (pairs,) of two revolutions each.

    recording : (n,) which recording a window is of. Consecutive windows of one recording make a
    pair and none is in two; the last of an odd number is left out.
    """
    first, second = [], []
    for name in dict.fromkeys(np.asarray(recording).tolist()):
        at = np.flatnonzero(recording == name)
        count = len(at) // 2
        first.append(at[0 : 2 * count : 2])
        second.append(at[1 : 2 * count : 2])
    return np.concatenate(first), np.concatenate(second)


def noise_free_probes(signal: np.ndarray, turns: int, revolutions: int) -> np.ndarray:
    """Every state's revolution begun at `turns` crank angles, evenly spread, without its mean.

    signal : (states, channels, M), one revolution each. Returns (states * turns, channels,
    M * revolutions) float32, all turns of a state in a row.
    """
    signal = remove_mean(np.asarray(signal, dtype=float))
    points = signal.shape[-1]
    starts = np.arange(turns) * points // turns
    turned = np.stack([np.roll(signal, -start, axis=-1) for start in starts], axis=1)
    return (
        np.tile(turned, revolutions)
        .reshape(-1, signal.shape[1], points * revolutions)
        .astype(np.float32)
    )


def first_of_each_state(state: np.ndarray, recording: np.ndarray) -> np.ndarray:
    """Mask (n,) of the windows of the first recording of every state: the paper's protocol.

    state, recording : (n,) of each window.
    """
    recording = np.asarray(recording)
    _, first, of_state = np.unique(np.asarray(state, str), return_index=True, return_inverse=True)
    return recording == recording[first][of_state]


def learnt_from(state: np.ndarray, recording: np.ndarray) -> np.ndarray:
    """Mask (n,) of the windows of the first recording of every known state, from which networks of
    recordings learn.

    state, recording : (n,) of each window.
    """
    return first_of_each_state(state, recording) & (np.asarray(state) != UNKNOWN)


def early_known(state: np.ndarray, recording: np.ndarray, share: float) -> np.ndarray:
    """Indices of the early `share` of the windows that are `learnt_from`.

    state, recording : (n,) of each window; a recording's windows follow each other, and recordings
    are numbered in their order.
    """
    early, _ = split_by_time(np.bincount(recording), share)
    return early[learnt_from(state, recording)[early]]


def early_healthy(state: np.ndarray, recording: np.ndarray, share: float) -> np.ndarray:
    """Indices of the early `share` of the windows of the first healthy recording.

    None of them is a late window of `split_by_time`, nor part of a late pair of `pair_windows`.

    Raises InputError where no recording is healthy, and where the first has no early windows.
    """
    healthy = np.flatnonzero((np.asarray(state) == "H") & first_of_each_state(state, recording))
    if not len(healthy):
        raise InputError(
            "rig.yaml",
            "recordings",
            "none is healthy at the diagnosed operating point",
            "Record one, or leave the randomised datasets out",
        )
    count = len(healthy)
    # the shares of windows and of pairs are rounded apart: the earlier cut is before both tests
    (early, _), (pairs, _) = (split_by_time([n], share) for n in (count, count // 2))
    kept = min(len(early), 2 * len(pairs))
    if not kept:
        raise InputError(
            "rig.yaml",
            "recordings",
            f"the first healthy one at the diagnosed operating point makes {count} windows, of "
            f"which none is among the early {share:.0%}",
            "Record ten revolutions or more, or leave the randomised datasets out",
        )
    return healthy[:kept]


def spread_windows(state: np.ndarray, recording: np.ndarray, count: int) -> dict[str, np.ndarray]:
    """State -> indices of at most `count` windows of its first recording, evenly from the first to
    the last.

    state, recording : (n,) of each window.
    """
    chosen, is_first = {}, first_of_each_state(state, recording)
    for name in dict.fromkeys(np.asarray(state).tolist()):
        at = np.flatnonzero((state == name) & is_first)
        chosen[name] = at[np.unique(np.linspace(0, len(at) - 1, count).round().astype(int))]
    return chosen
