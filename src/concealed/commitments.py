"""Digests that fix verdicts and seals before any seal is opened."""

import hashlib
from collections.abc import Iterable
from pathlib import Path


def sha256_of_files(paths: Iterable[str | Path]) -> dict[str, str]:
    """Path -> SHA-256 of the file's bytes, hexadecimal."""
    return {str(path): hashlib.sha256(Path(path).read_bytes()).hexdigest() for path in paths}
