"""Long recordings: the cost of an analysis grows with their length, not with its cube."""

import tracemalloc

import numpy as np
import pytest

from case_folders import RATE, ripple, sheet, write_case
from rippletwin.case import speed_estimate
from rippletwin.case.load import load_case
from rippletwin.case.model import Recording
from rippletwin.case.signal_checks import longest_run, signal_errors
from rippletwin.spectra import case_summary, noise, speed_regression
from rippletwin.spectra.angular_resampling import cut_revolutions
from rippletwin.spectra.speed_regression import (
    MAX_BLOCK_REVOLUTIONS,
    mean_speed,
    regress_to_mean_speed,
)

MEAN_HZ, DELAY_S, NOISE = 1000 / 60, 60e-3, 0.05
ORDER, COPIES = 180, 40


def delayed(count, seed):
    """Speeds (R,), spectra (R, 1, COPIES) of a delay seen at them, and what it is at their mean."""
    rng = np.random.default_rng(seed)
    time = np.arange(count) / MEAN_HZ
    deviation = 1e-3 * np.sin(2 * np.pi * 0.02 * time) + 5e-4 * np.sin(2 * np.pi * 0.07 * time + 1)
    speed = MEAN_HZ * (1 + deviation)

    def answer(hz):
        return np.exp(-2j * np.pi * ORDER * hz * DELAY_S)

    noise = rng.standard_normal((count, 1, COPIES)) + 1j * rng.standard_normal((count, 1, COPIES))
    spectra = answer(speed)[:, None, None] + NOISE * noise
    return speed, spectra, answer(mean_speed(speed))


def test_blocks_are_as_good_as_one_regression(monkeypatch):
    """Statistics: 300 revolutions in three blocks and in one, against the delay itself. The blocks'
    error is at most a quarter larger, and both are as large as the covariance says. The mean of the
    revolutions errs ten times as much."""
    speed, spectra, true = delayed(300, 0)
    orders = np.full(COPIES, ORDER)
    errors = []
    for most in (speed_regression.MAX_REVOLUTIONS_TOGETHER, 1000):
        monkeypatch.setattr(speed_regression, "MAX_REVOLUTIONS_TOGETHER", most)
        values, covariance = regress_to_mean_speed(spectra, speed, orders)
        error = np.abs(values[0] - true) ** 2
        assert np.mean(error / covariance[:, 0, 0].real) == pytest.approx(1.0, abs=0.5)
        errors.append(np.sqrt(np.mean(error)))
    assert errors[0] < 1.25 * errors[1]
    plain = np.sqrt(np.mean(np.abs(spectra.mean(axis=0) - true) ** 2))
    assert plain > 10 * errors[0]


def test_no_matrix_is_larger_than_a_block(monkeypatch):
    """What is decomposed of 2000 revolutions has no more rows than a block, so that cost and memory
    are proportional to the revolutions; each band is reported."""
    sizes, steps = [], []
    decompose = np.linalg.eigh

    def recorded(matrix):
        sizes.append(len(matrix))
        return decompose(matrix)

    monkeypatch.setattr(np.linalg, "eigh", recorded)
    speed, spectra, true = delayed(2000, 1)
    tracemalloc.start()
    try:
        values, _ = regress_to_mean_speed(
            spectra, speed, np.full(COPIES, ORDER), lambda *step: steps.append(step)
        )
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert max(sizes) < MAX_BLOCK_REVOLUTIONS and steps == [(1, 1)]
    assert peak < 15 * spectra.nbytes + 30 * 16 * MAX_BLOCK_REVOLUTIONS**2
    assert np.abs(values[0] - true).max() < 0.02


def test_cutting_takes_memory_in_proportion_to_the_recording():
    """Six times the recording; with all windows, which overlap, transformed at once it is eight."""
    pressure = ripple(8.0)
    tracemalloc.start()
    try:
        cut_revolutions(pressure, RATE, 9, 1000.0)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 7 * pressure.nbytes


@pytest.fixture
def long_recording(monkeypatch):
    """40 s at 1000 r/min, of which a quarter is analysed: blocks are smaller than they are."""
    monkeypatch.setattr(case_summary, "MAX_ANALYSED_REVOLUTIONS", 100)
    monkeypatch.setattr(speed_estimate, "BLOCK_SAMPLES", 2**17)
    monkeypatch.setattr(noise, "BLOCK_SAMPLES", 2**17)
    pressure = ripple(40.0).astype(np.float32)
    return Recording(
        file=None, kind="periodic", state="healthy", label="long", speed_rpm=1000.0,
        load_pressure=9.5e6, sampling_rate_hz=RATE, pressure=pressure,
    )  # fmt: skip


def test_the_middle_of_a_long_recording_is_analysed(tmp_path, long_recording):
    """Truth: 1 kPa of noise, five piston harmonics, 1000 r/min. All samples are counted, 100
    revolutions are analysed, and memory grows by no more than the recording itself."""
    write_case(tmp_path, sheet())
    rig = load_case(tmp_path).rig
    tracemalloc.start()
    try:
        assert signal_errors(long_recording, rig) == []
        found, observation = case_summary.summarise_recording(long_recording, rig)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert found["revolutions"] == pytest.approx(40 * 1000 / 60, abs=1)
    assert 95 <= found["analysed_revolutions"] <= 105
    assert found["speed_rpm"] == pytest.approx(1000, abs=0.1)
    assert found["speed_range_rpm"] == pytest.approx([1000, 1000], abs=2)
    for sensor in found["sensors"]:
        assert sensor["noise_pa"] == pytest.approx(1e3, rel=0.03)
        assert sensor["piston_harmonics"][0] == 5
        assert sensor["mean_pa"] == pytest.approx(9.5e6, abs=10)
    assert observation.values.shape[0] == 2
    assert peak < 4 * long_recording.pressure.nbytes


def test_a_speed_that_changes_is_seen_outside_the_middle(tmp_path, long_recording):
    """The first eighth of the recording turns 2 % slower: the range says so."""
    write_case(tmp_path, sheet())
    rig = load_case(tmp_path).rig
    slow = ripple(5.0, speed_hz=0.98 * 1000 / 60)
    long_recording.pressure[:, : slow.shape[1]] = slow
    found, _ = case_summary.summarise_recording(long_recording, rig)
    assert found["speed_range_rpm"] == pytest.approx([980, 1000], abs=2)


@pytest.mark.parametrize("seed", range(5))
def test_the_longest_run_is_that_of_a_plain_count(seed):
    """Independent truth: every run counted. Values are few, so that grid points often agree."""
    rng = np.random.default_rng(seed)
    row = rng.integers(0, 3, 5000).astype(float)
    for start, length in ((rng.integers(4000), 300), (4970, 30), (0, 40)):
        row[start : start + length] = 1.0
    edges = np.flatnonzero(np.diff(row, prepend=np.nan, append=np.nan))
    runs = np.diff(edges)
    assert longest_run(row, 32) == (edges[np.argmax(runs)], runs.max())
    assert longest_run(row, 5000) == (0, 0)
    assert longest_run(np.ones(5000), 32) == (0, 5000)
