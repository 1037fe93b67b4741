"""A copy of the workflow whose scripts make empty outputs: for dry runs after edits.

Everything that decides what runs again is the real thing (rules, scripts' imports, parameters,
Snakemake's records); only the work is left out.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from subprocess import CompletedProcess

from forked_snakemake import run_snakemake
from paths import ROOT

MAKE_OUTPUTS = """
import pathlib
for _path in map(pathlib.Path, snakemake.output):
    if _path.suffix in (".zarr", "") :
        _path.mkdir(parents=True, exist_ok=True)
        _path = _path / "made.png"
    _path.write_text(snakemake.rule)
raise SystemExit(0)
"""

RIG = """\
fluid: {density: 870, kinematic_viscosity: 3.2e-5}
pump: {pistons: 9}
line: {segments: [{length: 6.0, diameter: 0.02, wave_speed: 1050}]}
sensors: [{name: p1, position: 0.42}]
load: {kind: orifice}
uncertainty: {length: 0.01, diameter: 0.03}
recordings:
- {file: healthy.csv, speed_rpm: 1000, load_pressure: 9500000, state: healthy}
- {file: slipper.csv, speed_rpm: 1000, load_pressure: 9500000, state: slipper}
"""

OVERLAY = """\
results: out
case: case
seeds: 1
datasets: [CFD-P, CFD-MOC-P, CFD-MOC-P+, CFD-Q+]
faults: {compound: [[S, C1]]}
architectures: [cnn1d_341_100, cnn2d_7_2]
"""


def make(folder: Path) -> None:
    """The workflow, its library and a case in `folder`, with scripts that only make outputs."""
    for name in ("workflow", "config", "src", "resources", "profiles"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copy(ROOT / "Snakefile", folder)
    for script in (folder / "workflow" / "scripts").glob("*.py"):
        if script.name != "job.py":
            script.write_text(MAKE_OUTPUTS + script.read_text())
    (folder / "overlay.yaml").write_text(OVERLAY)
    case = folder / "case"
    case.mkdir()
    (case / "rig.yaml").write_text(RIG)
    for name in ("healthy.csv", "slipper.csv"):
        (case / name).write_text("time_s,p1\n")


def snakemake(folder: Path, *options: str) -> CompletedProcess:
    """Run the workflow of `folder`."""
    return run_snakemake(folder, "--cores", "2", "--configfile", "overlay.yaml", *options)


def planned(folder: Path) -> tuple[set[str], str]:
    """Names of the rules that a dry run would run, and its whole text."""
    result = snakemake(folder, "--dry-run")
    text = result.stdout + result.stderr
    assert result.returncode == 0, text
    table = re.search(r"^Job stats:\njob .*\n-+ .*\n((?:.+\n)+)", text, re.M)
    if table is None:
        return set(), text
    return {line.split()[0] for line in table[1].splitlines()} - {"all", "total"}, text
