"""What was found, without a name: the missing admittance against frequency.

Flat and real: a leak. In proportion to jw: a compliance. Through zero: a resonator. As (1 + j)
sqrt(w): a boundary layer. A negative real part: not passive, so the source or a sensor.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from rippletwin.explain.fit import Fit
from rippletwin.explain.posterior import Posterior
from rippletwin.line.chain import Insert

PROBE = 1e-4


def named_admittance(fit: Fit, observations: Sequence):
    """Position (m), frequencies (F,) and admittance (F,) of a fit's last point-like shunt.

    None where its effects are not shunts at a point.
    """
    if not fit.hypothesis or any(o.kind == "input_impedance" for o in observations):
        return None
    posterior = Posterior(fit.twin, observations)
    network = posterior.forward.network(fit.twin.theta)
    shunts = [i for i in network.inserts if i[1] == "shunt"]
    if not shunts:
        return None
    frequency = np.concatenate([o.frequency_hz for o in posterior.observations])
    return float(shunts[-1][0]), frequency, np.broadcast_to(shunts[-1][2], frequency.shape)


def missing_admittance(fit: Fit, observations: Sequence, position: float) -> np.ndarray:
    """Shunt admittance (F,) at `position` that the data ask for, the fit's own one included.

    At each frequency by least squares over the sensors from the fit's solution, all parameters
    held: the response to a shunt is p - G y p_x/(1 + G_x y), linear in y near the fit's value.
    """
    posterior = Posterior(fit.twin, observations, None, fit.source_free)
    posterior.floor, posterior.source_sd = fit.floor, fit.source_sd
    theta = fit.twin.theta
    prediction = posterior.predict(theta)
    network = posterior.forward.network(theta)
    own = [i for i in network.inserts if i[1] == "shunt" and abs(i[0] - position) < 1e-9]
    value = own[-1][2] if own else 0.0
    unit = np.abs(np.sqrt(network.shunt[0] / network.series[0]))
    network.inserts.append(Insert(position, "shunt", PROBE * unit))
    slope = (network.readings() - prediction) / PROBE
    r = posterior.whitened(prediction)[0]
    column = posterior.whitened(prediction + PROBE * slope)[0] - r
    weight = np.maximum(np.sum(np.abs(column) ** 2, axis=0), 1e-300)
    change = -np.sum(np.conj(column) * r, axis=0) / weight * PROBE
    return value + change * unit


def law(frequency_hz: np.ndarray, admittance: np.ndarray) -> str:
    """Which simple law an admittance (F,) follows best, in words."""
    w = 2 * np.pi * np.asarray(frequency_hz)
    weight = 1.0 / np.sqrt(w)
    shapes = {
        "flat and real: a leak": np.ones_like(w) + 0j,
        "in proportion to jw: a compliance": 1j * w,
        "as 1/jw: an inertance to somewhere": 1 / (1j * w),
        "as (1 + j) sqrt(w): a boundary layer": (1 + 1j) * np.sqrt(w),
    }
    left = {}
    for words, shape in shapes.items():
        scale = np.sum(weight * np.conj(shape) * admittance).real / np.sum(
            weight * np.abs(shape) ** 2
        )
        left[words] = float(np.sum(weight * np.abs(admittance - max(scale, 0.0) * shape) ** 2))
    best = min(left, key=left.get)
    if left[best] < 0.3 * float(np.sum(weight * np.abs(admittance) ** 2)):
        return best
    if np.mean(admittance.real < 0) > 0.5:
        return "a negative real part: not passive, so the source or a sensor"
    if np.any(np.diff(np.sign(admittance.imag[np.argsort(w)])) != 0):
        return "through zero: a resonator"
    return "no simple law"
