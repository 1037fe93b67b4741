"""What speaks against trusting a diagnosis's numbers, in words: nothing of that passes silently."""

from __future__ import annotations

from rippletwin.calibration.laplace import UNCONVERGED_GAIN
from rippletwin.diagnosis.diagnosis import Diagnosis


def find_doubts(d: Diagnosis) -> list[str]:
    """Half sentences, each a reason for doubt; none where the diagnosis may be taken as it is."""
    found = []
    if not all(flow.periodic for flow in d.model.flows.values()):
        found.append("the simulated pump did not settle into a periodic ripple")
    if d.expected_gain > UNCONVERGED_GAIN:
        found.append(
            "the fit of the pump's numbers did not converge: one more step promises "
            f"{d.expected_gain:.1f} of log posterior"
        )
    for name in d.severities:
        low, high = d.best.cut_off[name]
        if low:
            found.append(f"the {name} leak may be smaller than any that was tried")
        if high:
            found.append(f"the {name} leak may be larger than any that was tried")
    return found
