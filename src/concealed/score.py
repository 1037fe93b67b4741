"""One case scored: what the tool said beside what was true."""

from collections.abc import Sequence

SILENT = ("consistent", "calibration_only")
PLAIN = 0.05
"""Relative change of the ripple from which a single effect must be found: above the 1 to 4 % by
which the nominal flow ripple is wrong."""

ROOM = 0.01
"""Of the line's length, added to either end of a position's interval: what lengths are known to."""

GOOD_FIT = 0.05
"""Relative misfit up to which one who only recalibrates is content."""


def score(truth: dict, verdict: dict, baselines: dict, worth: float | None = None) -> dict:
    """A flat row of one case; the keys are those of docs/concealed.md.

    `truth` is what the seal held, `verdict` verdict.json, `baselines` what concealed.tool wrote,
    `worth` what concealed.oracle found.
    """
    true = truth["effects"]
    said = claims(verdict)
    classes = [set(names) for names in verdict["equivalents"] + truth["classes"]]
    hits = [hit(effect, said, classes) for effect in true]
    wrong = [
        claim["name"]
        for claim in said
        if not any(alike(claim["name"], effect["name"], classes) for effect in true)
    ]
    loud = verdict["verdict"] not in SILENT
    evidence = {each["effect"]: each["evidence"] for each in verdict["without"]}
    before, after = baselines["nominal"], baselines["calibrated"]
    return {
        "kind": truth["kind"],
        "effects": " + ".join(effect["name"] for effect in true),
        "change": truth["change"],
        "noise": truth["noise"],
        "numerics": truth["mesh"],
        "points": truth["points"],
        "sensors": truth["sensors"],
        "plain": truth["change"] >= PLAIN,
        "worth": worth,
        "verdict": verdict["verdict"],
        "said": " + ".join(f"{claim['name']} ({claim['element']})" for claim in said),
        "alarm": loud,
        "found": sum(h is not None for h in hits),
        "wrong": " + ".join(wrong),
        "right": bool(true) and hits[0] is not None if len(true) == 1 else all(hits) and bool(true),
        "clean": not wrong,
        "in_place": [
            place_right(effect, h, truth["length"])
            for effect, h in zip(true, hits, strict=True)
            if h is not None
        ],
        "place": located(true, verdict, truth["length"]),
        "intervals": [
            inside
            for effect, h in zip(true, hits, strict=True)
            if h is not None
            for inside in covered(effect, h)
        ],
        "stated": [
            (claim["probability"], not any(claim["name"] == name for name in wrong))
            for claim in said
        ],
        "evidence": [evidence.get(claim["name"]) for claim in said],
        "misfit_nominal": before,
        "misfit_calibrated": after,
        "misfit_corrected": baselines["corrected"],
        "swallowed": max(0.0, 1.0 - after / before),
        "held_out_before": verdict["fit"]["before"]["held_out"],
        "held_out_after": verdict["fit"]["after"]["held_out"],
        "floor": truth["floor"],
        "bias": {
            which: bias(truth["segments"], rows) for which, rows in baselines["segments"].items()
        },
        "baselines": {
            "bic": simple(true, baselines["bic"], truth["classes"]),
            "sparse": simple(true, baselines["sparse"], truth["classes"]),
            "recalibrate": {"alarm": after > GOOD_FIT, "right": False, "place": False, "said": ""},
        },
        "seconds": baselines["seconds"],
        "sentence": verdict["sentence"],
    }


def claims(verdict: dict) -> list[dict]:
    """The effects that a verdict names; none where it says that it has no name."""
    return verdict["effects"] if verdict["verdict"] in ("named", "ambiguous") else []


def alike(name: str, other: str, classes: Sequence[set]) -> bool:
    """Whether two names are the same, or of one stated class."""
    return name == other or any({name, other} <= names for names in classes)


def hit(effect: dict, said: list[dict], classes: Sequence[set]) -> dict | None:
    """The claim that names a true effect: by its own name sooner than by one of its class."""
    near = [claim for claim in said if alike(claim["name"], effect["name"], classes)]
    near.sort(
        key=lambda claim: (claim["name"] != effect["name"], claim["element"] != effect["element"])
    )
    return near[0] if near else None


def place_right(effect: dict, claim: dict, length: float) -> bool:
    """Whether a claim's element is the true one, or its position's interval holds the true one."""
    position = claim["parameters"].get("position")
    if effect["position"] is not None and position is not None:
        return _holds(effect, position["ci95"], length)
    return claim["element"] == effect["element"]


def located(true: list[dict], verdict: dict, length: float) -> bool:
    """Whether the verdict's `where` is the place of any true effect."""
    where = verdict["mismatch"]["where"]
    if where is None:
        return False
    for effect in true:
        if effect["position"] is None:
            if where["element"] == effect["element"]:
                return True
        elif where["element"] == f"segment {effect['segment']}" or (
            where["element"].startswith("between") and _holds(effect, where["position_m"], length)
        ):
            return True
    return False


def _holds(effect: dict, interval: Sequence[float], length: float) -> bool:
    """In true metres or as on the drawing: the calibrated line is somewhere between."""
    low, high = interval[0] - ROOM * length, interval[1] + ROOM * length
    return low <= effect["position"] <= high or low <= effect["position_nominal"] <= high


def covered(effect: dict, claim: dict) -> list[bool]:
    """Whether each 95 % interval of a rightly named effect holds the true value.

    Positions are left to `place_right`: they are known to the length's tolerance only.
    """
    if claim["name"] != effect["name"]:
        return []
    return [
        claim["parameters"][name]["ci95"][0] <= value <= claim["parameters"][name]["ci95"][1]
        for name, value in effect["parameters"].items()
        if name in claim["parameters"] and name != "position"
    ]


def bias(true: list[dict], rows: list[dict]) -> list[dict]:
    """Relative error and error in stated standard deviations of each delay and impedance.

    Empty where `rows` is: the tool gave no twin.
    """
    if not rows:
        return []
    return [
        {
            "quantity": quantity,
            "relative": row[quantity] / segment[quantity] - 1.0,
            "z": (row[quantity] - segment[quantity]) / row[f"{quantity}_sd"],
        }
        for segment, row in zip(true, rows, strict=True)
        for quantity in ("delay", "impedance")
    ]


def simple(true: list[dict], picked: dict | None, classes: list[list[str]]) -> dict:
    """A baseline that names one effect or none: alarm, right effect (any true one), right place."""
    if picked is None:
        return {"alarm": False, "right": False, "place": False, "said": ""}
    sets = [set(names) for names in classes]
    right = [effect for effect in true if alike(picked["name"], effect["name"], sets)]
    return {
        "alarm": True,
        "right": bool(right),
        "place": any(picked["element"] == effect["element"] for effect in right),
        "said": f"{picked['name']} ({picked['element']})",
    }
