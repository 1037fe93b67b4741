"""Random cases whose effect is concealed: data sheet, true rig, operating points and truth.

Every random number follows from the hash of the tool that is to be tried and the number of the
trial. So nobody can select cases that suit the tool.
"""

import hashlib
from dataclasses import dataclass

import numpy as np

from virtualrig.draw_effects import INDISTINGUISHABLE, LIBRARY, OUTSIDE
from virtualrig.draw_rig import (
    draw_data_sheet,
    draw_operating_points,
    draw_true_rig,
    draw_wrong_pump,
    mean_flow,
)
from virtualrig.drawn_effect import DrawnEffect, RigContext
from virtualrig.recorder import Point

MIX = {
    "none": 0.25,
    "off": 0.10,
    "single": 0.40,
    "pair": 0.10,
    "outside": 0.10,
    "indistinguishable": 0.05,
}
"""Share of each kind of case. `none` and `off` have no effect; nominal values of `off` are two to
three standard deviations off."""


@dataclass(frozen=True)
class DrawnCase:
    """A case before it is recorded.

    `sheet` goes into rig.yaml, `seal` with it builds the true rig, `truth` is what the scoring
    needs.
    """

    sheet: dict
    seal: dict
    points: tuple[Point, ...]
    truth: dict


def random_generator(commit: str, number: int | str, *path: int | str) -> np.random.Generator:
    """Random numbers for one purpose `path`, seeded by a hash of commit, number and purpose."""
    text = ":".join(map(str, (commit, number, *path)))
    return np.random.default_rng(list(hashlib.sha256(text.encode()).digest()))


def case_kinds(count: int, commit: str, number: int | str) -> list[tuple[str, int]]:
    """Kind of each case and its running number within its kind, in random order.

    Shares are those of MIX, rounded by largest remainders. Raises ValueError for `count` below 1.
    """
    if count < 1:
        raise ValueError(f"{count} cases: at least one is needed")
    exact = {kind: share * count for kind, share in MIX.items()}
    counts = {kind: int(value) for kind, value in exact.items()}
    rest = sorted(MIX, key=lambda kind: counts[kind] - exact[kind])
    for kind in rest[: count - sum(counts.values())]:
        counts[kind] += 1
    numbered = [(kind, k) for kind in MIX for k in range(counts[kind])]
    order = random_generator(commit, number, "order").permutation(count)
    return [numbered[k] for k in order]


def draw_case(count: int, commit: str, number: int | str, index: int) -> DrawnCase:
    """Case `index` of `count`."""
    kind, running = case_kinds(count, commit, number)[index]
    rng = random_generator(commit, number, "case", index)
    sheet = draw_data_sheet(rng)
    true = draw_true_rig(sheet, rng, off=kind == "off")
    points = draw_operating_points(rng)
    context = RigContext(
        rng,
        true["line"]["segments"],
        len(sheet["sensors"]),
        sheet["fluid"]["density"],
        sheet["pump"]["bulk_modulus"],
        float(np.mean([mean_flow(sheet, point) for point in points])),
        float(np.mean([point.load_pressure for point in points])),
    )
    effects, classes = draw_effects(
        kind, running, context, random_generator(commit, number, "effects")
    )
    true["effects"] = [effect.entry for effect in effects]
    error = rng.uniform(0.01, 0.04)
    true["pump"] = draw_wrong_pump(sheet, points[0], error, rng)
    # the rig divides volumes by the true pump's modulus: keep the compliances of the truth
    factor = 1 + true["pump"]["relative"]["bulk_modulus"]
    for entry in true["effects"]:
        if "volume" in entry:
            entry["volume"] *= factor
    truth = {
        "kind": kind,
        "effects": [truth_of_effect(effect, sheet, true) for effect in effects],
        "classes": classes,
        "segments": truth_of_segments(true["line"]["segments"], context.density),
        "length": float(context.length),
        "noise": true["noise"],
        "source_error": float(error),
        "points": len(points),
        "sensors": len(sheet["sensors"]),
        "seal": true,
    }
    return DrawnCase(sheet, true, points, truth)


def draw_effects(
    kind: str, running: int, context: RigContext, order: np.random.Generator
) -> tuple[list[DrawnEffect], list[list[str]]]:
    """Effects of a case, and the classes declared beforehand.

    `order` yields the same numbers for all cases: every effect has its turn before one comes again.
    """
    level = context.rng.uniform()
    singles = list(order.permutation(list(LIBRARY)))
    outside = list(order.permutation(list(OUTSIDE)))
    alike = list(order.permutation(len(INDISTINGUISHABLE)))
    if kind == "single":
        return [LIBRARY[singles[running % len(singles)]](context, level)], []
    if kind == "outside":
        return [OUTSIDE[outside[running % len(outside)]](context, level)], []
    if kind == "pair":
        names = context.rng.choice(singles, 2, replace=False)
        # both are well visible: a strong effect always hides a weak one
        return [LIBRARY[name](context, context.uniform(0.5, 1.0)) for name in names], []
    if kind == "indistinguishable":
        effect, names = INDISTINGUISHABLE[alike[running % len(alike)]](context, 0.5 + 0.5 * level)
        return [effect], [names]
    return [], []


def truth_of_segments(segments: list[dict], density: float) -> list[dict]:
    """Delay (s) and characteristic impedance (Pa s/m3) of each true segment."""
    return [
        {
            "delay": s["length"] / s["wave_speed"],
            "impedance": density * s["wave_speed"] / (np.pi / 4 * s["diameter"] ** 2),
        }
        for s in segments
    ]


def truth_of_effect(effect: DrawnEffect, sheet: dict, true: dict) -> dict:
    """The truth of an effect; its position also in metres of the data sheet's line."""
    described = effect.to_dict()
    if effect.position is not None:
        ends = [
            np.concatenate([[0.0], np.cumsum([s["length"] for s in line["segments"]])])
            for line in (true["line"], sheet["line"])
        ]
        described["position_nominal"] = float(np.interp(effect.position, *ends))
        described["segment"] = int(np.searchsorted(ends[0][1:-1], effect.position)) + 1
    return described
