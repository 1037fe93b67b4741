"""The synchrosqueezed transform against tones, reconstruction and ssqueezepy; the image chain."""

from __future__ import annotations

import numpy as np
import pytest

from rippletwin.learning.synchrosqueezing import (
    COLUMNS,
    SstSettings,
    amplitude_scale,
    frequency_axis,
    image_axes,
    sst_images,
    synchrosqueeze,
)

RATE = 51200.0
POINTS = 6144  # two revolutions at 1000 r/min
LINE = RATE / POINTS  # Hz between spectrum lines
TIME = np.arange(POINTS) / RATE
BAND = SstSettings()


def ripple(rng, lines=range(2, 150)):
    """A periodic in-band signal of random harmonics, amplitudes falling with frequency."""
    return sum(
        np.cos(2 * np.pi * k * LINE * TIME + rng.uniform(0, 2 * np.pi)) / (1 + (k / 20) ** 2)
        for k in lines
    )


@pytest.mark.parametrize("order", [1, 2, 4, 9, 18, 27, 89])
def test_a_tone_lands_in_its_row_with_its_amplitude(order):
    """Analytic: a tone of amplitude 3 at a shaft order reads 3 in the nearest row at all times and
    (next to) nothing elsewhere."""
    frequency = order * 2 * LINE
    squeezed = np.abs(synchrosqueeze(3 * np.cos(2 * np.pi * frequency * TIME)[None], RATE, BAND))[0]
    row = np.abs(np.log(frequency_axis(BAND) / frequency)).argmin()
    np.testing.assert_allclose(squeezed[row], 3, rtol=2e-5)
    assert np.delete(squeezed, row, axis=0).max() < 3e-5


