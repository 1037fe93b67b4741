"""The tool on one case, and what simpler methods make of the same fits; knows nothing of the truth.

`python -m concealed.tool CASE OUT` writes verdict.json and twin.json, the same as `rippletwin
explain`, and baselines.json.
"""

import json
import sys
import time
import traceback
from pathlib import Path
from types import SimpleNamespace

import numpy as np

from concealed.sparse import pick
from rippletwin.calibration.likelihood import Likelihood
from rippletwin.calibration.misfit import misfit
from rippletwin.calibration.report import segment_table
from rippletwin.case.load import load_case
from rippletwin.explanation.explain import explain
from rippletwin.explanation.search.stepwise_search import applicable_candidates
from rippletwin.explanation.verdict.verdict_file import write_verdict


def main(case_folder: str, out: str, processes: int = 1) -> None:
    """Explain one case and write what was found; a tool that fails has said nothing."""
    started = time.perf_counter()
    out = Path(out)
    try:
        explanation = explain(load_case(case_folder, states={"healthy"}), processes)
        write_verdict(explanation, out)
        seconds = time.perf_counter() - started
    except Exception as error:  # whatever it is: one case must not end the trial
        traceback.print_exc()
        (out / "verdict.json").write_text(json.dumps(crash(error)))
        seconds, explanation = time.perf_counter() - started, None
    found = NOTHING if explanation is None else baselines(explanation)
    (out / "baselines.json").write_text(json.dumps(found | {"seconds": seconds}, indent=1) + "\n")


NOTHING = {
    "nominal": float("nan"),
    "calibrated": float("nan"),
    "corrected": float("nan"),
    "segments": {"calibrated": [], "corrected": []},
    "bic": None,
    "sparse": None,
}


def crash(error: Exception) -> dict:
    """What stands for the verdict where there is none."""
    nothing = {"in_sample": float("nan"), "held_out": float("nan")}
    return {
        "verdict": "crashed",
        "mismatch": {"present": None, "where": None},
        "effects": [],
        "equivalents": [],
        "fit": {"before": nothing, "after": nothing},
        "without": [],
        "sentence": f"It ended with an error: {error!r}",
    }


def baselines(explanation) -> dict:
    """What recalibration, BIC and a sparse regression on the residual say of an Explanation.

    nominal, calibrated, corrected   relative misfits of the whole data: with nominal values (the
        shaft angle and nothing else fitted), recalibrated, and with what was accepted
    segments   delay and impedance of each segment with standard deviations, recalibrated
        ("calibrated") and with what was accepted ("corrected")
    bic        name and element of the effect that the Bayesian information criterion picks, or None
    sparse     the same of the regression
    """
    base, accepted = explanation.search.base, explanation.judgement.accepted
    observations = list(explanation.observations)
    likelihood = Likelihood(base.twin.with_(theta=np.zeros_like(base.twin.theta)), observations)
    return {
        "nominal": misfit(likelihood, turned(likelihood)).relative,
        "calibrated": misfit(likelihood, base.twin.theta).relative,
        "corrected": explanation.validation.after["in_sample"].misfit,
        "segments": {
            "calibrated": segment_table(_as_calibration(base)),
            "corrected": segment_table(_as_calibration(accepted)),
        },
        "bic": bic(explanation),
        "sparse": pick(base, applicable_candidates(explanation.rig, observations), observations),
    }


def turned(likelihood: Likelihood) -> np.ndarray:
    """Nominal coordinates with each recording's shaft angle where the prediction fits best."""
    from rippletwin.calibration.calibrate import align

    return align(likelihood, np.zeros(len(likelihood.twin.parameters)))


def bic(explanation) -> dict | None:
    """The single effect, or none, with the least k ln n - 2 ln L (Schwarz, Ann. Statist. 6, 1978).

    Of the explanation's own fits, at their posterior modes; n counts real numbers measured.
    """
    count = sum(2 * o.values.size for o in explanation.observations)

    def criterion(fit) -> float:
        proper = np.array([not p.flat for p in fit.twin.parameters])
        minus_log_likelihood = fit.objective - 0.5 * float(np.sum(fit.twin.theta[proper] ** 2))
        return 2 * minus_log_likelihood + len(fit.twin.parameters) * np.log(count)

    best = min([explanation.search.base, *explanation.search.singles], key=criterion)
    if not best.hypothesis:
        return None
    effect, place = best.hypothesis[0]
    return {"name": effect.name, "element": place.element}


def _as_calibration(fit) -> SimpleNamespace:
    return SimpleNamespace(twin=fit.twin, covariance=fit.covariance)


if __name__ == "__main__":
    main(*sys.argv[1:3], *map(int, sys.argv[3:4]))
