"""What of a case and its twin speaks against trusting its diagnoses, in plain words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rippletwin.case.model import Case, Recording
from rippletwin.case.plausibility import warn_of_pump
from rippletwin.diagnosis.kept_answers import digest
from rippletwin.explanation.checks.data_contradictions import plateau_warnings
from rippletwin.twin.twin import Twin

SHEET_OF_TWIN = ("fluid", "pump", "line", "sensors", "load")
"""Parts of a data sheet of which those of the twin count."""
CONTRADICTION = (
    "the healthy recordings contradict themselves, as verdict.json says; a diagnosis that compares "
    "with them may be wrong"
)


def find_warnings(
    case: Case, twin: Twin, recordings: Sequence[Recording], verdict: Mapping | None = None
) -> list[str]:
    """Warnings of the case, of the pump that its twin simulates, of a data sheet that is no longer
    that of the twin and of clipped `recordings`, each once; and where `verdict`, with the keys of
    verdict.json, says that the healthy recordings contradict themselves."""
    found = [CONTRADICTION] if (verdict or {}).get("verdict") == "bad_data" else []
    found += plateau_warnings(case.rig, recordings)
    changed = [
        name
        for name in SHEET_OF_TWIN
        if digest(getattr(case.rig, name)) != digest(getattr(twin.rig, name))
    ]
    if changed:
        found.append(
            f"rig.yaml: the twin was made with other values of {', '.join(changed)}, and these "
            "count; explain or calibrate again for a twin of this data sheet"
        )
    return list(dict.fromkeys([*found, *case.warnings, *warn_of_pump(twin.rig.pump)]))
