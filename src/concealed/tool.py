"""The tool on one case, and the results of simpler methods; the truth is unknown to all of them.

`python -m concealed.tool CASE OUT` writes verdict.json and twin.json, as `rippletwin explain` does,
and baselines.json. It runs in one process: its confinement has no shared memory.
"""

import json
import sys
import time
import traceback
from pathlib import Path

import numpy as np

from concealed.sparse import pick_by_matching_pursuit
from rippletwin import store
from rippletwin.calibration.likelihood import Likelihood
from rippletwin.calibration.misfit import measure_misfit
from rippletwin.calibration.report import segment_table
from rippletwin.calibration.shaft_angles import fit_shaft_angles
from rippletwin.case.load import load_case
from rippletwin.explanation.explain import explain
from rippletwin.explanation.search.stepwise_search import applicable_candidates
from rippletwin.explanation.verdict.verdict_file import write_verdict

NO_BASELINES = {
    "nominal": float("nan"),
    "segments": {"calibrated": [], "corrected": []},
    "bic": None,
    "sparse": None,
}
"""The baselines of a case in which the tool failed: they use its fits."""


def main(case_folder: str, out: str) -> None:
    """Explain one case and write the results; an error of the tool gives the verdict `crashed`."""
    started = time.process_time()
    out = Path(out)
    try:
        explanation = explain(load_case(case_folder, states={"healthy"}), processes=1)
        write_verdict(explanation, out)
        seconds = time.process_time() - started
    except Exception as error:  # any error: one case must not end the trial
        traceback.print_exc()
        store.write_text(out / "verdict.json", json.dumps(crash_verdict(error)))
        seconds, explanation = time.process_time() - started, None
    results = NO_BASELINES if explanation is None else compute_baselines(explanation)
    text = json.dumps(results | {"seconds": seconds}, indent=1) + "\n"
    store.write_text(out / "baselines.json", text)


def crash_verdict(error: Exception) -> dict:
    """The verdict of a tool that ended with an error: the keys that scoring reads."""
    unknown = {"in_sample": float("nan"), "held_out": float("nan")}
    return {
        "verdict": "crashed",
        "effects": [],
        "equivalents": [],
        "fit": {"before": unknown, "after": unknown},
        "without": [],
        "sentence": f"It ended with an error: {error!r}",
    }


def compute_baselines(explanation) -> dict:
    """Results of simpler methods on the data and the fits of an Explanation.

    nominal    relative misfit of the whole data with nominal values; of each recording only the
               shaft angle is fitted
    segments   delay and impedance of each segment with standard deviations: "calibrated" from the
               fit without effects with which the verdict compares, "corrected" from the explanation
    bic        name and element of the effect that `pick_by_bic` picks, or None
    sparse     the same of `pick_by_matching_pursuit`
    """
    base, accepted = explanation.search.base, explanation.decision.accepted
    observations = list(explanation.observations)
    # Evenness 1: the angles are those of the least misfit of the whole ripple.
    likelihood = Likelihood(base.twin, observations, evenness=1.0)
    nominal = fit_shaft_angles(likelihood, np.zeros_like(base.twin.theta))
    candidates = applicable_candidates(explanation.rig, observations)
    return {
        "nominal": measure_misfit(likelihood, nominal).relative,
        "segments": {
            "calibrated": segment_table(explanation.without_effects),
            "corrected": segment_table(accepted),
        },
        "bic": pick_by_bic(explanation),
        "sparse": pick_by_matching_pursuit(base, candidates, observations),
    }


def pick_by_bic(explanation) -> dict | None:
    """`name` and `element` of the effect in the fit with the least k ln n - 2 ln L, or None where
    that has usual effects alone, which are not picked but always tried.

    L is the likelihood at the posterior modes of the explanation's own fits, k the number of
    parameters, n that of real numbers measured (Schwarz, Ann. Statist. 6, 1978).
    """
    count = sum(2 * o.values.size for o in explanation.observations)

    def criterion(fit) -> float:
        proper = np.array([not p.flat for p in fit.twin.parameters], bool)
        minus_log_likelihood = fit.objective - 0.5 * float(np.sum(fit.twin.theta[proper] ** 2))
        return 2 * minus_log_likelihood + len(fit.twin.parameters) * np.log(count)

    best = min([explanation.search.base, *explanation.search.single_effect_fits], key=criterion)
    rig = explanation.rig
    picked = [(e, place) for e, place in best.hypothesis if not e.usual(rig, place)]
    return {"name": picked[-1][0].name, "element": picked[-1][1].element} if picked else None


if __name__ == "__main__":
    main(*sys.argv[1:3])
