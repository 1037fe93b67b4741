"""Windows put together: pairs of recorded ones, probes without noise, a few of a recording."""

import numpy as np
import pytest

from rippletwin.errors import InputError
from rippletwin.learning.dataset import UNKNOWN, split_by_time
from rippletwin.learning.windows import (
    check_window_counts,
    early_healthy,
    early_known,
    first_of_each_state,
    noise_free_probes,
    pair_windows,
    spread_windows,
)


@pytest.mark.parametrize(("count", "enough"), [(1, False), (3, False), (4, True), (100, True)])
def test_a_recording_that_is_too_short_to_learn_from_is_named(count, enough):
    """Of four windows three are early, one of which is held out, and one is late; of three windows
    two are early, of which no fifth can be held out."""
    if enough:
        return check_window_counts({"a": 100, "b": count}, 0.8, 0.2)
    with pytest.raises(InputError, match=f"recording b: file: makes {count} windows") as e:
        check_window_counts({"a": 100, "b": count}, 0.8, 0.2)
    assert "experimental" in e.value.remedy


def test_pairs_are_consecutive_and_of_one_recording():
    """By hand: five windows of one recording and two of the next; the fifth has no partner."""
    first, second = pair_windows(np.array([0, 0, 0, 0, 0, 1, 1]))
    assert first.tolist() == [0, 2, 5] and second.tolist() == [1, 3, 6]


def test_a_single_window_makes_no_pair():
    """Of one recording there is one window: two recordings are never joined."""
    first, second = pair_windows(np.array([0, 1]))
    assert first.size == second.size == 0


def test_probes_begin_evenly_over_the_revolution():
    """Two states of 8 points, 4 turns, 2 revolutions: each probe is its state's revolution without
    its mean, begun a quarter later, and repeats."""
    signal = np.stack([np.arange(8.0), np.arange(8.0) ** 2])[:, None]
    probes = noise_free_probes(signal, turns=4, revolutions=2)
    assert probes.shape == (8, 1, 16) and probes.dtype == np.float32
    for state in range(2):
        revolution = signal[state, 0] - signal[state, 0].mean()
        for turn in range(4):
            expected = np.tile(np.roll(revolution, -2 * turn), 2)
            np.testing.assert_allclose(probes[4 * state + turn, 0], expected)


def test_windows_are_spread_over_the_first_recording_of_their_state():
    """Of ten windows three: the first, the middle, the last; of two all, none of them twice. Those
    of a second slipper, whose leak may be another, are left out."""
    state = np.array(["H"] * 10 + ["S"] * 7)
    recording = np.array([0] * 10 + [1] * 2 + [2] * 5)
    chosen = spread_windows(state, recording, 3)
    assert chosen["H"].tolist() == [0, 4, 9] and chosen["S"].tolist() == [10, 11]


def test_the_first_recording_of_each_state_is_the_papers_protocol():
    """Of two slippers the first; recordings of other states keep theirs, whatever the order."""
    state = np.array(["H", "H", "S", "S", "C", "S", "S", "H"])
    recording = np.array([0, 0, 1, 1, 2, 3, 3, 4])
    kept = first_of_each_state(state, recording)
    assert kept.tolist() == [True, True, True, True, True, False, False, False]


def test_early_known_windows_are_of_the_first_recording_of_their_state():
    """By hand: the early half of the healthy recording and of the first slipper's; neither those of
    a second slipper nor those of a recording that nobody knows."""
    state = np.array(["H"] * 4 + ["S"] * 2 + [UNKNOWN] * 2 + ["S"] * 2)
    recording = np.array([0] * 4 + [1] * 2 + [2] * 2 + [3] * 2)
    assert early_known(state, recording, 0.5).tolist() == [0, 1, 4]
    assert early_known(state, recording, 0.0).size == 0


def test_early_healthy_windows_are_of_one_recording():
    """The early half of the first healthy recording; InputError where there is none."""
    state, recording = np.array(list("SHHHHHH")), np.array([0, 1, 1, 1, 1, 2, 2])
    assert early_healthy(state, recording, 0.5).tolist() == [1, 2]
    with pytest.raises(InputError, match="none is healthy"):
        early_healthy(state[:1], recording[:1], 0.5)


@pytest.mark.parametrize("share", [0.3, 0.5, 0.75, 0.8, 0.9])
def test_early_healthy_windows_are_tested_by_no_network(share):
    """For any number of windows, odd ones too: neither a network on windows nor one on pairs is
    tested on a window that simulations have their misfit from."""
    for count in range(4, 60):
        recording = np.zeros(count, int)
        early = early_healthy(np.full(count, "H"), recording, share)
        _, late = split_by_time([count], share)
        pairs = np.transpose(pair_windows(recording))
        _, late_pairs = split_by_time([len(pairs)], share)
        assert not set(early) & {*late, *pairs[late_pairs].flat}, count


def test_a_healthy_recording_without_an_early_window_is_refused():
    """A single window is tested, so that nothing is left for simulations."""
    with pytest.raises(InputError, match="makes 1 windows, of which none is among the early 80%"):
        early_healthy(np.array(["H"]), np.array([0]), 0.8)
