"""Input impedances as reflection coefficients: the reference, and what is compared.

An impedance varies by orders of magnitude between resonance and antiresonance, and its error with
it. The error of the reflection coefficient, the wave that returns over the one sent, is about the
same at all frequencies. So that is what the twin predicts and what a fit compares.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from rippletwin.case.model import Segment

if TYPE_CHECKING:
    from rippletwin.twin.twin import Twin


def characteristic_impedance(fluid, segment) -> float:
    """rho a/A of a segment without loss, Pa s/m3."""
    return fluid.density * segment.wave_speed / segment.area


def reference_impedance(twin: Twin, theta: np.ndarray, observation) -> float:
    """Reference of an input impedance that `twin` predicts at theta (P,), Pa s/m3: rho a/A of the
    first segment.

    A measurement given as a ratio remains one whatever the true bore, so its reference is the
    model's own; one given in Pa s/m3 is divided by the data sheet's, as the data are.
    """
    first = twin.rig.line[0]
    if observation.normalised:
        v = twin.arrays(theta)
        first = Segment(first.length, v.diameters[0], v.wave_speeds[0])
    return characteristic_impedance(twin.rig.fluid, first)


def stated_unit(observation, rig) -> float:
    """What the values of an observed input impedance are divided by to be a ratio: 1 where they are
    one already, otherwise rho a/A of the data sheet's first segment, Pa s/m3."""
    if observation.normalised:
        return 1.0
    return characteristic_impedance(rig.fluid, rig.line[0])


def to_reflection(ratio: np.ndarray) -> np.ndarray:
    """R = (z - 1)/(z + 1) of an impedance over its reference, z, same shape.

    |R| <= 1 for anything passive.
    """
    return (ratio - 1.0) / (ratio + 1.0)
