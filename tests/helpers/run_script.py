"""Run one of the workflow's scripts as Snakemake would, without Snakemake."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path
from types import SimpleNamespace

from paths import ROOT

SCRIPTS = ROOT / "workflow" / "scripts"


class Named(list):
    """Snakemake's way to hold inputs, outputs and wildcards: a list whose entries have names."""

    def __init__(self, named: dict):
        super().__init__(named.values())
        self.__dict__.update(named)


def run_script(
    name: str, folder: Path, output: dict, wildcards: dict, params: dict, **files
) -> None:
    """Run workflow/scripts/NAME.py; `files` are its inputs, its log goes into `folder`."""
    job = SimpleNamespace(
        rule=name,
        input=Named({"effects": ()} | files),
        output=Named(output),
        wildcards=Named(wildcards),
        params=SimpleNamespace(**params),
        log=[str(folder / "log.txt")],
        threads=1,
    )
    before = sys.stdout, sys.stderr, sys.excepthook
    sys.path.insert(0, str(SCRIPTS))
    try:
        runpy.run_path(str(SCRIPTS / f"{name}.py"), init_globals={"snakemake": job})
    finally:
        sys.path.remove(str(SCRIPTS))
        sys.stdout, sys.stderr, sys.excepthook = before
