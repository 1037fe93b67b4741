"""The tool on one rig: a twin of its healthy recordings, then the diagnosis of the others.

Its arguments are a case, an output folder and TWIN, `explained` or `calibrated`: what is fitted to
the healthy recordings before the others are diagnosed. Writes twin.json and diagnosis.json, and
run.json with the seconds that either took and the twin's misfit. It runs in one process: its
confinement has no shared memory.
"""

import json
import sys
import time
import traceback
from pathlib import Path

import yaml

from rippletwin.calibration import report
from rippletwin.calibration.calibrate import Settings, calibrate
from rippletwin.case.load import load_case
from rippletwin.diagnosis.diagnose import diagnose, select_recordings
from rippletwin.diagnosis.diagnosis_file import write_diagnosis
from rippletwin.diagnosis.faults.library import select_faults
from rippletwin.explanation.explain import explain
from rippletwin.explanation.verdict.verdict_file import write_verdict
from rippletwin.spectra.observation import observe
from rippletwin.twin.twin import Twin


def main(case_folder: str, out: str, twin_kind: str) -> None:
    """Diagnose one rig; an error of the tool gives each of its recordings the state `crashed`."""
    out = Path(out)
    started, fitted, misfit = time.perf_counter(), None, None
    try:
        twin, misfit = TWINS[twin_kind](load_case(case_folder, states={"healthy"}), out)
        fitted = time.perf_counter()
        case = load_case(case_folder, states={"healthy", "unknown"})
        write_diagnosis(diagnose(case, twin, select_recordings(case), select_faults()), out)
    except Exception:  # any error: one rig must not end the trial
        traceback.print_exc()
        crashed = [{"label": label, "state": "crashed"} for label in unknown_labels(case_folder)]
        (out / "diagnosis.json").write_text(json.dumps({"recordings": crashed}) + "\n")
    ended = time.perf_counter()
    run = {
        "fit_s": (fitted or ended) - started,
        "diagnose_s": ended - (fitted or ended),
        "misfit": misfit,
    }
    (out / "run.json").write_text(json.dumps(run) + "\n")


def unknown_labels(case_folder: str) -> list[str]:
    """Labels of the recordings of unknown state, without the checks of `load_case`."""
    sheet = yaml.safe_load((Path(case_folder) / "rig.yaml").read_text())
    return [Path(r["file"]).stem for r in sheet["recordings"] if r["state"] == "unknown"]


def fit_calibrated(case, out: Path) -> tuple[Twin, float]:
    """The twin with the physics of the data sheet and unsteady friction, and its misfit."""
    observations = [observe(r, case.rig, piston_harmonics_only=True) for r in case.recordings]
    twin = Twin(case.rig, observations, friction="unsteady")
    calibration = calibrate(twin, observations, Settings())
    report.save(calibration, out)
    return calibration.twin, float(calibration.after.relative)


def fit_explained(case, out: Path) -> tuple[Twin, float]:
    """The twin with the effects that `rippletwin explain` finds, and its misfit."""
    explanation = explain(case, processes=1)
    verdict = write_verdict(explanation, out)
    return explanation.twin, float(verdict["fit"]["after"]["in_sample"])


TWINS = {"calibrated": fit_calibrated, "explained": fit_explained}

if __name__ == "__main__":
    main(*sys.argv[1:4])
