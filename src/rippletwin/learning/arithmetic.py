"""Where a network is trained, and how precise its products are.

Mixed precision (Micikevicius et al. 2018, arXiv 1710.03740): convolutions and products take
bfloat16, which has the range of float32 and 8 bits of its 24. Weights, gradients of weights, the
optimiser's state, normalisation's statistics and the loss stay in float32. bfloat16 needs no
scaling of the loss, as float16 does.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass

import torch
from llvmlite.binding import get_host_cpu_features

BFLOAT16_INSTRUCTIONS = ("avx512bf16", "amx-bf16")  # as LLVM calls them
PRECISIONS = ("auto", "float32", "bfloat16")


@dataclass(frozen=True)
class Arithmetic:
    """The device of a training, and the precision of its products."""

    device: torch.device
    precision: torch.dtype

    def __str__(self) -> str:
        return f"{str(self.precision).removeprefix('torch.')} on {self.device.type}"

    def mixed(self) -> AbstractContextManager:
        """A context in which convolutions and products have the precision."""
        reduced = self.precision is not torch.float32
        return torch.autocast(self.device.type, self.precision, enabled=reduced)


FLOAT32 = Arithmetic(torch.device("cpu"), torch.float32)
"""The same on every machine."""


def choose_arithmetic(gpu: str | bool = "auto", precision: str = "auto") -> Arithmetic:
    """What a training computes with on this machine.

    gpu        as for `choose_device`
    precision  "float32", "bfloat16", or "auto": bfloat16 on a GPU and on a processor that
               multiplies it in hardware

    Raises ValueError as `choose_device` does, and for another word.
    """
    if precision not in PRECISIONS:
        raise ValueError(f"precision must be one of {PRECISIONS}, not {precision!r}")
    device = choose_device(gpu)
    if precision == "auto":
        reduced = device.type == "cuda" or multiplies_bfloat16()
    else:
        reduced = precision == "bfloat16"
    return Arithmetic(device, torch.bfloat16 if reduced else torch.float32)


def choose_device(gpu: str | bool = "auto") -> torch.device:
    """The GPU that torch finds, or the processor; float32 is made to mean 24 bits on it.

    gpu  True, False, or "auto": a GPU where there is one

    Raises ValueError for another word, or if a GPU is asked for and torch finds none.
    """
    if gpu not in ("auto", True, False):
        raise ValueError(f"gpu must be auto, true or false, not {gpu!r}")
    found = torch.cuda.is_available()
    if gpu is True and not found:
        raise ValueError("gpu is true, but torch finds none: set it to auto or false")
    if not (found and gpu):
        return torch.device("cpu")
    torch.backends.cudnn.allow_tf32 = False  # convolutions would have 11 bits
    return torch.device("cuda")


def multiplies_bfloat16() -> bool:
    """Whether the processor has instructions that multiply bfloat16."""
    features = get_host_cpu_features()
    return any(features.get(name, False) for name in BFLOAT16_INSTRUCTIONS)
