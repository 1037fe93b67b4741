"""Read what a report is made of: the case, and the results that lie beside it."""

from __future__ import annotations

import json
import shlex
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from rippletwin.case.load import load_case
from rippletwin.case.model import Case
from rippletwin.diagnosis import diagnosed_numbers
from rippletwin.diagnosis.diagnosed_numbers import DiagnosedNumbers
from rippletwin.errors import InputError
from rippletwin.figures import explained_numbers
from rippletwin.figures.explained_numbers import ExplainedNumbers
from rippletwin.report import charts
from rippletwin.report.charts import OrderSpectrum
from rippletwin.twin.twin import Twin
from rippletwin.twin.twin_file import from_dict

EXPLAINED, DIAGNOSED = "explained", "diagnosed"  # folders of a case in which results are looked for


@dataclass(frozen=True)
class Results:
    """A case and what is known of it; what is not there is None or empty, and `missing` says so.

    verdict, diagnosis   as in verdict.json and in the list of diagnosis.json
    spectra              order spectra of the periodic recordings
    twin, covariance     the twin without its effects, and the covariance (P, P) of its theta
    explained, diagnosed the numbers behind the figures
    missing              what the report lacks and what makes it, a sentence each
    """

    case: Case
    spectra: Sequence[OrderSpectrum] = ()
    verdict: Mapping | None = None
    twin: Twin | None = None
    covariance: np.ndarray | None = None
    explained: ExplainedNumbers | None = None
    diagnosis: Sequence[Mapping] = ()
    diagnosed: Mapping[str, DiagnosedNumbers] = field(default_factory=dict)
    missing: Sequence[str] = ()


def read_results(
    case_folder: str | Path,
    explained: str | Path | None = None,
    diagnosed: str | Path | None = None,
) -> Results:
    """The case and its results.

    explained, diagnosed : folders that `explain` and `diagnose` wrote; by default the folders
        `explained` and `diagnosed` of the case, where they exist. Where `explained` holds no
        verdict, that of `diagnosed` is taken.

    Raises InputError where the case is wrong, a folder that is named holds no result, or a result
    is not as the commands write it.
    """
    case = load_case(case_folder)
    spectra, without_spectrum = _order_spectra(case)
    with refuse_foreign(case_folder):
        results = _read_folders(case, explained, diagnosed)
    return replace(results, spectra=spectra, missing=(*results.missing, *without_spectrum))


def _order_spectra(case: Case) -> tuple[list[OrderSpectrum], list[str]]:
    """The order spectra of the case, and a sentence for each recording that has none."""
    spectra, missing = [], []
    for recording in case.recordings:
        if recording.kind != "periodic":
            continue
        try:
            spectra.append(charts.order_spectrum(recording, case.rig))
        except InputError as error:
            missing.append(
                f"There is no order spectrum of {recording.label}: {error.problem}. {error.remedy}"
            )
    return spectra, missing


def _read_folders(
    case: Case, explained: str | Path | None, diagnosed: str | Path | None
) -> Results:
    """What `explain` and `diagnose` wrote of the case, as `read_results` takes it."""
    missing = []
    diagnosis_folder = _folder(diagnosed, case.folder / DIAGNOSED, "diagnosis.json", "--diagnosed")
    usual = case.folder / EXPLAINED
    by_default = next(
        (each for each in (usual, diagnosis_folder) if (each / "verdict.json").is_file()), usual
    )
    folder = _folder(explained, by_default, "verdict.json", "--explained")
    verdict, numbers, twin, covariance = _read_json(folder / "verdict.json"), None, None, None
    if verdict is None:
        missing.append(f"There is no verdict: {_command('explain', case, EXPLAINED)}")
    else:
        numbers = explained_numbers.load(folder)
        if numbers is None:
            missing.append(
                "There are no ripples, because explain drew no figures: run it again without "
                "--no-figures"
            )
        if (folder / "twin.json").exists():
            twin, covariance = _line_of_twin(folder / "twin.json")
    diagnosis = _read_json(diagnosis_folder / "diagnosis.json")
    faulty = [r for r in case.recordings if r.kind == "periodic" and r.state != "healthy"]
    if diagnosis is None and faulty:
        named = []
        # diagnose takes known faults only where they are named
        if all(r.state != "unknown" for r in faulty):
            named = [word for r in faulty for word in ("--recording", r.label)]
        told = _command("diagnose", case, DIAGNOSED, *named)
        missing.append(f"There is no diagnosis: {told}")
    return Results(
        case=case,
        verdict=verdict,
        twin=twin,
        covariance=covariance,
        explained=numbers,
        diagnosis=() if diagnosis is None else tuple(diagnosis["recordings"]),
        diagnosed=diagnosed_numbers.load(diagnosis_folder),
        missing=tuple(missing),
    )


@contextmanager
def refuse_foreign(case_folder: str | Path) -> Iterator[None]:
    """Turn what results raise that cannot be read, or that no command has written so, into an
    InputError: they are JSON that may have been edited, or come from another version."""
    try:
        yield
    except InputError:
        raise
    except OSError as error:
        raise InputError(
            error.filename or case_folder,
            "results",
            f"cannot be read ({error.strerror})",
            "Correct the permissions of the file and its folder, or copy it again",
        ) from error
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise InputError(
            case_folder,
            "results",
            f"are not as the commands write them ({error!r})",
            "Run explain and diagnose again",
        ) from error


def _command(name: str, case: Case, out: str, *options: str) -> str:
    """The command line that makes a result, as a shell takes it."""
    folder = case.folder
    return shlex.join(["rippletwin", name, str(folder), *options, "--out", str(folder / out)])


def _folder(named: str | Path | None, default: Path, file: str, option: str) -> Path:
    """The folder that is named, or the default; InputError where a named one lacks `file`."""
    if named is None:
        return default
    if not (Path(named) / file).is_file():
        raise InputError(
            "command line",
            option,
            f"{named} holds no {file}",
            "name the folder that was given to the command as --out",
        )
    return Path(named)


def _line_of_twin(path: Path) -> tuple[Twin, np.ndarray | None]:
    """The twin of a twin.json without its effects, and the covariance of its theta.

    Effects have a table of their own in verdict.json, and may be of files that are not at hand.
    """
    data = _read_json(path)
    data = data.get("twin", data) | {"covariance": data.get("covariance")}
    own = tuple(f"{effect['name']}@" for effect in data["effects"])
    # Effects' own parameters come last. A label or a sensor's name may hold an @ too.
    count = sum(not name.startswith(own) for name in data["values"])
    values = dict(list(data["values"].items())[:count])
    twin = from_dict(data | {"effects": [], "theta": data["theta"][:count], "values": values})
    if data["covariance"] is None:
        return twin, None
    return twin, np.array(data["covariance"])[:count, :count]


def _read_json(path: Path) -> dict | None:
    """What a JSON file holds; None where there is none."""
    if not path.is_file():
        return None
    try:
        return json.loads(path.read_text())
    except ValueError as error:
        problem = f"is no JSON ({error})"
        raise InputError(path, path.name, problem, "write it again with the command") from None
