"""Trained networks kept with all that tomorrow's recording needs: one file an architecture."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
import torch
from scipy.special import logsumexp

from rippletwin.errors import InputError
from rippletwin.learning.architectures import CLASSES
from rippletwin.learning.conformal import Conformal
from rippletwin.learning.networks import restore_networks, save_tensors
from rippletwin.learning.training import (
    activation_statistics,
    predict,
    predict_log_probabilities,
)

FORMAT = 3
"""Of the files: counts up when what networks calculate, or what is kept of them, changes."""

ARCHIVE = b"PK\x03\x04"  # the first bytes of a zip archive, which torch writes


@dataclass(frozen=True)
class KeptNetworks:
    """The networks of all seeds of one architecture and dataset.

    signal, channels        "pressure" or "flow", and the names of its channels
    samples_per_revolution  of a window, which is one revolution
    speed_hz, load_pressure operating point, rev/s and Pa, at which they have learnt
    weights, conformal      a state dictionary and a `Conformal` each seed
    """

    architecture: str
    dataset: str
    signal: str
    channels: list[str]
    samples_per_revolution: int
    speed_hz: float
    load_pressure: float | None
    weights: list[dict]
    conformal: list[Conformal]
    classes: tuple[str, ...] = CLASSES

    def answers(self, windows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Class indices and conformal p-values (seeds, n) of windows (n, channels, M)."""
        said, p_values = [], []
        for network, conformal in zip(self._restored(), self.conformal, strict=True):
            said.append(predict(network, windows)[0])
            p_values.append(conformal.p_values(activation_statistics(network, windows)))
        return np.array(said), np.array(p_values)

    def log_probabilities(self, windows: np.ndarray) -> np.ndarray:
        """Logarithm (classes,) of the mean probability over seeds and windows (n, channels, M)."""
        each = np.concatenate([predict_log_probabilities(n, windows) for n in self._restored()])
        return logsumexp(each, axis=0) - np.log(len(each))

    def strangeness(self, windows: np.ndarray) -> np.ndarray:
        """Nonconformity (seeds, n) of windows over the largest of the held-out samples: above 1 it
        ranks windows whose p-values are all the least."""
        return np.array(
            [
                conformal.nonconformity(activation_statistics(network, windows))
                / conformal.scores[-1]
                for network, conformal in zip(self._restored(), self.conformal, strict=True)
            ]
        )

    def _restored(self):
        """The network of each seed."""
        return restore_networks(self.architecture, len(self.channels), self.weights)

    def save(self, path: str | Path) -> None:
        """Write them to `path`: tensors, lists, text and numbers only."""
        data = vars(self) | {"classes": list(self.classes), "format": FORMAT}
        data["conformal"] = [
            {name: torch.as_tensor(values) for name, values in asdict(each).items()}
            for each in self.conformal
        ]
        save_tensors(data, path)


def load_networks(path: str | Path) -> KeptNetworks:
    """The networks of a file that `KeptNetworks.save` wrote.

    Raises InputError where the file holds something else, or has another format.
    """
    remedy = "Let the workflow make it anew"
    try:
        data = _load_archive(path)
        parts, written = data.pop("conformal"), data.pop("format", 1)
        if written == FORMAT:
            conformal = [
                Conformal(**{name: values.numpy() for name, values in each.items()})
                for each in parts
            ]
            rest = {"conformal": conformal, "classes": tuple(data["classes"])}
            return KeptNetworks(**data | rest)
    except Exception:  # torch raises a dozen kinds for a damaged file
        raise InputError(path, "networks", "holds no kept networks", remedy) from None
    found = f"is {written}, and this version of rippletwin reads {FORMAT}"
    raise InputError(path, "format", found, remedy)


def _load_archive(path: str | Path) -> dict:
    """The tensors and plain data of an archive. Raises ValueError for torch's older format, where a
    damaged length takes all memory."""
    with open(path, "rb") as file:
        if file.read(len(ARCHIVE)) != ARCHIVE:
            raise ValueError("no archive")
        file.seek(0)
        return torch.load(file, weights_only=True)
