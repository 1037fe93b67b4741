"""The time-domain form of an effect that states only its frequency domain.

The effect changes a probe, a line in the frequency domain; what it has changed there becomes
elements of the line in the time domain. One-ports (on the line, at the pump, at an open or a closed
end) and the wall's yielding go through a passive rational fit; what a sensor reads over its
pressure is taken at the frequencies of the simulation and needs none.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.optimize import nnls

from rippletwin.errors import InputError
from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine
from rippletwin.line.frequency_domain.pipe_immittance import series_impedance, shunt_admittance
from rippletwin.line.time_domain.line_elements import Element, TimeDomainLine
from rippletwin.line.time_domain.passive_fit import fit_passive_terms
from rippletwin.twin.effects.base import Effect, LineState, Place

HIGHEST_HZ = 6000.0  # that the fit follows
FREQUENCIES = 400  # of the probe, half of them evenly spaced and half by their logarithm
MAX_FIT_ERROR = 0.01
"""Relative rms error of the fit over the band; an effect that is followed no better is refused."""
RETARDATION_TIMES = 40  # of the wall that are tried


def apply_in_time(
    effect: Effect, line: TimeDomainLine, state: LineState, values: Mapping, place: Place
) -> None:
    """Let an effect change the line by its own time-domain form, or by one made of `apply`.

    Raises InputError where no passive rational function follows the effect.
    """
    if effect.apply_in_time is not None:
        effect.apply_in_time(line, state, values, place)
        return
    probe_of = partial(_probed, effect, line, state, values, place)
    s = 2j * np.pi * _frequencies(1.0 / line.period)
    before, after = _probe(line, state, s), probe_of(s)
    _refuse_unknown_changes(effect, before, after)
    for position, kind, immittance in after.inserts:
        elements = _elements(effect, float(position), kind, s, _whole(immittance, s))
        line.inserts += elements
    line.source += _elements(
        effect, 0.0, "shunt", s, _whole(after.source_admittance - before.source_admittance, s)
    )
    added = after.source_impedance - before.source_impedance
    line.passage += _elements(effect, 0.0, "series", s, _whole(added, s))
    _change_walls(effect, line, s, after.shunt / before.shunt)
    _change_load(effect, line, s, before.load, after.load)
    if after.sensor_factor is not before.sensor_factor:
        for index in range(len(line.positions)):
            line.sensors.append((index, _reading(probe_of, index)))


def series_elements(
    name: str, impedance: Callable[[np.ndarray], np.ndarray], period: float
) -> list[Element]:
    """Series elements of the load whose sum follows `impedance`, a function of s (F,).

    Raises InputError, with `name`, where no passive rational function does.
    """
    s = 2j * np.pi * _frequencies(1.0 / period)
    elements, problem = _fit_elements(0.0, "series", s, impedance(s))
    if problem:
        problem = f"has no time domain: {problem}"
        raise InputError("the twin", name, problem, "Use the other domain")
    return elements


def _frequencies(lowest_hz: float) -> np.ndarray:
    """Frequencies (F,) of the probe, Hz."""
    even = np.linspace(lowest_hz, HIGHEST_HZ, FREQUENCIES // 2)
    return np.union1d(even, np.geomspace(lowest_hz, HIGHEST_HZ, FREQUENCIES // 2))


def _probe(line: TimeDomainLine, state: LineState, s: np.ndarray) -> FrequencyDomainLine:
    """The pipes of the line in the frequency domain, without any element on them."""
    pipes = [pipe.linear(line.density) for pipe in line.pipes]
    series = [
        series_impedance(
            s,
            density=line.density,
            viscosity=line.viscosity,
            diameter=pipe.diameter,
            friction=line.friction,
        )
        for pipe in pipes
    ]
    shunt = [
        pipe.yielding(s)
        * shunt_admittance(
            s, density=line.density, wave_speed=pipe.wave_speed, diameter=pipe.diameter
        )
        for pipe in pipes
    ]
    load: tuple = (line.end.kind, None)
    if line.end.kind == "orifice":
        load = "admittance", np.full(len(s), 1.0 / (state.load_resistance or np.inf))
    return FrequencyDomainLine(
        s=s,
        lengths=np.array([pipe.length for pipe in pipes]),
        series=np.array(series),
        shunt=np.array(shunt),
        load=load,
        sensor_positions=np.array(line.positions),
    )


def _probed(effect, line, state, values, place, s: np.ndarray) -> FrequencyDomainLine:
    """The probe after the effect."""
    probe = _probe(line, state, s)
    effect.apply(probe, state, values, place)
    return probe


def _refuse_unknown_changes(effect: Effect, before, after) -> None:
    """Raise InputError for a change that has no generic form in the time domain."""
    changed = {
        "series": not np.allclose(after.series, before.series, rtol=1e-9, atol=0.0),
        "lengths": not np.array_equal(after.lengths, before.lengths),
        "opening": after.opening is not None,
        "nonlinear_compliances": bool(after.nonlinear_compliances),
        "source_flow": np.any(after.source_flow != before.source_flow),
    }
    for name, has_changed in changed.items():
        if has_changed:
            raise _refusal(effect, f"it changes `{name}` of the line")


def _refusal(effect: Effect, why: str) -> InputError:
    return InputError(
        effect.file or effect.name,
        "EFFECT.apply_in_time",
        f"missing, and no time-domain form follows from `apply`: {why}",
        "State apply_in_time (docs/how-to/add_an_effect.md)",
    )


def _whole(value, s: np.ndarray) -> np.ndarray:
    return np.broadcast_to(np.asarray(value, complex), s.shape)


def _elements(effect: Effect, position: float, kind: str, s, immittance) -> list[Element]:
    """Elements (none where it is zero) whose sum follows a one-port's immittance (F,)."""
    elements, problem = _fit_elements(position, kind, s, immittance)
    if problem:
        raise _refusal(effect, problem)
    return elements


