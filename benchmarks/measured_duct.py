"""A measured duct with six microphones: its end, the microphones' gains, and what is left.

    python benchmarks/measured_duct.py MEASURED FOLDER

MEASURED holds empty.h5 (`time_data`, samples by channels). FOLDER gets the case, twin.json and
report.md of its calibration, and with --explain verdict.json and figures too, which takes a long
time: six sensors have many effects of their own.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from measured_case import copy_case
from rippletwin.calibration import report
from rippletwin.calibration.calibrate import Calibration, calibrate
from rippletwin.case.model import Case, Load
from rippletwin.explanation.explain import explain
from rippletwin.explanation.verdict.verdict_file import write_verdict
from rippletwin.figures.explanation import draw
from rippletwin.spectra.frequency_selection import select_fitted_frequencies
from rippletwin.spectra.observation import observe
from rippletwin.twin.twin import Twin


def case(measured: Path, folder: Path) -> Case:
    """The duct's case."""
    return copy_case("duct", {"empty.h5": measured / "empty.h5"}, folder)


def calibrated(duct: Case, load: str = "unknown", gain: bool = True) -> Calibration:
    """The calibration of the duct with unsteady friction; `gain` False trusts the microphones."""
    rig = replace(duct.rig, load=Load(load))
    if not gain:
        rig = replace(rig, uncertainty=replace(rig.uncertainty, sensor_gain=0.0))
    data = select_fitted_frequencies([observe(duct.recordings[0], rig)], rig)
    return calibrate(Twin(rig, data, friction="unsteady"), data)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("measured", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--explain", action="store_true")
    parser.add_argument("--processes", type=int, default=2)
    arguments = parser.parse_args()
    duct = case(arguments.measured, arguments.folder / "case")
    for warning in duct.warnings:
        print(f"warning: {warning}")
    calibration = calibrated(duct)
    report.save(calibration, arguments.folder)
    for load in ("anechoic", "unknown"):
        for gain in (False, True):
            left = calibrated(duct, load, gain).after.relative
            print(f"load {load}, gains {'free' if gain else 'trusted'}: {left:.1%} is left")
    rows = zip(calibration.twin.parameters, calibration.twin.theta, calibration.sd)
    for p, u, sd in rows:
        if p.name.startswith(("gain", "phase")):
            print(f"{p.name}: {p.value(u):.3f} (sd {p.value_sd(u, sd):.3f}) {p.unit}")
    curve = calibration.load
    for f, r, sd in list(zip(curve.frequency_hz, np.abs(curve.reflection), curve.sd))[::8]:
        print(f"|R| at {f:.0f} Hz: {r:.3f} (sd {sd:.3f})")
    if arguments.explain:
        explanation = explain(duct, processes=arguments.processes)
        result = write_verdict(explanation, arguments.folder / "explained")
        draw(explanation, arguments.folder / "explained", processes=arguments.processes)
        print(f"\n{result['verdict']}: {result['sentence']}")


if __name__ == "__main__":
    main()
