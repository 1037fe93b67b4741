"""Digests that fix verdicts and seals before any seal is opened."""

import hashlib
from collections.abc import Iterable, Mapping
from pathlib import Path


def sha256_of_files(paths: Iterable[str | Path]) -> dict[str, str]:
    """Path -> SHA-256 of the file's bytes, hexadecimal."""
    return {str(path): hashlib.sha256(Path(path).read_bytes()).hexdigest() for path in paths}


def check_unchanged(committed: Mapping[str, str], paths: Iterable[str | Path]) -> None:
    """Raise ValueError that names the files whose digest is not the committed one."""
    digests = sha256_of_files(paths)
    changed = [path for path, digest in digests.items() if committed.get(path) != digest]
    if changed:
        raise ValueError(f"changed since it was committed to: {', '.join(changed)}")
