"""Sentences on what recordings at one mean pressure cannot tell apart."""

from __future__ import annotations

from collections.abc import Sequence

SAME_PRESSURE = 0.05  # relative; mean pressures closer than this count as one
VOLUMES = ("line_volume", "load_volume")


def pressure_sentences(
    names: Sequence[str], pressures: Sequence[float | None], is_gas: bool
) -> list[str]:
    """What fits as well as accepted effects `names` where all mean pressures (Pa) are the same.

    Only a change with pressure discriminates air from any liquid that stiffens, and a volume of the
    line's liquid from a smaller one of gas, whose compliance is V/(n p). A line of gas (`is_gas`)
    has neither.
    """
    known = [p for p in pressures if p is not None]
    if is_gas or not known or max(known) > (1 + SAME_PRESSURE) * min(known):
        return []
    sentences = []
    if "entrained_air" in names:
        sentences.append(
            "At a single mean pressure any liquid that stiffens under compression fits as well as "
            "entrained air: record at another pressure."
        )
    if set(VOLUMES) & set(names):
        sentences.append(
            "At a single mean pressure a small volume of gas, as of an accumulator, fits as well "
            "as a volume of the line's liquid: record at another pressure."
        )
    return sentences
