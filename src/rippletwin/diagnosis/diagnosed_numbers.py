"""The numbers behind the figures of a diagnosis, and their file."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from rippletwin import store
from rippletwin.diagnosis.diagnosis import Diagnosis
from rippletwin.diagnosis.faults.library import state_name

FILE = "figures/diagnose.json"
MAX_DIGITS = 6


@dataclass(frozen=True)
class Leak:
    """Posterior of a leak's area: density (N,) over its logarithm, 1 at its largest, at area (N,);
    median and ends of the 95 % interval; all areas in m2."""

    area: Sequence[float]
    density: Sequence[float]
    median: float
    low: float
    high: float


@dataclass(frozen=True)
class DiagnosedNumbers:
    """What the figures of one recording's diagnosis show.

    state, probable   the diagnosis, and the most probable state of all that were tried
    orders            (K,) shaft orders
    measured, predicted, allowed   (S, K) amplitude, Pa, of the change against the healthy pump: as
                      recorded, by the most probable state, and the error that is allowed for
    leaks             of the most probable state, by fault
    """

    label: str
    state: str
    probable: str
    sensors: Sequence[str]
    probabilities: Mapping[str, float]
    orders: Sequence[int]
    measured: Sequence[Sequence[float]]
    predicted: Sequence[Sequence[float]]
    allowed: Sequence[Sequence[float]]
    leaks: Mapping[str, Leak]


def gather(d: Diagnosis) -> DiagnosedNumbers:
    """The numbers behind the figures of a diagnosis."""
    model, best = d.model, d.best
    model.linearise_line(best.mode)
    parts = model.predict(best.mode)
    at_sensors, variance = model.division.at_sensors, model.variance(parts, best.errors)
    leaks = {}
    for name, density in best.areas.items():
        shape = np.exp(density.log_density - np.max(density.log_density))
        leaks[name] = Leak(_rounded(np.exp(density.nodes)), _rounded(shape), *density.interval)
    return DiagnosedNumbers(
        label=d.label,
        state=d.state,
        probable=state_name(best.state),
        sensors=[s.name for s in model.observation.sensors],
        probabilities=dict(d.probabilities),
        orders=[int(k) for k in model.orders],
        measured=_rounded(np.abs(at_sensors(model.values - parts.healthy))),
        predicted=_rounded(np.abs(at_sensors(parts.change))),
        allowed=_rounded(np.sqrt(model.division.variance_at_sensors(variance))),
        leaks=leaks,
    )


def save(numbers: Sequence[DiagnosedNumbers], folder: str | Path) -> Path:
    """Write the numbers into `folder`, which must have a folder `figures`; returns the path."""
    path = Path(folder) / FILE
    store.write_text(path, json.dumps([asdict(each) for each in numbers], allow_nan=False) + "\n")
    return path


def load(folder: str | Path) -> dict[str, DiagnosedNumbers]:
    """The numbers in `folder` by the recording's label; empty where diagnose has drawn nothing."""
    path = Path(folder) / FILE
    if not path.exists():
        return {}
    entries = json.loads(path.read_text())
    return {each["label"]: from_plain(each) for each in entries}


def load_labels(folder: str | Path) -> list[str]:
    """Labels of the recordings whose numbers are in `folder`; none where the file was spoilt."""
    try:
        return [str(each["label"]) for each in json.loads((Path(folder) / FILE).read_text())]
    except (OSError, ValueError, LookupError, TypeError):
        return []


def from_plain(data: Mapping) -> DiagnosedNumbers:
    """The numbers of which `asdict` made plain data."""
    leaks = {name: Leak(**leak) for name, leak in data["leaks"].items()}
    return DiagnosedNumbers(**{**data, "leaks": leaks})


def _rounded(values) -> Any:
    """An array as lists of numbers with MAX_DIGITS digits."""
    if np.ndim(values) == 0:
        return float(f"{float(values):.{MAX_DIGITS}g}")
    return [_rounded(value) for value in values]
