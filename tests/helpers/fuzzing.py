"""Inputs that nobody would write: good ones, damaged at random, within limits of memory and time.

The environment variable RIPPLETWIN_FUZZ states how many inputs each test tries; without it there
are few, and always the same.
"""

from __future__ import annotations

import json
import math
import os
import resource
import signal
import struct
from collections.abc import Callable
from contextlib import contextmanager
from pathlib import Path
from random import Random
from typing import Any

from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st

ASKED = os.environ.get("RIPPLETWIN_FUZZ")
FEW = 424
MORE_MEMORY = 1 << 30  # bytes that reading any input may take
SECONDS = 60.0  # that an input may take


class Hung(BaseException):
    """An input took too long. No reader that catches exceptions makes a refusal of it."""


@contextmanager
def time_limit(seconds: float):
    """Raises `Hung` after so many seconds."""

    def end(*_):
        raise Hung

    before = signal.signal(signal.SIGALRM, end)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, before)


def tried(share: float = 1.0):
    """Decorator of a `given` test: it tries `share` of the usual number of inputs, each within
    SECONDS."""
    chosen = settings(
        max_examples=max(int(share * int(ASKED or FEW)), 1),
        derandomize=ASKED is None,
        database=None,
        deadline=None,
        phases=[Phase.explicit, Phase.generate],  # to shrink an input takes longer than to find it
        suppress_health_check=list(HealthCheck),
    )

    def decorate(test):
        test.hypothesis.inner_test = time_limit(SECONDS)(test.hypothesis.inner_test)
        return chosen(test)

    return decorate


@contextmanager
def little_memory():
    """Allocations fail once the process has MORE_MEMORY more than now; address space that a library
    reserves and does not use does not count."""
    before = resource.getrlimit(resource.RLIMIT_DATA)
    pages = int(Path("/proc/self/statm").read_text().split()[5])
    limit = pages * resource.getpagesize() + MORE_MEMORY
    resource.setrlimit(resource.RLIMIT_DATA, (limit, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_DATA, before)


def refused(error: BaseException) -> bool:
    """Whether an InputError is told in words, and no allocation failed on the way to it."""
    words = str(error)
    cause: BaseException | None = error
    while cause is not None:
        if isinstance(cause, MemoryError):
            return False
        cause = cause.__cause__ or cause.__context__
    return bool(words)


def made(make: Callable[[Random], Any]) -> st.SearchStrategy:
    """Strategy of what `make` makes of random numbers. Hypothesis draws no more than their seed: an
    edit that it draws part by part takes longer than most files take to be read."""
    return st.binary(min_size=8, max_size=8).map(lambda seed: make(Random(seed)))


# ---- bytes ----

TOKENS = (
    b"\x00" * 8, b"\xff" * 8, b"\x7f\xff\xff\xff", b"\xff\xff\xff\x7f", b"\x00\x00\x00\x80",
    b"\x01\x00\x00\x00", b"nan", b"1e999", b"-1", b"0", b",", b";", b"\t", b"\n", b"\r\n", b'"',
    b"{", b"}", b"[", b"]", b": ", b"- ", b"&a ", b"*a", b"!!python/none", b"\xef\xbb\xbf",
    "é".encode(), b"#", b"%", b"'", b"~", b"null", b"1_0", b"0x10", b"1:30", b"<<: ",
)  # fmt: skip
"""What readers of text and of binary headers stumble over."""


def _edit(random: Random) -> tuple[str, float, Any]:
    kind = random.choice(("write", "insert", "remove", "repeat", "flip", "cut"))
    if kind in ("write", "insert"):
        some = random.choice(TOKENS), random.randbytes(random.randint(1, 8))
        return kind, random.random(), random.choice(some)
    return kind, random.random(), random.randint(0, 7) if kind == "flip" else random.randint(1, 64)


EDITS = made(lambda random: [_edit(random) for _ in range(random.randint(1, 4))])
"""Edits of a file, for `edited`."""


def edited(good: bytes, edits: list[tuple[str, float, Any]], head: int | None = None) -> bytes:
    """`good` after edits; places are in its first `head` bytes where that is given."""
    data = bytearray(good)
    for kind, where, what in edits:
        at = int(where * min(len(data), head or len(data)))
        if kind == "write":
            data[at : at + len(what)] = what
        elif kind == "insert":
            data[at:at] = what
        elif kind == "remove":
            del data[at : at + what]
        elif kind == "repeat":
            data[at:at] = data[at : at + what]
        elif kind == "flip" and data:
            data[min(at, len(data) - 1)] ^= 1 << what
        elif kind == "cut":
            del data[at:]
    return bytes(data)


# ---- trees of plain data ----

NUMBERS = (
    0, -1, 1, 7, 0.5, 1.0, -0.0, 1e-6, 1e6, 1e-300, 1e300, -1e300, 5e-324, 2**63, 10**308,
    math.nan, math.inf, -math.inf,
)  # fmt: skip
WORDS = ("", "healthy", "unknown", "../x", "/etc/passwd", "\x00", "a" * 300, "p1")
LETTERS = [chr(code) for code in (*range(256), 0x2028, 0x202E, 0xFEFF, 0xFFFF, 0x1F600)]


def _text(random: Random, most: int) -> str:
    return "".join(random.choices(LETTERS, k=random.randint(0, most)))


def _double(random: Random) -> float:
    """Any bits of a double."""
    return struct.unpack("d", random.randbytes(8))[0]


def _value(random: Random, depth: int = 0) -> Any:
    """Plain data of at most three levels: numbers and text, often odd, lists and mappings."""
    kind = random.randrange(8 if depth < 2 else 6)
    if kind == 0:
        return random.choice((None, True, False))
    if kind <= 3:
        return random.choice((random.choice(NUMBERS), random.randint(-10, 10), _double(random)))
    if kind <= 5:
        return random.choice((random.choice(WORDS), _text(random, 12)))
    parts = [_value(random, depth + 1) for _ in range(random.randint(0, 3))]
    return parts if kind == 6 else {_text(random, 6): part for part in parts}


def _tree_edit(random: Random) -> tuple[str, float, Any, str]:
    kind = random.choice(("set", "drop", "add", "twice"))
    return kind, random.random(), _value(random), _text(random, 6)


TREE_EDITS = made(lambda random: [_tree_edit(random) for _ in range(random.randint(1, 3))])
"""Edits of a tree of dictionaries, lists and values, for `edited_tree`."""


def edited_tree(good: Any, edits: list[tuple[str, float, Any, str]]) -> Any:
    """A copy of plain data after edits, each at one of its nodes."""
    tree = [json.loads(json.dumps(good))]
    for kind, where, value, key in edits:
        places = _places(tree)
        holder, name = places[int(where * len(places))]
        inner = holder[name]
        if kind == "set":
            holder[name] = value
        elif kind == "add" and isinstance(inner, dict):
            inner[key] = value
        elif kind == "add" and isinstance(inner, list):
            inner.append(value)
        elif kind == "twice" and isinstance(inner, list):
            inner.extend(inner[:20])
        elif kind == "drop" and holder is not tree:
            del holder[name]
    return tree[0]


def _places(tree: Any) -> list[tuple[Any, Any]]:
    """(holder, key or index) of every node below `tree`."""
    found, pending = [], [tree]
    while pending:
        holder = pending.pop()
        names = holder.keys() if isinstance(holder, dict) else range(len(holder))
        for name in names:
            found.append((holder, name))
            if isinstance(holder[name], (dict, list)):
                pending.append(holder[name])
    return found
