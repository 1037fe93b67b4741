"""Every command of the documentation runs.

Shell blocks are fenced with ```sh. A block runs in a copy of the repository that holds a small
recorded case, `my_case`. A block marked `<!-- long -->` runs in the long suite. A command that no
test can run as it stands (it needs a network, a cluster, measurements that are not part of the
project, or hours) is listed in NOT_RUN with the reason and with what is run in its place.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from case_folders import sheet, write_case
from doc_pages import PAGES, Block, blocks, blocks_of, prose_of
from forked_snakemake import run_snakemake
from paths import ROOT

LANGUAGES = {"sh", "text", "python", "yaml", "json", "mermaid"}
PROGRAMS = ("rippletwin", "virtualrig", "snakemake", "python", "python3", "make", "pip")
COPIED = ("workflow", "config", "src", "resources", "profiles", "benchmarks", "docs", "tests")
COPIED_FILES = (
    "Snakefile", "Makefile", "pyproject.toml", "environment.txt", "environment-bench.txt",
    "environment-bench-numpy1.txt", "README.md",
)  # fmt: skip
SCHEDULED = "it takes from minutes to hours; the smoke run of `make test` runs the same rules"
NETWORK = "it downloads packages"
CLUSTER = "it needs a cluster"
HOURS = "it takes a quarter of an hour and more"

NOT_RUN = {
    "make run": (SCHEDULED, "make --dry-run run"),
    "make smoke": (SCHEDULED, "make --dry-run smoke"),
    "make lint": ("it makes an environment", "make --dry-run lint"),
    "make bench": ("it makes an environment", "make --dry-run bench"),
    "make docs-site": ("it makes an environment", "make --dry-run docs-site"),
    "make test": ("it runs this test", "make --dry-run test"),
    "make test-long": ("it runs this test", "make --dry-run test-long"),
    "make coverage": ("it runs this test", "make --dry-run coverage"),
    "make mutants": (HOURS, "make --dry-run mutants"),
    "make fuzz": (HOURS, "make --dry-run fuzz"),
    "python benchmarks/processors.py own_rig": (
        "it takes minutes",
        "python benchmarks/processors.py --help",
    ),
    'python -m pytest -m long -k "killed and 100" tests/workflow/test_killed_runs.py': (
        HOURS,
        "python -m pytest --collect-only -q -m long tests/workflow/test_killed_runs.py",
    ),
    "python tests/fuzz/guided.py twin --inputs 200000": (
        HOURS,
        "python -m py_compile tests/fuzz/guided.py",
    ),
    "python benchmarks/mutants.py scoring verdict --count 100 --seed 56": (
        HOURS,
        "python benchmarks/mutants.py --help",
    ),
    "python benchmarks/mutants.py readers --count 60 --seed 56": (
        HOURS,
        "python benchmarks/mutants.py --help",
    ),
    "python benchmarks/processors_networks.py": (
        HOURS,
        "python benchmarks/processors_networks.py --help",
    ),
    "python benchmarks/soak.py my_case": (HOURS, "python benchmarks/soak.py --help"),
    "python3 -m venv .venv": (NETWORK, "python3 -m venv --help"),
    ". .venv/bin/activate": ("it needs the environment above", "true"),
    "pip install --requirement environment.txt": (
        NETWORK,
        "python -m pip install --help && test -s environment.txt",
    ),
    "pip install jupyterlab": (NETWORK, "python -m pip install --help"),
    "pip install 'rippletwin[readers]'": (NETWORK, "python -m pip install --help"),
    "pip install snakemake-executor-plugin-slurm": (NETWORK, "python -m pip install --help"),
    "pip install snakemake-executor-plugin-kubernetes snakemake-storage-plugin-s3": (
        NETWORK,
        "python -m pip install --help",
    ),
    "snakemake --report report.zip": ("it needs a finished run", "snakemake --help"),
    "python docs/figures/report.py my_case/report.html": (
        "it needs a browser",
        "python docs/figures/report.py --help",
    ),
    "python benchmarks/concealed_errors.py results/concealed": (
        "it needs a finished trial",
        "python benchmarks/concealed_errors.py --help",
    ),
    "python benchmarks/explain_time.py results/concealed/cases/*0": (
        "it needs a finished trial",
        "python benchmarks/explain_time.py --help",
    ),
    "python benchmarks/explain_time.py results/concealed/cases/*0 --profile": (
        "it needs a finished trial",
        "python benchmarks/explain_time.py --help",
    ),
    "python benchmarks/bench_mesh.py --each 1": (
        "it takes minutes",
        "python benchmarks/bench_mesh.py --help",
    ),
    "python benchmarks/gpu_training.py cnn1d_341_100 resnet34_1d cnn2d_3_1": (
        "it needs a GPU",
        "python benchmarks/gpu_training.py --help",
    ),
    "python benchmarks/constants.py results/concealed constants --cases 8": (
        "it needs a finished trial",
        "python benchmarks/constants.py --help",
    ),
    "python benchmarks/third_party_tubes.py 44 tubes": (
        "openwind is not part of the environment",
        "python benchmarks/third_party_tubes.py --help",
    ),
    "python benchmarks/measured_tube.py RUN_1 RUN_2 tube": (
        "the measurements are not part of the project",
        "python benchmarks/measured_tube.py --help",
    ),
    "python benchmarks/measured_holes.py MEASURED holes": (
        "the measurements are not part of the project",
        "python benchmarks/measured_holes.py --help",
    ),
    "python benchmarks/measured_holes.py MEASURED holes_unlisted --states first_open"
    " --without side_hole": (
        "the measurements are not part of the project",
        "python benchmarks/measured_holes.py --help",
    ),
    "python benchmarks/measured_duct.py MEASURED duct": (
        "the measurements are not part of the project",
        "python benchmarks/measured_duct.py --help",
    ),
    "python benchmarks/flow_sensor_truth.py flow_truth": (
        HOURS,
        "python benchmarks/flow_sensor_truth.py --help",
    ),
    "rippletwin explain results/concealed/cases/001 --out explained_again": (
        "it needs a finished trial",
        "rippletwin explain --help",
    ),
    "rippletwin diagnose my_case --out my_case/diagnosed --twin my_case/explained/twin.json"
    " --networks results/my_case": (
        "it needs a finished run",
        "rippletwin diagnose --help",
    ),
    "python benchmarks/run_costs.py results": (
        "it needs a finished run",
        "python -m py_compile benchmarks/run_costs.py",
    ),
}
"""Command -> why it is not run, and the command that is run in its place."""

SLOW = {"make pins", "make audit"}  # they download all packages

PROFILE_IS_READ = (
    'python -c \'import yaml; p = yaml.safe_load(open("profiles/{0}/config.yaml"));'
    ' assert p["executor"] == "{0}" and p["default-resources"]["mem_mb"]\''
)


def stand_in(command: str) -> str:
    """What is run for a command: itself, or what NOT_RUN or a family of commands says."""
    if command in NOT_RUN:
        return NOT_RUN[command][1]
    if re.match(r"python benchmarks/explain_(selfcheck|confusion)\.py", command):  # HOURS
        return f"python -m py_compile {command.split()[1]}"
    profile = re.match(r"snakemake --workflow-profile profiles/(slurm|kubernetes)\b", command)
    if profile:  # CLUSTER
        return PROFILE_IS_READ.format(profile[1])
    if command.startswith("snakemake") and "--dry-run" not in command:  # SCHEDULED
        return f"{command} --dry-run --quiet"
    return command


def make_folder(folder: Path) -> Path:
    """A copy of the repository, as a reader has it; what numba has compiled comes with it."""
    for name in COPIED:
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns(".*"))
    for name in COPIED_FILES:
        shutil.copy(ROOT / name, folder)
    author = "-c user.name=reader -c user.email=reader@example.org"
    run(f"git init -q && git add -A && git {author} commit -qm copy", folder)
    return folder


@pytest.fixture(scope="module")
def shared_folder(tmp_path_factory) -> Path:
    """A copy of the repository with `my_case`: a healthy recording and one of unknown state."""
    folder = make_folder(tmp_path_factory.mktemp("repository"))
    case = folder / "my_case"
    case.mkdir()
    content = sheet()
    content["recordings"].append({**content["recordings"][0], "state": "unknown"})
    content["recordings"][1] |= {"label": "unknown", "file": "unknown_0.h5"}
    write_case(case, content)
    shutil.copy(case / "healthy_0.h5", case / "unknown_0.h5")
    return folder


def write_overlay(folder: Path, page: str) -> None:
    """my.yaml as the page's own yaml block has it, where the page speaks of it."""
    for block in blocks_of(ROOT / page):
        content = yaml.safe_load(block.text) if block.language == "yaml" else None
        if isinstance(content, dict) and {"concealed", "diagnosis_trial", "architectures"} & set(
            content
        ):
            names = content.get("architectures")
            if names:  # the page's own network is not in the library
                content["architectures"] = [n for n in names if n != "cnn1d_75_25"]
            (folder / "my.yaml").write_text(yaml.safe_dump(content))


