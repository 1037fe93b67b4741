"""What speaks against trusting a diagnosis's numbers, in words: nothing of that passes silently."""

from __future__ import annotations

from rippletwin.diagnosis.diagnosis import Diagnosis


def find_doubts(d: Diagnosis) -> list[str]:
    """Half sentences, each a reason for doubt; none where the diagnosis may be taken as it is."""
    found = []
    if not all(flow.periodic for flow in d.model.flows.values()):
        found.append("the simulated pump did not settle into a periodic ripple")
    for name in d.severities:
        low, high = d.best.cut_off[name]
        if low:
            found.append(f"the {name} leak may be smaller than any that was tried")
        if high:
            found.append(f"the {name} leak may be larger than any that was tried")
    return found
