"""What networks that the workflow has trained say of a recording."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from rippletwin.case.model import Recording, Rig
from rippletwin.diagnosis.anchor import distance
from rippletwin.diagnosis.faults.library import FAULT_OF
from rippletwin.errors import InputError
from rippletwin.learning.conformal import PROMISED_RATE
from rippletwin.learning.dataset import remove_mean
from rippletwin.learning.kept_networks import KeptNetworks, load_networks
from rippletwin.spectra.observation import revolutions_of

STATE_OF = {"H": "healthy"} | FAULT_OF
"""Class of the networks -> state."""


def find_networks(results: str | Path, rig: Rig) -> dict[str, KeptNetworks]:
    """The networks that judge pressure in RESULTS/networks/DATASET/ARCHITECTURE.pt.

    They are called after their architecture; where several datasets have been learnt, after both,
    as in "cnn1d_341_100@CFD-MOC-PR". Raises InputError where there are none, and where they have
    learnt from other sensors than the rig has.
    """
    folder = Path(results) / "networks"
    found = read_networks(sorted(folder.glob("*/*.pt")), rig)
    if not found:
        raise InputError(
            folder,
            "--networks",
            "there are no networks that judge pressure",
            "Give the results folder of a workflow with a randomised dataset, as CFD-MOC-PR",
        )
    return found


def read_networks(files: Sequence[str | Path], rig: Rig) -> dict[str, KeptNetworks]:
    """The networks that judge pressure among those in files, called as `find_networks` says.

    Raises InputError where they have learnt from other sensors than the rig has.
    """
    read = [(path, load_networks(path)) for path in map(Path, files)]
    found = [(path, kept) for path, kept in read if kept.signal == "pressure"]
    names = [sensor.name for sensor in rig.sensors]
    for path, kept in found:
        if sorted(kept.channels) != sorted(names):
            raise InputError(
                path,
                "--networks",
                f"they have learnt from the sensors {', '.join(kept.channels)}, and the case has "
                f"{', '.join(names)}",
                "Give the results of a workflow that ran on this rig, or call the sensors alike",
            )
    several = len({kept.dataset for _, kept in found}) > 1
    return {
        f"{kept.architecture}@{kept.dataset}" if several else kept.architecture: kept
        for _, kept in found
    }


def ask_networks(
    networks: dict[str, KeptNetworks], recordings: Sequence[Recording], rig: Rig
) -> dict[str, dict]:
    """Recording's label -> what each network says of its windows, in the words of diagnosis.json.

    Networks are not asked about a recording of another operating point than theirs. Raises
    InputError as `cut_windows`.
    """
    return {
        recording.label: {
            name: judge_windows(
                kept.classes,
                *kept.answers(windows_for(kept, recording, rig)),
            )
            for name, kept in networks.items()
            if is_at_their_point(recording, kept)
        }
        for recording in recordings
    }


def judge_windows(classes: Sequence[str], said: np.ndarray, p_values: np.ndarray) -> dict:
    """`state`, the `share` of windows and seeds that say it, and the share that is `unlike` all
    that has been simulated; the state is "unlike" where most are. `said`, indices of `classes`, and
    `p_values` are those of `KeptNetworks.answers`, of one shape."""
    unlike = float(np.mean(p_values <= PROMISED_RATE))
    states = np.array([STATE_OF[name] for name in classes])[said]
    names, counts = np.unique(states, return_counts=True)
    state, share = str(names[np.argmax(counts)]), float(counts.max() / states.size)
    if unlike > 0.5:
        state, share = "unlike", unlike
    return {"state": state, "share": share, "unlike": unlike}


def windows_for(kept: KeptNetworks, recording: Recording, rig: Rig) -> np.ndarray:
    """`cut_windows` with the sensors in the order in which networks have learnt them."""
    names = [sensor.name for sensor in rig.sensors]
    windows = cut_windows(recording, rig, kept.samples_per_revolution)
    return windows[:, [names.index(channel) for channel in kept.channels]]


def cut_windows(recording: Recording, rig: Rig, samples: int) -> np.ndarray:
    """Windows (R, S, M), Pa, of one revolution each at M even shaft angles, without their means.

    Raises InputError where no ripple repeats with the shaft (`revolutions_of`)."""
    return remove_mean(revolutions_of(recording, rig, samples).windows)


def is_at_their_point(recording: Recording, kept: KeptNetworks) -> bool:
    """Whether a recording has the operating point at which networks have learnt."""
    speed_hz = recording.speed_rpm / 60.0
    return not distance(speed_hz, kept.speed_hz, recording.load_pressure, kept.load_pressure)
