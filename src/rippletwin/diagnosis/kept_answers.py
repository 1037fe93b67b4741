"""Answers that stay valid: only recordings that are new, or whose inputs changed, are diagnosed.

An answer is kept in a file with a digest of everything that it was made from: the recording and its
anchors, the twin and what it is recalibrated with, the faults, and the program itself. The answer
is taken again where the digest is the same; names and ages of files do not matter.
"""

from __future__ import annotations

import importlib.metadata
import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, fields, is_dataclass
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from threadpoolctl import threadpool_limits

import rippletwin
from rippletwin import store
from rippletwin.case.model import Case, Recording
from rippletwin.diagnosis.diagnose import (
    ReadOnce,
    check_twin,
    diagnose_one,
    find_anchors,
    healthy_beside,
    recalibrate_twin,
)
from rippletwin.diagnosis.diagnosed_numbers import DiagnosedNumbers, from_plain, gather
from rippletwin.diagnosis.diagnoser import Diagnoser
from rippletwin.diagnosis.diagnosis_file import entry_of
from rippletwin.diagnosis.faults.base import Fault
from rippletwin.diagnosis.pump_calibration import RecalibratedTwin
from rippletwin.twin.twin import Twin
from rippletwin.twin.twin_file import from_dict, to_dict

FOLDER = "kept"
TWIN = "twin.json"
ANSWERS = "recordings"  # folder in FOLDER with a file for each label
LIBRARIES = ("numpy", "scipy", "numba")
WITHOUT_EFFECT = ("file", "state")  # fields of a recording that no answer depends on


@dataclass(frozen=True)
class Answer:
    """An entry of diagnosis.json, the numbers behind its figures, and whether it was kept."""

    entry: Mapping
    numbers: DiagnosedNumbers
    kept: bool


def diagnose_changed(
    case: Case,
    twin: Twin,
    recordings: Sequence[Recording],
    faults: Sequence[Fault],
    folder: str | Path,
    progress: Callable[[str, int, int], None] | None = None,
) -> list[Answer]:
    """As `diagnose`, with the answers that a folder keeps of an earlier call; new ones are kept.

    folder : that of diagnosis.json; answers are in its folder FOLDER.
    """
    check_twin(case, twin)
    anchors = {r.label: find_anchors(case, r) for r in recordings}
    kept = Path(folder) / FOLDER
    beside = healthy_beside(case, recordings)
    read = ReadOnce(case.rig)
    of_twin = digest(digest_program(), case.rig, _plain_twin(twin), _effect_files(twin), beside)
    of_all = digest(of_twin, [_plain_fault(fault) for fault in faults])
    answers = []
    diagnoser = None
    with threadpool_limits(1):
        for k, recording in enumerate(recordings):
            if progress:
                progress("diagnosing", k, len(recordings))
            path = kept / ANSWERS / f"{recording.label}.json"
            key = digest(of_all, recording, anchors[recording.label])
            answer = _read_answer(path, key)
            if answer is None:
                if diagnoser is None:
                    fitted = _recalibrated(twin, beside, read, kept, of_twin)
                    diagnoser = Diagnoser(fitted.twin, faults, expected_gain=fitted.expected_gain)
                found = diagnose_one(diagnoser, recording, anchors[recording.label], read)
                answer = Answer(entry_of(found), gather(found), False)
                _write_answer(path, key, answer)
            answers.append(answer)
    if progress:
        progress("diagnosing", len(recordings), len(recordings))
    return answers


def _recalibrated(
    twin: Twin, healthy: Sequence[Recording], read: ReadOnce, kept: Path, key: str
) -> RecalibratedTwin:
    """`recalibrate_twin`, or the twin that was kept of it."""
    data = _read_json(kept / TWIN, key)
    if data is None:
        found = recalibrate_twin(twin, healthy, read)
        data = {"key": key, "twin": to_dict(found.twin), "expected_gain": found.expected_gain}
        store.write_text(kept / TWIN, json.dumps(data) + "\n")
    # one way for both: the same answers to the last digit
    return RecalibratedTwin(from_dict(data["twin"]), data["expected_gain"])


def _read_answer(path: Path, key: str) -> Answer | None:
    data = _read_json(path, key)
    if data is None:
        return None
    return Answer(data["entry"], from_plain(data["numbers"]), True)


def _write_answer(path: Path, key: str, answer: Answer) -> None:
    data = {"key": key, "entry": dict(answer.entry), "numbers": asdict(answer.numbers)}
    store.write_text(path, json.dumps(data, allow_nan=False) + "\n")


def _read_json(path: Path, key: str) -> dict | None:
    """What a kept file holds; None where it is not there, damaged, or made from other inputs."""
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return data if isinstance(data, dict) and data.get("key") == key else None


def _plain_twin(twin: Twin) -> dict:
    """What of a twin its answers depend on."""
    return {key: value for key, value in to_dict(twin).items() if key != "values"}


def _effect_files(twin: Twin) -> list[bytes]:
    """Content of the users' files that define effects of the twin."""
    return [Path(e.file).read_bytes() for e, _ in twin.effects if e.file is not None]


def _plain_fault(fault: Fault) -> list:
    """What of a fault an answer depends on: its numbers, and the user's file that defines it; the
    library's are part of the program."""
    numbers = [getattr(fault, f.name) for f in fields(fault) if f.name not in ("leaks", "file")]
    return numbers if fault.file is None else [*numbers, Path(fault.file).read_bytes()]


@cache
def digest_program() -> str:
    """Digest of this program's source and of the versions of the libraries it calculates with."""
    package = Path(rippletwin.__file__).parent
    sources = [(str(p.relative_to(package)), p.read_bytes()) for p in sorted(package.rglob("*.py"))]
    return digest(sources, [importlib.metadata.version(name) for name in LIBRARIES])


def digest(*parts: Any) -> str:
    """The same for the same content of numbers, text, arrays, lists, dictionaries and dataclasses,
    recordings without WITHOUT_EFFECT."""
    found = sha256()
    _add(found, parts)
    return found.hexdigest()


def _add(found, value: Any) -> None:
    if isinstance(value, np.ndarray):
        found.update(f"array {value.dtype} {value.shape};".encode())
        found.update(np.ascontiguousarray(value).tobytes())
    elif is_dataclass(value) and not isinstance(value, type):
        left_out = WITHOUT_EFFECT if isinstance(value, Recording) else ()
        _add(
            found, {f.name: getattr(value, f.name) for f in fields(value) if f.name not in left_out}
        )
    elif isinstance(value, Mapping):
        _add(found, [(key, value[key]) for key in sorted(value, key=str)])
    elif isinstance(value, (list, tuple)):
        found.update(f"list {len(value)};".encode())
        for each in value:
            _add(found, each)
    else:
        found.update(f"{type(value).__name__} {value!r};".encode())
