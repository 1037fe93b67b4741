"""A small case with made results of explain and diagnose, for tests of figures and of the page."""

from __future__ import annotations

import json
from contextlib import contextmanager
from pathlib import Path
from unittest import mock

import numpy as np

from case_folders import ripple, sheet, write_case, write_hdf5
from rippletwin.case.load import load_case
from rippletwin.case.model import Case
from rippletwin.diagnosis import diagnosed_numbers
from rippletwin.diagnosis.diagnosed_numbers import DiagnosedNumbers, Leak
from rippletwin.figures import explained_numbers
from rippletwin.figures.explained_numbers import (
    Candidate,
    ExplainedNumbers,
    LinePlace,
    Missing,
    Places,
    Point,
)
from rippletwin.twin import twin_file
from rippletwin.twin.twin import Twin

HOSTILE = "<img src=x onerror=alert(1)>&\"'"
ORDERS = 9 * np.arange(1, 5)
AMPLITUDES = np.array([[3e5, 1e5, 5e4, 2e4], [2e5, 2e5, 1e4, 1e4]], complex)
GEOMETRY = {"piston_diameter": 0.017, "pitch_radius": 0.0335, "swash_angle_deg": 17.0}
VERDICT = {
    "verdict": "named",
    "mismatch": {
        "present": True,
        "p_value": 1.97e-303,
        "where": {"element": "segment 2", "position_m": [5.95, 8.95], "bands_hz": [[150.0, 900.0]]},
    },
    "effects": [
        {
            "name": "viscoelastic_wall",
            "element": "segment 2",
            "parameters": {
                "compliance_ratio": {"value": 0.1, "ci95": [0.09787, 0.1023], "unit": "1"}
            },
            "probability": 0.99999,
        },
        {
            "name": "sensor_gain",
            "element": "sensor p1",
            "parameters": {"gain_error": {"value": 0.031, "ci95": [0.028, 0.034], "unit": "1"}},
            "probability": 0.97,
        },
    ],
    "equivalents": [],
    "next_recording": None,
    "fit": {
        "before": {"held_out": 0.754, "theil_held_out": 0.32},
        "after": {"held_out": 0.022, "theil_held_out": 0.011},
        "model_error": {"before": 0.34, "after": 0.004},
    },
    "sentence": "The twin lacks viscoelastic wall (segment 2).",
}
DIAGNOSIS = {
    "label": HOSTILE,
    "state": "slipper",
    "probabilities": {"healthy": 1e-9, "slipper": 0.97, "cylinder": 0.03},
    "severity": {"slipper": {"value": 6.1e-7, "ci95": [4.4e-7, 8.5e-7], "unit": "m2"}},
    "piston": 2,
    "unlike": {"p_value": 0.4, "where": {"orders": [], "element": None}},
    "networks": {"cnn1d_341_100": {"state": "slipper", "share": 0.9, "unlike": 0.05}},
    "sentence": "a worn slipper",
}


def made_numbers(found: bool = True, free: tuple | None = (1.0, 8.5)) -> ExplainedNumbers:
    """Numbers behind the figures of one operating point; `found` whether an effect was accepted."""
    calibrated = AMPLITUDES * (1 + 0.5j)
    corrected = AMPLITUDES * 1.02 if found else calibrated
    size = np.array([[20.0, 5.0, 30.0, 8.0]] * 2)
    point = Point(
        "healthy_0", "periodic", ("p1", "p2"), 1000.0, 9.5e6, ORDERS * 1000 / 60, ORDERS,
        AMPLITUDES, calibrated, corrected, size, size / 10 if found else size,
    )  # fmt: skip
    candidates = (
        Candidate(("viscoelastic wall of segment 2", "gain of sensor p1"), 766.6, 438.7),
        Candidate(("viscoelastic wall of segment 2",), 294.0),
        Candidate(("delay of sensor p2",), 2.0),
    )
    places = Places(
        ((5.95, 0.0197), (3.0, 0.0197)),
        (("p1", 0.42), ("p2", 2.59)),
        (LinePlace("viscoelastic wall of segment 2", 5.95, 8.95),) if found else (),
        free,
        {"source": 1.0},
    )
    law = 1e-11j * ORDERS
    missing = Missing(
        "viscoelastic wall of segment 2", "shunt admittance per metre", "m2/(Pa s)",
        ORDERS * 1000 / 60, law, law * 1.01, np.abs(law) / 20,
    )  # fmt: skip
    return ExplainedNumbers((point,), candidates, 8.0, places, (missing,) if found else ())


def made_change(label: str = "unknown_0") -> DiagnosedNumbers:
    """Numbers behind the figures of one diagnosis."""
    orders = list(range(1, 41))
    size = [1e5 / order for order in orders]
    area = list(np.geomspace(1e-7, 5e-6, 41))
    density = list(np.exp(-0.5 * (np.log(np.array(area) / 6.1e-7) / 0.17) ** 2))
    allowed = [1e3] * len(orders)
    return DiagnosedNumbers(
        label, "slipper", "slipper", ["p1", "p2"], DIAGNOSIS["probabilities"], orders,
        [size, size], [size, size], [allowed, allowed],
        {"slipper": Leak(area, density, 6.1e-7, 4.4e-7, 8.5e-7)},
    )  # fmt: skip


def write_results(folder: Path, pump: dict | None = None, **changed) -> Path:
    """A case in `folder` with an unknown recording of a hostile label, and results of explain and
    diagnose beside it; `changed` keys of the verdict. Returns `folder`."""
    content = sheet()
    content["pump"] |= pump or {}
    unknown = content["recordings"][0] | {
        "file": "unknown.h5", "state": "unknown", "label": HOSTILE,
    }  # fmt: skip
    content["recordings"].append(unknown)
    write_case(folder, content)
    write_hdf5(folder / "unknown.h5", ripple())
    for name in ("explained", "diagnosed"):
        (folder / name / "figures").mkdir(parents=True)
    explained_numbers.save(made_numbers(), folder / "explained")
    (folder / "explained" / "verdict.json").write_text(json.dumps(VERDICT | changed))
    twin = Twin(load_case(folder).rig)
    theta = np.zeros(len(twin.parameters))
    theta[twin.index["wave_speed[1]"]] = -1.0
    twin = twin.with_(theta=theta)
    covariance = (0.2**2 * np.eye(len(theta))).tolist()
    data = twin_file.to_dict(twin) | {"covariance": covariance}
    (folder / "explained" / "twin.json").write_text(json.dumps(data))
    diagnosis = json.dumps({"recordings": [DIAGNOSIS]})
    (folder / "diagnosed" / "diagnosis.json").write_text(diagnosis)
    diagnosed_numbers.save([made_change(HOSTILE)], folder / "diagnosed")
    return folder


@contextmanager
def quick_page(case: Case):
    """Pages are those of a case whose recordings are read, and have no spectra of them: both take
    most of a page's time."""
    with (
        mock.patch("rippletwin.report.results.load_case", lambda folder: case),
        mock.patch("rippletwin.report.results._order_spectra", lambda case: ([], [])),
    ):
        yield
