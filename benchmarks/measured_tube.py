"""Missing physics of a measured air tube, found on one measurement and tested on another.

    python benchmarks/measured_tube.py RUN_1 RUN_2 FOLDER

RUN_1 and RUN_2 are the two measured input impedances. FOLDER gets a case of each, and verdict.json,
twin.json and figures of the first.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.optimize import minimize_scalar

from measured_case import copy_case
from rippletwin.calibration.fit import Fit, Hypothesis
from rippletwin.calibration.frequency_continuation import refine
from rippletwin.calibration.misfit import relative_misfit, score_fit
from rippletwin.case.model import Case
from rippletwin.explanation.checks.prior_sensitivity import widen_priors
from rippletwin.explanation.explain import explain
from rippletwin.explanation.verdict.verdict_file import write_verdict
from rippletwin.figures.explanation import draw
from rippletwin.spectra.frequency_selection import select_fitted_frequencies
from rippletwin.spectra.observation import observe
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.reflection import to_reflection
from rippletwin.twin.twin import Twin

ACOUSTICS: Hypothesis = (
    (EFFECTS["unsteady_friction"], Place("line")),
    (EFFECTS["thermal_boundary_layer"], Place("line")),
    (EFFECTS["end_radiation"], Place("load")),
)


def case(run: Path, folder: Path) -> Case:
    """The tube's case with one of the measurements."""
    return copy_case("air_tube", {"measured.txt": run}, folder)


def fit_effects(rig, data, effects: Hypothesis) -> Fit:
    """Fit from the data sheet, with its uncertainties as priors."""
    base = Twin(rig, data)
    return refine(base, effects, data, [np.zeros(len(base.with_(effects=effects).parameters))])


def with_nominal_values(fit: Fit) -> Fit:
    """The same twin with the values of the data sheet."""
    return replace(fit, twin=fit.twin.with_(theta=np.zeros_like(fit.twin.theta)))


def with_wave_speed_of(fit: Fit, observation) -> tuple[Fit, float]:
    """The fit with the wave speed that fits another run best, and its ratio to the first run's.

    The air may have another temperature then.
    """
    parameter = fit.twin.parameters[fit.twin.index["wave_speed[1]"]]
    before = fit.twin.values()["wave_speed[1]"]

    def at(ratio: float) -> Fit:
        theta = fit.twin.theta.copy()
        theta[fit.twin.index["wave_speed[1]"]] = parameter.prior.coordinate(ratio * before)
        return replace(fit, twin=fit.twin.with_(theta=theta))

    best = minimize_scalar(
        lambda ratio: score_fit(at(ratio), [observation]).misfit,
        bounds=(0.99, 1.01),
        method="bounded",
    )
    return at(best.x), float(best.x)


def reflection_difference(a, b) -> float:
    """Relative difference of two runs' reflection coefficients at the frequencies both have."""
    _, i, j = np.intersect1d(a.frequency_hz, b.frequency_hz, return_indices=True)
    return relative_misfit(to_reflection(a.values[:, i]), to_reflection(b.values[:, j]))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runs", nargs=2, type=Path, metavar="RUN")
    parser.add_argument("folder", type=Path)
    arguments = parser.parse_args()
    cases = [case(run, arguments.folder / f"run_{k + 1}") for k, run in enumerate(arguments.runs)]
    whole = [observe(c.recordings[0], c.rig) for c in cases]
    rig, data = cases[0].rig, select_fitted_frequencies(whole[:1], cases[0].rig)
    print(f"the runs differ by {reflection_difference(*whole):.2%} of the reflection coefficient\n")
    print("| | run 1 | run 2 | bore |\n|---|---|---|---|")

    def row(words: str, fit: Fit) -> None:
        one, two = (score_fit(fit, [o]).misfit for o in whole)
        bore = fit.twin.values()["diameter[1]"]
        print(f"| {words} | {one:.1%} | {two:.1%} | {1e3 * bore:.2f} mm |", flush=True)

    for count in range(4):
        names = [effect.name.replace("_", " ") for effect, _ in ACOUSTICS[:count]]
        words = "nominal values, steady friction" if not names else f"... {names[-1]}"
        row(words, with_nominal_values(fit_effects(rig, data, ACOUSTICS[:count])))
    row("steady friction, calibrated to run 1", fit_effects(rig, data, ()))
    loose = widen_priors(rig)
    row("... with wide priors", fit_effects(loose, data, ()))
    row("unsteady friction, calibrated with wide priors", fit_effects(loose, data, ACOUSTICS[:1]))
    explanation = explain(cases[0], processes=1)
    accepted = explanation.decision.accepted
    row("**explained**: " + ", ".join(accepted.names).replace("_", " "), accepted)
    warmer, ratio = with_wave_speed_of(accepted, whole[1])
    row(f"... with the wave speed {ratio - 1:+.2%}, that of run 2", warmer)
    result = write_verdict(explanation, arguments.folder / "explained")
    draw(explanation, arguments.folder / "explained")
    print("\n" + result["sentence"])


if __name__ == "__main__":
    main()
