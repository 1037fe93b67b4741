"""What was found, without a name: the missing quantity against frequency.

An effect changes one quantity of the line: the admittance of a shunt at a point, the impedance or
admittance of a stretch per metre, what a sensor reads, what the pump or the load lets through. The
data say at every frequency alone how much of that change they ask for; the named law has to pass
through those points. Flat and real: a leak. In proportion to jw: a compliance. Through zero: a
resonator. As (1 + j) sqrt(w): a boundary layer. A negative real part: not passive, so the source
or a sensor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rippletwin.calibration.fit import Fit, posterior_at_fit
from rippletwin.calibration.posterior import Posterior
from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine
from rippletwin.twin.effects.base import LineState
from rippletwin.twin.forward_model import ForwardModel, reflection

PROBE_SHARE = 1e-4
RETARDATIONS = np.geomspace(2e-5, 5e-3, 9)  # s, of a compliance that relaxes


@dataclass(frozen=True)
class MissingImmittance:
    """One quantity that the base line lacks, in SI units.

    quantity, where   in words; `unit` is the quantity's
    frequency_hz      (F,)
    law               (F,) what the fit's effect makes of it
    points, sd        (F,) what the data ask for at each frequency alone, and how well they know it
    """

    quantity: str
    where: str
    unit: str
    frequency_hz: np.ndarray
    law: np.ndarray
    points: np.ndarray
    sd: np.ndarray

    @property
    def words(self) -> str:
        """The simple law that the points follow."""
        return describe_law(self.frequency_hz, self.points, 1.0 / np.maximum(self.sd, 1e-300) ** 2)


def observable_of(posterior: Posterior, network: FrequencyDomainLine) -> np.ndarray:
    """What a network would be seen as, (S, F): pressures, or reflection coefficients."""
    twin = posterior.twin
    if posterior.observations[0].kind != "input_impedance":
        return network.readings()
    impedance = network.input_impedance()
    scale = np.concatenate(
        [
            np.full(len(o.frequency_hz), twin.reference_impedance(twin.theta, o))
            for o in posterior.observations
        ]
    )
    return reflection(impedance / scale)[None]


def whitened_columns(posterior: Posterior, prediction: np.ndarray, moved: Sequence) -> np.ndarray:
    """Whitened differences (..., S, F) of predictions `moved` (..., S, F) from `prediction`.

    A free source goes with each of them at its most likely amplitude.
    """
    h = posterior.best_source(prediction)
    amplitude = h / np.where(prediction == 0, 1.0, prediction)
    moved = np.asarray(moved)
    stack = np.concatenate([h[None], (moved * amplitude).reshape(-1, *h.shape)])
    r = posterior.whitened(stack)[0]
    return (r[1:] - r[0]).reshape(moved.shape)


def missing_immittance(
    fit: Fit, observations: Sequence, which: int = -1
) -> MissingImmittance | None:
    """What the effect `which` of a fit adds to the line; None for a fit without effects.

    All else is held as fitted. With law Y and points Y (1 + e), the e of each frequency is the
    least-squares answer over the sensors of a model linear about the fit.
    """
    if not fit.hypothesis:
        return None
    posterior = posterior_at_fit(fit, observations)
    twin, theta = fit.twin, fit.twin.theta
    effect, place, values = twin.effect_values(theta)[which]
    without, changed = _networks(posterior, effect, place, values)
    found = _changed_quantity(without, changed)
    if found is None:
        return None
    quantity, where, unit, change = found
    whole = observable_of(posterior, changed)
    probe = observable_of(posterior, _interpolate_networks(without, changed, 1.0 + PROBE_SHARE))
    prediction = posterior.predict(theta)
    column = whitened_columns(posterior, prediction, prediction + (probe - whole) / PROBE_SHARE)
    r = posterior.whitened(prediction)[0]
    weight = np.maximum(np.sum(np.abs(column) ** 2, axis=0), 1e-300)
    share = -np.sum(np.conj(column) * r, axis=0) / weight
    return MissingImmittance(
        quantity,
        where,
        unit,
        posterior.forward.frequency_hz,
        change,
        change * (1.0 + share),
        np.abs(change) / np.sqrt(weight),
    )


def _networks(
    posterior: Posterior, effect, place, values
) -> tuple[FrequencyDomainLine, FrequencyDomainLine]:
    """The fit's line without one effect and with it, the load's state held where an orifice is."""
    twin, forward = posterior.twin, posterior.forward
    rest = tuple(pair for pair in twin.effects if pair != (effect, place))
    other = twin.with_(effects=rest)
    theta = np.array([twin.theta[twin.index[p.name]] for p in other.parameters])
    without = ForwardModel(other, posterior.observations).network(theta)
    orifice = twin.rig.load.kind == "orifice"
    if orifice:
        without = replace(without, load=forward.network(twin.theta).load)
    changed = replace(
        without,
        series=without.series.copy(),
        shunt=without.shunt.copy(),
        inserts=list(without.inserts),
    )
    state = forward.line_state(twin.arrays(twin.theta))
    effect.apply(changed, state, values, place)
    return without, changed


def _changed_quantity(without: FrequencyDomainLine, changed: FrequencyDomainLine):
    """(words, where, unit, change (F,)) of the first quantity in which two networks differ."""

    def over(x):
        return np.broadcast_to(np.asarray(x, complex), without.s.shape)

    change = over(changed.source_admittance) - over(without.source_admittance)
    if np.any(change):
        return "admittance beside the pump's flow", "source", "m3/(Pa s)", change
    shape = (len(without.sensor_positions), len(without.s))
    factor = np.broadcast_to(changed.sensor_factor, shape) / np.broadcast_to(
        without.sensor_factor, shape
    )
    if np.any(factor != 1.0):
        row = int(np.argmax(np.sum(np.abs(factor - 1.0), axis=1)))
        return "reading over pressure, less one", f"sensor {row + 1}", "1", factor[row] - 1.0
    for name, unit, words in (
        ("series", "Pa s/m4", "series impedance per metre"),
        ("shunt", "m2/(Pa s)", "shunt admittance per metre"),
    ):
        change = getattr(changed, name) - getattr(without, name)
        moved = np.flatnonzero(np.any(change, axis=1))
        if len(moved):
            return words, f"segment {moved[0] + 1}", unit, change[moved[0]]
    new = [i for i in changed.inserts if not any(i is old for old in without.inserts)]
    if new:
        x, kind, value = new[0]
        unit, word = ("m3/(Pa s)", "admittance") if kind == "shunt" else ("Pa s/m3", "impedance")
        return f"{kind} {word}", f"{float(x):.2f} m from the pump", unit, over(value)
    if changed.load is not without.load:
        (p1, q1), (p0, q0) = changed.load_state(), without.load_state()
        return "impedance of the load", "load", "Pa s/m3", over(p1 / q1) - over(p0 / q0)
    return None


def _interpolate_networks(
    without: FrequencyDomainLine, changed: FrequencyDomainLine, share: float
) -> FrequencyDomainLine:
    """The network with `share` of every change; 1 is `changed`."""

    def mix(a, b):
        return a + share * (b - a)

    def inserted(i):
        return i if any(i is old for old in without.inserts) else (i[0], i[1], share * i[2])

    load = without.load
    if changed.load is not without.load:
        (p1, q1), (p0, q0) = changed.load_state(), without.load_state()
        load = "impedance", mix(p0 / q0, p1 / q1)
    return replace(
        without,
        series=mix(without.series, changed.series),
        shunt=mix(without.shunt, changed.shunt),
        source_admittance=mix(without.source_admittance, changed.source_admittance),
        sensor_factor=mix(without.sensor_factor, changed.sensor_factor),
        inserts=[inserted(i) for i in changed.inserts],
        load=load,
    )


def describe_law(
    frequency_hz: np.ndarray, immittance: np.ndarray, weight: np.ndarray | None = None
) -> str:
    """Which simple law an immittance (F,) follows, in words; weights are 1/sqrt(w) by default."""
    w = 2 * np.pi * np.asarray(frequency_hz)
    weight = 1.0 / np.sqrt(w) if weight is None else np.asarray(weight)
    simple = {
        "flat and real, as a leak or a resistance": [np.ones_like(w) + 0j],
        "in proportion to jw, as a compliance or an inertance": [1j * w],
        "as 1/jw, through an inertance or a compliance": [1 / (1j * w)],
        "as (1 + j) sqrt(w), a boundary layer": [(1 + 1j) * np.sqrt(w)],
        "as jw/(1 + jw tau), a compliance that relaxes": [
            1j * w / (1 + 1j * w * tau) for tau in RETARDATIONS
        ],
    }
    whole = float(np.sum(weight * np.abs(immittance) ** 2))
    left = {}
    for number, (words, shapes) in enumerate(simple.items()):
        scales = [
            max(np.sum(weight * np.conj(s) * immittance).real, 0.0)
            / np.sum(weight * np.abs(s) ** 2)
            for s in shapes
        ]
        rest = [
            float(np.sum(weight * np.abs(immittance - c * s) ** 2)) for c, s in zip(scales, shapes)
        ]
        # A law with one number more must do clearly better.
        left[words] = min(rest) * (2.0 if number == len(simple) - 1 else 1.0)
    best = min(left, key=left.get)
    if left[best] < 0.3 * whole:
        return best
    order = np.argsort(w)
    if np.sum((weight * immittance.real)[immittance.real < 0]) < -0.5 * np.sum(
        weight * np.abs(immittance.real)
    ):
        return "with a negative real part: not passive, so the source or a sensor"
    sign = np.sign(immittance.imag[order])
    if np.any(np.diff(sign) != 0):
        return "through zero, as a resonator"
    return "by no simple law"


def is_passive(fit: Fit, which: int = -1) -> bool:
    """Whether a nameless network's immittance is positive real, as fitted.

    Re Y(s) >= 0 for Re s >= 0 (Brune 1931, J. Math. Phys. 10:191): looked at along the imaginary
    axis and a grid of the right half-plane up to 100 kHz. Raises ValueError for a named effect.
    """
    twin = fit.twin
    effect, place, values = twin.effect_values(twin.theta)[which]
    if effect.named:
        raise ValueError(f"{effect.name} is no nameless network")
    w = 2 * np.pi * np.geomspace(0.1, 1e5, 400)
    s = np.concatenate([1j * w, *(w * (np.tan(a) + 1j) * np.cos(a) for a in (0.3, 0.9, 1.5))])
    v, fluid = twin.arrays(twin.theta), twin.rig.fluid
    state = LineState(fluid.density, v.viscosity, v.diameters, v.wave_speeds, v.lengths)
    line = FrequencyDomainLine(s, v.lengths, series=np.ones((len(v.lengths), len(s))), shunt=None)
    effect.apply(line, state, values, place)
    (immittance,) = (insert.immittance for insert in line.inserts)
    return bool(np.all(immittance.real >= -1e-9 * np.abs(immittance)))
