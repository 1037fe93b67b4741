"""A concealed trial whose seals are open: its folder is RESULTS/concealed."""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path

from virtualrig.seal import open_seal_file


def check_opened(parser: ArgumentParser, trial: Path) -> None:
    """End the program with a message where `trial` is no trial that ran to its end."""
    if not (trial / "rows.json").exists():
        parser.error(f"{trial}: has no rows.json; run `snakemake concealed` to its end")


def open_truth(trial: Path, case: str) -> dict:
    """The truth of a case, as "007"."""
    return open_seal_file(trial / "seals" / f"{case}.json", trial / "keys" / case)
