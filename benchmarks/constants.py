"""How do the scores of explain move when each constant that decides is halved and doubled?

    python benchmarks/constants.py TRIAL OUT [--cases N] [--only NAME ...] [--processes 2]

TRIAL is the folder of a concealed trial whose seals are open, RESULTS/concealed. Its first N cases
are explained once as the tool is and twice for each constant. OUT gets a folder for each setting
and case; what is there is not run again. Prints a table of the scores.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from opened_trial import check_opened, open_truth
from scaled_constants import scale_constant

CONSTANTS = {
    "evidence of an effect": ("explanation.thresholds", "MIN_LOG_BAYES_FACTOR"),
    "evidence of an always-present effect": (
        "explanation.thresholds",
        "MIN_LOG_BAYES_FACTOR_ALWAYS_PRESENT",
    ),
    "evidence between equivalents": ("explanation.thresholds", "EQUIVALENT_LOG_BAYES_FACTOR"),
    "pull of an effect's parameter": ("explanation.thresholds", "PULL_ALARM"),
    "effects in a hypothesis": ("explanation.search.stepwise_moves", "MAX_EFFECTS"),
    "promise of a candidate that is fitted": ("explanation.search.stepwise_moves", "MIN_PROMISE"),
    "candidates fitted in a round": ("explanation.search.stepwise_moves", "PROMISING"),
    "rough starts that are followed": ("explanation.search.position_search", "ROUGH_MARGIN"),
    "smoothness of a free correction": (
        "explanation.localise.smooth_corrections",
        "CORRELATION_HZ",
    ),
    "amplitude of a free correction": ("explanation.localise.smooth_corrections", "AMPLITUDES"),
    "least model error": ("calibration.error_sizes", "MIN_MODEL_ERROR"),
    "little model error": ("explanation.thresholds", "LITTLE_MODEL_ERROR"),
    "error of the ripple's size": ("calibration.reading_errors", "SIZE_SD"),
    "error of products of harmonics": ("calibration.posterior", "PRODUCT_ERROR"),
    "smoothness of the ripple's error": ("calibration.smooth_source", "CORRELATION_HZ"),
    "state of a recording": ("twin.parameters", "RECORDING_STATE_SD"),
    "priors of the pump's numbers": ("twin.parameters", "PUMP_SDS"),
    "prior of the pump's volume": ("twin.effects.source_impedance", "VOLUME_SD"),
    "model error above which only usual effects are established": (
        "explanation.thresholds",
        "MUCH_MODEL_ERROR",
    ),
    "values of a parameter from a part of the data and from all": (
        "explanation.thresholds",
        "MAX_DISAGREEMENT",
    ),
    "gain of a step above which a fit has not converged": (
        "calibration.laplace",
        "UNCONVERGED_GAIN",
    ),
    "error of the ripple up to which a fit leaves nothing": (
        "explanation.thresholds",
        "GOOD_RIPPLE_ERROR",
    ),
    "gain of a sensor": ("explanation.checks.sensor_tolerance", "GAIN_SD"),
    "lag of a sensor": ("explanation.checks.sensor_tolerance", "LAG_SD"),
    "priors of the free data sheet": ("explanation.checks.prior_sensitivity", "WIDENING"),
}
"""Constants that decide: what each is, its module below `rippletwin`, its name there."""
FACTORS = {"halved": 0.5, "doubled": 2.0}
AS_IS = "as it is"


def settings(only: list[str]) -> list[str]:
    """Names of the settings: the tool as it is, and each constant halved and doubled."""
    names = only or list(CONSTANTS)
    return [AS_IS, *(f"{name}, {change}" for name in names for change in FACTORS)]


def explain_case(setting: str, case: Path, out: Path) -> None:
    """Explain one case with one setting, in this process, which has imported nothing yet."""
    if setting != AS_IS:
        name, change = setting.rsplit(", ", 1)
        module, constant = CONSTANTS[name]
        scale_constant(f"rippletwin.{module}", constant, FACTORS[change])
    from concealed import tool

    out.mkdir(parents=True, exist_ok=True)
    tool.main(str(case), str(out))


def score(trial: Path, out: Path, setting: str, cases: list[str]) -> dict:
    """Counts over the cases: see the columns of `table`."""
    from concealed.score import score_case

    rows = []
    for case in cases:
        verdict, baselines = (
            json.loads((folder_of(out, setting, case) / name).read_text())
            for name in ("verdict.json", "baselines.json")
        )
        truth = open_truth(trial, case)
        row = score_case(truth, verdict, baselines)
        there = row["established"]
        z = [abs(each["z"]) for each in row["line_errors"]["corrected"]]
        rows.append(
            {
                "true": sum(there),
                "wrong": len(there) - sum(there),
                "found": row["effects_found"],
                "concealed": len(truth["effects"]),
                "held": sum(row["intervals_hold"]),
                "intervals": len(row["intervals_hold"]),
                "line_held": sum(value <= 2.0 for value in z),
                "line": len(z),
                "seconds": row["seconds"],
            }
        )
    return {key: sum(row[key] for row in rows) for key in rows[0]}


def table(scores: dict[str, dict]) -> str:
    """A Markdown table of the scores by setting."""
    lines = [
        "| constant | established: there | not there | concealed effects found | intervals hold |"
        " line within two deviations | time |",
        "|---|---|---|---|---|---|---|",
    ]
    for setting, row in scores.items():
        lines.append(
            f"| {setting} | {row['true']} | {row['wrong']} | {row['found']} of {row['concealed']} |"
            f" {row['held']} of {row['intervals']} | {row['line_held']} of {row['line']} |"
            f" {row['seconds'] / scores[AS_IS]['seconds']:.2f} |"
        )
    return "\n".join(lines)


def folder_of(out: Path, setting: str, case: str) -> Path:
    """Where the verdict of a setting and case is."""
    return out / setting.replace(", ", " ").replace(" ", "_").replace("'", "") / case


def run_settings(trial: Path, out: Path, names: list[str], cases: list[str], processes: int):
    """Explain what is not explained yet, each case in a process of its own."""

    def run(job):
        setting, case = job
        folder = folder_of(out, setting, case)
        if (folder / "baselines.json").exists():
            return
        command = [sys.executable, __file__, "--one", setting, str(trial / "cases" / case), folder]
        subprocess.run(command, check=True)

    jobs = [(setting, case) for case in cases for setting in names]
    with ThreadPoolExecutor(processes) as pool:
        for number, _ in enumerate(pool.map(run, jobs), 1):
            print(f"{number} of {len(jobs)}", end="\r", file=sys.stderr, flush=True)


def main() -> None:
    if sys.argv[1:2] == ["--one"]:
        explain_case(sys.argv[2], Path(sys.argv[3]), Path(sys.argv[4]))
        return
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("trial", type=Path, help="folder RESULTS/concealed of an opened trial")
    parser.add_argument("out", type=Path, help="folder of the verdicts")
    parser.add_argument("--cases", type=int, default=8, help="how many of its cases")
    parser.add_argument("--only", nargs="*", default=[], choices=list(CONSTANTS), metavar="NAME")
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    check_opened(parser, options.trial)
    cases = sorted(path.stem for path in (options.trial / "seals").glob("*.json"))[: options.cases]
    names = settings(options.only)
    run_settings(options.trial, options.out, names, cases, options.processes)
    print(table({name: score(options.trial, options.out, name, cases) for name in names}))


if __name__ == "__main__":
    main()
