# What several stages share: the case, the datasets, and what a script depends on besides its inputs.
import os
import re
import shlex
import sys
from pathlib import Path

import pandas as pd
from snakemake.utils import validate

sys.path[:0] = [str(ROOT / "workflow"), str(ROOT / "src")]

import case_parts
from config_errors import (
    check_config,
    check_datasets,
    check_load_pressures,
    check_names,
    check_severity,
    read_rig,
)
from rippletwin.learning.architectures import ARCHITECTURES, CLASSES
from rippletwin.learning.malloc_settings import MALLOC_ENVIRONMENT
from source_files import package_files, source_files_of
from stored_outputs import expand_outputs

check_config(config, ROOT / "workflow/schemas/config.schema.yaml")
check_severity(config["faults"])
check_names("architectures", config["architectures"], list(ARCHITECTURES))

RESULTS = config["results"]
PAPER = local(os.path.relpath(ROOT / "resources/paper_accuracy.csv"))
EFFECT_FILES = local(config["explain"]["effects"])  # a user's own, in no storage

# The virtual rig's command is found even where the environment is not activated.
shell.prefix(f"PATH={shlex.quote(os.path.dirname(sys.executable))}:$PATH; ")
# numba does not follow `threads:`.
for name, value in {"NUMBA_NUM_THREADS": "1", **MALLOC_ENVIRONMENT}.items():
    os.environ.setdefault(name, value)


# ---- the case -------------------------------------------------------------------------------

RECORDED_HERE = config["case"] == "virtualrig"
# the virtual rig makes its sheet in one piece with the recordings
RIG, SHEET = (
    (f"{RESULTS}/case/rig.yaml", {}) if RECORDED_HERE else read_rig(config["case"])
)
CASE = os.path.dirname(RIG)  # empty where rig.yaml lies in the working directory
WHOSE_RECORDINGS = "the virtual rig's" if RECORDED_HERE else f"those of {CASE or '.'}"

# the virtual rig has a healthy pump and known faults at one operating point
HAS_PERIODIC = RECORDED_HERE or case_parts.has_periodic(SHEET)
DIAGNOSED_HERE = RECORDED_HERE or case_parts.is_diagnosed(SHEET)
SCORED_HERE = RECORDED_HERE or case_parts.is_scored(SHEET)
HAS_KNOWN = RECORDED_HERE or case_parts.has_known(SHEET)
HAS_UNKNOWN = not RECORDED_HERE and bool(case_parts.recordings_for(SHEET, "unknown"))

RIG_SECTIONS = ("fluid", "pump", "line", "sensors", "load", "uncertainty")


def recordings(purpose):
    """Files of the case besides rig.yaml that serve a purpose of `case_parts`; one folder where the
    virtual rig makes them."""
    if RECORDED_HERE:
        return [f"{CASE}/recordings"]
    return local(case_parts.files_for(SHEET, purpose, CASE))


def rig_sheet():
    """rig.yaml as an input whose age does not matter: `rig_content` tells what was edited."""
    return RIG if RECORDED_HERE else local(ancient(RIG))


def rig_content(*sections, recordings=None):
    """Params: what rig.yaml says in these sections and of the recordings that serve a purpose, in
    normal form, so that an edit of anything else reruns nothing."""
    parts = {name: SHEET.get(name) for name in sections}
    if recordings is not None and not RECORDED_HERE:
        parts["recordings"] = case_parts.recordings_for(SHEET, recordings)
    return case_parts.normal_form(parts)


# ---- datasets and states --------------------------------------------------------------------

table = pd.read_csv(
    ROOT / "config/datasets.tsv", sep="\t", dtype=str, keep_default_na=False
)
validate(table, ROOT / "workflow/schemas/datasets.schema.yaml")
check_datasets(table)
check_names("datasets", config["datasets"], list(table["name"]))
DATASETS = {row.name: row for row in table.itertuples(index=False)}
CHOSEN = [name for name in DATASETS if name in config["datasets"]]
SIMULATED = [name for name in CHOSEN if DATASETS[name].line != "rig"]
PRESSURES = [name for name in SIMULATED if DATASETS[name].signal == "pressure"]
if SIMULATED and not RECORDED_HERE:
    check_load_pressures(case_parts.recordings_for(SHEET, "reference"))
RANDOMISED = [name for name in CHOSEN if DATASETS[name].randomised == "yes"]
# networks that can be asked about recordings of unknown state
ASKED = [name for name in RANDOMISED if DATASETS[name].signal == "pressure"]
STATES = {  # what a dataset's networks learn, and what they are shown besides
    "single": list(CLASSES),
    "compound": ["+".join(faults) for faults in config["faults"]["compound"]],
}


wildcard_constraints:
    dataset="|".join(map(re.escape, DATASETS)),
    twin="calibrated|corrected",
    faults="|".join(STATES),
    state="|".join(re.escape(state) for states in STATES.values() for state in states),
    architecture="|".join(ARCHITECTURES),
    domain="time|image",
    revolutions="1|2",
    windows="recorded|probe",


def cells(datasets, networks=config["architectures"]):
    """(dataset, architecture) of every network that learns from one of these datasets."""
    return [(name, network) for name in datasets for network in networks]


def of_domain(domain):
    """The configured networks on time windows, or on images."""
    names = config["architectures"]
    return [name for name in names if ARCHITECTURES[name].domain == domain]


# whether networks are asked about recordings of unknown state
ASKED_HERE = HAS_UNKNOWN and bool(ASKED) and bool(of_domain("time"))


def in_words(name):
    """A figure's file name as a label of the report."""
    return name.removeprefix("explain_").replace("_", " ")


def scripts_sources(script):
    """Source files that a script of workflow/scripts runs: its jobs rerun when one changes."""
    return relative(source_files_of(ROOT / "workflow/scripts" / script))


def relative(files):
    """Paths from the working directory, so that a moved project reruns nothing; in no storage."""
    return local([os.path.relpath(file) for file in files])
