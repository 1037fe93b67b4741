"""Processor time of one synchrosqueezed image, and of ssqueezepy's transform.

OMP_NUM_THREADS=1 python benchmarks/imaging_speed.py [--ssqueezepy]
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from rippletwin.learning.synchrosqueezing import SstSettings, sst_images, synchrosqueeze

RATE, POINTS = 51200.0, 6144  # two revolutions at 1000 r/min


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--ssqueezepy", action="store_true", help="for comparison")
    arguments = parser.parse_args()
    windows = np.random.default_rng(0).standard_normal((64, 2, POINTS)).astype(np.float32)

    print("| what | ms a signal |\n|---|---|")
    signals = windows.reshape(-1, POINTS)
    report("transform", lambda: synchrosqueeze(signals, RATE, SstSettings()), len(signals))
    for size in (32, 64, 256):
        settings = SstSettings(size=size, scale=0.1)
        report(
            f"image, {size} pixels",
            lambda settings=settings: sst_images(windows, RATE, settings),
            len(signals),
        )
    if arguments.ssqueezepy:
        import ssqueezepy

        wavelet = ssqueezepy.Wavelet(("gmw", {"gamma": 3, "beta": 60}))
        report(
            "ssqueezepy.ssq_cwt, its defaults",
            lambda: [ssqueezepy.ssq_cwt(s, wavelet, fs=RATE) for s in signals[:4]],
            4,
        )


def report(what: str, run, count: int) -> None:
    """Print the best of three calls, after one that compiles."""
    run()
    times = []
    for _ in range(3):
        start = time.process_time()
        run()
        times.append(time.process_time() - start)
    print(f"| {what} | {1e3 * min(times) / count:.2f} |", flush=True)


if __name__ == "__main__":
    main()