def run(command: str, folder: Path) -> None:
    """Run a command line; one that fails is an error with what it printed."""
    if command.startswith("snakemake "):
        done = run_snakemake(folder, *shlex.split(command)[1:])
    else:
        done = run_in_shell(command, folder)
    assert done.returncode == 0, f"{command}\n{done.stdout[-3000:]}\n{done.stderr[-3000:]}"


def run_in_shell(command: str, folder: Path) -> subprocess.CompletedProcess:
    """Run it in the shell, with this interpreter's programs and the folder's source."""
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path, "PYTHONPATH": str(folder / "src")}
    return subprocess.run(
        ["bash", "-c", command], cwd=folder, env=environment, capture_output=True, text=True
    )


def fast_commands() -> dict[str, Block]:
    """Distinct commands of the blocks that are not long, and the first block of each.

    Targets of one configuration become one command: Snakemake takes seconds to plan a run.
    """
    found: dict[str, Block] = {}
    targets: dict[str, set[str]] = {}
    first: dict[str, Block] = {}
    for block in blocks("sh"):
        for command in block.commands if not block.long else ():
            planned = re.fullmatch(r"snakemake --cores 2((?: [^-\s]\S*)*)((?: --.*)?)", command)
            if planned and "--dry-run" not in command:
                wanted, options = planned[1].split() or ["all"], planned[2]
                targets.setdefault(options, set()).update(wanted)
                first.setdefault(options, block)
            else:
                found.setdefault(command, block)
    for options, wanted in targets.items():
        found[f"snakemake --cores 2 {' '.join(sorted(wanted))}{options}"] = first[options]
    return found


