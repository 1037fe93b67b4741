"""The page that reports a trial."""

from collections import Counter
from collections.abc import Callable

import numpy as np

from concealed import summary
from concealed.failures import circumstance, failure
from concealed.score import PLAIN_CHANGE
from rippletwin.explanation.thresholds import MIN_LOG_BAYES_FACTOR
from rippletwin.learning.markdown import markdown_table

KINDS = {
    "none": "no effect, nominal values within tolerance",
    "off": "no effect, nominal values two to three standard deviations off",
    "single": "one effect of the library",
    "pair": "two effects of the library",
    "outside": "an effect that the library does not have",
    "indistinguishable": "an effect of a class declared indistinguishable beforehand",
}
GROUPS = {
    "no effect": ("none", "off"),
    "single effects": ("single", "indistinguishable"),
    "pairs": ("pair",),
    "outside the library": ("outside",),
    "all": tuple(KINDS),
}


def report_page(rows: list[dict], origin: dict) -> str:
    """The page in Markdown, of the rows of `concealed.score.score_case`.

    `origin` states where the cases come from: `commit` (hash of the tool's tree), `number` (of the
    trial), `not_committed` (whether the tool has changes that are not committed), `checks` (of the
    numerics: a list of `truth`, `error` and `allowed`, the latter two in Pa).
    """
    return "\n".join(
        [
            "# How often `rippletwin explain` is right when the effect is concealed",
            "",
            *_origin(rows, origin),
            *_terms(),
            "## Scores",
            "",
            markdown_table(
                ("score", "target", "result"),
                [(s.what, s.target, str(s.rate)) for s in summary.score_table(rows)],
            ),
            "## What supported effects would add",
            "",
            *_levels(rows),
            "## Comparison with simpler methods",
            "",
            *_methods(rows),
            "## Single effects by the change that they make in the ripple",
            "",
            markdown_table(
                ("change", "alarm", "effect or its class named"),
                [
                    (span(b.low, b.high), str(b.alarm), str(b.right))
                    for b in summary.power_table(rows)
                ],
            ),
            "![power](figures/power.png)",
            "",
            "## Stated probabilities of named effects",
            "",
            *_probabilities(rows),
            "## Line parameters in cases with an effect",
            "",
            markdown_table(
                (
                    "quantity",
                    "twin",
                    "mean error",
                    "rms error",
                    "within two stated standard deviations",
                ),
                [
                    (
                        e.quantity,
                        e.twin,
                        f"{100 * e.mean:+.2f} %",
                        _percent(e.rms, 2),
                        str(e.within),
                    )
                    for e in summary.line_error_table(rows)
                ],
            ),
            "![errors](figures/line_errors.png)",
            "",
            "## Misfits",
            "",
            *_misfits(rows),
            "## Failures",
            "",
            *_failures(rows),
            "## All cases",
            "",
            _cases(rows),
            "## Numerics of the recordings",
            "",
            _numerics(rows, origin["checks"]),
        ]
    )


def _origin(rows: list[dict], origin: dict) -> list[str]:
    counts = Counter(row["kind"] for row in rows)
    seconds = np.array([row["seconds"] for row in rows])
    points = np.array([row["points"] for row in rows])
    return [
        f"{len(rows)} cases, {drawn_from(origin, 'concealed')}",
        "",
        markdown_table(
            ("kind", "cases", "what"),
            [(f"`{kind}`", str(counts[kind]), what) for kind, what in KINDS.items()],
        ),
        f"The tool took {np.median(seconds):.0f} s of one core a case (median; "
        f"{seconds.min():.0f} to {seconds.max():.0f} s, 95 % of the cases at most "
        f"{np.quantile(seconds, 0.95):.0f} s) and {np.median(seconds / points):.0f} s for each "
        "operating point (median).",
        "",
    ]


def _terms() -> list[str]:
    return [
        "* Shares are followed by their exact 95 % confidence interval (Clopper and Pearson). "
        "Where a case counts several times, the interval takes these as independent.",
        "* *Change*: norm of the change that the effect makes in the sensors' ripple, relative. "
        f"*Plain*: a change of {100 * PLAIN_CHANGE:.0f} % or more.",
        "* *Oracle log evidence*: of the true effects, fitted from their true values. The data "
        f"*support* an effect if it is {MIN_LOG_BAYES_FACTOR:.0f} or more, the threshold of the "
        "tool. *Held out, from the truth*: misfit of data left out of the fit that begins from the "
        "truth.",
        "* *Named first*: of the established effects that are no nuisance physics, the one whose "
        "loss costs most log evidence.",
        "* *Misfit*: relative, of the whole data, if not held out. *Calibrated*: the least that "
        "calibration reaches without an effect. *Absorbed*: 1 - calibrated/nominal. *Corrected*: "
        "with the effects of the verdict.",
        "* *Floor*: misfit that the true line has with the nominal flow ripple. The corrected twin "
        "corrects the ripple and may misfit less.",
        "",
    ]


def _levels(rows: list[dict]) -> list[str]:
    return [
        "The scores above count established effects alone.",
        "",
        markdown_table(
            (
                "effects that count as named",
                "truly there",
                "plain single effects: named",
                "pairs: both named",
                "no effect: not there",
                "outside the library: not there",
            ),
            [tuple(map(str, score)) for score in summary.support_table(rows)],
        ),
    ]


