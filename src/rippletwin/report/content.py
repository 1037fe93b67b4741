"""What stands on the page, section by section, made of the results: no markup but the drawings."""

from __future__ import annotations

import importlib.metadata
import platform
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache

from markupsafe import Markup

from rippletwin import __version__
from rippletwin.case.model import Rig
from rippletwin.case.quantities import write_certainty, write_share
from rippletwin.case.words import name_change, name_element, name_ordinal, name_state
from rippletwin.figures.explained_numbers import LinePlace, Places
from rippletwin.figures.line_drawing import describe_free, shown_places
from rippletwin.report import charts, verdict_words
from rippletwin.report.line_picture import MarkedPlace, draw_line
from rippletwin.report.results import Results
from rippletwin.report.svg import Chart, draw_chart
from rippletwin.report.tables import (
    Table,
    effect_table,
    parameter_table,
    recording_table,
    severity_words,
    tolerance_note,
)

WIDE, NARROW = 960.0, 358.0  # widths of the line's drawing, on a desk and on a phone
LIBRARIES = ("numpy", "scipy", "numba")


@dataclass(frozen=True)
class Figure:
    """A drawn chart with its heading, note and legend of (name, role, form)."""

    heading: str
    note: str
    svg: Markup
    legend: Sequence[tuple[str, str, str]]


@dataclass(frozen=True)
class Tile:
    """A key figure: what it is, its value, and a line of explanation."""

    name: str
    value: str
    note: str = ""


@dataclass(frozen=True)
class DiagnosisCard:
    """One recording's diagnosis: `kind` is "healthy", "faulty" or "unlike", neither of them; `bars`
    are (state, probability as text, width in per cent)."""

    label: str
    state: str
    kind: str
    facts: Sequence[str]
    bars: Sequence[tuple[str, str, float]]
    networks: Sequence[str]
    figures: Sequence[Figure]


@dataclass(frozen=True)
class Population:
    """How often the diagnosis is right on a population of rigs: what they are, probabilities of
    detection against severity, and what was told of each state."""

    sentence: str
    detection: Sequence[Figure]
    confusion: Sequence[Figure]


@dataclass(frozen=True)
class WorkflowPart:
    """What only a whole run of the workflow has.

    population  a scored diagnosis trial, or None
    tables    such as accuracy beside the paper's, and timings
    pictures  (description, file as a data: URL)
    notes     sentences under the tables
    configuration  as text
    """

    tables: Sequence[Table] = ()
    pictures: Sequence[tuple[str, str]] = ()
    notes: Sequence[str] = ()
    configuration: str = ""
    population: Population | None = None


@dataclass(frozen=True)
class Page:
    """Everything that the template shows."""

    title: str
    headline: str
    kind: str
    sentence: str
    tiles: Sequence[Tile]
    warnings: Sequence[str]
    missing: Sequence[str]
    columns: int
    line_wide: Markup
    line_narrow: Markup
    place: str
    certainty: Sequence[str]
    effects: Table | None
    ripples: Sequence[Figure]
    residuals: Sequence[Figure]
    remaining: Sequence[str]
    following: Sequence[str]
    diagnoses: Sequence[DiagnosisCard]
    parameters: Table | None
    tolerance: str
    recordings: Table
    orders: Sequence[Figure]
    full_sentence: str
    versions: Sequence[tuple[str, str]]
    workflow: WorkflowPart | None


def make_page(results: Results, workflow: WorkflowPart | None = None) -> Page:
    """The page's content."""
    case, verdict, numbers = results.case, results.verdict, results.explained
    places, marked = _places(results)
    orders = [chart for each in results.spectra for chart in charts.chart_orders(each)]
    kind = "unknown" if verdict is None else verdict["verdict"]
    return Page(
        title=case.folder.resolve().name,
        headline="Not explained yet" if verdict is None else verdict_words.verdict_title(verdict),
        kind=kind,
        sentence="" if verdict is None else verdict_words.verdict_sentence(verdict),
        tiles=_tiles(results),
        warnings=case.warnings,
        missing=results.missing,
        columns=min(max(len(case.rig.sensors), 2), 3),
        line_wide=draw_line(places, marked, WIDE),
        line_narrow=draw_line(places, marked, NARROW),
        place=_free_place(places, marked),
        certainty=[] if verdict is None else verdict_words.mismatch_sentences(verdict),
        effects=effect_table(verdict["effects"]) if verdict and verdict.get("effects") else None,
        ripples=[] if numbers is None else draw_figures(charts.chart_ripples(numbers)),
        residuals=[] if numbers is None else draw_figures(charts.chart_residuals(numbers)),
        remaining=[] if verdict is None else verdict_words.remaining_sentences(verdict),
        following=[] if verdict is None else verdict_words.next_sentences(verdict),
        diagnoses=[_diagnosis(each, results) for each in results.diagnosis],
        parameters=None
        if results.twin is None
        else parameter_table(results.twin, results.covariance),
        tolerance="" if results.twin is None else tolerance_note(results.twin),
        recordings=recording_table(case),
        orders=draw_figures(orders),
        full_sentence="" if verdict is None else verdict.get("sentence", ""),
        versions=_versions(),
        workflow=workflow,
    )


