"""Outputs of a rule for many wildcards, wherever the outputs are kept.

Snakemake's expand() takes plain paths. With a default storage provider a rule's outputs are no
plain paths: each carries its place in the storage.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import product


def expand_outputs(outputs, **values: str | Iterable[str]) -> list:
    """Every output for every combination of wildcards, the first output's combinations first.

    outputs : an output of `rules.NAME.output`, or all of them.
    values : a value, or several, for each wildcard of the outputs.
    """
    files = [outputs] if isinstance(outputs, str) else outputs
    listed = ([value] if isinstance(value, str) else list(value) for value in values.values())
    chosen = [dict(zip(values, one, strict=True)) for one in product(*listed)]
    return [file.apply_wildcards(wildcards) for file in files for wildcards in chosen]
