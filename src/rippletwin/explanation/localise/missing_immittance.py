"""The missing quantity against frequency, without reference to a named effect.

An effect changes one quantity of the line: the admittance of a shunt at a point, the impedance or
admittance per metre of a segment, the factor of a sensor, or the admittance at the pump or load. At
every frequency alone, the data determine how much of that change they need. The law of a named
effect must pass through these points. A flat and real law is a leak. A law in proportion to jw is a
compliance. A law through zero is a resonator. A law as (1 + j) sqrt(w) is a boundary layer. A
negative real part is not passive, so it belongs to the source or a sensor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rippletwin.calibration.fit import Fit, posterior_at_fit
from rippletwin.calibration.posterior import Posterior
from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine
from rippletwin.line.frequency_domain.pipe_immittance import shunt_admittance
from rippletwin.twin.effects.base import LineState
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.reflection import reference_impedance, to_reflection

PROBE_SHARE = 1e-4  # of the change by an effect, for finite differences
RETARDATION_TIMES = np.geomspace(2e-5, 5e-3, 9)  # s, of a relaxing compliance
MAX_PASSIVITY_HZ = 1e5
MAX_UNEXPLAINED_SHARE = 0.3  # of the weighted power of an immittance that follows a simple law
PENALTY_FOR_TIME_CONSTANT = 2.0
"""Factor on what a law with a time constant leaves: with one parameter more it must do better."""


@dataclass(frozen=True)
class MissingImmittance:
    """One quantity that the line without an effect lacks, in SI units.

    quantity, where   in words; `unit` is the quantity's
    frequency_hz      (F,)
    law               (F,) the quantity by the fitted effect
    points, sd        (F,) the quantity by the data at each frequency alone, and its standard
                      deviation
    """

    quantity: str
    where: str
    unit: str
    frequency_hz: np.ndarray
    law: np.ndarray
    points: np.ndarray
    sd: np.ndarray

    @property
    def law_in_words(self) -> str:
        """The simple law that the points follow, in words. Where the effect changes nothing, a
        point says nothing."""
        weight = np.divide(1.0, self.sd**2, out=np.zeros(len(self.sd)), where=self.sd > 0.0)
        return describe_law(self.frequency_hz, self.points, weight)


def observable_of(
    posterior: Posterior, network: FrequencyDomainLine, theta: np.ndarray | None = None
) -> np.ndarray:
    """The observed quantity of a network, (S, F): pressures, Pa, or reflection coefficients.

    `theta` (P,) are the parameters of the network, by default those of the posterior's twin.
    """
    twin = posterior.twin
    theta = twin.theta if theta is None else theta
    if posterior.observations[0].kind != "input_impedance":
        return network.readings()
    impedance = network.input_impedance()
    scale = np.concatenate(
        [
            np.full(len(o.frequency_hz), reference_impedance(twin, theta, o))
            for o in posterior.observations
        ]
    )
    return to_reflection(impedance / scale)[None]


def whiten_columns(
    posterior: Posterior, prediction: np.ndarray, moved: np.ndarray | Sequence
) -> np.ndarray:
    """Whitened differences (..., S, F) of predictions `moved` (..., S, F) from `prediction` (S, F).

    A free source keeps its most likely amplitude at `prediction`.
    """
    moved = np.asarray(moved)
    stack = np.concatenate([prediction[None], moved.reshape(-1, *prediction.shape)])
    r = posterior.whitened(stack)[0]
    return (r[1:] - r[0]).reshape(moved.shape)


def find_missing_immittance(
    fit: Fit, observations: Sequence, effect_index: int = -1
) -> MissingImmittance | None:
    """What one effect of a fit adds to the line; None for a fit without effects.

    Everything else is fixed at the fit. With law Y and points Y (1 + e), e is the least-squares
    solution at each frequency, over the sensors, of a model linear in e.
    """
    if not fit.hypothesis:
        return None
    posterior = posterior_at_fit(fit, observations)
    twin, theta = fit.twin, fit.twin.theta
    effect, place, values = twin.effect_values(theta)[effect_index]
    without, changed = _networks(posterior, effect, place, values)
    difference = _changed_quantity(without, changed)
    if difference is None:
        return None
    quantity, where, unit, change = difference
    whole = observable_of(posterior, changed)
    probe = observable_of(posterior, _interpolate_networks(without, changed, 1.0 + PROBE_SHARE))
    prediction = posterior.predict(theta)
    column = whiten_columns(posterior, prediction, prediction + (probe - whole) / PROBE_SHARE)
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
    """The fitted line without one effect and with it; an orifice keeps its fitted state."""
    twin, forward = posterior.twin, posterior.forward
    rest = tuple(pair for pair in twin.effects if pair != (effect, place))
    other = twin.with_(effects=rest)
    theta = np.array([twin.theta[twin.index[p.name]] for p in other.parameters])
    without = ForwardModel(other, posterior.observations).network(theta)
    if twin.rig.load.kind == "orifice":
        without = replace(without, load=forward.network(twin.theta).load)
    changed = replace(
        without,
        series=without.series.copy(),
        shunt=without.shunt.copy(),
        inserts=list(without.inserts),
    )
    state = forward.line_state(forward.arrays(twin.theta))
    effect.apply(changed, state, values, place)
    return without, changed


def _changed_quantity(without: FrequencyDomainLine, changed: FrequencyDomainLine):
    """(quantity, where, unit, change (F,)) of the first quantity in which two networks differ.

    None for a two-port, which changes several at once.
    """

    def over(x):
        return np.broadcast_to(np.asarray(x, complex), without.s.shape)

    change = over(changed.source_admittance) - over(without.source_admittance)
    if np.any(change):
        return "admittance parallel to the pump's flow", "source", "m3/(Pa s)", change
    shape = (len(without.sensor_positions), len(without.s))
    factor = np.broadcast_to(changed.sensor_factor, shape) / np.broadcast_to(
        without.sensor_factor, shape
    )
    if np.any(factor != 1.0):
        row = int(np.argmax(np.sum(np.abs(factor - 1.0), axis=1)))
        return "relative error of the reading", f"sensor {row + 1}", "1", factor[row] - 1.0
    for name, unit, quantity in (
        ("series", "Pa s/m4", "series impedance per metre"),
        ("shunt", "m2/(Pa s)", "shunt admittance per metre"),
    ):
        change = getattr(changed, name) - getattr(without, name)
        moved = np.flatnonzero(np.any(change, axis=1))
        if len(moved):
            return quantity, f"segment {moved[0] + 1}", unit, change[moved[0]]
    new = [i for i in changed.inserts if not any(i is old for old in without.inserts)]
    if len({kind for _, kind, _ in new}) > 1:
        return None  # a two-port
    if new:
        x, kind, value = new[0]
        unit, name = ("m3/(Pa s)", "admittance") if kind == "shunt" else ("Pa s/m3", "impedance")
        return f"{kind} {name}", f"{float(x):.2f} m from the pump", unit, over(value)
    if changed.load is not without.load:
        (p1, q1), (p0, q0) = changed.load_state(), without.load_state()
        if without.load[0] == "closed":  # it has no impedance
            return "admittance of the load", "load", "m3/(Pa s)", over(q1 / p1)
        return "impedance of the load", "load", "Pa s/m3", over(p1 / q1) - over(p0 / q0)
    return None


def _interpolate_networks(
    without: FrequencyDomainLine, changed: FrequencyDomainLine, share: float
) -> FrequencyDomainLine:
    """The network with `share` of every change: 0 is `without`, 1 is `changed`."""

    def mix(a, b):
        return a + share * (b - a)

    def inserted(i):
        return i if any(i is old for old in without.inserts) else (i[0], i[1], share * i[2])

    load = without.load
    if changed.load is not without.load:
        (p1, q1), (p0, q0) = changed.load_state(), without.load_state()
        if without.load[0] == "closed":
            load = "admittance", share * q1 / p1
        else:
            load = "impedance", mix(p0 / q0, p1 / q1)
    return replace(
        without,
        series=mix(without.series, changed.series),
        shunt=mix(without.shunt, changed.shunt),
        source_admittance=mix(without.source_admittance, changed.source_admittance),
        source_impedance=mix(without.source_impedance, changed.source_impedance),
        sensor_factor=mix(without.sensor_factor, changed.sensor_factor),
        inserts=[inserted(i) for i in changed.inserts],
        load=load,
    )


def describe_law(
    frequency_hz: np.ndarray, immittance: np.ndarray, weight: np.ndarray | None = None
) -> str:
    """What an immittance (F,), SI units, behaves like over frequency_hz (F,), in words: a noun,
    with its simple law in brackets.

    `weight` (F,) is 1/sqrt(w) by default.
    """
    w = 2 * np.pi * np.asarray(frequency_hz)
    weight = 1.0 / np.sqrt(w) if weight is None else np.asarray(weight)
    time_constant_law = "a relaxing compliance (proportional to jw/(1 + jw tau))"
    shapes_by_law: dict[str, list[np.ndarray]] = {
        "a leak or a resistance (flat and real)": [np.ones_like(w) + 0j],
        "a compliance or an inertance (proportional to jw)": [1j * w],
        "an inertance or a compliance in series (proportional to 1/jw)": [1 / (1j * w)],
        "a boundary layer (proportional to (1 + j) sqrt(w))": [(1 + 1j) * np.sqrt(w)],
        time_constant_law: [1j * w / (1 + 1j * w * tau) for tau in RETARDATION_TIMES],
    }
    residuals = {
        law: min(_power_left(immittance, shape, weight) for shape in shapes)
        for law, shapes in shapes_by_law.items()
    }
    residuals[time_constant_law] *= PENALTY_FOR_TIME_CONSTANT
    best = min(residuals, key=residuals.get)
    if residuals[best] < MAX_UNEXPLAINED_SHARE * np.sum(weight * np.abs(immittance) ** 2):
        return best
    real = weight * immittance.real
    if np.sum(real[real < 0]) < -0.5 * np.sum(np.abs(real)):
        return "a source or a sensor, for it is not passive (negative real part)"
    sign = np.sign(immittance.imag[np.argsort(w)])
    if np.any(np.diff(sign) != 0):
        return "a resonator (imaginary part through zero)"
    return "none of the simple laws"


def _power_left(immittance: np.ndarray, shape: np.ndarray, weight: np.ndarray) -> float:
    """Weighted power of an immittance (F,) less its best multiple >= 0 of `shape` (F,)."""
    inner = np.sum(weight * np.conj(shape) * immittance).real
    scale = max(inner, 0.0) / np.sum(weight * np.abs(shape) ** 2)
    return float(np.sum(weight * np.abs(immittance - scale * shape) ** 2))


def is_passive(fit: Fit, effect_index: int = -1) -> bool:
    """Whether the fitted immittances of a passive network are positive real.

    Re Y(s) >= 0 for Re s >= 0 (Brune 1931, J. Math. Phys. 10:191), checked along the imaginary
    axis and on a grid of the right half-plane up to 100 kHz; of a piece of another pipe Z' and Y'.
    Raises ValueError for a named effect.
    """
    twin = fit.twin
    effect, place, values = twin.effect_values(twin.theta)[effect_index]
    if effect.named:
        raise ValueError(f"{effect.name} is a named effect, not a passive network")
    w = 2 * np.pi * np.geomspace(0.1, MAX_PASSIVITY_HZ, 400)
    s = np.concatenate([1j * w, *(w * (np.tan(a) + 1j) * np.cos(a) for a in (0.3, 0.9, 1.5))])
    v, fluid = twin.arrays(twin.theta), twin.rig.fluid
    state = LineState(fluid.density, v.viscosity, v.diameters, v.wave_speeds, v.lengths)
    shunt = np.array(
        [
            shunt_admittance(s, density=fluid.density, wave_speed=a, diameter=d)
            for a, d in zip(v.wave_speeds, v.diameters)
        ]
    )
    line = FrequencyDomainLine(s, v.lengths, series=np.ones((len(v.lengths), len(s))), shunt=shunt)
    if effect.immittances is not None:
        immittances = effect.immittances(line, state, values, place)
    else:
        effect.apply(line, state, values, place)
        immittances = [insert.immittance for insert in line.inserts]
    return all(bool(np.all(z.real >= -1e-9 * np.abs(z))) for z in immittances)
