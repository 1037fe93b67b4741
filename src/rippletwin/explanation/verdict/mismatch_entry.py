"""The entry `mismatch` of verdict.json: whether something is missing, how surely, and where."""

from __future__ import annotations

from typing import Any

import numpy as np

from rippletwin.calibration.fit import Fit
from rippletwin.explanation.checks.alarms import evidence_p_value
from rippletwin.explanation.localise import residual_bands
from rippletwin.explanation.localise.source_free_fits import compare_evidence
from rippletwin.explanation.verdict.explanation import Explanation
from rippletwin.explanation.verdict.places import element_and_extent, stretch_between_sensors

NOTHING_MISSING = ("consistent", "calibration_only")
"""Verdicts that report no mismatch."""


def describe_mismatch(
    e: Explanation, verdict: str, entries: list[dict], shaft_effects: list[dict]
) -> dict:
    """Whether something is missing, how surely, and where.

    verdict         of the explanation, with what the shaft orders show
    entries         of the accepted effects (`profile_intervals.effect_intervals`)
    shaft_effects   effects at shaft orders as verdict.json has them
    """
    search, null_distribution = e.search, e.null_distribution
    singles, accepted = search.single_effect_fits, e.decision.accepted
    is_present = verdict not in NOTHING_MISSING

    def largest(fits: list[Fit]) -> float:
        return max([0.0, *map(search.log_bayes_factor, fits)])

    if null_distribution is None:
        tried = [*singles, *search.rivals, *search.passive_networks, accepted]
        count = len({frozenset(fit.hypothesis) for fit in tried})
        p_value = evidence_p_value(largest([*singles, accepted]), count)
    else:  # the draws are fitted with single effects only
        p_value = null_distribution.p_value(largest(singles))
    mismatch = {
        "present": is_present,
        "p_value": p_value,
        "where": _where(e, entries, shaft_effects) if is_present else None,
    }
    if null_distribution is not None:
        mismatch["by_chance"] = {
            "draws": len(null_distribution.log_bayes_factors),
            "largest": max(null_distribution.log_bayes_factors),
            "threshold": null_distribution.threshold,
        }
    return mismatch


def _where(e: Explanation, entries: list[dict], shaft_effects: list[dict]) -> dict:
    """Element, interval (m), frequency bands, shaft angles and operating points of the mismatch."""
    base, location = e.search.base, e.location
    element, position = "line", [0.0, float(e.rig.length)]
    if entries:
        first = entries[0]
        element, position = element_and_extent(e.rig, first["place"], first["parameters"])
    elif any(effect["support"] == "established" for effect in shaft_effects):
        element, position = "source", [0.0, 0.0]
    elif location is not None:
        element, position = location.element, list(location.position)
        if element == "position":
            element = stretch_between_sensors(e.rig, *position)
    where: dict[str, Any] = {
        "element": element,
        "position_m": position,
        "bands_hz": residual_bands.residual_frequency_bands(base, e.observations),
        "crank_angle_deg": residual_bands.residual_crank_angles(base, e.observations),
        "conditions": residual_bands.residual_conditions(base, e.observations),
    }
    if location is not None:
        where["one_element_free"] = location.log_bayes_factors
        if len(e.rig.sensors) > 2:
            where["interior_misfit"] = {
                which: [
                    float(np.sqrt(np.mean(misfit**2)))
                    for misfit in residual_bands.interior_misfit(fit, e.observations)
                ]
                for which, fit in (("before", base), ("after", e.decision.accepted))
            }
    if e.source_free_fits:
        where["source_informed_and_free"] = compare_evidence(
            e.search.leading_fits, e.source_free_fits
        )
    return where
