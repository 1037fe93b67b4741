"""Kept networks that have learnt nothing but noise, for tests of what is done with them."""

from pathlib import Path

import numpy as np

from rippletwin.learning.conformal import fit_conformal
from rippletwin.learning.kept_networks import KeptNetworks
from rippletwin.learning.networks import build
from rippletwin.learning.training import activation_statistics

SAMPLES = 3072


def kept(seed=0, dataset="CFD-MOC-PR", architecture="cnn1d_341_100", **changes):
    """Untrained networks of two seeds whose p-values are those of white noise of 1 Pa."""
    rng = np.random.default_rng(seed)
    x, held_out = rng.standard_normal((2, 60, 2, SAMPLES)).astype(np.float32)
    networks = [build(architecture, 2).eval() for _ in range(2)]
    conformal = [
        fit_conformal(
            activation_statistics(network, x),
            np.arange(60) % 4,
            activation_statistics(network, held_out),
        )
        for network in networks
    ]
    fields = {
        "architecture": architecture,
        "dataset": dataset,
        "signal": "pressure",
        "channels": ["p1", "p2"],
        "samples_per_revolution": SAMPLES,
        "speed_hz": 1000 / 60,
        "load_pressure": 9.5e6,
        "weights": [network.state_dict() for network in networks],
        "conformal": conformal,
    }
    return KeptNetworks(**fields | changes)


def saved(folder, networks) -> Path:
    path = folder / "networks" / networks.dataset / f"{networks.architecture}.pt"
    path.parent.mkdir(parents=True, exist_ok=True)
    networks.save(path)
    return path
