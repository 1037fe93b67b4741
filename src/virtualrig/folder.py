"""Writing of a case folder: rig.yaml with the data sheet's values, and HDF5 recordings."""

from pathlib import Path

import h5py
import numpy as np
import yaml

from virtualrig.recorder import SAMPLING_RATE_HZ, Point, Take
from virtualrig.rig import RigError

_HEADER = """\
# Written by virtualrig. SI units; values are those of drawings and catalogues, not calibrated.
# Pump: a port opens over port_opening_deg to its whole area port_area and closes the same way;
# about each dead centre a chamber is shut off for port_overlap_deg; dead_volume is a chamber's
# smallest volume; case_leakage is laminar, m3/s/Pa a chamber.
"""


def write_recording(path: Path, take: Take) -> None:
    """`pressure` (sensors, samples), Pa, with the sampling rate as attribute."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with h5py.File(path, "w") as file:
        data = file.create_dataset("pressure", data=take.pressure.astype(np.float32))
        data.attrs["unit"] = "Pa"
        file.attrs["sampling_rate_hz"] = data.attrs["sampling_rate_hz"] = SAMPLING_RATE_HZ


def write_truth(path: Path, take: Take) -> None:
    """True outlet flow and pressure over one revolution, and the crank turns of the samples."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with h5py.File(path, "w") as file:
        file["outlet_flow"] = take.orbit.outlet_flow
        file["outlet_pressure"] = take.orbit.outlet_pressure
        file["turns"] = take.turns
        file.attrs["speed_rpm"] = take.orbit.speed_rpm
        file.attrs["sampling_rate_hz"] = SAMPLING_RATE_HZ


def write_sheet(folder: Path, known: dict, recordings: list[dict]) -> None:
    """rig.yaml of a case."""
    text = yaml.safe_dump(known | {"recordings": recordings}, sort_keys=False, width=100)
    (folder / "rig.yaml").write_text(_HEADER + text)


def write_ripple(path: Path, angle_deg: np.ndarray, flow: np.ndarray) -> None:
    """One revolution of flow as `angle_deg,flow_m3_s`."""
    table = np.column_stack([angle_deg, flow])
    np.savetxt(path, table, fmt="%.9g", delimiter=",", header="angle_deg,flow_m3_s", comments="")


def recording_entry(point: Point, with_ripple: bool) -> dict:
    """The entry of one recording in rig.yaml."""
    entry = {
        "file": f"recordings/{point.label}.h5",
        "speed_rpm": point.speed_rpm,
        "load_pressure": point.load_pressure,
        "state": point.state,
    }
    if with_ripple:
        entry["flow_ripple"] = ripple_name(point)
    return entry


def ripple_name(point: Point) -> str:
    """File of the nominal flow ripple of a point, relative to the case folder."""
    return f"flow_ripple_{point.label}.csv"


def prepare_folder(folder: Path, truth: Path | None) -> None:
    """Make an empty case folder.

    Raises RigError where it has content, or where the folder `truth` lies in it.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise RigError(f"--out {folder}: exists and is not empty; name a new folder")
    if truth is not None and truth.resolve().is_relative_to(folder.resolve()):
        raise RigError(f"--true-flow {truth}: lies in the case folder; keep the truth out of it")
    folder.mkdir(parents=True, exist_ok=True)
