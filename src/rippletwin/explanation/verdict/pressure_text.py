"""Sentences on what recordings at one mean pressure cannot tell apart."""

from __future__ import annotations

from collections.abc import Sequence

from rippletwin.explanation.search.gas_rivals import has_one_pressure


def pressure_sentences(names: Sequence[str], observations: Sequence, is_gas: bool) -> list[str]:
    """What fits as well as accepted effects `names` where all mean pressures are the same.

    Only a change with pressure discriminates air from any liquid that stiffens, and a volume of the
    line's liquid from a smaller one of gas. A line of gas (`is_gas`) has neither. Gas in place of a
    volume on the line is an equivalent of its own (`gas_rivals`).
    """
    unknown = all(o.load_pressure is None for o in observations)
    if is_gas or unknown or not has_one_pressure(observations):
        return []
    sentences = []
    if "entrained_air" in names:
        sentences.append(
            "At a single mean pressure any liquid that stiffens under compression fits as well as "
            "entrained air: record at another pressure."
        )
    if "load_volume" in names:
        sentences.append(
            "At a single mean pressure a small volume of gas, as of an accumulator, fits as well "
            "as a volume of the line's liquid: record at another pressure."
        )
    return sentences
