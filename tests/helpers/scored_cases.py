"""Truths, verdicts and rows of concealed cases, written by hand, for tests of their scoring."""

from concealed.score import NO_ORACLE, score_case


def truth(**changes):
    """The truth of a case with one leak at 3 m; `changes` replace entries."""
    base = {
        "kind": "single", "effects": [effect("leak", conductance=2.0)], "classes": [],
        "change": 0.2, "noise": 1e3, "points": 1, "sensors": 2, "length": 5.0, "floor": 0.03,
        "mesh": None, "segments": [{"delay": 1.0, "impedance": 4.0}],
    }  # fmt: skip
    return base | changes


def pair_truth():
    """The truth of a case with a leak and a side branch at one place."""
    return truth(kind="pair", effects=[effect("leak"), effect("side_branch")])


def effect(name, **parameters):
    """A true effect at 3 m, which the drawing shows at 3.1 m."""
    return {
        "name": name, "element": "position", "position": 3.0, "position_nominal": 3.1,
        "segment": 2, "level": 0.5, "parameters": {"position": 3.0, **parameters},
    }  # fmt: skip


def claim(name, element="position", position=(2.9, 3.2), **intervals):
    """An effect as a verdict names it, with 95 % intervals of its parameters."""
    if position is not None:
        intervals["position"] = position
    parameters = {key: {"value": sum(ci) / 2, "ci95": list(ci)} for key, ci in intervals.items()}
    return {"name": name, "element": element, "parameters": parameters, "probability": 0.9}


def verdict(kind, *claims, equivalents=()):
    """A verdict of a misfit of 10 % before and 1 % after, 2 % of data left out; a leak in it has a
    log evidence of 20."""
    where = {"element": "between p1 and p2", "position_m": [2.9, 3.2]} if claims else None
    return {
        "verdict": kind, "effects": list(claims), "equivalents": [list(e) for e in equivalents],
        "mismatch": {"present": bool(claims), "where": where}, "sentence": "The sentence.",
        "fit": {"before": {"in_sample": 0.1, "held_out": 0.11},
                "after": {"in_sample": 0.01, "held_out": 0.02}},
        "without": [{"effect": "leak", "place": "position", "evidence": 20.0}],
    }  # fmt: skip


def score_example(truth_, verdict_, log_evidence=None, held_out=None):
    """The row of a truth and a verdict, with baselines that pick nothing; the other arguments are
    what the oracle says."""
    segments = [{"delay": 1.1, "delay_sd": 0.05, "impedance": 4.0, "impedance_sd": 1.0}]
    baselines = {
        "nominal": 0.5, "bic": None, "sparse": None, "seconds": 1.0,
        "segments": {"calibrated": segments, "corrected": segments},
    }  # fmt: skip
    oracle = NO_ORACLE | {"log_evidence": log_evidence, "held_out": held_out}
    return score_case(truth_, verdict_, baselines, oracle)
