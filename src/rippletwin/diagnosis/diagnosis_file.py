"""diagnosis.json (docs/reference/diagnosis_json.md), written whole or not at all."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from rippletwin import store
from rippletwin.diagnosis.diagnosis import Diagnosis
from rippletwin.diagnosis.doubts import find_doubts
from rippletwin.diagnosis.sentence import describe_diagnosis


def diagnosis_dict(diagnoses: Sequence[Diagnosis]) -> dict:
    """Plain data with the key `recordings` of diagnosis.json; no networks were asked."""
    return {"recordings": [entry_of(d) for d in diagnoses]}


def entry_of(d: Diagnosis) -> dict:
    """One recording's entry in diagnosis.json."""
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
        "networks": {},
        "sentence": describe_diagnosis(d),
        "doubts": find_doubts(d),
    }


def write_diagnosis(
    entries: Sequence[Mapping],
    folder: str | Path,
    networks: Mapping[str, dict] | None = None,
    warnings: Sequence[str] = (),
) -> dict:
    """Write diagnosis.json into `folder` (made if needed), whole or not at all; returns it.

    entries    of `entry_of`
    networks   what networks say, by the recording's label
    warnings   what of the data sheet the diagnoses suffer from, in plain words
    """
    answers = networks or {}
    result = {
        "recordings": [{**e, "networks": answers.get(e["label"], {})} for e in entries],
        "warnings": list(warnings),
    }
    text = json.dumps(result, indent=1, allow_nan=False) + "\n"
    store.write_text(Path(folder) / "diagnosis.json", text)
    return result
