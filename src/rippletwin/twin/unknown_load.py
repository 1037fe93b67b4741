"""The load of which nothing is known but that it is passive: its parameters, its law, its curve.

Its reflection coefficient has a few Schur parameters (`line.frequency_domain.passive_end`), each
with a prior on (-1, 1). That makes it smooth: it cannot stand in for the line, whose waves return
late.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rippletwin.line.frequency_domain.passive_end import end_impedance, reflection_coefficient

REFLECTION_SDS = tuple(np.exp(-((0.3 * np.arange(9)) ** 2)))
"""Of the Schur parameters. Where they are small, the reflection coefficient is a Gaussian process
in the angle 2 atan(f/REFLECTION_HZ), smooth over 0.6 rad: over 150 Hz at low frequencies, 300 Hz at
500 Hz and 750 Hz at 1 kHz. A longer memory belongs to the line."""
REFLECTION_HZ = 500.0
CURVE_POINTS = 80
STEP = 1e-4  # of the derivatives, in prior standard deviations


def unknown_impedance(s: np.ndarray, v, density: float) -> np.ndarray:
    """Impedance (..., F), Pa s/m3, at `s` (F,) behind the last segment, with `v` of `Twin.arrays`.

    It refers to the segment without loss.
    """
    return end_impedance(unknown_reflection(s, v), _characteristic(v, density))


def unknown_reflection(s: np.ndarray, v) -> np.ndarray:
    """Reflection coefficient (..., F) of the load at `s` (F,), 1/s, with `v` of `Twin.arrays`."""
    return reflection_coefficient(s, v.reflection, 2.0 * np.pi * REFLECTION_HZ)


def _characteristic(v, density: float):
    return density * v.wave_speeds[-1] / (0.25 * np.pi * v.diameters[-1] ** 2)


@dataclass(frozen=True)
class LoadCurve:
    """Reflection coefficient (F,) complex, its standard deviation (F,), and the impedance (F,) in
    Pa s/m3 of an unknown load at frequency_hz (F,)."""

    frequency_hz: np.ndarray
    reflection: np.ndarray
    sd: np.ndarray
    impedance: np.ndarray

    def as_dict(self) -> dict:
        """The curve as plain data."""

        def parts(x):
            return {"re": x.real.tolist(), "im": x.imag.tolist()}

        return {
            "frequency_hz": self.frequency_hz.tolist(),
            "reflection": parts(self.reflection),
            "sd": self.sd.tolist(),
            "impedance": parts(self.impedance),
        }


def load_curve(twin, covariance: np.ndarray, observations: Sequence) -> LoadCurve | None:
    """The curve of a twin's unknown load over the observed band; None where the load is known.

    `covariance` (P, P) of the twin's theta; the standard deviation is of first order.
    """
    own = [k for k, p in enumerate(twin.parameters) if p.name.startswith("reflection[")]
    if not own:
        return None
    ends = [(o.frequency_hz[0], o.frequency_hz[-1]) for o in observations]
    frequency_hz = np.linspace(min(a for a, _ in ends), max(b for _, b in ends), CURVE_POINTS)
    s = 2j * np.pi * frequency_hz

    def reflected(theta):
        return unknown_reflection(s, twin.arrays(theta))

    at = reflected(twin.theta)
    unit = np.eye(len(twin.theta))
    slopes = np.array([(reflected(twin.theta + STEP * unit[k]) - at) / STEP for k in own])
    square = np.einsum("if,ij,jf->f", slopes.conj(), covariance[np.ix_(own, own)], slopes).real
    impedance = unknown_impedance(s, twin.arrays(twin.theta), twin.rig.fluid.density)
    return LoadCurve(frequency_hz, at, np.sqrt(np.maximum(square, 0.0)), impedance)
