"""Scoring of one rig's recordings: the tool's diagnosis against the truth."""

import math

LEAK_STATES = ("slipper", "cylinder", "slipper+cylinder")
"""States that the tool knows and that are no healthy one."""

OUTSIDE_STATES = ("valve_plate", "blocked_port", "cavitation")
"""Faults of the pump that the tool does not know."""

CHANGED_LINE = "changed_line"


def score_rig(rig: int, truth: dict, diagnosis: dict, run: dict) -> list[dict]:
    """One row for each column and each recording of unknown state that it has answered, in the
    order of the labels.

    `truth` is the content of the seal, `diagnosis` that of diagnosis.json, `run` that of run.json.
    Keys of a row:
        column, rig, label
        state, change, weakest, areas   the truth (`virtualrig.population.record_rig`)
        told                  the state that the tool names, "unlike" or "crashed"
        right                 see `is_right`
        suspicion             see `suspicion`
        probability           the tool's of the state that it names; None where it states none
        states                the names of the states that have a probability
        likeliest             the known state that it gives the highest probability, also where it
                              names "unlike"; None where it crashed
        severities            a list of {fault, true, value, low, high} for each fault that is both
                              true and named, m2
        piston_right          None where the tool tells no piston or no single one is true
        twin_misfit, fit_s, diagnose_s   of the rig, from `run`
    """
    return [
        {"column": column} | row
        for column, found in diagnosis.items()
        for row in _score_column(rig, truth, found["recordings"], run[column])
    ]


def _score_column(rig: int, truth: dict, entries: list[dict], run: dict) -> list[dict]:
    """The rows of one column but for its name, of its entries of diagnosis.json."""
    told = {each["label"]: each for each in entries}
    rows = []
    for label, true in sorted(truth["recordings"].items()):
        if label not in told:
            continue
        said = told[label]
        rows.append(
            {
                "rig": rig,
                "label": label,
                "state": true["state"],
                "change": true["change"],
                "weakest": true["weakest"],
                "areas": true["areas"],
                "told": said["state"],
                "right": is_right(true["state"], said["state"]),
                "suspicion": suspicion(said),
                "probability": said.get("probabilities", {}).get(said["state"]),
                "states": list(said.get("probabilities", {})),
                "likeliest": likeliest_state(said),
                "severities": compare_severities(true["areas"], said),
                "piston_right": is_piston_right(true["pistons"], said),
                "twin_misfit": run["misfit"],
                "fit_s": run["fit_s"],
                "diagnose_s": run["diagnose_s"],
            }
        )
    return rows


def is_right(state: str, told: str) -> bool:
    """Whether the tool named the true state, or said "unlike" of one that it does not know."""
    known = state == "healthy" or state in LEAK_STATES
    return told == (state if known else "unlike")


def suspicion(said: dict) -> float:
    """How far the tool doubts that a recording is healthy, on a scale that ranks recordings.

    Log odds against healthy; where the recording is unlike all states at least those of its
    p-value; -infinity where the tool crashed: it has found nothing.
    """
    if said["state"] == "crashed":
        return -math.inf
    odds = said["log_odds"]  # probabilities of 0 and 1 would rank nothing
    if said["state"] == "unlike":
        p_value = said["unlike"]["p_value"]
        odds = max(odds, _log(1.0 - p_value) - _log(p_value))
    return odds


def likeliest_state(said: dict) -> str | None:
    """The known state of the highest stated probability, None where none is stated."""
    probabilities = said.get("probabilities")
    return max(probabilities, key=probabilities.get) if probabilities else None


def _log(share: float) -> float:
    return math.log(max(share, 1e-300))


def compare_severities(areas: dict[str, float], said: dict) -> list[dict]:
    """True and stated leak area of each fault that is both true and named."""
    return [
        {
            "fault": name,
            "true": areas[name],
            "value": stated["value"],
            "low": stated["ci95"][0],
            "high": stated["ci95"][1],
        }
        for name, stated in said.get("severity", {}).items()
        if name in areas
    ]


def is_piston_right(pistons: dict[str, int], said: dict) -> bool | None:
    """Whether the piston that the tool tells is the true one of a single leak; None if it tells
    none, or if there is not one leak."""
    if said.get("piston") is None or len(pistons) != 1:
        return None
    return said["piston"] in pistons.values()
