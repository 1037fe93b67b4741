"""Which files of a case a job depends on, and by which paths."""

from pathlib import Path

import pytest

import case_parts

SHEET = {
    "load": {"kind": "impedance", "impedance": "/data/load.csv"},
    "recordings": [
        {"file": "/data/healthy.h5", "state": "healthy", "flow_ripple": "ripple.csv"},
        {"file": "more/slipper.h5", "state": "slipper"},
    ],
}


@pytest.mark.parametrize("folder", ["", "case", "/cases/mine"])
def test_files_are_found_from_any_folder(folder):
    """Beside a rig.yaml in the working directory, where the folder is empty, a name stays relative;
    an absolute one, which RIPPLETWIN_DATA allows, is that of the file in any case."""
    here = Path(folder)
    files = case_parts.files_for(SHEET, "fit", folder)
    assert files == sorted(map(str, ["/data/load.csv", "/data/healthy.h5", here / "ripple.csv"]))
    assert str(here / "more/slipper.h5") in case_parts.files_for(SHEET, "all", folder)