def draw_figures(drawn: Sequence[Chart]) -> list[Figure]:
    """Charts with what stands above them."""
    return [
        Figure(
            chart.heading,
            chart.note,
            draw_chart(chart),
            [(s.name, s.role, s.form) for s in chart.series],
        )
        for chart in drawn
    ]


def _places(results: Results) -> tuple[Places, list[MarkedPlace]]:
    """The line of the data sheet, and what is marked along it."""
    verdict = results.verdict
    if results.explained is not None:
        places = results.explained.places
    else:
        places = _line_of(results.case.rig, _mismatch_place(verdict))
    marked = [MarkedPlace(place, "found") for place in places.found]
    free = shown_places(places)[len(places.found) :]
    if verdict is not None and verdict["verdict"] not in ("consistent", "calibration_only"):
        marked += [MarkedPlace(place, "free") for place in free]
    remainder = (verdict or {}).get("remainder") or {}
    if remainder.get("position_m"):
        words = f"what remains, {name_element(remainder.get('element') or 'line')}"
        marked.append(MarkedPlace(LinePlace(words, *remainder["position_m"]), "left"))
    return places, marked


def _line_of(rig: Rig, found: Sequence[LinePlace]) -> Places:
    segments = tuple((s.length, s.diameter) for s in rig.line)
    return Places(
        segments, tuple((s.name, s.position) for s in rig.sensors), tuple(found), None, {}
    )


def _mismatch_place(verdict: Mapping | None) -> list[LinePlace]:
    where = ((verdict or {}).get("mismatch") or {}).get("where")
    if not where or not where.get("position_m"):
        return []
    return [LinePlace(f"what is missing: {name_element(where['element'])}", *where["position_m"])]


def _free_place(places: Places, marked: Sequence[MarkedPlace]) -> str:
    """What the recordings tell of the place without an effect's name, where something is marked."""
    return describe_free(places) if marked and places.sensors and places.free else ""


def _tiles(results: Results) -> list[Tile]:
    tiles, verdict = [], results.verdict or {}
    errors = verdict_words.held_out(verdict)
    if errors is not None:
        note = f"was {write_share(errors[0])} calibrated without effects"
        value = write_share(errors[1])
        tiles.append(Tile("Error on data that the twin has not seen", value, note))
    theil = ((verdict.get("fit") or {}).get("after") or {}).get("theil_held_out")
    if theil is not None:
        before = ((verdict.get("fit") or {}).get("before") or {}).get("theil_held_out")
        note = "0 is perfect" if before is None else f"was {before:.2g}; 0 is perfect"
        tiles.append(Tile("Theil's coefficient of the same", f"{theil:.2g}", note))
    healthy = len(results.case.healthy)
    note = f"{healthy} of the healthy pump"
    tiles.append(Tile("Recordings", str(len(results.case.recordings)), note))
    if results.diagnosis:
        states = [name_state(each["state"]) for each in results.diagnosis]
        faulty = sum(_kind(each) == "faulty" for each in results.diagnosis)
        value = f"{faulty} of {len(states)}"
        tiles.append(Tile("Diagnosed as faulty", value, ", ".join(dict.fromkeys(states))))
    return tiles


def _kind(entry: Mapping) -> str:
    """What a diagnosis says: that the pump is healthy, that it is faulty, or neither."""
    return entry["state"] if entry["state"] in ("healthy", "unlike") else "faulty"


def _diagnosis(entry: Mapping, results: Results) -> DiagnosisCard:
    facts = [f"Leak area, {words}" for words in severity_words(entry.get("severity") or {})]
    if entry.get("piston") is not None:
        ordinal = name_ordinal(entry["piston"] + 1)
        facts.append(f"It is the {ordinal} piston to begin its delivery in the recording")
    if entry["state"] == "unlike":
        where = (entry.get("unlike") or {}).get("where") or {}
        changed = name_change(where.get("element"), where.get("orders") or ())
        facts.append(changed[0].upper() + changed[1:])
    facts += [f"Doubtful: {doubt}" for doubt in entry.get("doubts") or ()]
    networks = [
        f"{name}: {name_state(said['state'])}, {write_share(said['share'])} of windows and seeds"
        for name, said in (entry.get("networks") or {}).items()
    ]
    numbers = results.diagnosed.get(entry["label"])
    return DiagnosisCard(
        entry["label"],
        name_state(entry["state"]),
        _kind(entry),
        facts,
        [
            (name_state(state), write_certainty(p), 100 * p)
            for state, p in entry["probabilities"].items()
        ],
        networks,
        [] if numbers is None else draw_figures(charts.chart_change(numbers)),
    )


@cache
def _versions() -> list[tuple[str, str]]:
    versions = [("rippletwin", __version__), ("Python", platform.python_version())]
    return versions + [(name, importlib.metadata.version(name)) for name in LIBRARIES]
