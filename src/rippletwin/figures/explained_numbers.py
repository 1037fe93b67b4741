"""The numbers behind the figures of an explanation, and their file.

They are gathered once, because each needs a fit's prediction. Figures and reports are drawn from
them without the recordings.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rippletwin import store
from rippletwin.calibration.fit import posterior_at_fit
from rippletwin.calibration.misfit import predict_with_ripple
from rippletwin.case.words import name_effect, name_hypothesis
from rippletwin.explanation.checks.profile_intervals import effect_intervals
from rippletwin.explanation.localise.missing_immittance import find_missing_immittance
from rippletwin.explanation.localise.residual_bands import residual_map
from rippletwin.explanation.localise.source_free_fits import compare_evidence
from rippletwin.explanation.verdict.explanation import Explanation
from rippletwin.explanation.verdict.places import element_and_extent
from rippletwin.twin.unknown_load import LoadCurve, load_curve

FILE = "figures/explain.json"
SINGLE_EFFECTS_SHOWN = 10
MAX_DIGITS = 6
MIN_RELATIVE_CHANGE = 1e-9  # of a reading; less is rounding noise


@dataclass(frozen=True)
class Point:
    """One observation: complex amplitudes (S, F) measured, of the calibrated line without effects
    and of the corrected one, and their whitened residuals (S, F).

    speed_rpm, load_pressure (Pa) and orders (F,) are None where the source is not the shaft. A
    whitened residual is over the error that the fit expects: 1 is as good as expected.
    """

    label: str
    kind: str
    sensors: tuple[str, ...]
    speed_rpm: float | None
    load_pressure: float | None
    frequency_hz: np.ndarray
    orders: np.ndarray | None
    measured: np.ndarray
    calibrated: np.ndarray
    corrected: np.ndarray
    residual_calibrated: np.ndarray
    residual_corrected: np.ndarray

    def misfit(self, curve: np.ndarray, sensor: int | None = None) -> float:
        """Relative misfit of an (S, F) curve, of one sensor or of all."""
        rows = slice(None) if sensor is None else sensor
        difference = np.linalg.norm(curve[rows] - self.measured[rows])
        return float(difference / np.linalg.norm(self.measured[rows]))


@dataclass(frozen=True)
class Candidate:
    """Log Bayes factor of effects (in words) against the calibrated line; `source_free` with an
    unknown source, None where that was not fitted."""

    effects: tuple[str, ...]
    evidence: float
    source_free: float | None = None


@dataclass(frozen=True)
class LinePlace:
    """Something along the line: its interval (m from the pump) and what it is, in words."""

    words: str
    low: float
    high: float


@dataclass(frozen=True)
class Places:
    """The line, and where along it something was found.

    found      the accepted effects
    free       best interval of one free correction, whatever effect makes it; None where no
               position was scanned
    elements   log Bayes factor of one free correction of each element, in words
    """

    segments: tuple[tuple[float, float], ...]
    sensors: tuple[tuple[str, float], ...]
    found: tuple[LinePlace, ...]
    free: tuple[float, float] | None
    elements: Mapping[str, float]

    @property
    def length(self) -> float:
        """Length of the line, m."""
        return sum(length for length, _ in self.segments)


@dataclass(frozen=True)
class Missing:
    """What one effect adds to the line against frequency, in SI units; fields as in
    `missing_immittance.MissingImmittance`."""

    effect: str
    quantity: str
    unit: str
    frequency_hz: np.ndarray
    law: np.ndarray
    points: np.ndarray
    sd: np.ndarray


@dataclass(frozen=True)
class ExplainedNumbers:
    """Everything that the figures of an explanation show."""

    points: tuple[Point, ...]
    candidates: tuple[Candidate, ...]
    threshold: float
    places: Places
    missing: tuple[Missing, ...]
    load: LoadCurve | None = None


def gather(e: Explanation) -> ExplainedNumbers:
    """The numbers behind the figures of an explanation."""
    return ExplainedNumbers(
        tuple(_points(e)),
        tuple(_candidates(e)),
        float(e.min_log_bayes_factor),
        _places(e),
        tuple(_missing(e)),
        load_curve(e.decision.accepted.twin, e.decision.accepted.covariance, e.observations),
    )


def _points(e: Explanation) -> list[Point]:
    fits = {"calibrated": e.without_effects, "corrected": e.decision.accepted}
    curves, maps = {}, {}
    for name, fit in fits.items():
        posterior = posterior_at_fit(fit, e.observations)
        values = posterior.best_source(posterior.predict(fit.twin.theta))
        if name == "corrected":
            values = predict_with_ripple(posterior, values, e.ripple)
        curves[name] = [values[:, part] for part in posterior.forward.slices]
        curves["measured"] = [posterior.values[:, part] for part in posterior.forward.slices]
        maps[f"residual_{name}"] = residual_map(fit, e.observations)
    return [
        Point(
            label=o.label,
            kind=o.kind,
            sensors=tuple(s.name for s in o.sensors) or (o.kind.replace("_", " "),),
            speed_rpm=None if o.speed_hz is None else 60.0 * float(o.speed_hz),
            load_pressure=o.load_pressure,
            frequency_hz=np.asarray(o.frequency_hz, float),
            orders=None if o.orders is None else np.asarray(o.orders, int),
            **{name: values[k] for name, values in (curves | maps).items()},
        )
        for k, o in enumerate(e.observations)
    ]


def _candidates(e: Explanation) -> list[Candidate]:
    """The best explanations, the leading one first."""
    search = e.search
    if not search.single_effect_fits:
        return []
    fits = [*search.single_effect_fits[:SINGLE_EFFECTS_SHOWN], *search.passive_networks[:1]]
    fits += [search.best] if len(search.best.hypothesis) > 1 else []
    source_free = {
        row["effects"]: row["source_free"]
        for row in compare_evidence(search.leading_fits, e.source_free_fits)
    }
    shown = {
        f.label: Candidate(
            tuple(name_hypothesis(f.label)),
            float(search.log_bayes_factor(f)),
            source_free.get(f.label),
        )
        for f in fits
    }
    return sorted(shown.values(), key=lambda c: -c.evidence)


def _places(e: Explanation) -> Places:
    found = []
    for entry in effect_intervals(e.decision.accepted):
        effect, place, parameters = entry["effect"], entry["place"], entry["parameters"]
        _, (low, high) = element_and_extent(e.rig, place, parameters)
        found.append(LinePlace(name_effect(effect.name, str(place)), float(low), float(high)))
    location = e.location
    return Places(
        tuple((s.length, s.diameter) for s in e.rig.line),
        tuple((s.name, s.position) for s in e.rig.sensors),
        tuple(found),
        None if location is None else location.profile.best_interval()[1:],
        {} if location is None else dict(location.log_bayes_factors),
    )


def _missing(e: Explanation) -> list[Missing]:
    """Of every accepted effect that changes a quantity by more than rounding."""
    fit, shown = e.decision.accepted, []
    for k, (effect, place) in enumerate(fit.hypothesis):
        m = find_missing_immittance(fit, e.observations, k)
        if m is None or (m.unit == "1" and np.max(np.abs(m.law)) < MIN_RELATIVE_CHANGE):
            continue
        order = np.argsort(m.frequency_hz)
        words, frequency = name_effect(effect.name, str(place)), m.frequency_hz[order]
        law, points, sd = m.law[order], m.points[order], m.sd[order]
        shown.append(Missing(words, m.quantity, m.unit, frequency, law, points, sd))
    return shown


def save(numbers: ExplainedNumbers, folder: str | Path) -> Path:
    """Write the numbers into `folder`, which must have a folder `figures`; returns the path."""
    path = Path(folder) / FILE
    store.write_text(path, json.dumps(_plain(numbers), allow_nan=False) + "\n")
    return path


def load(folder: str | Path) -> ExplainedNumbers | None:
    """The numbers in `folder`; None where explain has drawn no figures."""
    path = Path(folder) / FILE
    if not path.exists():
        return None
    data = json.loads(path.read_text())
    places, end = data["places"], data.get("load")
    return ExplainedNumbers(
        tuple(Point(**{k: _array(v) for k, v in each.items()}) for each in data["points"]),
        tuple(Candidate(tuple(c.pop("effects")), **c) for c in data["candidates"]),
        data["threshold"],
        Places(
            tuple(map(tuple, places["segments"])),
            tuple(map(tuple, places["sensors"])),
            tuple(LinePlace(**each) for each in places["found"]),
            None if places["free"] is None else tuple(places["free"]),
            places["elements"],
        ),
        tuple(Missing(**{k: _array(v) for k, v in each.items()}) for each in data["missing"]),
        LoadCurve(**{k: _array(v) for k, v in end.items()}) if end else None,
    )


def _plain(value):
    """Dataclasses and arrays as plain data; numbers have MAX_DIGITS digits."""
    if hasattr(value, "__dataclass_fields__"):
        return {name: _plain(getattr(value, name)) for name in value.__dataclass_fields__}
    if isinstance(value, Mapping):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, np.ndarray) and np.iscomplexobj(value):
        return {"re": _plain(value.real), "im": _plain(value.imag)}
    if isinstance(value, np.ndarray):
        return _plain(value.tolist())
    if isinstance(value, Sequence) and not isinstance(value, str):
        return [_plain(each) for each in value]
    if isinstance(value, float | np.floating):
        return float(f"{value:.{MAX_DIGITS}g}")
    return value


def _array(value):
    """What `_plain` made of an array as an array, other values as they are."""
    if isinstance(value, Mapping):
        return np.array(value["re"]) + 1j * np.array(value["im"])
    if isinstance(value, list):
        return tuple(value) if value and isinstance(value[0], str) else np.array(value)
    return value