def _methods(rows: list[dict]) -> list[str]:
    return [
        markdown_table(
            (
                "method",
                "no effect: alarm",
                "plain single effects: effect or its class named",
                "outside the library: given a name",
            ),
            [tuple(map(str, method)) for method in summary.method_table(rows)],
        ),
        "Calibration alone names no effect; its alarm is a calibrated misfit above 5 %.",
        "",
    ]


def _probabilities(rows: list[dict]) -> list[str]:
    return [
        markdown_table(
            ("stated", "mean stated", "right"),
            [
                (span(b.low, b.high), f"{b.mean:.3f}", str(b.right))
                for b in summary.reliability_table(rows)
            ],
        ),
        f"Brier score {summary.brier_score(rows):.3f}.",
        "",
        "![probabilities](figures/probabilities.png)",
        "",
    ]


def _misfits(rows: list[dict]) -> list[str]:
    def median(name: str, kinds: tuple[str, ...]) -> str:
        values = [row[name] for row in rows if row["kind"] in kinds and row[name] is not None]
        return _percent(np.nanmedian(values), 2) if np.any(np.isfinite(values)) else "-"

    columns = {
        "misfit_nominal": "nominal",
        "misfit_calibrated": "calibrated",
        "absorbed": "absorbed",
        "misfit_corrected": "corrected",
        "held_out_calibrated": "held out, calibrated",
        "held_out_corrected": "held out, corrected",
        "oracle_held_out": "held out, from the truth",
        "floor": "floor",
    }
    return [
        "Medians over the cases.",
        "",
        markdown_table(
            ("cases", *columns.values()),
            [
                (group, *(median(name, kinds) for name in columns))
                for group, kinds in GROUPS.items()
            ],
        ),
        "![misfits](figures/misfit.png)",
        "",
    ]


def _failures(rows: list[dict]) -> list[str]:
    failed = [row for row in rows if failure(row) is not None]
    if not failed:
        return ["None.", ""]
    return [
        _table(
            failed,
            *("case", "failure", "true effects", "named", "change", "oracle log evidence"),
            *("cause by the data", "held out, corrected", "held out, from the truth"),
            *("points", "sensors", "noise, Pa"),
        ),
        "The verdicts' sentences:",
        "",
        *(
            f"* **Case {row['case']}** (`{row['verdict']}`): {' '.join(row['sentence'].split())}"
            for row in failed
        ),
        "",
    ]


def _cases(rows: list[dict]) -> str:
    return _table(
        rows,
        *("case", "kind", "true effects", "change", "oracle log evidence", "verdict", "named"),
        *("failure", "nominal", "calibrated", "absorbed", "corrected"),
        *("held out, corrected", "held out, from the truth"),
    )


def _table(rows: list[dict], *columns: str) -> str:
    """A line for each case, of these COLUMNS."""
    return markdown_table(columns, [[COLUMNS[name](row) for name in columns] for row in rows])


def _numerics(rows: list[dict], checks: list[dict]) -> str:
    refined = [
        {"truth": f"finer meshes, case {row['case']}"} | row["mesh"]
        for row in rows
        if row["mesh"] is not None
    ]
    return markdown_table(
        ("checked against", "error, Pa rms", "allowed, Pa rms"),
        [(c["truth"], f"{c['error']:.0f}", f"{c['allowed']:.0f}") for c in [*checks, *refined]],
    )


def _log_evidence(row: dict) -> str:
    value = row["oracle_log_evidence"]
    return "-" if value is None else f"{value:.0f}"


def _percent(share: float | None, digits: int) -> str:
    return "-" if share is None else f"{100 * share:.{digits}f} %"


COLUMNS: dict[str, Callable[[dict], object]] = {
    "case": lambda row: row["case"],
    "kind": lambda row: row["kind"],
    "failure": lambda row: failure(row) or "-",
    "true effects": lambda row: row["effects"] or "-",
    "verdict": lambda row: row["verdict"],
    "named": lambda row: row["named"] or "-",
    "change": lambda row: _percent(row["change"], 1),
    "oracle log evidence": _log_evidence,
    "cause by the data": circumstance,
    "nominal": lambda row: _percent(row["misfit_nominal"], 1),
    "calibrated": lambda row: _percent(row["misfit_calibrated"], 2),
    "absorbed": lambda row: _percent(row["absorbed"], 0),
    "corrected": lambda row: _percent(row["misfit_corrected"], 2),
    "held out, corrected": lambda row: _percent(row["held_out_corrected"], 2),
    "held out, from the truth": lambda row: _percent(row["oracle_held_out"], 2),
    "points": lambda row: row["points"],
    "sensors": lambda row: row["sensors"],
    "noise, Pa": lambda row: f"{row['noise']:.0f}",
}
"""Column of a table with a line for each case -> its cell of a row."""


def drawn_from(origin: dict, trial: str) -> str:
    """The end of a page's first sentence: what the cases of `snakemake TRIAL` were drawn from."""
    changed = " The tool has changes that are not committed." if origin["not_committed"] else ""
    return (
        f"drawn from tree `{origin['commit'][:12]}` and trial number {origin['number']} by "
        f"`snakemake {trial}`.{changed} The protocol is in docs/{trial}.md."
    )


def span(low: float, high: float) -> str:
    """Shares from `low` to `high`, which is infinite where there is no end, in per cent."""
    if high == np.inf:
        return f"{100 * low:g} % and more"
    return f"below {100 * high:g} %" if low == 0 else f"{100 * low:g} to {100 * high:g} %"
