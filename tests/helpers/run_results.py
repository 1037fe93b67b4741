"""Everything that a run of the workflow has written, to be read and compared."""

from __future__ import annotations

import json
from pathlib import Path

import matplotlib.image
import numpy as np
import pandas as pd

from rippletwin import store

NOT_COMPARED = ("benchmarks", "logs")  # times of the machine


def read_everything(results: Path) -> None:
    """Read each file of the results that has its final name; a torn one raises."""
    for path in finished_files(results):
        if path.suffix == ".json":
            json.loads(path.read_text())
        elif path.suffix == ".csv":
            pd.read_csv(path)
        elif path.suffix == ".png":
            matplotlib.image.imread(path)
        elif path.suffix == ".html":
            assert path.read_text().rstrip().endswith("</html>"), path
    for path in results.rglob("[!.]*.zarr"):
        store.load(path).load()


def finished_files(results: Path) -> list[Path]:
    """Files without a hidden name on the way, outside stores and what is not compared."""
    named = ((path, path.relative_to(results).parts) for path in results.rglob("*"))
    return [
        path
        for path, parts in named
        if path.is_file()
        and parts[0] not in NOT_COMPARED
        and not any(part.startswith(".") or part.endswith(".zarr") for part in parts)
    ]


def final_results(results: Path, scored: bool = True) -> dict[str, bytes]:
    """The bytes of every table, verdict, twin, diagnosis and store, by name.

    scored : whether a recording of a known fault gives the networks accuracies.

    The page and the tables of costs tell how long the stages took, figures are made of the numbers.
    """
    found = {
        str(path.relative_to(results)): path.read_bytes()
        for path in finished_files(results)
        if path.suffix in (".csv", ".md", ".json")
    }
    for path in results.rglob("*.zarr"):
        dataset = store.load(path).load()
        for name, variable in dataset.variables.items():
            found[f"{path.relative_to(results)}/{name}"] = np.asarray(variable.values).tobytes()
    wanted = {"explain/verdict.json", "diagnosis/diagnosis.json"}
    assert wanted | ({"accuracy.csv"} if scored else set()) <= set(found)
    return found
