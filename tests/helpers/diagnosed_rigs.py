"""Truths and diagnoses of a rig, made up for tests of the diagnosis trial."""

from diagnosis_trial.score import score_rig


def truth(**states) -> dict:
    """A truth with one recording for each label; keywords are label = (state, change, areas)."""
    rows = {"healthy_0_0": row("healthy", 0.0)}
    for label, (state, change, areas) in states.items():
        rows[label] = row(state, change, areas)
    return {"recordings": rows, "rig": {}}


def row(state: str, change: float, areas: dict | None = None) -> dict:
    areas = areas or {}
    return {"state": state, "point": [1000.0, 9e6], "change": change, "weakest": change / 2,
            "areas": areas, "pistons": {name: 3 for name in areas}, "plan": {}}  # fmt: skip


def said(
    label: str, state: str, healthy: float, intervals: dict | None = None, piston=None
) -> dict:
    """What the tool says; `healthy` is the probability of that, `intervals` fault -> its ends."""
    probabilities = {"healthy": healthy, "slipper": 0.0, "cylinder": 0.0, "slipper+cylinder": 0.0}
    named = state if state in probabilities and state != "healthy" else "slipper"
    probabilities[named] = 1 - healthy
    severity = {
        name: {"value": (low * high) ** 0.5, "ci95": [low, high], "unit": "m2"}
        for name, (low, high) in (intervals or {}).items()
    }
    return {"label": label, "state": state, "probabilities": probabilities, "severity": severity,
            "piston": piston,
            "unlike": {"p_value": 1e-3 if state == "unlike" else 0.5}}  # fmt: skip


COLUMN = "anchored@calibrated"
RUN = {"misfit": 0.2, "fit_s": 30.0, "diagnose_s": 12.0}


def scored(rig: int, truth: dict, told: list[dict], run: dict = RUN, column: str = COLUMN):
    """Rows of a rig whose tool has one column."""
    return score_rig(rig, truth, {column: {"recordings": told}}, {column: run})