def test_rows_sum_to_the_signal():
    """Reconstruction: the real part summed over rows is the in-band signal at the columns' times,
    so no energy of the band is lost or counted twice."""
    signal = ripple(np.random.default_rng(0))
    squeezed = synchrosqueeze(signal[None], RATE, BAND)[0]
    at = np.arange(COLUMNS) * (POINTS // COLUMNS)
    error = squeezed.sum(0).real - signal[at]
    assert np.sqrt(np.mean(error**2)) < 1e-3 * signal.std()


def test_energy_outside_the_band_is_dropped():
    """A strong tone above the band and one below leave the picture of an in-band tone unchanged;
    clamping would put their amplitude into the first and last row."""
    inside = np.cos(2 * np.pi * 18 * LINE * TIME)
    outside = 50 * np.cos(2 * np.pi * 300 * LINE * TIME) + 5 * np.cos(2 * np.pi * LINE * TIME)
    alone, both = synchrosqueeze(np.stack([inside, inside + outside]), RATE, BAND)
    np.testing.assert_allclose(both, alone, atol=1e-4)


def test_agrees_with_ssqueezepy():
    """Other implementation: ssqueezepy's ssq_cwt (Morse 3, 60) of the same wavelets onto the same
    axis, without padding, at the same columns, to 1e-4 of its largest value in 99.9 % of the
    pixels (coefficients within rounding of a row's edge may fall to either side)."""
    ssqueezepy = pytest.importorskip("ssqueezepy")
    signal = ripple(np.random.default_rng(1))
    wide = _continued(frequency_axis(BAND))
    peak = (60 / 3) ** (1 / 3)
    scales = peak * RATE / (2 * np.pi * wide[::-1])
    theirs, _, axis, *_ = ssqueezepy.ssq_cwt(
        signal,
        ssqueezepy.Wavelet(("gmw", {"gamma": 3, "beta": 60})),
        scales=scales,
        fs=RATE,
        ssq_freqs=wide,
        padtype=None,
    )
    inside = [np.abs(axis - f).argmin() for f in frequency_axis(BAND)]
    theirs = theirs[inside][:, :: POINTS // COLUMNS]
    ours = synchrosqueeze(signal[None], RATE, BAND)[0]
    theirs *= (ours * theirs.conj()).sum().real / (np.abs(theirs) ** 2).sum()  # their constant
    difference = np.abs(ours - theirs) / np.abs(theirs).max()
    assert (difference < 1e-4).mean() > 0.999
    assert np.linalg.norm(ours - theirs) < 0.01 * np.linalg.norm(theirs)


def _continued(frequency):
    """The axis with 19 more rows on either side: the transform's own wavelets."""
    step = frequency[1] / frequency[0]
    return frequency[0] * step ** np.arange(-19, len(frequency) + 19)


def test_a_moving_tone_is_followed():
    """Analytic: a tone whose frequency varies by 10 % over the window is found at its instantaneous
    frequency, column by column, to a row."""
    depth, slow = 15.0, 1 / (POINTS / RATE)
    phase = 2 * np.pi * 150 * TIME - depth / slow * (np.cos(2 * np.pi * slow * TIME) - 1)
    squeezed = np.abs(synchrosqueeze(np.cos(phase)[None], RATE, BAND))[0]
    at = np.arange(COLUMNS) * (POINTS // COLUMNS)
    truth = 150 + depth * np.sin(2 * np.pi * slow * TIME[at])
    found = frequency_axis(BAND)[squeezed.argmax(0)]
    step = np.log(frequency_axis(BAND)[1] / frequency_axis(BAND)[0])
    assert np.abs(np.log(found / truth)).max() < 1.5 * step


def test_shifting_the_signal_shifts_the_picture():
    """Periodic windows: a cyclic shift by whole columns moves the picture and changes nothing."""
    signal = ripple(np.random.default_rng(2))
    moved = np.roll(signal, 5 * POINTS // COLUMNS)
    a, b = np.abs(synchrosqueeze(np.stack([signal, moved]), RATE, BAND))
    assert np.linalg.norm(np.roll(a, 5, -1) - b) < 0.01 * np.linalg.norm(a)


def test_images_show_what_the_axes_say():
    """A tone's brightest pixel row is the one whose frequency is nearest; silence reads 1; the
    brightest value of a full-size image is exp(k)."""
    settings = SstSettings(size=64)
    tone = 2e5 * np.cos(2 * np.pi * 18 * LINE * TIME)[None, None]
    settings = SstSettings(size=64, scale=amplitude_scale(tone, RATE, settings))
    image = sst_images(tone, RATE, settings)
    frequency, time = image_axes(settings, POINTS / RATE)
    assert image.shape == (1, 1, 64, 64) and image.dtype == np.float32
    assert abs(np.log(frequency[image[0, 0, :, 7].argmax()] / (18 * LINE))) < np.log(125) / 64
    assert np.median(image) == pytest.approx(1)
    assert time[0] >= 0 and time[-1] < POINTS / RATE and (np.diff(frequency) > 0).all()
    full = sst_images(tone, RATE, SstSettings(size=256, scale=settings.scale, k=2.0))
    assert 0.6 * np.exp(2) < full.max() < 1.001 * np.exp(2)


def test_amplitude_is_kept():
    """No window is normalised: half the ripple gives an image of half the (logarithmic) contrast
    for small k, whatever else is in the batch."""
    signal = ripple(np.random.default_rng(3))
    settings = SstSettings(size=32, k=1e-3)
    whole, half = sst_images(np.stack([signal, signal / 2])[:, None], RATE, settings)[:, 0] - 1
    np.testing.assert_allclose(half, whole / 2, rtol=0.01, atol=1e-6)


def test_every_channel_and_window_is_its_own_picture():
    """(n, channels) are transformed one by one: batching changes nothing."""
    rng = np.random.default_rng(4)
    windows = np.stack([[ripple(rng), ripple(rng)] for _ in range(2)])
    settings = SstSettings(size=32)
    together = sst_images(windows, RATE, settings)
    for i in range(2):
        for c in range(2):
            alone = sst_images(windows[i : i + 1, c : c + 1], RATE, settings)[0, 0]
            np.testing.assert_array_equal(together[i, c], alone)


def test_a_band_beyond_the_sampling_rate_is_refused():
    """The remedy is in the message: the sampling rate that would do."""
    with pytest.raises(ValueError, match="sampling rate"):
        synchrosqueeze(np.zeros((1, 600)), 2000.0, BAND)
    with pytest.raises(ValueError, match="band"):
        frequency_axis(SstSettings(min_frequency_hz=2000))
