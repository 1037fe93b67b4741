# What several stages share: where files are, and what a job depends on besides them.
import ast
import os
import re
import subprocess
import sys
from pathlib import Path

import yaml
from snakemake.exceptions import WorkflowError

ROOT = Path(workflow.basedir)
SOURCE = ROOT / "src"
SCRIPTS = ROOT / "workflow" / "scripts"
PAPER = os.path.relpath(ROOT / "resources" / "paper_accuracy.csv")
RESULTS = config["results"]

# The virtual rig's command is found even where the environment is not activated.
shell.prefix(f"PATH={os.path.dirname(sys.executable)}:$PATH; ")
# numba does not follow `threads:`.
os.environ.setdefault("NUMBA_NUM_THREADS", "1")
# Training spends half its time on page faults unless the heap keeps what is freed; malloc reads
# these when a process starts.
os.environ.setdefault("MALLOC_MMAP_MAX_", "0")
os.environ.setdefault("MALLOC_TRIM_THRESHOLD_", str(16 * 2**30))
os.environ.setdefault("MALLOC_TOP_PAD_", str(256 * 2**20))


# ---- the case -------------------------------------------------------------------------------

RECORDED_HERE = config["case"] == "virtualrig"
CASE = f"{RESULTS}/case" if RECORDED_HERE else config["case"].rstrip("/")
RIG = f"{CASE}/rig.yaml"
if RECORDED_HERE:
    SHEET = {}  # made in one piece with the recordings
elif Path(RIG).is_file():
    SHEET = yaml.safe_load(Path(RIG).read_text())
else:
    raise WorkflowError(f"case: {CASE} has no rig.yaml; see docs/reference/rig_yaml.md")


def recordings():
    """The case's files besides rig.yaml: one folder where the virtual rig makes them."""
    if RECORDED_HERE:
        return [f"{CASE}/recordings"]
    named = [
        name
        for entry in SHEET.get("recordings", [])
        for name in (
            entry.get("file"),
            entry.get("flow_ripple"),
            *entry.get("repeats", ()),
        )
        if name
    ]
    return sorted({f"{CASE}/{name}" for name in named})


def rig_sheet():
    """rig.yaml as an input whose age does not matter: `rig_sections` tells what was edited."""
    return RIG if RECORDED_HERE else ancient(RIG)


def rig_sections(*names):
    """Params: these sections of rig.yaml, so that editing another one reruns nothing."""
    return {name: SHEET.get(name) for name in names}


# ---- datasets, networks, seeds --------------------------------------------------------------

STATES = ["H", "S", "C1", "C2"]
COMPOUND = ["+".join(faults) for faults in config["faults"]["compound"]]
EXPERIMENTAL = "experimental"  # the dataset that learns from recordings
ASIDE = "compound/"  # compound faults as a dataset would have them: compound/CFD-Q


def simulated():
    """The configured datasets that learn from simulations."""
    return [dataset for dataset in config["datasets"] if dataset != EXPERIMENTAL]


def corrected():
    """The configured datasets that learn from the corrected twin."""
    return [dataset for dataset in config["datasets"] if dataset.endswith("+")]


SEEDS = range(config["seeds"])
# Longest first, as measured; see benchmarks/ of a run.
SLOWEST = [
    "resnet34_2d",
    "resnet18_2d",
    "cnn2d_30_3",
    "cnn1d_3_1",
    "cnn2d_3_1",
    "resnet34_1d",
]


wildcard_constraints:
    state="|".join(map(re.escape, STATES + COMPOUND)),
    dataset=rf"(?:{ASIDE})?(?:CFD-P|CFD-MOC-P\+?|CFD-Q\+?)|{EXPERIMENTAL}",
    plus=r"\+?",
    architecture="[a-z0-9_]+",
    revolutions="1|2",
    windows="recorded|probe",


def every_seed(path):
    """A pattern of stores with one for each {seed}; other wildcards stay."""
    return [f"{RESULTS}/{path}".replace("{seed}", str(seed)) for seed in SEEDS]


def signal_of(dataset):
    """What networks judge: pressure along the line, or flow at the pump."""
    return "flow" if "CFD-Q" in dataset else "pressure"


def plus_of(dataset):
    """ "+" where the twin is the corrected one, as in file names."""
    return "+" if dataset.endswith("+") else ""


def twin_of(wildcards):
    """The calibrated twin, or the one that `explain` corrected."""
    return rules.explain.output.twin if wildcards.plus else rules.calibrate.output.twin


def states_of(wildcards):
    """The simulated states of a dataset, a store each: pressure in a line, or the pump's flow."""
    dataset = wildcards.dataset
    propagated = f"propagated{plus_of(dataset)}"
    return expand(
        f"{RESULTS}/{{folder}}/{{state}}.zarr",
        folder=propagated if "CFD-MOC-P" in dataset or plus_of(dataset) else "faults",
        state=COMPOUND if dataset.startswith(ASIDE) else STATES,
    )


def leak_area_of(wildcards):
    """Leak of a state, m2; a list where several faults come together."""
    areas = [
        config["faults"]["leak_area"].get(fault, 0.0)
        for fault in wildcards.state.split("+")
    ]
    return areas if len(areas) > 1 else areas[0]


