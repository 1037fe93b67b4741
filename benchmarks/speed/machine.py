"""The processor, and rates that bound what a program on it can do; versions of the peers."""

from __future__ import annotations

import os
import platform
import re
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np
from numba import njit

from speed.timing import alternate

INSTRUCTIONS = ("avx2", "fma", "avx512f", "avx512_bf16", "amx_bf16")
"""Those that matter here, by their names in /proc/cpuinfo."""
OWN = ("numpy", "scipy", "numba", "torch")
PEERS = ("rthym-moc", "ptsnet", "tsnet", "openwind", "ssqueezepy", "scipy", "pymoo")
CACHES = Path("/sys/devices/system/cpu/cpu0/cache")


def describe() -> dict:
    """Processor, its instructions and caches, cores, and versions of what computes."""
    info = Path("/proc/cpuinfo").read_text() if Path("/proc/cpuinfo").exists() else ""
    model = re.search(r"model name\s*: (.*)", info)
    flags = re.search(r"flags\s*: (.*)", info)
    present = set(flags[1].split()) if flags else set()
    return {
        "processor": model[1].strip() if model else platform.processor(),
        "instructions": {name: name in present for name in INSTRUCTIONS},
        "caches": _caches(),
        "cores": os.cpu_count(),
        "python": platform.python_version(),
        "versions": versions(OWN),
    }


def versions(packages: tuple[str, ...]) -> dict[str, str | None]:
    """Installed version of each package, None where it is not installed."""
    found: dict[str, str | None] = {}
    for name in packages:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = None
    return found


def _caches() -> dict[str, str]:
    """Size of each cache of the first core: {"L1 data": "32K", ...}."""
    found = {}
    for folder in sorted(CACHES.glob("index*")):
        kind = (folder / "type").read_text().strip()
        if kind != "Instruction":
            name = f"L{(folder / 'level').read_text().strip()}"
            found[name] = (folder / "size").read_text().strip()
    return found


def copy_rate(size: int, rounds: int = 5) -> float:
    """Bytes a second, read and written, of copying `size` bytes again and again, one thread."""
    source = np.ones(max(size // 8, 1))
    target = np.empty_like(source)
    repeats = max(2**24 // source.nbytes, 1)
    times = alternate({"copy": lambda: _copy(source, target, repeats)}, rounds)["copy"]
    return float(2 * source.nbytes * repeats / np.median(times))


@njit
def _copy(source, target, repeats):
    for r in range(repeats):
        for i in range(len(source)):
            target[i] = source[i] + r  # another value each time, or the loop would be left out


def product_rate(bfloat16: bool = False, rounds: int = 5) -> float:
    """Floating-point operations a second of torch's product of two 1024 x 1024 matrices."""
    import torch

    torch.set_num_threads(1)
    kind = torch.bfloat16 if bfloat16 else torch.float32
    a, b = (torch.ones(1024, 1024, dtype=kind) for _ in range(2))
    times = alternate({"product": lambda: a @ b}, rounds)["product"]
    return float(2 * 1024**3 / np.median(times))
