"""Coverage-guided fuzzing of every reader: inputs that reach new branches are varied further.

    python tests/fuzz/guided.py [READER ...] [--inputs 10000] [--corpus DIR] [--found DIR]

Each reader runs in a process of its own. It ends at the first input that is neither read nor
refused with an InputError, or that takes longer than SECONDS or more than MORE_MEMORY. That input
is kept in FOUND with a log, and the exit status is 1. With CORPUS a later run goes on from the
inputs that this one found worth keeping. Needs the extra `fuzz` (atheris).
"""

from __future__ import annotations

import argparse
import hashlib
import logging
import multiprocessing
import os
import sys
import tempfile
from collections.abc import Callable
from contextlib import redirect_stderr
from functools import partial
from pathlib import Path

import atheris

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tests/helpers"), str(ROOT / "workflow")]

# atheris tells of each module that it instruments
with (
    open(os.devnull, "w") as nowhere,
    redirect_stderr(nowhere),
    atheris.instrument_imports(include=["rippletwin", "nptdms", "pyuff", "yaml"]),
):
    import yaml
    from snakemake.exceptions import WorkflowError
    from test_fuzz_readers import TABLES
    from test_fuzz_results import RESULTS

    from case_folders import ripple, sheet, write_case, write_hdf5
    from config_errors import check_config
    from fuzzing import TOKENS, little_memory, refused
    from good_recordings import WRITE, Good
    from made_results import quick_page, write_results
    from noise_networks import kept, saved
    from rippletwin.case.load import load_case
    from rippletwin.case.rig_yaml import find_sheet_faults, parse_sheet
    from rippletwin.errors import InputError
    from rippletwin.learning.kept_networks import load_networks
    from rippletwin.report.page import report_case
    from rippletwin.twin.twin_file import load_twin

SECONDS = 60  # that an input may take
LONGEST = 1 << 16  # bytes of an input
RESIDENT_MB = 4096  # of the whole process, torch included; `little_memory` is the narrow limit

Reader = tuple[Path, Callable[[], object]]
"""A good file, and what reads it."""


# ---- what is read ----


def prepare_recording(name: str, folder: Path) -> Reader:
    """A recording in one of the formats."""
    good = Good(folder, name, WRITE[name])
    return good.path, good.load


def prepare_table(name: str, folder: Path) -> Reader:
    """A flow ripple, an impedance or a spectrum as text."""
    read, text = TABLES[name]
    path = folder / "table.csv"
    path.write_text(text)
    return path, partial(read, path)


def prepare_sheet(folder: Path) -> Reader:
    """rig.yaml as text, and the case where it is good."""
    write_case(folder, sheet(), None)
    write_hdf5(folder / "healthy_0.h5", ripple(0.3))
    path = folder / "rig.yaml"

    def read():
        if not list(find_sheet_faults(path, parse_sheet(path))):
            load_case(folder)

    return path, read


def prepare_config(folder: Path) -> Reader:
    """A configuration of the workflow."""
    path = folder / "config.yaml"
    path.write_text((ROOT / "config/smoke.yaml").read_text())

    def read():
        try:
            config = yaml.safe_load(path.read_bytes())
        except (yaml.YAMLError, ValueError):
            return  # snakemake reads the file, and says so
        if isinstance(config, dict):
            check_config(config, ROOT / "workflow/schemas/config.schema.yaml")

    return path, read


def prepare_twin(folder: Path) -> Reader:
    """twin.json."""
    path = write_results(folder) / "explained" / "twin.json"
    return path, partial(load_twin, path)


def prepare_result(name: str, folder: Path) -> Reader:
    """A file that the page shows."""
    case = load_case(write_results(folder))

    def read():
        with quick_page(case):
            report_case(folder, folder / "report.html")

    return folder / name, read


def prepare_networks(folder: Path) -> Reader:
    """Kept networks."""
    path = saved(folder, kept())
    return path, partial(load_networks, path)


READERS: dict[str, Callable[[Path], Reader]] = {
    "sheet": prepare_sheet,
    "config": prepare_config,
    "twin": prepare_twin,
    "networks": prepare_networks,
    **{name: partial(prepare_recording, name) for name in WRITE},
    **{name.replace(" ", "_"): partial(prepare_table, name) for name in TABLES},
    **{Path(name).stem: partial(prepare_result, name) for name in RESULTS if "twin" not in name},
}


# ---- fuzzing ----


def fuzz(name: str, inputs: int, corpus: Path, found: Path, seed: int) -> None:
    """Fuzz one reader and end the process: with 0 if nothing was found. What it prints goes to
    `found`."""
    with open(found / f"{name}.log", "w") as log:
        os.dup2(log.fileno(), sys.stderr.fileno())
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        path, read = READERS[name](Path(folder))
        (corpus / "good").write_bytes(path.read_bytes())
        tokens = Path(folder) / "tokens"
        tokens.write_text("".join(_quoted(token) for token in TOKENS))

        def test_one_input(data: bytes) -> None:
            path.write_bytes(data)
            try:
                with little_memory():
                    read()
            except BaseException as error:
                if _is_refusal(error, path):
                    return
                (found / f"{name}-{hashlib.sha1(data).hexdigest()}").write_bytes(data)
                raise

        test_one_input(path.read_bytes())
        options = {
            "runs": inputs,
            "seed": seed,
            "timeout": SECONDS,
            "max_len": max(LONGEST, 2 * path.stat().st_size),
            "rss_limit_mb": RESIDENT_MB,
            "dict": tokens,
            "artifact_prefix": f"{found}/{name}-",
        }
        settings = [f"-{key}={value}" for key, value in options.items()]
        atheris.Setup([name, *settings, str(corpus)], test_one_input)
        atheris.Fuzz()


def _is_refusal(error: BaseException, path: Path) -> bool:
    """Whether an input is refused in words, and no allocation failed on the way."""
    # scipy allocates what a damaged tag inside a variable claims, and touches no more of it than
    # the file holds
    is_told = isinstance(error, (InputError, WorkflowError))
    return is_told and (refused(error) or path.suffix == ".mat")


def _quoted(token: bytes) -> str:
    """A line of libFuzzer's dictionary."""
    return '"' + "".join(f"\\x{byte:02x}" for byte in token) + '"\n'


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("readers", nargs="*", help="of " + ", ".join(READERS))
    parser.add_argument("--inputs", type=int, default=10000, help="of each reader")
    parser.add_argument("--corpus", type=Path, help="folder of inputs worth keeping")
    parser.add_argument("--found", type=Path, default=Path("fuzz_found"))
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    unknown = set(arguments.readers) - set(READERS)
    if unknown:
        parser.error(f"no such reader: {', '.join(sorted(unknown))}")
    arguments.found.mkdir(parents=True, exist_ok=True)
    logging.disable()  # libraries log every oddity of a damaged file
    failed = []
    with tempfile.TemporaryDirectory() as scratch:
        for name in arguments.readers or READERS:
            corpus = (arguments.corpus or Path(scratch)) / name
            corpus.mkdir(parents=True, exist_ok=True)
            job = (name, arguments.inputs, corpus, arguments.found, arguments.seed)
            # A fork has the instrumented modules; libFuzzer ends its process.
            process = multiprocessing.get_context("fork").Process(target=fuzz, args=job)
            process.start()
            process.join()
            if process.exitcode:
                failed.append(name)
                print(f"{name}: an input is neither read nor refused, see {arguments.found}")
            else:
                (arguments.found / f"{name}.log").unlink()
                print(f"{name}: nothing found", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
