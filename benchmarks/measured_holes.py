"""Missing physics of a measured air tube with side holes, and its error on a run not fitted.

    python benchmarks/measured_holes.py MEASURED FOLDER [--without EFFECT ...]

MEASURED holds three runs of each state, STATE_1.txt to STATE_3.txt, of which two are fitted. FOLDER
gets a case of each state, and verdict.json, twin.json and figures of it. An effect that the library
lacks must turn up in what remains: its place and law are printed.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from measured_case import copy_case
from rippletwin.calibration.misfit import relative_misfit, score_fit
from rippletwin.case.model import Case
from rippletwin.explanation.explain import explain
from rippletwin.explanation.verdict.verdict_file import write_verdict
from rippletwin.figures.explanation import draw
from rippletwin.spectra.observation import observe
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.reflection import to_reflection

STATES = ("closed", "first_open")


def case(measured: Path, state: str, folder: Path, runs: tuple[int, int] = (1, 2)) -> Case:
    """The tube's case with two runs of a state."""
    files = {f"run_{k}.txt": measured / f"{state}_{run}.txt" for k, run in enumerate(runs, 1)}
    return copy_case("hole_tube", files, folder)


def unseen_run(measured: Path, state: str, run: int, seen: Case, folder: Path):
    """The observation of a run that is not fitted."""
    other = case(measured, state, folder, (run, run))
    recording = replace(other.recordings[0], spectra=other.recordings[0].spectra[:1])
    return observe(recording, seen.rig)


def describe_remainder(remainder: dict | None) -> str:
    """What remains beside a verdict: its element and place, its law, and what stands in for it."""
    if remainder is None:
        return "nothing remains"
    networks = []
    if (first := remainder["stand_in"]) is not None:
        law = {"element": remainder["element"], "follows": remainder["law"]}
        networks = [first | law, *first["beside"]]
    stand_ins = [
        f"{each['form']} at {1e3 * each['parameters']['position']['value']:.1f} mm, "
        f"{each['element']}, like {each['follows']}"
        for each in networks
    ]
    extent = remainder["position_m"] or []
    return (
        f"{remainder['model_error']:.1%} of the reading remains; {remainder['element']}, "
        f"{' to '.join(f'{1e3 * x:.1f}' for x in extent)} mm, like {remainder['law']}; in the twin "
        + ("; ".join(stand_ins) or "nothing stands in for it")
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("measured", type=Path)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--states", nargs="*", default=STATES, metavar="STATE")
    parser.add_argument(
        "--without",
        nargs="*",
        default=(),
        choices=list(EFFECTS),
        metavar="EFFECT",
        help="effects to take out of the library",
    )
    parser.add_argument("--processes", type=int, default=2)
    arguments = parser.parse_args()
    for name in arguments.without:
        EFFECTS.pop(name, None)
    print("| state | runs differ by | calibrated | explained | error on run 3 | effects |")
    print("|---|---|---|---|---|---|")
    sentences = []
    for state in arguments.states:
        folder = arguments.folder / state
        fitted = case(arguments.measured, state, folder / "fitted")
        unseen = unseen_run(arguments.measured, state, 3, fitted, folder / "unseen")
        first, second = to_reflection(fitted.recordings[0].spectra[:, 0])
        explanation = explain(fitted, processes=arguments.processes)
        accepted = explanation.decision.accepted
        misfits = [
            score_fit(fit, data).misfit
            for fit, data in (
                (explanation.search.base, [unseen]),
                (accepted, explanation.observations),
                (accepted, [unseen]),
            )
        ]
        between = relative_misfit(first, second)
        values = accepted.twin.values()
        effects = [
            f"{effect.name}" + (f" at {1e3 * x:.1f} mm" if (x := values.get(key)) else "")
            for effect, place in accepted.hypothesis
            for key in [f"{effect.name}@{place}.position"]
        ]
        cells = [state, f"{between:.1%}", *(f"{x:.1%}" for x in misfits), ", ".join(effects)]
        print("| " + " | ".join(cells) + " |", flush=True)
        result = write_verdict(explanation, folder / "explained")
        draw(explanation, folder / "explained", processes=arguments.processes)
        sentences.append(
            f"{state}: {result['verdict']}: {result['sentence']}\n"
            f"{state}: {describe_remainder(result['remainder'])}"
        )
    print("\n" + "\n\n".join(sentences))


if __name__ == "__main__":
    main()
