"""Time until the program answers: imports of the commands and of the workflow's jobs."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import yaml

from check_long_recording import sheet, write_recording
from measured_command import run_measured
from speed.result import Claim, Result, Table

ROOT = Path(__file__).resolve().parents[2]
SCRIPTS = ROOT / "workflow" / "scripts"
SECONDS, RATE = 3.0, 51200.0  # of the recording that is checked
PROGRAM = "import sys; from rippletwin.cli import main; sys.exit(main())"
LIBRARIES = "import numpy, scipy.interpolate, scipy.fft, numba"  # those that `check` computes with
READING = "import rippletwin.case.load, rippletwin.spectra.case_summary"
OUTLOOK = f"{READING}; import rippletwin.explanation.verdict.expected_confusion"
IMPORTS_OF = """
import ast, sys, time, json
start = time.process_time()
sys.path[:0] = {paths!r}
tree = ast.parse(open({script!r}).read())
wanted = [n for n in ast.walk(tree) if isinstance(n, (ast.Import, ast.ImportFrom))]
for node in wanted:
    if isinstance(node, ast.ImportFrom) and node.module == "__future__":
        continue
    exec(compile(ast.Module([node], []), "imports", "exec"), {{}})
print(json.dumps(time.process_time() - start))
"""


def started_seconds(code: str, arguments: list[str], rounds: int) -> np.ndarray:
    """Processor seconds (rounds,) of a line of Python, in a new process each time."""
    taken = []
    for _ in range(rounds + 1):  # the first reads files that are not in the page cache
        run = run_measured(
            [sys.executable, "-c", code, *arguments],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        if run.returncode:
            raise RuntimeError(f"{code!r} {' '.join(arguments)} ended with {run.returncode}")
        taken.append(run.cpu_s)
    return np.array(taken[1:])


def script_seconds(script: Path) -> float:
    """Processor seconds of everything that a script imports, wherever it does."""
    paths = [str(ROOT / "src"), str(SCRIPTS), str(ROOT / "workflow")]
    code = IMPORTS_OF.format(paths=paths, script=str(script))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    if done.returncode:
        raise RuntimeError(f"{script.name}: {done.stderr[-500:]}")
    return float(json.loads(done.stdout))


def small_case(folder: Path) -> None:
    """A case with one short recording."""
    write_recording(folder / "long.h5", int(SECONDS * RATE), RATE, 2)
    (folder / "rig.yaml").write_text(yaml.safe_dump(sheet(2)))


def run(quick: bool = False) -> Result:
    """Start of two commands, and imports of every script of the workflow."""
    rounds = 1 if quick else 5

    def median(code: str, *arguments: str) -> float:
        return float(np.median(started_seconds(code, list(arguments), rounds)))

    with tempfile.TemporaryDirectory() as folder:
        small_case(Path(folder))
        helped, checked = median(PROGRAM, "--help"), median(PROGRAM, "check", folder)
    libraries, reading, outlook = map(median, (LIBRARIES, READING, OUTLOOK))
    scripts = sorted(SCRIPTS.glob("*.py"))
    scripts = scripts[:2] if quick else scripts
    imports = {path.stem: script_seconds(path) for path in scripts}
    slowest = sorted(imports, key=imports.get, reverse=True)
    return Result(
        point=8,
        title="Import and start",
        what=[
            "Processor time of the program in a process of its own, files in the page cache. The "
            f"case that is checked has one recording of {SECONDS:.0f} s.",
            "The share that imports have in a job depends on the run: the table has what a job "
            "of each script imports.",
        ],
        claims=[
            Claim("rippletwin --help", helped, 0.5, "s", at_least=False),
            Claim("rippletwin check", checked, 0.5, "s", at_least=False),
        ],
        tables=[
            Table(
                "Parts of `rippletwin check`",
                ["what", "processor seconds"],
                [
                    ["importing what reads and summarises a case", f"{reading:.2f}"],
                    ["importing what says which effects would show", f"{outlook - reading:.2f}"],
                    ["reading, spectra, and which effects would show", f"{checked - outlook:.2f}"],
                ],
            ),
            Table(
                "Imports of the workflow's scripts, the slowest first",
                ["script", "processor seconds"],
                [[name, f"{imports[name]:.2f}"] for name in slowest[:12]],
            ),
        ],
        bound=[
            f"Importing NumPy, SciPy and Numba alone takes {libraries:.2f} s, so that no command "
            "that computes with them can start faster."
        ],
    )
