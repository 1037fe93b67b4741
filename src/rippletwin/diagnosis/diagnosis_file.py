"""diagnosis.json: diagnoses in the words of the contract, written whole or not at all."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from rippletwin.diagnosis.diagnosis import Diagnosis
from rippletwin.diagnosis.sentence import sentence


def diagnosis_dict(
    diagnoses: Sequence[Diagnosis], networks: Mapping[str, dict] | None = None
) -> dict:
    """The diagnoses as plain data, with the keys of diagnosis.json; `networks` holds what networks
    say, by the recording's label."""
    answers = networks or {}
    return {"recordings": [_recording(d, answers.get(d.label, {})) for d in diagnoses]}


def _recording(d: Diagnosis, networks: dict) -> dict:
    return {
        "label": d.label,
        "state": d.state,
        "probabilities": dict(d.probabilities),
        "severity": {
            name: {"value": s.value, "ci95": [s.low, s.high], "unit": "m2"}
            for name, s in d.severities.items()
        },
        "piston": d.piston,
        "unlike": {
            "p_value": d.unlikeness.p_value,
            "where": {"orders": list(d.unlikeness.orders), "element": d.unlikeness.element},
        },
        "networks": networks,
        "sentence": sentence(d),
    }


def write_diagnosis(
    diagnoses: Sequence[Diagnosis], folder: str | Path, networks: Mapping[str, dict] | None = None
) -> dict:
    """Write diagnosis.json into `folder` (made if needed), whole or not at all; returns it."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    result = diagnosis_dict(diagnoses, networks)
    path = folder / "diagnosis.json"
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        temporary.write_text(json.dumps(result, indent=1, allow_nan=False) + "\n")
        os.replace(temporary, path)
    finally:
        temporary.unlink(missing_ok=True)
    return result