def recorded_signal_of(wildcards):
    """Recorded windows of a dataset's signal; flow is seen through the line of its own twin."""
    dataset = wildcards.dataset
    plus = plus_of(dataset) if signal_of(dataset) == "flow" else ""
    return f"{RESULTS}/recordings/{signal_of(dataset)}{plus}.zarr"


def domain_of(architecture):
    return "image" if "2d" in architecture else "time"


def family_of(architecture):
    return "residual" if architecture.startswith("resnet") else "plain"


def recorded_of(wildcards):
    """What a network is tested on."""
    if domain_of(wildcards.architecture) == "image":
        return f"{RESULTS}/images/{wildcards.dataset}/recorded.zarr"
    return recorded_signal_of(wildcards)


def samples_of(wildcards):
    """What a network learns from: a store a seed, or the recordings."""
    if wildcards.dataset == EXPERIMENTAL:
        return [recorded_of(wildcards)]
    if domain_of(wildcards.architecture) == "image":
        return every_seed("images/{dataset}/{seed}.zarr")
    return every_seed("samples/{dataset}/{seed}x1.zarr")


def compound_samples_of(wildcards):
    """Samples of compound faults for a network of a dataset: of the first seed."""
    dataset = ASIDE + wildcards.dataset
    if domain_of(wildcards.architecture) == "image":
        return f"{RESULTS}/images/{dataset}/0.zarr"
    return f"{RESULTS}/samples/{dataset}/0x1.zarr"


def reference_of(wildcards):
    """What the images of a dataset are scaled by."""
    if wildcards.dataset == EXPERIMENTAL:
        return f"{RESULTS}/recordings/pressure.zarr"
    return f"{RESULTS}/seeds/{wildcards.dataset.removeprefix(ASIDE)}.zarr"


def urgency_of(wildcards):
    """Start the longest trainings first."""
    architecture = wildcards.architecture
    return 20 - SLOWEST.index(architecture) if architecture in SLOWEST else 10


# ---- attention -------------------------------------------------------------------------------


def probes_of(wildcards):
    """Simulated states without noise, as a network takes them."""
    if domain_of(wildcards.architecture) == "image":
        return f"{RESULTS}/images/{wildcards.dataset}/probe.zarr"
    return f"{RESULTS}/samples/{wildcards.dataset}/probex1.zarr"


def of_domain(domain):
    """The configured networks on time windows, or on images."""
    return [name for name in config["architectures"] if domain_of(name) == domain]


def pressures():
    """The simulated pressures to hold against the recorded one, from worst to best."""
    known = ["CFD-P", "CFD-MOC-P", "CFD-MOC-P+"]
    return [dataset for dataset in known if dataset in config["datasets"]]


def attention_targets():
    """What a whole run makes of this stage with the configured datasets and networks."""
    wanted = [rules.claims.output]
    if simulated():
        wanted += [
            rules.attention_table.output,
            rules.plot_ranks.output,
            expand(
                rules.plot_attention.output,
                dataset=simulated(),
                domain=[name for name in ("time", "image") if of_domain(name)],
            ),
        ]
    if pressures():
        wanted.append(rules.compare_sst.output)
    return wanted


# ---- concealed cases --------------------------------------------------------------------------


def git(*arguments):
    """What git says of the tool that is tried."""
    command = ["git", "-C", str(ROOT), *arguments]
    try:
        return subprocess.run(
            command, check=True, capture_output=True, text=True
        ).stdout.strip()
    except (OSError, subprocess.CalledProcessError) as error:
        raise WorkflowError(
            "concealed: its cases follow from the tool's commit; run it in a git checkout"
        ) from error


def tool_commit(wildcards):
    """Hash of the tool's source in the commit: nobody can pick the cases that follow from it."""
    return git("rev-parse", "HEAD:src/rippletwin")


def not_committed(wildcards):
    """Whether the tool that runs differs from that commit, which the page then says."""
    return git("status", "--porcelain", "src/rippletwin") != ""


# ---- what a script imports ------------------------------------------------------------------


def imported(file):
    """Dotted names that a Python file imports, late imports included."""
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            name = node.module or ""
            if node.level:
                package = file.relative_to(SOURCE).parts[: -node.level]
                name = ".".join([*package, *filter(None, [name])])
            yield name
            yield from (f"{name}.{alias.name}" for alias in node.names)


def files_of(name):
    """This repository's source files that importing a name runs."""
    parts = name.split(".")
    for folder in (SOURCE, SCRIPTS):
        for depth in range(1, len(parts) + 1):
            path = folder.joinpath(*parts[:depth])
            for file in (path / "__init__.py", path.with_suffix(".py")):
                if file.exists():
                    yield file


def library(script):
    """Every source file that a script of workflow/scripts runs: its jobs rerun when one changes."""
    pending, found = [SCRIPTS / script], set()
    while pending:
        file = pending.pop()
        names = list(imported(file))
        reached = {path for name in names for path in files_of(name)}
        if "pkgutil" in names:  # it takes in whatever lies in its folder
            reached |= set(file.parent.glob("*.py"))
        pending += reached - found
        found |= reached
    return sorted(os.path.relpath(file) for file in found)


def virtualrig():
    """Every file of the virtual rig, another program: its code, its sheet and what it conceals."""
    files = (SOURCE / "virtualrig").rglob("*")
    return sorted(
        os.path.relpath(file) for file in files if file.suffix in (".py", ".yaml")
    )