FAST = fast_commands()
WITH_LONG = sorted({block.page for block in blocks("sh") if block.long})


@pytest.mark.parametrize(
    "command",
    [pytest.param(c, marks=[pytest.mark.long] if c in SLOW else [], id=c[:70]) for c in FAST],
)
def test_command_runs(command: str, shared_folder: Path):
    """Each command line ends with exit code 0, or the one that stands in for it does."""
    write_overlay(shared_folder, FAST[command].page)
    run(stand_in(command), shared_folder)


@pytest.mark.long
@pytest.mark.parametrize("page", WITH_LONG)
def test_commands_of_a_page_run_in_order(page: str, tmp_path: Path):
    """A reader who enters every command of the page, one after the other, gets through it."""
    folder = make_folder(tmp_path)
    commands = [c for b in blocks_of(ROOT / page) if b.language == "sh" for c in b.commands]
    if not any(c.startswith("virtualrig record --out my_case") for c in commands):
        run("virtualrig record --out my_case --points smoke --seconds 2 --processes 2", folder)
        sheet_file = folder / "my_case" / "rig.yaml"  # a reader's own: one state is not known
        sheet_file.write_text(sheet_file.read_text().replace("state: slipper", "state: unknown"))
    write_overlay(folder, page)
    text = (ROOT / page).read_text()
    for name, content in re.findall(r"Save this as `(\S+)`.*?```python\n(.*?)```", text, re.S):
        (folder / name).write_text(content)
    for command in commands:
        run(stand_in(command).replace("healthy_0", "healthy_1000_95"), folder)


def test_every_fence_says_its_language():
    """A block without a language could hide a command from this test."""
    unknown = [
        str(block) for page in PAGES for block in blocks_of(page) if block.language not in LANGUAGES
    ]
    assert not unknown


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_commands_in_the_text_are_among_those_that_run(page: Path):
    """A command line in backticks or in an indented block stands in a fenced block of some page
    too, so that it is run."""
    run_somewhere = {c for block in blocks("sh") for c in block.commands}
    prose = prose_of(page)
    named = re.findall(r"`([^`\n]+)`", prose) + re.findall(r"(?m)^ {4,}(\S.*)$", prose)
    commands = [
        n for n in named if n.split()[0] in PROGRAMS and len(n.split()) > 1 and not n.isupper()
    ]
    known = {c for c in run_somewhere} | {" ".join(shlex.split(c)[:2]) for c in run_somewhere}
    assert not [c for c in commands if c not in known and not c.split()[1].isupper()]


def test_not_run_lists_only_commands_that_stand_somewhere():
    """The list of exceptions has no entry that is no longer in the documentation."""
    present = {c for block in blocks("sh") for c in block.commands}
    assert set(NOT_RUN) | SLOW <= present
