"""Imports run one way: read from the sources with ast, late imports inside functions included.

ROOMS is the order of the rooms and loose modules of `rippletwin`, the first at the bottom: a module
imports from its own room and from those before it. `learning` stands aside: it knows arrays, and
nothing of the physics that made them. The order follows a recording on its way, with two
exceptions. `harmonics` comes after `case`, for it is about the flow ripples that a case holds.
`flow_sensor` comes after `explanation`, for it uses a corrected twin and nothing uses it.
"""

import ast
import os
import subprocess
import sys
from functools import cache
from graphlib import CycleError, TopologicalSorter

import pytest

from paths import ROOT

SOURCES = ROOT / "src"
ROOMS = (
    "errors",
    "store",
    "case",
    "harmonics",
    "spectra",
    "line",
    "pump",
    "twin",
    "calibration",
    "explanation",
    "flow_sensor",
    "diagnosis",
    "figures",
    "report",
    "cli",
    "__main__",
)
ASIDE = {"learning": ("errors", "store")}
"""Rooms outside that order, and what each may import besides itself."""
USERS_OF_ASIDE = {"diagnosis": ("learning",)}
"""Rooms that import a room outside the order: trained networks are asked beside the twin."""

EXPLANATION = (
    ("thresholds", "fit_starts"),
    ("fit_jobs",),
    ("search", "localise"),
    ("stages",),
    ("checks",),
    ("verdict",),
)
"""Parts of `explanation` from the bottom up, `explain` above all. Those of one level are apart."""

MAX_PACKAGES, MAX_LOOSE_MODULES = 13, 4


@cache
def modules() -> dict:
    """Name -> path of every module and package under src."""
    found = {}
    for path in sorted(SOURCES.rglob("*.py")):
        parts = path.relative_to(SOURCES).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


