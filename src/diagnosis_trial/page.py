"""The page that reports a diagnosis trial."""

from collections.abc import Sequence

import numpy as np

from concealed.page import drawn_from, span
from concealed.summary import Rate, percent
from diagnosis_trial import detection, summary
from diagnosis_trial.figures import file_name
from rippletwin.learning.markdown import markdown_table

FAILURES_SHOWN = 60


def report_page(rows: list[dict], origin: dict) -> str:
    """The page in Markdown, of the rows of `diagnosis_trial.score.score_rig`.

    `origin` states `commit` (hash of the tool's tree), `number` (of the trial) and `not_committed`
    (whether the tool has changes that are not committed).
    """
    columns = summary.columns_of(rows)
    shared = summary.shared_rows(rows)
    return "\n".join(
        [
            "# How often `rippletwin diagnose` is right on a population of rigs",
            "",
            *_origin(rows, columns, origin),
            "## Scores",
            "",
            "Over the recordings that a column has answered: a network does so at the operating "
            "point that it has learnt.",
            "",
            _scores(columns),
            *(_scores_of_shared(shared) if len(shared) < len(rows) else []),
            "## Smallest leak found at 5 % false alarms",
            "",
            "The alarm is raised above the suspicion that at most 5 % of the healthy recordings "
            "exceed: the log odds against healthy, or those of the p-value where a recording is "
            "called unlike and they are larger. Intervals are from resampled rigs.",
            "",
            _smallest(columns),
            "![detection](figures/detection.png)",
            "",
            *(line for name, chosen in columns.items() for line in _column(name, chosen)),
        ]
    )


def _origin(rows: list[dict], columns: dict[str, list[dict]], origin: dict) -> list[str]:
    every = len({(row["rig"], row["label"]) for row in rows})
    return [
        f"{every} recordings of {len({row['rig'] for row in rows})} rigs, "
        f"{drawn_from(origin, 'diagnosis_trial')}",
        "",
        "A column is METHOD@TWIN.",
        "",
        markdown_table(
            ("column", "misfit of the twin", "twin, s", "diagnosis of a rig, s"),
            [(name, *_costs(made)) for name, made in columns.items()],
        ),
        "* Medians over rigs, the misfit with its least and greatest; seconds of one core. A "
        "column uses simulations of the pump that an earlier one of the same twin has made.",
        "* Shares are followed by their exact 95 % confidence interval (Clopper and Pearson). It "
        "takes recordings as independent.",
        "* *Change*: norm of the change that the state makes in the sensors' ripple, over that of "
        "the healthy ripple, from two runs of the rig.",
        "",
    ]


def _costs(rows: list[dict]) -> tuple[str, str, str]:
    """Misfit of the twin and seconds of either step, of one column."""
    rigs = list({row["rig"]: row for row in rows}.values())
    misfit, fit, seconds = (
        [row[key] for row in rigs if row[key] is not None]
        for key in ("twin_misfit", "fit_s", "diagnose_s")
    )
    least, middle, most = (percent(x) for x in np.quantile(misfit or [np.nan], [0, 0.5, 1]))
    text = f"{middle} % ({least} to {most} %)" if misfit else ""
    return text, *(f"{np.median(x):.0f}" if x else "" for x in (fit, seconds))


def _scores(columns: dict[str, list[dict]]) -> str:
    return "\n".join(_score_table(part) for part in summary.parts_of_page(columns))


def _score_table(columns: dict[str, list[dict]]) -> str:
    tables = [summary.score_table(rows) for rows in columns.values()]
    lines = [
        (same[0].what, same[0].target, *(str(score.rate) for score in same))
        for same in zip(*tables, strict=True)
    ]
    answered = "Recordings answered", "", *(str(len(rows)) for rows in columns.values())
    return markdown_table(("score", "target", *columns), [answered, *lines])


def _scores_of_shared(rows: list[dict]) -> list[str]:
    heading = "## Scores over the recordings that all columns have answered"
    return [heading, "", _scores(summary.columns_of(rows))]


def _smallest(columns: dict[str, list[dict]]) -> str:
    """The table of smallest leaks, by change and by area, with intervals over rigs."""
    rng = np.random.default_rng(0)
    lines = [
        (name, *line) for name, rows in columns.items() for line in _smallest_of_column(rows, rng)
    ]
    heads = [f"found in {100 * p:.0f} %" for p in detection.FOUND]
    return markdown_table(
        ("column", "alarm above", "false alarms", "fault", "severity", *heads), lines
    )


