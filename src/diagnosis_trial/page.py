"""The page that reports a diagnosis trial."""

from collections.abc import Iterable

import numpy as np

from concealed.summary import Rate, percent
from diagnosis_trial import detection, summary
from diagnosis_trial.score import LEAK_STATES

FAILURES_SHOWN = 60


def report_page(rows: list[dict], origin: dict) -> str:
    """The page in Markdown, of the rows of `diagnosis_trial.score.score_rig`.

    `origin` states `commit` (hash of the tool's tree), `number` (of the trial), `not_committed`
    (whether the tool has changes that are not committed) and `twin` ("explained" or "calibrated").
    """
    return "\n".join(
        [
            "# How often `rippletwin diagnose` is right on a population of rigs",
            "",
            *_origin(rows, origin),
            "## Scores",
            "",
            *_table(("score", "target", "result"),
                    [(s.what, s.target, str(s.rate)) for s in summary.score_table(rows)]),
            "## Smallest leak found at 5 % false alarms",
            "",
            *_smallest(rows),
            "![detection](figures/detection.png)",
            "",
            "## States by the change that they make in the ripple",
            "",
            *_table(("state", "change", "state right", "not called healthy"),
                    [(b.state, _span(b.low, b.high), str(b.right), str(b.noticed))
                     for b in summary.change_table(rows)]),
            "![confusion](figures/confusion.png)",
            "",
            "## Leak areas and stated probabilities",
            "",
            *_table(("fault", "stated over true, median", "5 to 95 %", "95 % intervals that hold"),
                    [(e.fault, f"{e.median:.2f}", f"{e.low:.2f} to {e.high:.2f}", str(e.coverage))
                     for e in summary.severity_table(rows)]),
            *_table(("stated probability", "mean", "state right"),
                    [(f"{b.low:g} to {b.high:g}", f"{b.mean:.4f}", str(b.right))
                     for b in summary.reliability_table(rows)]),
            "![severities](figures/severities.png)",
            "",
            "## Rigs",
            "",
            *_rigs(rows),
            "## Recordings that were diagnosed wrongly",
            "",
            *_failures(rows),
        ]
    )  # fmt: skip


def _origin(rows: list[dict], origin: dict) -> list[str]:
    changed = " The tool has changes that are not committed." if origin["not_committed"] else ""
    rigs = {row["rig"]: row for row in rows}
    misfit = np.array([row["twin_misfit"] for row in rigs.values() if row["twin_misfit"]])
    fit, seconds = (np.median([row[key] for row in rigs.values()]) for key in _TIMES)
    each = len(rows) / max(len(rigs), 1)
    lines = [
        f"{len(rows)} recordings of {len(rigs)} rigs, drawn from tree `{origin['commit'][:12]}` "
        f"and trial number {origin['number']} by `snakemake diagnosis_trial`.{changed} The "
        "protocol is in docs/diagnosis_trial.md.",
        "",
        f"The twin is `{origin['twin']}` from the rig's healthy recordings (median {fit:.0f} s); a "
        f"recording is then diagnosed in {seconds / each:.1f} s (median, one process).",
    ]
    if len(misfit):
        quantiles = np.quantile(misfit, [0, 0.5, 1])
        lines[-1] += " It leaves {} % of the healthy ripple (median; {} to {} %).".format(
            *(percent(quantiles[k]) for k in (1, 0, 2))
        )
    return [
        *lines,
        "",
        "* Shares are followed by their exact 95 % confidence interval (Clopper and Pearson). It "
        "takes recordings as independent.",
        "* *Change*: norm of the change that the state makes in the sensors' ripple, over that of "
        "the healthy ripple, from two runs of the rig.",
        "",
    ]


_TIMES = ("fit_s", "diagnose_s")


def _smallest(rows: list[dict]) -> list[str]:
    """The table of smallest leaks, by change and by area, with intervals over rigs."""
    healthy = [row["suspicion"] for row in rows if row["state"] == "healthy"]
    if not healthy:
        return ["There is no healthy recording.", ""]
    threshold = detection.alarm_threshold(healthy)
    rng = np.random.default_rng(0)
    lines = []
    for state in summary.SINGLE:
        chosen = [row for row in rows if row["state"] == state]
        hit = [row["suspicion"] > threshold for row in chosen]
        rigs = [row["rig"] for row in chosen]
        for severity, unit, factor in (
            ([row["change"] for row in chosen], "% of the ripple", 100.0),
            ([row["areas"][state] for row in chosen], "mm2", 1e6),
        ):
            cells = []
            for probability in detection.FOUND:
                found = detection.smallest_found(severity, hit, rigs, probability, rng)
                cells.append(
                    "too few"
                    if found is None
                    else "{:.2g} ({:.2g} to {:.2g})".format(*(factor * x for x in found))
                )
            lines.append((state, unit, *cells))
    rate = Rate(sum(s > threshold for s in healthy), len(healthy))
    heads = [f"found in {100 * p:.0f} %" for p in detection.FOUND]
    return [
        f"The alarm is raised above log odds of {threshold:.3g} against healthy: false alarms "
        f"{rate}. Intervals are from resampled rigs.",
        "",
        *_table(("fault", "severity", *heads), lines),
    ]


def _rigs(rows: list[dict]) -> list[str]:
    lines = []
    for rig in sorted({row["rig"] for row in rows}):
        of_rig = [row for row in rows if row["rig"] == rig]
        known = [row for row in of_rig if row["state"] in ("healthy", *LEAK_STATES)]
        misfit = of_rig[0]["twin_misfit"]
        lines.append(
            (
                str(rig),
                "" if misfit is None else f"{percent(misfit)} %",
                f"{sum(row['right'] for row in known)} of {len(known)}",
                f"{sum(row['right'] for row in of_rig)} of {len(of_rig)}",
            )
        )
    return _table(("rig", "misfit of the twin", "known states right", "all right"), lines)


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
    return [*_table(heads, lines), *([f"And {left} more.", ""] if left else [])]


def _span(low: float, high: float) -> str:
    if high == np.inf:
        return f"{100 * low:g} % and more"
    return f"below {100 * high:g} %" if low == 0 else f"{100 * low:g} to {100 * high:g} %"


def _table(heads: Iterable[str], lines: Iterable[Iterable[str]]) -> list[str]:
    heads, lines = list(heads), list(lines)
    if not lines:
        return ["None.", ""]
    rule = "|" + "---|" * len(heads)
    return [*("| " + " | ".join(cells) + " |" for cells in [heads]), rule,
            *("| " + " | ".join(cells) + " |" for cells in lines), ""]  # fmt: skip