def imports_of(path) -> set[str]:
    """Modules that a source file imports; of `from a import b` it is a.b where that is a module."""
    found, tree = set(), ast.parse(path.read_text())
    for node in ast.walk(tree):  # what only a type checker reads is never imported
        if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
            node.body = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found |= {name.name for name in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: a relative import"
            inner = {f"{node.module}.{name.name}" for name in node.names}
            found |= {name if name in modules() else node.module for name in inner}
    return found


@cache
def graph() -> dict[str, set[str]]:
    """Module -> what it imports, for every module under src."""
    return {name: imports_of(path) for name, path in modules().items()}


def arrows(package: str) -> list[tuple[str, str]]:
    """(importer, imported) pairs within a package, both without its name."""
    start = f"{package}."
    return [
        (name.removeprefix(start), other.removeprefix(start))
        for name, others in graph().items()
        for other in others
        if name.startswith(start) and other.startswith(start)
    ]


def room(module: str) -> str:
    return module.split(".")[0]


def test_rooms_import_only_rooms_before_them():
    """Later rooms use earlier ones, and none is missing from the order."""
    rank = {name: k for k, name in enumerate(ROOMS)}
    wrong = []
    for importer, imported in arrows("rippletwin"):
        own, other = room(importer), room(imported)
        if own == other:
            continue
        allowed = other in ASIDE[own] if own in ASIDE else rank.get(other, 99) < rank[own]
        allowed = allowed or other in USERS_OF_ASIDE.get(own, ())
        if not allowed:
            wrong.append(f"{importer} imports {imported}")
    assert not wrong, "\n".join(wrong)


def test_every_room_has_a_place_in_the_order():
    """A new room must be put into ROOMS, or this test would not see its imports."""
    inside = {room(name.removeprefix("rippletwin.")) for name in modules() if "rippletwin." in name}
    assert inside <= {*ROOMS, *ASIDE}, inside - {*ROOMS, *ASIDE}


def test_parts_of_explanation_import_only_parts_below_them():
    """Fits do not know the search, the search not the checks, and none of them the verdict."""
    rank = {name: k for k, level in enumerate(EXPLANATION) for name in level}
    rank["explain"] = len(EXPLANATION)
    wrong = [
        f"{importer} imports {imported}"
        for importer, imported in arrows("rippletwin.explanation")
        if room(importer) != room(imported) and not rank[room(imported)] < rank[room(importer)]
    ]
    assert not wrong, "\n".join(wrong)


@pytest.mark.parametrize("package", ["rippletwin", "virtualrig", "concealed", "diagnosis_trial"])
def test_no_modules_import_each_other_in_a_circle(package):
    """Every module can be read before those that use it."""
    edges = {}
    for importer, imported in arrows(package):
        edges.setdefault(importer, set()).add(imported)
    try:
        TopologicalSorter(edges).prepare()
    except CycleError as error:
        pytest.fail(" -> ".join(error.args[1]))


def test_a_newcomer_meets_few_rooms():
    """The top floor stays small enough to be read at once."""
    inside = [name.split(".")[1:] for name in modules() if name.startswith("rippletwin.")]
    top = {parts[0] for parts in inside}
    packages = {name for name in top if (SOURCES / "rippletwin" / name).is_dir()}
    assert len(packages) <= MAX_PACKAGES, packages
    assert len(top - packages) <= MAX_LOOSE_MODULES, top - packages


def test_packages_hold_a_docstring_only():
    """A re-export would import a room's libraries for everybody, and rerun the workflow's jobs."""
    wrong = [
        name
        for name, path in modules().items()
        if path.name == "__init__.py"
        and name
        # The first imports rooms on demand only (see below); no workflow imports the second.
        not in ("rippletwin", "rippletwin.cli")
        and not (
            len(body := ast.parse(path.read_text()).body) == 1
            and ast.get_docstring(ast.Module(body, []))
        )
    ]
    assert not wrong, wrong


def test_the_package_itself_imports_a_room_only_when_asked():
    """`rippletwin` offers functions of the rooms and yet loads none; each of them is there, also
    after the room `report` has been imported, and a name that is not offered is an error."""
    code = """
import sys, rippletwin
assert not [name for name in sys.modules if name.startswith("rippletwin.")], sys.modules
assert "numpy" not in sys.modules
rippletwin.load_case
assert "rippletwin.case.load" in sys.modules and "rippletwin.twin.twin" not in sys.modules
import rippletwin.report.page
names = [name for name in rippletwin.__all__ if not name.startswith("__")]
assert len(names) == 7 and all(callable(getattr(rippletwin, name)) for name in names)
assert set(names) <= set(dir(rippletwin))
try:
    rippletwin.nothing
except AttributeError:
    sys.exit(7)
"""
    environment = {**os.environ, "PYTHONPATH": str(SOURCES)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True)
    assert done.returncode == 7, done.stderr.decode()


@pytest.mark.parametrize(
    ("package", "strangers"),
    [
        ("rippletwin", {"virtualrig", "concealed", "diagnosis_trial", "snakemake"}),
        ("virtualrig", {"rippletwin", "concealed", "diagnosis_trial", "snakemake"}),
        ("concealed", {"diagnosis_trial", "snakemake"}),
        ("diagnosis_trial", {"virtualrig", "snakemake"}),
    ],
)
def test_programs_do_not_know_each_other(package, strangers):
    """The rig is an independent judge of the tool only as long as they share no code."""
    wrong = [
        f"{name} imports {other}"
        for name, others in graph().items()
        for other in others
        if room(name) == package and room(other) in strangers
    ]
    assert not wrong, "\n".join(wrong)


def test_nothing_imports_the_tests():
    """What only tests use (helpers, references) is not needed to run the programs."""
    folder = ROOT / "tests"
    own = {path.stem for path in folder.rglob("*.py")} | {"tests", "conftest", "pytest"}
    wrong = [
        f"{name} imports {other}"
        for name, others in graph().items()
        for other in others
        if room(other) in own
    ]
    assert not wrong, "\n".join(wrong)


def test_effects_know_each_other_by_the_library_only():
    """An effect is a plugin: its file can be added or removed without touching another."""
    folder = "rippletwin.twin.effects."
    plugins = {
        name for name, path in modules().items()
        if name.startswith(folder) and "\nEFFECT = " in path.read_text()
    }  # fmt: skip
    assert len(plugins) >= 16
    wrong = [f"{name} imports {other}" for name, o in graph().items() for other in o & plugins]
    assert not wrong, "\n".join(wrong)