def _fit_elements(position: float, kind: str, s, immittance) -> tuple[list[Element], str]:
    """The same, and why they do not follow it; empty where they do."""
    fit, problem = fit_passive_terms(s, immittance), ""
    if not fit.error <= MAX_FIT_ERROR:
        problem = f"a passive rational function follows its {kind} to {fit.error:.1%} only"
    return [Element(position, kind, *term) for term in fit.terms], problem


def _change_walls(effect: Effect, line: TimeDomainLine, s, factor: np.ndarray) -> None:
    """Give pipes a retarded compliance where the effect multiplies Y' by `factor` (n, F)."""
    times = np.geomspace(0.1 / np.abs(s[-1]), 10.0 / np.abs(s[0]), RETARDATION_TIMES)
    terms = np.array([np.ones_like(s), *(1.0 / (1.0 + s * tau) for tau in times)]).T
    rows = np.vstack([terms.real, terms.imag])
    for k, pipe in enumerate(line.pipes):
        wanted = (factor[k] - 1.0) * pipe.yielding(s)
        size = np.max(np.abs(wanted))
        if size < 1e-9:
            continue
        if wanted.real.min() < -MAX_FIT_ERROR * size:
            raise _refusal(effect, "a wall that yields less than an elastic one")
        share = nnls(rows, np.r_[wanted.real, wanted.imag])[0]
        error = np.sqrt(np.mean(np.abs(terms @ share - wanted) ** 2)) / size
        if error > MAX_FIT_ERROR:
            raise _refusal(effect, f"retarded strains follow its wall to {error:.1%} only")
        creep = tuple((c, tau) for c, tau in zip(share[1:], times) if c > 0.0)
        pipe = replace(pipe, creep=(*pipe.creep, *creep))
        line.pipes[k] = pipe.softened(share[0]) if share[0] > 0.0 else pipe


def _change_load(effect: Effect, line: TimeDomainLine, s, before: tuple, after: tuple) -> None:
    """Put what the effect made of the load before the end of the line."""
    if after[0] == before[0] and np.array_equal(after[1], before[1]):
        return
    if line.end.kind == "anechoic":
        line.end = replace(line.end, kind="open")
    if line.end.kind == "open" and after[0] in ("impedance", "admittance"):
        impedance = after[1] if after[0] == "impedance" else 1.0 / np.asarray(after[1])
        line.load += _elements(effect, 0.0, "series", s, _whole(impedance, s))
    elif line.end.kind in ("closed", "orifice") and after[0] in ("impedance", "admittance"):
        admittance = after[1] if after[0] == "admittance" else 1.0 / np.asarray(after[1])
        own = 0.0 if before[1] is None else before[1]
        line.load += _elements(effect, 0.0, "shunt", s, _whole(admittance - own, s))
    else:
        raise _refusal(effect, f"it replaces an end of kind {line.end.kind}")


def _reading(probe_of: Callable, index: int) -> Callable[[np.ndarray], np.ndarray]:
    """What sensor `index` reads over the pressure at it, at s (F,) of which the first is 0."""

    def factor(s: np.ndarray) -> np.ndarray:
        probe = probe_of(np.where(s == 0.0, 1j, s))
        shape = (len(probe.sensor_positions), len(s))
        return np.broadcast_to(probe.sensor_factor, shape)[index]

    return factor
