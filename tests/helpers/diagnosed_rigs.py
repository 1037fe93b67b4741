"""Truths and diagnoses of a rig, made up for tests of the diagnosis trial."""

import math

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
            "piston": piston, "log_odds": math.log((1 - healthy) / healthy),
            "unlike": {"p_value": 1e-3 if state == "unlike" else 0.5}}  # fmt: skip


COLUMN = "anchored@calibrated"
RUN = {"misfit": 0.2, "fit_s": 30.0, "diagnose_s": 12.0}


def scored(rig: int, truth: dict, told: list[dict], run: dict = RUN, column: str = COLUMN):
    """Rows of a rig whose tool has one column."""
    return score_rig(rig, truth, {column: {"recordings": told}}, {column: run})


def made_rows(rigs: int = 10) -> list[dict]:
    """Rigs whose slippers are found above 3 %, with intervals that hold in nine of ten."""
    made = []
    for rig in range(rigs):
        change = 10 ** (-2.5 + 0.25 * rig)
        area = 1e-7 * change
        true = truth(
            unknown_00=("slipper", change, {"slipper": area}),
            unknown_01=("cylinder", change, {"cylinder": area}),
            unknown_02=("healthy", 0.0, None),
            unknown_03=("blocked_port", 0.3, None),
            unknown_04=("changed_line", 0.2, None),
            unknown_05=("slipper+cylinder", 0.1, {"slipper": area, "cylinder": area}),
        )
        found = change > 0.03
        shift = 3.0 if rig == 9 else 1.0
        interval = {"slipper": (0.8 * shift * area, 1.3 * shift * area)}
        told = [
            said("unknown_00", "slipper" if found else "healthy", 1e-4 if found else 0.9,
                 interval if found else None, piston=3 if found else None),
            said("unknown_01", "slipper", 0.2),
            said("unknown_02", "unlike" if rig == 0 else "healthy", 0.95),
            said("unknown_03", "unlike" if rig % 2 else "cylinder", 1e-3),
            said("unknown_04", "unlike", 0.5),
            said("unknown_05", "slipper+cylinder", 1e-5),
        ]  # fmt: skip
        made += scored(rig, true, told)
    return made
