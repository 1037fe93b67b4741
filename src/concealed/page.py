"""The results as a page."""

import numpy as np

from concealed import summary


def markdown(rows: list[dict], origin: dict) -> str:
    """The page of all rows.

    `origin` says where the cases come from: commit, number, not_committed (whether the tool was
    changed since), checks (of the numerics: truth, error and allowed error in Pa).
    """
    changed = ", the tool having changes that are not committed" if origin["not_committed"] else ""
    return "\n".join(
        [
            "# What `rippletwin explain` finds when the effect is concealed",
            "",
            f"{len(rows)} cases drawn from tree `{origin['commit'][:12]}` and number "
            f"{origin['number']}{changed}. Shares with exact 95 % intervals. docs/concealed.md "
            "says how.",
            "",
            *_table(
                ("score", "target", "found"),
                [(what, target, str(found)) for what, target, found in summary.scores(rows)],
            ),
            "## Beside simpler methods",
            "",
            *_table(
                ("method", "false alarms", "right effect, plain singles", "misnamed, outside"),
                [tuple(map(str, row)) for row in summary.compared(rows)],
            ),
            "Recalibrating alone names nothing; its alarm is a misfit above 5 % after calibration.",
            "",
            "## Power: single effects by the change they make in the ripple",
            "",
            *_table(
                ("change", "alarm", "right effect"),
                [(_span(a, b), str(c), str(d)) for a, b, c, d in summary.power(rows)],
            ),
            "![power](figures/power.png)",
            "",
            "## Stated probabilities",
            "",
            *_table(
                ("stated", "mean stated", "right"),
                [(_span(a, b), f"{m:.2f}", str(r)) for a, b, m, r in summary.reliability(rows)],
            ),
            f"Brier score {summary.brier(rows):.3f}.",
            "",
            "## Line parameters of cases with an effect",
            "",
            *_table(
                ("quantity", "twin", "mean error", "rms error", "within two deviations"),
                [
                    (q, which, f"{mean:+.2%}", f"{rms:.2%}", str(within))
                    for q, which, mean, rms, within in summary.biases(rows)
                ],
            ),
            "## Misfits",
            "",
            *_misfits(rows),
            "![misfits](figures/misfit.png)",
            "",
            "## Every case",
            "",
            *_cases(rows),
            "## Failures",
            "",
            *_failures(rows),
            "## Numerics",
            "",
            *_table(
                ("checked against", "error, Pa rms", "allowed, Pa rms"),
                [
                    (c["truth"], f"{c['error']:.0f}", f"{c['allowed']:.0f}")
                    for c in [*origin["checks"], *_refined(rows)]
                ],
            ),
        ]
    )


def _refined(rows: list[dict]) -> list[dict]:
    """The estimated errors of cases whose mesh was refined until they were small, as checks."""
    return [
        {
            "truth": f"finer meshes, case {k}",
            "error": row["numerics"]["error"],
            "allowed": row["numerics"]["allowed"],
        }
        for k, row in enumerate(rows)
        if row["numerics"] is not None
    ]


def _misfits(rows: list[dict]) -> list[str]:
    def median(name: str, kinds: tuple[str, ...]) -> str:
        values = [row[name] for row in rows if row["kind"] in kinds]
        return f"{np.nanmedian(values):.2%}" if np.any(np.isfinite(values)) else "-"

    names = ("misfit_nominal", "misfit_calibrated", "swallowed", "misfit_corrected")
    names += ("held_out_before", "held_out_after")
    groups = {
        "no effect": ("none", "off"),
        "single effects": ("single", "indistinguishable"),
        "pairs": ("pair",),
        "outside the library": ("outside",),
    }
    return [
        "Medians. Swallowed: 1 - (misfit after calibration)/(misfit with nominal values).",
        "",
        *_table(
            ("cases", "nominal", "calibrated", "swallowed", "corrected", "held out, calibrated",
             "held out, corrected"),
            [(g, *(median(name, kinds) for name in names)) for g, kinds in groups.items()],
        ),
    ]  # fmt: skip


def _cases(rows: list[dict]) -> list[str]:
    return _table(
        ("case", "kind", "truth", "change", "worth", "nominal", "calibrated", "swallowed",
         "corrected", "verdict", "said"),
        [
            (
                str(row["case"]), row["kind"], row["effects"] or "-", f"{row['change']:.1%}",
                _worth(row), f"{row['misfit_nominal']:.1%}", f"{row['misfit_calibrated']:.2%}",
                f"{row['swallowed']:.0%}", f"{row['misfit_corrected']:.2%}", row["verdict"],
                row["said"] or "-",
            )
            for row in rows
        ],
    )  # fmt: skip


def _failures(rows: list[dict]) -> list[str]:
    lines = []
    for row in rows:
        what = summary.failed(row)
        if what is not None:
            lines += [
                f"* **Case {row['case']}: {what}.** True: {row['effects'] or 'no effect'} "
                f"(change {row['change']:.1%}, worth {_worth(row)}, {row['points']} points, "
                f"{row['sensors']} sensors, noise {row['noise']:.0f} Pa). "
                f"It said ({row['verdict']}): {row['sentence']}"
            ]
    return [*(lines or ["None."]), ""]


def _worth(row: dict) -> str:
    return "-" if row["worth"] is None else f"{row['worth']:.0f}"


def _table(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> list[str]:
    lines = [head, ("---",) * len(head), *rows]
    return ["| " + " | ".join(cells) + " |" for cells in lines] + [""]


def _span(low: float, high: float) -> str:
    return f"{low:.0%} to {high:.0%}" if np.isfinite(high) else f"over {low:.0%}"