def _smallest_of_column(rows: list[dict], rng: np.random.Generator) -> list[tuple[str, ...]]:
    healthy = [row["suspicion"] for row in rows if row["state"] == "healthy"]
    if not healthy:
        return []
    threshold = detection.alarm_threshold(healthy)
    false_alarms = Rate(sum(s > threshold for s in healthy), len(healthy))
    lines = []
    for state in summary.SINGLE:
        leaks = detection.detect_leaks(rows, state)
        for severity, unit, factor in (
            (leaks.change, "% of the ripple", 100.0),
            ([row["areas"][state] for row in leaks.rows], "mm2", 1e6),
        ):
            found = [
                detection.smallest_found(leaks, severity, probability, rng)
                for probability in detection.FOUND
            ]
            cells = [_found_text(each, severity, factor) for each in found]
            alarm = f"{threshold:.3g}", f"{false_alarms.hits} of {false_alarms.count}"
            lines.append((*alarm, state, unit, *cells))
    return lines


def _found_text(
    found: tuple[float, float, float] | None, severity: Sequence[float], factor: float
) -> str:
    """A smallest leak found with its interval; outside the severities that were recorded, on which
    side of them it is, for a curve says nothing there."""
    if found is None:
        return "too few"
    least, most = min(severity), max(severity)
    if not least <= found[0] <= most:
        side, end = ("below", least) if found[0] < least else ("above", most)
        return f"{side} {factor * end:.2g}"
    return "{:.2g} ({:.2g} to {:.2g})".format(*(factor * x for x in found))


def _column(name: str, rows: list[dict]) -> list[str]:
    """What one column has said, in detail."""
    picture = file_name("confusion", name)
    severities = file_name("severities", name)
    return [
        f"## {name}",
        "",
        markdown_table(
            ("state", "change", "state right", "not called healthy"),
            [
                (b.state, span(b.low, b.high), str(b.right), str(b.noticed))
                for b in summary.change_table(rows)
            ],
        ),
        f"![confusion](figures/{picture}.png)",
        "",
        markdown_table(
            ("fault", "stated over true, median", "5 to 95 %", "95 % intervals that hold"),
            [
                (e.fault, f"{e.median:.2f}", f"{e.low:.2f} to {e.high:.2f}", str(e.coverage))
                for e in summary.severity_table(rows)
            ],
        ),
        markdown_table(
            ("stated probability", "mean", "state right"),
            [
                (f"{b.low:g} to {b.high:g}", f"{b.mean:.4f}", str(b.right))
                for b in summary.reliability_table(rows)
            ],
        ),
        f"![severities](figures/{severities}.png)",
        "",
        _rigs(rows),
        "Recordings that were diagnosed wrongly:",
        "",
        *_failures(rows),
    ]


def _rigs(rows: list[dict]) -> str:
    lines = []
    for rig in sorted({row["rig"] for row in rows}):
        of_rig = [row for row in rows if row["rig"] == rig]
        known = [row for row in of_rig if row["state"] in summary.KNOWN]
        misfit = of_rig[0]["twin_misfit"]
        lines.append(
            (
                str(rig),
                "" if misfit is None else f"{percent(misfit)} %",
                f"{sum(row['right'] for row in known)} of {len(known)}",
                f"{sum(row['right'] for row in of_rig)} of {len(of_rig)}",
            )
        )
    return markdown_table(("rig", "misfit of the twin", "known states right", "all right"), lines)


def _failures(rows: list[dict]) -> list[str]:
    wrong = sorted((row for row in rows if not row["right"]), key=lambda row: -row["change"])
    lines = [
        (
            f"{row['rig']}, {row['label']}",
            row["state"],
            f"{100 * row['change']:.2g} %",
            row["told"],
            "" if row["probability"] is None else f"{row['probability']:.3g}",
        )
        for row in wrong[:FAILURES_SHOWN]
    ]
    heads = ("rig, recording", "truth", "change", "told", "stated probability")
    left = len(wrong) - len(lines)
    return [markdown_table(heads, lines), *([f"And {left} more.", ""] if left else [])]
