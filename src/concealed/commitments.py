"""Digests that bind verdicts and seals before anything is opened."""

import hashlib
from collections.abc import Iterable
from pathlib import Path


def digests(paths: Iterable[str]) -> dict[str, str]:
    """Path -> SHA-256 of the file."""
    return {str(path): hashlib.sha256(Path(path).read_bytes()).hexdigest() for path in paths}
