"""Which of this repository's source files a Python script runs.

Snakemake reruns a job when one of its input files changes, but it does not look into what a script
imports. Rules therefore name these files as inputs.
"""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
IMPORT_ROOTS = (ROOT / "src", ROOT / "workflow" / "scripts")
"""Folders from which Python imports this repository's modules."""

PLUGIN_FOLDERS = {
    "src/rippletwin/twin/effects/library.py": "src/rippletwin/twin/effects",
    "src/rippletwin/diagnosis/faults/library.py": "src/rippletwin/diagnosis/faults",
    "src/rippletwin/case/readers/registry.py": "src/rippletwin/case/readers",
}
"""Modules that import by a computed name -> the folder whose modules they import."""

DATA_FILES = {
    "src/rippletwin/report/page.py": "src/rippletwin/report/templates/*",
    "src/rippletwin/case/schema_errors.py": "src/rippletwin/case/rig.schema.yaml",
}
"""Modules that read files of their package -> which."""

SUFFIXES = {".py", ".yaml"}  # code and data of a package
BLOCKS = ("body", "orelse", "handlers", "finalbody", "cases")  # statements of a statement


def source_files_of(path: Path | str) -> list[Path]:
    """Source files that running `path` imports, directly or not, late imports included, and the
    data files that these read; sorted.

    path : a script or a module, anywhere; relative paths are below this repository. It is in the
        result only where another file imports it.
    """
    pending = [_absolute(path)]
    found: set[Path] = set()
    while pending:
        new = _imported_files(pending.pop()) - found
        found |= new
        pending += new
    return sorted(found)


def package_files(name: str) -> list[Path]:
    """Every file of code or data of a package of src/, sorted: those of another program."""
    return sorted(file for file in (ROOT / "src" / name).rglob("*") if file.suffix in SUFFIXES)


@cache
def _imported_files(file: Path) -> frozenset[Path]:
    """Source files that `file` itself imports, and data that it reads; a file is parsed once a
    process."""
    if file.suffix != ".py":
        return frozenset()
    found = {path for name in _imported_names(file) for path in _files_run_by(name)}
    if file.is_relative_to(ROOT):
        name = file.relative_to(ROOT).as_posix()
        if name in PLUGIN_FOLDERS:
            found |= set((ROOT / PLUGIN_FOLDERS[name]).glob("*.py"))
        if name in DATA_FILES:
            found |= set(ROOT.glob(DATA_FILES[name]))
    return frozenset(found)


def _imported_names(file: Path) -> Iterator[str]:
    """Dotted names in a file's import statements, wherever they are but for type checkers only."""
    for node in _statements(ast.parse(file.read_text("utf-8")).body):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            parents = _package_of(file, node.level) if node.level else ()
            name = ".".join([*parents, *filter(None, [node.module])])
            yield name
            yield from (f"{name}.{alias.name}" for alias in node.names)


def _statements(nodes: Iterable[ast.AST]) -> Iterator[ast.AST]:
    """Statements and all within them, but for what type checkers only read. Expressions, nine
    nodes of ten, are not looked at: they hold no statement."""
    for node in nodes:
        yield node
        for block in BLOCKS:
            if not (block == "body" and _is_for_type_checkers(node)):
                yield from _statements(getattr(node, block, ()))


def _is_for_type_checkers(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and ast.unparse(node.test).endswith("TYPE_CHECKING")


def _package_of(file: Path, level: int) -> tuple[str, ...]:
    """The package that `level` leading dots mean in a file."""
    for root in IMPORT_ROOTS:
        if file.is_relative_to(root):
            return file.relative_to(root).parts[:-level]
    raise ValueError(f"{file}: a relative import outside {', '.join(map(str, IMPORT_ROOTS))}")


@cache
def _files_run_by(name: str) -> frozenset[Path]:
    """This repository's files that `import name` runs: each package's __init__ and the module."""
    package, _, _ = name.rpartition(".")
    path = name.replace(".", "/")
    candidates = [
        root / end for root in IMPORT_ROOTS for end in (f"{path}/__init__.py", f"{path}.py")
    ]
    found = frozenset(file for file in candidates if file.is_file())
    return found | _files_run_by(package) if package else found


def _absolute(path: Path | str) -> Path:
    path = Path(path)
    return path if path.is_absolute() else ROOT / path
