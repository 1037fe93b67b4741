"""The tool on one rig: twins of its healthy recordings, then a diagnosis of the others by each
column.

Its arguments are a case, an output folder and the columns, METHOD@TWIN. METHOD is

    anchored              `rippletwin diagnose`
    unanchored            the same, but compared with the twin's own healthy ripple
    P, PR, PRA, Q, QR     a network that the twin teaches (`diagnosis_trial.networks`)

and TWIN one of `diagnosis_trial.twins`. Writes diagnosis.json, column -> {"recordings": [...]}: of
`anchored` and `unanchored` the entries of `rippletwin diagnose` with the log odds against healthy,
of a network the keys that are scored (`networks.ask_network`), of a column that ended with an error
label and state alone; and run.json, column -> the processor seconds that twin and diagnoses took
and the twin's misfit. It runs in one process: its confinement has no shared memory.
"""

import json
import sys
import time
import traceback
from collections.abc import Callable
from pathlib import Path

import yaml

from diagnosis_trial.networks import ask_network, teach_network
from diagnosis_trial.twins import TWINS, FittedTwin
from rippletwin import store
from rippletwin.case.load import label_of, load_case
from rippletwin.case.model import Case
from rippletwin.diagnosis.diagnose import diagnose, select_recordings
from rippletwin.diagnosis.diagnosis_file import diagnosis_dict


def main(case_folder: str, out: str, *columns: str) -> None:
    """Diagnose one rig; an error of the tool gives each of its recordings the state `crashed`."""
    out, twins, diagnoses, runs = Path(out), {}, {}, {}
    for column in columns:
        method, kind = column.split("@")
        run = {"fit_s": None, "diagnose_s": None, "misfit": None}
        try:
            if kind not in twins:
                twins[kind] = timed(fit_twin, case_folder, kind, out)
            fitted, run["fit_s"] = twins[kind]
            run["misfit"] = fitted.misfit
            case = load_case(case_folder, states={"healthy", "unknown"})
            found = timed(diagnose_by, method, kind, fitted, case)
            diagnoses[column], run["diagnose_s"] = found
        except Exception:  # any error: one rig must not end the trial
            traceback.print_exc()
            crashed = [{"label": x, "state": "crashed"} for x in unknown_labels(case_folder)]
            diagnoses[column] = {"recordings": crashed}
        runs[column] = run
    store.write_text(out / "diagnosis.json", json.dumps(diagnoses, indent=1) + "\n")
    store.write_text(out / "run.json", json.dumps(runs) + "\n")


def fit_twin(case_folder: str, kind: str, out: Path) -> FittedTwin:
    """The twin of this kind; its files are in a folder of its own."""
    return TWINS[kind](load_case(case_folder, states={"healthy"}), out / kind)


def diagnose_by(method: str, kind: str, fitted: FittedTwin, case: Case) -> dict:
    """The recordings of unknown state by a method; the nominal twin is not fitted again."""
    recordings = select_recordings(case)
    if method in ("anchored", "unanchored"):
        again, anchored = kind != "nominal", method == "anchored"
        found = diagnose(case, fitted.twin, recordings, recalibrate=again, anchored=anchored)
        entries = diagnosis_dict(found)["recordings"]
        return {"recordings": [e | {"log_odds": d.log_odds} for e, d in zip(entries, found)]}
    network = teach_network(method, fitted.twin, fitted.covariance, case)
    return ask_network(network, recordings, case.rig, fitted.twin)


def timed(work: Callable, *arguments) -> tuple:
    """What `work` returns, and the processor seconds that it took."""
    started = time.process_time()
    return work(*arguments), time.process_time() - started


def unknown_labels(case_folder: str) -> list[str]:
    """Labels of the recordings of unknown state, without the checks of `load_case`."""
    sheet = yaml.safe_load((Path(case_folder) / "rig.yaml").read_text())
    return [label_of(r) for r in sheet["recordings"] if r["state"] == "unknown"]


if __name__ == "__main__":
    main(*sys.argv[1:])
