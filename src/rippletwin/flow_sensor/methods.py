"""The flow sensor by either method, and the noise of what it estimates."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from rippletwin.flow_sensor import spectral_inversion
from rippletwin.flow_sensor.estimate import FlowEstimate
from rippletwin.flow_sensor.line_response import LineFactory
from rippletwin.spectra.noise import noise_cycle_scatter

METHODS = ("spectral", "pinn")
STEPS_BETWEEN_REPORTS = 50  # of the physics-informed network's training
LAST_SHARE = 0.1  # of that training's steps, in which a converged one gains no more
UNCONVERGED_GAIN = 0.2  # share of the loss


def estimate_flow_by(
    method: str,
    windows: np.ndarray,
    speed_hz: np.ndarray,
    line_at: LineFactory,
    noise: np.ndarray,
    bandwidth_hz: float,
    *,
    width: int,
    steps: int,
    threads: int,
    progress: Callable[[str], None],
) -> FlowEstimate:
    """The pump's source flow of each one-revolution window, by one of `METHODS`.

    windows : (n, S, M) pressure, Pa; speed_hz : (n,) speed of each, rev/s, of which "pinn" takes
    the mean; noise : (S,) standard deviation of a sample, Pa. `width` (neurons of a hidden layer),
    `steps` (of the optimiser) and `threads` are for "pinn" alone: a network is trained once for the
    line, then solved a window at a time. progress(text) is called on the way. Raises ValueError for
    another method.
    """
    if method == "spectral":
        return spectral_inversion.estimate_flow(windows, speed_hz, line_at, noise, bandwidth_hz)
    if method != "pinn":
        raise ValueError(f"method {method!r}: known are {', '.join(METHODS)}")

    import torch  # takes seconds, and the other method needs none

    from rippletwin.flow_sensor import pinn

    torch.set_num_threads(threads)

    def report(step: int, loss: float) -> None:
        if step % STEPS_BETWEEN_REPORTS == 0:
            progress(f"step {step}: loss {loss:.2g}")

    settings, mean_speed_hz = pinn.Settings(width=width, steps=steps), float(np.mean(speed_hz))
    trunk, losses = pinn.train(line_at, mean_speed_hz, bandwidth_hz, settings, report)
    progress(f"equations hold to {float(trunk.residual):.2g} of the waves")
    gain = last_gain(losses)
    if not gain <= UNCONVERGED_GAIN:
        progress(
            f"warning: not converged: the last {LAST_SHARE:.0%} of the training lowered its loss "
            f"by {gain:.0%}; raise flow_sensor.pinn.steps"
        )
    return pinn.estimate_flow(windows, mean_speed_hz, line_at, trunk, noise, bandwidth_hz)


def last_gain(losses: np.ndarray) -> float:
    """Share by which the last LAST_SHARE of the steps lowered the least loss; losses (n,)."""
    before = losses[: max(int((1.0 - LAST_SHARE) * len(losses)), 1)]
    return float(1.0 - np.min(losses) / np.min(before))


def noise_of_flow(flow: np.ndarray, recording: np.ndarray, healthy: np.ndarray) -> np.ndarray:
    """Standard deviation (1,) of a sample of estimated flow, by the scatter between revolutions.

    flow : (n, M); recording : (n,) which recording a window is of; healthy : (n,) booleans. The
    mean over healthy recordings, or over all where none is. The flow ends at its bandwidth, so the
    finest wavelet details, by which pressure's noise is estimated, are empty.
    """
    counted = np.unique(recording[healthy] if np.any(healthy) else recording)
    scatter = [noise_cycle_scatter(flow[recording == k][:, None]) for k in counted]
    return np.mean(scatter, axis=0)
