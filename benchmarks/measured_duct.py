"""Missing physics of a measured duct with six microphones, below its plane-wave limit.

    python benchmarks/measured_duct.py MEASURED FOLDER

MEASURED holds empty.h5 (`time_data`, samples by channels). FOLDER gets the case, and verdict.json,
twin.json and figures.
"""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

from rippletwin.calibration.misfit import score_fit
from rippletwin.case.load import load_case
from rippletwin.case.model import Case
from rippletwin.explanation.explain import explain
from rippletwin.explanation.verdict.verdict_file import write_verdict
from rippletwin.figures.explanation import draw

DATA_SHEET = Path(__file__).resolve().parent.parent / "resources" / "duct" / "rig.yaml"


def case(measured: Path, folder: Path) -> Case:
    """The duct's case: the data sheet and the recorder's own file beside it."""
    folder.mkdir(parents=True, exist_ok=True)
    shutil.copy(DATA_SHEET, folder)
    shutil.copy(measured / "empty.h5", folder)
    return load_case(folder)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("measured", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--processes", type=int, default=2)
    arguments = parser.parse_args()
    duct = case(arguments.measured, arguments.folder / "case")
    for warning in duct.warnings:
        print(f"warning: {warning}")
    explanation = explain(duct, processes=arguments.processes)
    accepted, data = explanation.decision.accepted, explanation.observations
    for words, fit in (("calibrated", explanation.search.base), ("explained", accepted)):
        print(f"{words}: {score_fit(fit, data).misfit:.1%} {fit.label}", flush=True)
    for name, value in accepted.twin.values().items():
        if "@sensor" in name:
            print(f"{name}: {value:.4g}")
    result = write_verdict(explanation, arguments.folder / "explained")
    draw(explanation, arguments.folder / "explained", processes=arguments.processes)
    print(f"\n{result['verdict']}: {result['sentence']}")


if __name__ == "__main__":
    main()
