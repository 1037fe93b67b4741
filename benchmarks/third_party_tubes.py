"""Missing physics of random tubes that a third party's simulator calculates.

    python benchmarks/third_party_tubes.py SEED FOLDER [--tubes 12]

Draws tubes from SEED and calculates their input impedance with openwind's finite elements: a tube
alone, with one hole, with a hole and a cone, with two holes, and with a hole but without losses at
the walls. The data sheet knows one cylinder, whose numbers are off by their stated uncertainty. Two
runs are explained, a third is not seen. All runs have noise and temperatures of their own. FOLDER
gets a case of each tube and its verdict.json. Seeds from 1000 on are for development. The seed that
is reported is 44: it is named here before it is run, and run once.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from openwind_tubes import (
    NOMINAL_TEMPERATURE,
    UNCERTAINTY,
    Cone,
    Hole,
    Tube,
    air,
    impedance,
    with_noise,
    write_case,
)
from rippletwin.calibration.misfit import relative_misfit, score_fit
from rippletwin.case.load import load_case
from rippletwin.explanation.explain import explain
from rippletwin.explanation.verdict.verdict_file import write_verdict
from rippletwin.spectra.observation import observe
from rippletwin.twin.reflection import to_reflection

KINDS = ("tube", "hole", "hole and cone", "two holes", "hole, no losses")
LOSSES = ("unsteady_friction", "thermal_boundary_layer")
RIGHT_PLACE = 0.01  # m
FREQUENCY_HZ = np.linspace(100.0, 4000.0, 391)
TEMPERATURE_SD = 2.0  # K, of the room
RUN_TEMPERATURE_SD = 0.3  # K, of a run
RUNS_FITTED = 2


def draw_tube(kind: str, rng: np.random.Generator) -> Tube:
    """A tube of a kind. Holes and the cone are at least a tenth of the length apart."""
    length = rng.uniform(0.2, 0.6)
    radius = float(np.exp(rng.uniform(np.log(2e-3), np.log(6e-3))))
    other = radius * float(np.exp(rng.choice([-1, 1]) * rng.uniform(0.1, 0.3)))
    size = rng.uniform(0.02, 0.06)
    count = {"tube": 0, "two holes": 2}.get(kind, 1)
    with_cone = kind == "hole and cone"
    while True:
        places = np.sort(rng.uniform(0.15, 0.85, count + with_cone)) * length
        if np.all(np.diff(places) > 0.1 * length + size * with_cone):
            break
    cone = None
    if with_cone:
        at = float(places[rng.integers(2)])
        places = places[places != at]
        cone = Cone(at - size / 2, at + size / 2, other)
    holes = tuple(
        Hole(x, bore * rng.uniform(0.35, 0.8), rng.uniform(1e-3, 3e-3))
        for x in map(float, places)
        for bore in [radius if cone is None or x < cone.begin else cone.radius]
    )
    end = str(rng.choice(["infinite_flanged", "unflanged", "closed"]))
    losses = 0.0 if kind == "hole, no losses" else rng.uniform(1.0, 1.3)
    return Tube(length, radius, holes, cone, end, losses)


def write_cases(tube: Tube, folder: Path, rng: np.random.Generator) -> tuple[Path, Path]:
    """Folders of the case that is fitted and of the one with the run that is not."""
    room = rng.normal(NOMINAL_TEMPERATURE, TEMPERATURE_SD)
    runs = [
        with_noise(impedance(FREQUENCY_HZ, tube, rng.normal(room, RUN_TEMPERATURE_SD)), rng)
        for _ in range(RUNS_FITTED + 1)
    ]
    segment = {
        "length": tube.length * float(1 + UNCERTAINTY["length"] * rng.normal()),
        "diameter": 2 * tube.radius * float(1 + UNCERTAINTY["diameter"] * rng.normal()),
        "wave_speed": air()["c"],
    }
    load = "closed" if tube.end == "closed" else "open"
    fitted, unseen = folder / "fitted", folder / "unseen"
    write_case(fitted, FREQUENCY_HZ, runs[:RUNS_FITTED], segment, load)
    write_case(unseen, FREQUENCY_HZ, runs[RUNS_FITTED:], segment, load)
    return fitted, unseen


@dataclass(frozen=True)
class Score:
    """What a verdict established of a tube.

    right, wrong : names
    places : errors of the holes that were established, m
    covered : of these holes, how many have their position in its 95 % interval
    losses, holes : how many of the true ones were established, and how many there are
    """

    right: list[str]
    wrong: list[str]
    places: list[float]
    covered: int
    losses: tuple[int, int]
    holes: tuple[int, int]


def score(tube: Tube, effects: list[dict]) -> Score:
    """Compare the established ones of a verdict's `effects` with the truth.

    A hole within RIGHT_PLACE of a true one is right, and each true hole counts once. Losses are
    right where the walls have them, the radiation of an open end where the end is open. Everything
    else is wrong: a cone is outside the library and has no equivalent in it.
    """
    left = [hole.position for hole in tube.holes]
    there = {name for name in LOSSES if tube.losses > 0.0}
    radiates = {"end_radiation"} if tube.end != "closed" else set()
    right, wrong, places, covered = [], [], [], 0
    for effect in effects:
        if effect["support"] != "established":
            continue
        name = effect["name"]
        if name == "side_hole":
            position = effect["parameters"]["position"]
            near = [x for x in left if abs(x - position["value"]) <= RIGHT_PLACE]
            if near:
                x = min(near, key=lambda x: abs(x - position["value"]))
                left.remove(x)
                places.append(position["value"] - x)
                low, high = position["ci95"]
                covered += low <= x <= high
            (right if near else wrong).append(name)
        else:
            (right if name in there | radiates else wrong).append(name)
    return Score(
        right,
        wrong,
        places,
        covered,
        (sum(name in there for name in right), len(there)),
        (len(places), len(tube.holes)),
    )


def in_words(tube: Tube) -> str:
    """The truth in some words."""
    words = [f"{1e3 * tube.length:.0f} mm, bore {2e3 * tube.radius:.1f} mm, {tube.end}"]
    words += [f"hole {2e3 * h.radius:.1f} mm wide at {1e3 * h.position:.0f} mm" for h in tube.holes]
    if tube.cone is not None:
        begin, end = 1e3 * tube.cone.begin, 1e3 * tube.cone.end
        words.append(f"cone to {2e3 * tube.cone.radius:.1f} mm at {begin:.0f} to {end:.0f} mm")
    return "; ".join(words)


def told(effects: list[dict]) -> str:
    """Effects of a verdict in some words, those that are not established in brackets."""
    words = []
    for effect in effects:
        name = effect["name"].replace("_", " ")
        position = effect["parameters"].get("position")
        if position is not None:
            name += f" at {1e3 * position['value']:.0f} mm"
        words.append(name if effect["support"] == "established" else f"({name})")
    return ", ".join(words)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("seed", type=int)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--tubes", type=int, default=12)
    parser.add_argument("--processes", type=int, default=1)
    arguments = parser.parse_args()
    columns = ("tube", "truth", "verdict", "effects", "right", "wrong",
               "runs differ", "calibrated", "explained", "time")  # fmt: skip
    print("| " + " | ".join(columns) + " |\n|" + "---|" * len(columns))
    scores, unseen_misfits = [], []
    for k in range(arguments.tubes):
        rng = np.random.default_rng([arguments.seed, k])
        kind = KINDS[k % len(KINDS)]
        tube = draw_tube(kind, rng)
        folder = arguments.folder / f"{k + 1}"
        fitted, unseen = (load_case(path) for path in write_cases(tube, folder, rng))
        began = time.monotonic()
        explanation = explain(fitted, processes=arguments.processes)
        verdict = write_verdict(explanation, folder / "explained")
        spent = time.monotonic() - began
        data = [observe(unseen.recordings[0], fitted.rig)]
        base, accepted = explanation.search.base, explanation.decision.accepted
        before, after = (score_fit(fit, data).misfit for fit in (base, accepted))
        first, second = to_reflection(fitted.recordings[0].spectra[:, 0])
        between = relative_misfit(first, second)
        result = score(tube, verdict["effects"])
        scores.append((kind, result))
        unseen_misfits.append((between, before, after))
        cells = [
            f"{k + 1}, {kind}", in_words(tube), verdict["verdict"], told(verdict["effects"]),
            f"{len(result.right)}", ", ".join(result.wrong) or "-",
            *(f"{x:.1%}" for x in unseen_misfits[-1]), f"{spent:.0f} s",
        ]  # fmt: skip
        print("| " + " | ".join(cells) + " |", flush=True)
    print_summary(scores, unseen_misfits)


def print_summary(
    scores: list[tuple[str, Score]], unseen_misfits: list[tuple[float, float, float]]
) -> None:
    """Print the scores of each kind and of all tubes, and the medians of the misfits."""
    print()
    for kind in KINDS:
        own = [result for name, result in scores if name == kind]
        if not own:
            continue
        losses, holes = (
            np.sum([getattr(r, which) for r in own], axis=0) for which in ("losses", "holes")
        )
        wrong = sum(len(r.wrong) for r in own)
        print(
            f"{kind}: {len(own)} tubes, losses established {losses[0]} of {losses[1]}, holes at "
            f"their place {holes[0]} of {holes[1]}, wrong {wrong}"
        )
    results = [result for _, result in scores]
    right, wrong = (sum(len(getattr(r, which)) for r in results) for which in ("right", "wrong"))
    places = 1e3 * np.abs([x for r in results for x in r.places])
    print(f"established and there: {right} of {right + wrong}")
    if len(places):
        covered = sum(r.covered for r in results)
        print(
            f"places are off by {np.median(places):.1f} mm (median), at most {np.max(places):.1f} "
            f"mm; {covered} of {len(places)} intervals hold"
        )
    between, before, after = np.median(unseen_misfits, axis=0)
    print(
        f"run not fitted, medians: calibrated {before:.1%}, explained {after:.1%}, where the runs "
        f"that are fitted differ by {between:.1%}"
    )


if __name__ == "__main__":
    main()
