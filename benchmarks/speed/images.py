"""Synchrosqueezed images, against ssqueezepy's transform of the same band."""

from __future__ import annotations

import os
from importlib.util import find_spec

import numpy as np
import torch

from rippletwin.learning.synchrosqueezing import (
    BETA,
    COLUMNS,
    GAMMA,
    MARGIN_OCTAVES,
    SstSettings,
    frequency_axis,
    sst_images,
    synchrosqueeze,
    transform_images,
)
from speed.result import Claim, Result, Table
from speed.timing import alternate, in_words, median_ratio

RATE, POINTS = 51200.0, 6144  # two revolutions at 1000 r/min
SIZES = (32, 64, 256)
BATCH = 16  # signals


def signals(count: int) -> np.ndarray:
    """Ripples (count, POINTS) of a pump: piston harmonics, shaft orders and noise, Pa."""
    rng = np.random.default_rng(0)
    turn = 2 * np.pi * np.arange(POINTS) * 2 / POINTS
    found = rng.standard_normal((count, POINTS)) * 1e3
    for order in range(1, 91):
        size = 1e5 if order % 9 == 0 else 5e3
        phase = rng.uniform(0, 2 * np.pi, (count, 1))
        found += size / np.sqrt(order) * np.cos(order * turn + phase)
    return found.astype(np.float32)


def wide_axis(settings: SstSettings) -> np.ndarray:
    """The rows' frequencies continued by the transform's margin on either side."""
    axis = frequency_axis(settings)
    step = np.log2(axis[1] / axis[0])
    extra = int(np.ceil(MARGIN_OCTAVES / step))
    return axis[0] * 2.0 ** (step * np.arange(-extra, len(axis) + extra))


class Ssqueezepy:
    """ssqueezepy's transform of one signal at the same wavelets and rows, nothing padded."""

    def __init__(self, settings: SstSettings):
        os.environ["SSQ_PARALLEL"] = "0"
        import ssqueezepy

        self.transform = ssqueezepy.ssq_cwt
        self.wavelet = ssqueezepy.Wavelet(("gmw", {"gamma": GAMMA, "beta": BETA}), N=POINTS)
        self.axis, self.wide = frequency_axis(settings), wide_axis(settings)
        peak = (BETA / GAMMA) ** (1 / GAMMA)
        self.scales = peak * RATE / (2 * np.pi * self.wide[::-1])

    def __call__(self, signal: np.ndarray):
        return self.transform(
            signal,
            self.wavelet,
            scales=self.scales,
            fs=RATE,
            ssq_freqs=self.wide,
            padtype=None,
            cache_wavelet=True,
            astensor=False,
        )

    def same_as(self, signal: np.ndarray) -> np.ndarray:
        """Its transform (rows, COLUMNS) at the rows and instants of ours, up to a factor."""
        found, _, axis, *_ = self(signal)
        inside = [np.abs(axis - f).argmin() for f in self.axis]
        return np.asarray(found)[inside][:, :: POINTS // COLUMNS]


def run(quick: bool = False) -> Result:
    """Time of a transform and of images, and what they differ by."""
    torch.set_num_threads(1)
    rounds, batch = (1, 2) if quick else (7, BATCH)
    data = signals(batch)
    scale = 1 / 1.2e5
    sizes = {size: SstSettings(size=size, scale=scale) for size in SIZES}
    settings = sizes[64]
    tasks = {"transform": lambda: synchrosqueeze(data, RATE, settings)}
    for size, each in sizes.items():
        tasks[f"{size} pixels"] = lambda each=each: sst_images(data[:, None], RATE, each)
    claims, notes, difference = [], [], None
    if find_spec("ssqueezepy"):
        theirs = Ssqueezepy(settings)
        tasks["ssqueezepy"] = lambda: theirs(data[0])
        difference = compare(theirs, data, settings)
    else:
        notes.append("ssqueezepy is not installed.")
    times = alternate(tasks, rounds)
    one = {name: t / (1 if name == "ssqueezepy" else batch) for name, t in times.items()}
    middle = {name: float(np.median(values)) for name, values in one.items()}
    claims += [
        Claim(
            "time of ssqueezepy's transform over that of ours",
            median_ratio(one["ssqueezepy"], one["transform"]) if "ssqueezepy" in one else None,
            40.0,
        ),
        Claim(
            "difference of the images at 64 pixels, of their norm less the background",
            difference,
            1e-3,
            "",
            False,
        ),
    ]
    rows = [
        [
            name if name != "transform" else "transform alone",
            in_words(seconds),
            f"{seconds / middle['transform']:.3g}",
        ]
        for name, seconds in middle.items()
    ]
    return Result(
        point=4,
        title="Synchrosqueezed images",
        what=[
            f"One signal is two revolutions of {POINTS} points; ours are transformed "
            f"{batch} at a time. ssqueezepy has the same Morse wavelet, the same band of scales "
            "and rows, its wavelet cached, no padding and one thread. It calculates all points "
            f"in time where ours calculates the {COLUMNS} that an image has.",
        ],
        claims=claims,
        tables=[Table("Time of one signal", ["what", "time", "over the transform"], rows)],
        bound=bound(settings, middle["transform"]),
        notes=notes,
    )


def compare(theirs: Ssqueezepy, data: np.ndarray, settings: SstSettings) -> float:
    """Difference of images from both transforms, their background of one subtracted."""
    own = synchrosqueeze(data, RATE, settings)
    other = np.array([theirs.same_as(signal) for signal in data])
    # ssqueezepy's amplitudes have another constant factor
    factor = np.sum(own * other.conj()).real / np.sum(np.abs(other) ** 2)
    ours = transform_images(own, settings) - 1
    images = transform_images((factor * other).astype(np.complex64), settings) - 1
    return float(np.linalg.norm(ours - images) / np.linalg.norm(images))


def bound(settings: SstSettings, seconds: float) -> list[str]:
    """The inverse transforms cannot be left out: two for each wavelet."""
    wavelets = len(wide_axis(settings))
    block = torch.ones(2, wavelets, COLUMNS, dtype=torch.complex64)
    inverse = alternate({"ifft": lambda: torch.fft.ifft(block, norm="forward")}, 5)["ifft"]
    share = float(np.median(inverse)) / seconds
    return [
        f"{2 * wavelets} inverse FFTs of {COLUMNS} points (two for each of {wavelets} wavelets) "
        f"bound a transform to {in_words(float(np.median(inverse)))}, which is "
        f"{100 * share:.0f} % of its time. The rest is folding the spectrum and reassigning the "
        "coefficients."
    ]
