"""docs/benchmarks.md and its figure from the results of the benchmarks."""

from __future__ import annotations

import textwrap
from pathlib import Path

from matplotlib.ticker import NullFormatter

from rippletwin.figures import style
from speed.result import Chart, Claim, Result, Table

INTRODUCTION = """# Benchmarks

<!-- Written by benchmarks/bench.py; do not edit. -->

How fast the tool is, beside other programs that solve the same. The command that measures writes
this page and its figure:

<!-- long -->
```sh
make bench
```

Programs that run in one process are measured in turns, and their ratios are medians over rounds;
sections say where it is otherwise. Times are processor seconds of one thread. Times of different
machines cannot be compared. The other programs are requirements of the benchmarks alone
(`environment-bench.txt`); nothing of `src/` needs them for what is measured here.

![Speeds over their targets](figures/benchmarks.svg)
"""


def write(records: list[dict], page: Path, picture: Path) -> None:
    """Write the page and the figures of `records`, one for each benchmark; charts lie beside
    `picture`, in the folder figures of the page."""
    records = sorted(records, key=lambda record: record["result"]["point"])
    results = [Result.from_json(record["result"]) for record in records]
    parts = [INTRODUCTION, machine_words(records), summary(results)]
    parts += [section(result) for result in results]
    page.write_text("\n".join(part.rstrip() + "\n" for part in parts))
    draw(results, picture)
    for chart in (chart for result in results for chart in result.charts):
        draw_chart(chart, picture.parent / chart.file)


def machine_words(records: list[dict]) -> str:
    """The section on the processor and the versions."""
    machines = {record["machine"]["processor"] for record in records}
    first = records[0]["machine"]
    has = [name for name, there in first["instructions"].items() if there]
    lacks = [name for name, there in first["instructions"].items() if not there]
    caches = ", ".join(f"{name} {size}" for name, size in first["caches"].items())
    versions = known_versions(records)
    lines = [
        "## Machine and versions",
        "",
        f"* Processor: {first['processor']}, {first['cores']} cores; caches {caches}.",
        f"* Instructions: {', '.join(has) or 'none'} are there; {', '.join(lacks) or 'none'} "
        "are not.",
        f"* Python {first['python']}; "
        + ", ".join(f"{name} {version or 'not installed'}" for name, version in versions.items())
        + ".",
    ]
    if len(machines) > 1:
        lines.append("* The sections were measured on different machines.")
    return "\n".join(lines) + "\n"


def known_versions(records: list[dict]) -> dict[str, str | None]:
    """Version of each package; None where no record has one.

    A program in another Python has its version in the record of its benchmark alone.
    """
    known: dict[str, str | None] = {}
    for record in records:
        for name, version in (record["machine"]["versions"] | record["peers"]).items():
            known[name] = version or known.get(name)
    return known


def summary(results: list[Result]) -> str:
    """One row for every claim with a target."""
    rows = [
        [result.title, claim.text, target_words(claim), result_words(claim), verdict(claim)]
        for result in results
        for claim in result.claims
        if claim.target is not None
    ]
    table = Table("", ["", "what", "target", "result", "reached"], rows)
    missed = sum(claim.met is False for result in results for claim in result.claims)
    words = f"{missed} of {len(rows)} targets are missed." if missed else "All targets are reached."
    return f"## Targets\n\n{words}\n\n{markdown(table)}"


def section(result: Result) -> str:
    """The section of one benchmark."""
    lines = [f"## {result.title}", "", " ".join(result.what), ""]
    for claim in result.claims:
        target = "" if claim.target is None else f" (target {target_words(claim)})"
        note = f": {claim.note}" if claim.note else ""
        lines.append(f"* {sentence(claim.text)}: **{result_words(claim)}**{target}{note}.")
    for chart in result.charts:
        lines += ["", f"![{chart.title}](figures/{chart.file})"]
    for table in result.tables:
        lines += ["", f"{table.caption}:", "", markdown(table).rstrip()]
    if result.bound:
        lines += ["", "The bound: " + " ".join(result.bound)]
    if result.notes:
        lines += ["", " ".join(result.notes)]
    return "\n".join(lines) + "\n"


def sentence(text: str) -> str:
    """The text with a capital, but for names in lower case."""
    return text if text.startswith(("rippletwin", "calibrate")) else text[0].upper() + text[1:]


def target_words(claim: Claim) -> str:
    sign = "at least" if claim.at_least else "at most"
    return f"{sign} {number(claim.target)}{unit(claim)}"


def result_words(claim: Claim) -> str:
    return "not measured" if claim.result is None else f"{number(claim.result)}{unit(claim)}"


def unit(claim: Claim) -> str:
    return f" {claim.unit}" if claim.unit else ""


def verdict(claim: Claim) -> str:
    return {True: "yes", False: "**no**", None: "not measured"}[claim.met]


def number(value: float) -> str:
    """Two or three digits, without an exponent where the number is of ordinary size."""
    if value == 0:
        return "0"
    if 1e-3 <= abs(value) < 1e5:
        return f"{value:.0f}" if abs(value) >= 100 else f"{value:.3g}"
    return f"{value:.1e}"


def markdown(table: Table) -> str:
    """A table in Markdown, without its caption."""
    lines = [table.columns, ["---"] * len(table.columns), *table.rows]
    return "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines) + "\n"


def advantage(claim: Claim) -> float:
    """Result over target, so that more than one is better than the target."""
    ratio = max(claim.result, 1e-12) / claim.target
    return ratio if claim.at_least else 1 / ratio


SPEED_UNITS = ("times", "s", "min")
"""Units of the claims that the figure shows; the others are of agreement and growth."""


def draw(results: list[Result], path: Path) -> None:
    """Speeds over their targets on a logarithmic axis; filled where the target is reached."""
    shown = [
        claim
        for result in results
        for claim in result.claims
        if claim.unit in SPEED_UNITS and None not in (claim.target, claim.result)
    ]
    fig, axes = style.figure(height=0.7 + 0.3 * len(shown))
    ax = axes[0, 0]
    for row, claim in enumerate(shown):
        colour = style.CORRECTED if claim.met else style.ALARM
        value = advantage(claim)
        ax.plot([1, value], [row, row], color=colour, lw=1.5)
        ax.plot(value, row, "o", color=colour, mfc=colour if claim.met else "white", ms=5)
    ax.axvline(1, color=style.NEUTRAL, lw=0.8)
    ax.set_xscale("log")
    ax.xaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_formatter(NullFormatter())
    labels = [textwrap.fill(claim.text, 58) for claim in shown]
    ax.set_yticks(range(len(shown)), labels, fontsize=7)
    ax.set_ylim(len(shown) - 0.5, -0.5)
    values = [0.1, 10.0, *map(advantage, shown)]  # at least three labelled ticks
    ax.set_xlim(min(values) / 1.2, max(values) * 1.2)
    ax.set_xlabel("times faster than the target (open: missed)")
    style.save(fig, path)


def draw_chart(chart: Chart, path: Path) -> None:
    """Horizontal bars, the first on top, each beginning with its part."""
    fig, axes = style.figure(height=1.0 + 0.16 * len(chart.labels))
    ax, rows = axes[0, 0], range(len(chart.labels))
    ax.barh(rows, chart.values, color=style.CALIBRATED)
    ax.barh(rows, chart.parts, color=style.NOMINAL)
    ax.set_yticks(rows, chart.labels, fontsize=7)
    ax.set_ylim(len(chart.labels) - 0.5, -0.5)
    ax.set_title(chart.title, loc="left")
    ax.set_xlabel(chart.axis)
    style.save(fig, path)
