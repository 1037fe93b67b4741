"""The page of a diagnosis trial: which smallest leaks it tells."""

import numpy as np
import pytest

from diagnosis_trial.page import report_page

CHANGES = np.geomspace(0.01, 1.0, 40)


def _rows(first_found: float) -> list[dict]:
    """Slippers' leaks, each on a rig of its own, found from a change on; healthy recordings beside
    them raise no alarm."""
    row = {"column": "anchored@nominal", "right": True, "told": "slipper", "probability": 0.9,
           "states": ["healthy", "slipper"], "likeliest": "slipper", "weakest": 0.0,
           "severities": [], "piston_right": None,
           "twin_misfit": 0.1, "fit_s": 1.0, "diagnose_s": 1.0}  # fmt: skip
    leaks = [
        row | {"rig": k, "label": "leak", "state": "slipper", "change": float(change),
               "areas": {"slipper": 1e-6 * float(change)},
               "suspicion": 9.0 if change >= first_found else -9.0}
        for k, change in enumerate(CHANGES)
    ]  # fmt: skip
    healthy = {"label": "healthy", "state": "healthy", "told": "healthy", "likeliest": "healthy",
               "change": 0.0, "areas": {}, "suspicion": 0.0}  # fmt: skip
    return [*leaks, *(row | healthy | {"rig": k} for k in range(len(CHANGES)))]


@pytest.mark.parametrize(
    ("first_found", "told"), [(0.0, "below 1"), (9.0, "above 1e+02"), (0.1, None)]
)
def test_a_smallest_leak_outside_the_recorded_ones_is_not_extrapolated(first_found, told):
    """Where every leak is found, or none, the curve beyond them is the penalty's; between, the
    number is near the change from which on leaks are found."""
    page = report_page(_rows(first_found), {"commit": "a", "number": 1000, "not_committed": False})
    line = next(x for x in page.splitlines() if "| slipper | % of the ripple |" in x)
    *_, half, most = line.strip("| ").split(" | ")
    if told:
        assert half == most == told
    else:
        assert float(half.split()[0]) == pytest.approx(10.0, rel=0.1)
