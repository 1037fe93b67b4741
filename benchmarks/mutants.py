"""How many faults in the rules of the verdict, the scoring and the readers the tests notice.

    python benchmarks/mutants.py [GROUP ...] [--count 40] [--seed 0]

One place of a module is changed: a comparison, a sign, a number, a condition, what is returned.
Tests that belong to the module run on it. The change, a mutant, is killed where a test fails. A
random sample of all mutants of each group is tried. Mutants that survive are printed: each asks for
a test, unless it does the same as the original.

Each mutant runs in a process of its own, forked after the imports. Tests that start programs of
their own do not see it. Modules of compiled functions are not for this: numba would keep a mutant
in its cache.
"""

from __future__ import annotations

import argparse
import ast
import importlib
import importlib.machinery
import importlib.util
import os
import random
import signal
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
GROUPS: dict[str, tuple[tuple[str, ...], tuple[str, ...]]] = {
    "verdict": (
        (
            "rippletwin/explanation/verdict/decision.py",
            "rippletwin/explanation/checks/support.py",
            "rippletwin/explanation/checks/alarms.py",
            "rippletwin/explanation/checks/robustness.py",
        ),
        tuple(
            f"tests/explanation/test_{name}.py"
            for name in ("support", "decision", "alarms", "verdict_file")
        ),
    ),
    "scoring": (
        ("concealed/names.py", "concealed/score.py", "diagnosis_trial/score.py"),
        (
            "tests/concealed/test_score.py",
            "tests/diagnosis_trial/test_score.py",
            "tests/diagnosis_trial/test_detection.py",
            "tests/concealed/test_summary.py",
        ),
    ),
    "readers": (
        (
            "rippletwin/case/readers/*.py",
            "rippletwin/case/load.py",
            "rippletwin/case/tables.py",
            "rippletwin/case/rig_yaml.py",
            "rippletwin/case/yaml_limits.py",
            "rippletwin/case/quantities.py",
            "rippletwin/case/pressure_units.py",
        ),
        ("tests/case",),
    ),
}
"""Group -> (modules under src, tests that belong to them)."""

IMPORTED_BEFORE = (
    "pytest", "numpy", "numba", "scipy.optimize", "scipy.signal", "scipy.io", "scipy.stats",
    "scipy.interpolate", "scipy.linalg", "pandas", "yaml", "h5py", "xarray", "zarr", "jsonschema",
    "torch",
)  # fmt: skip
COMPARISONS = {
    ast.Lt: ast.LtE, ast.LtE: ast.Lt, ast.Gt: ast.GtE, ast.GtE: ast.Gt, ast.Eq: ast.NotEq,
    ast.NotEq: ast.Eq, ast.In: ast.NotIn, ast.NotIn: ast.In, ast.Is: ast.IsNot, ast.IsNot: ast.Is,
}  # fmt: skip
ARITHMETIC = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult,
    ast.FloorDiv: ast.Div, ast.Pow: ast.Mult, ast.Mod: ast.Mult, ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
}  # fmt: skip
CALLS = {"min": "max", "max": "min", "any": "all", "all": "any"}
NOT_CHANGED = ("annotation", "returns", "decorator_list", "type_params")  # fields of nodes


@dataclass(frozen=True)
class Mutant:
    """One change of a module: replace the child `field`[`index`] of the node `number`
    of `changeable` by its variant `variant`."""

    path: Path
    number: int
    field: str
    index: int | None
    variant: int
    line: int
    text: str


def variants(node: ast.AST) -> list[ast.AST]:
    """What a node is replaced by, one at a time."""
    if isinstance(node, ast.Compare) and type(node.ops[0]) in COMPARISONS:
        return [ast.Compare(node.left, [COMPARISONS[type(node.ops[0])](), *node.ops[1:]],
                            node.comparators)]  # fmt: skip
    if isinstance(node, ast.BoolOp):
        other = ast.Or() if isinstance(node.op, ast.And) else ast.And()
        return [ast.BoolOp(other, node.values)]
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not | ast.USub):
        return [node.operand]
    if isinstance(node, ast.BinOp) and type(node.op) in ARITHMETIC:
        return [ast.BinOp(node.left, ARITHMETIC[type(node.op)](), node.right)]
    if isinstance(node, ast.Constant) and isinstance(node.value, bool):
        return [ast.Constant(not node.value)]
    if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
        return [ast.Constant(node.value + 1)]
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in CALLS:
        return [ast.Call(ast.Name(CALLS[node.func.id], ast.Load()), node.args, node.keywords)]
    if isinstance(node, ast.IfExp):
        return [ast.IfExp(node.test, node.orelse, node.body)]
    if isinstance(node, ast.If | ast.While):
        test = ast.UnaryOp(ast.Not(), node.test)
        return [type(node)(test, node.body, node.orelse)]
    if isinstance(node, ast.Return) and node.value is not None and not _is_none(node.value):
        return [ast.Return(ast.Constant(None))]
    if isinstance(node, ast.Raise):
        return [ast.Pass()]
    if isinstance(node, ast.Continue):
        return [ast.Break()]
    return []


def _is_none(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and node.value is None


def changeable(node: ast.AST) -> Iterator[ast.AST]:
    """The nodes of a tree, without annotations and decorators."""
    yield node
    for field, value in ast.iter_fields(node):
        if field not in NOT_CHANGED:
            for child in value if isinstance(value, list) else [value]:
                if isinstance(child, ast.AST):
                    yield from changeable(child)


def mutants_of(path: Path) -> Iterator[Mutant]:
    """Every mutant of a module."""
    for number, parent in enumerate(changeable(ast.parse(path.read_text()))):
        for field, value in ast.iter_fields(parent):
            if field in NOT_CHANGED:
                continue
            children = enumerate(value) if isinstance(value, list) else [(None, value)]
            for index, child in children:
                if not isinstance(child, ast.AST):
                    continue
                for variant, new in enumerate(variants(child)):
                    before, after = (ast.unparse(ast.fix_missing_locations(n)).split("\n")[0]
                                     for n in (child, new))  # fmt: skip
                    line = getattr(child, "lineno", 0)
                    yield Mutant(path, number, field, index, variant, line, f"{before} -> {after}")


def mutated(mutant: Mutant):
    """The compiled module with the change."""
    tree = ast.parse(mutant.path.read_text())
    parent = list(changeable(tree))[mutant.number]
    value = getattr(parent, mutant.field)
    old = value if mutant.index is None else value[mutant.index]
    new = ast.copy_location(variants(old)[mutant.variant], old)
    if mutant.index is None:
        setattr(parent, mutant.field, new)
    else:
        value[mutant.index] = new
    return compile(ast.fix_missing_locations(tree), str(mutant.path), "exec")


class MutantLoader(importlib.machinery.SourceFileLoader):
    """Loads a module from code that is there already."""

    def __init__(self, name: str, path: str, code):
        super().__init__(name, path)
        self.code = code

    def get_code(self, fullname):
        return self.code


class MutantFinder:
    """Finds one module: the mutant."""

    def __init__(self, name: str, path: Path, code):
        self.name, self.path, self.code = name, path, code

    def find_spec(self, name, path=None, target=None):
        if name != self.name:
            return None
        loader = MutantLoader(name, str(self.path), self.code)
        return importlib.util.spec_from_file_location(name, self.path, loader=loader)


def survives(tests: tuple[str, ...], mutant: Mutant | None, seconds: float) -> bool:
    """Whether all tests pass within a time, in a process of their own."""
    with tempfile.TemporaryDirectory() as folder:
        child = os.fork()
        if child == 0:
            code = 1
            try:
                os.setpgid(0, 0)
                code = _run_tests(tests, mutant, folder)
            finally:
                os._exit(code)
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            done, status = os.waitpid(child, os.WNOHANG)
            if done:
                return os.waitstatus_to_exitcode(status) == 0
            time.sleep(0.02)
        os.killpg(child, signal.SIGKILL)
        os.waitpid(child, 0)
        return False


def _run_tests(tests: tuple[str, ...], mutant: Mutant | None, folder: str) -> int:
    import pytest

    with open(os.devnull, "w") as nowhere:
        os.dup2(nowhere.fileno(), 1)
        os.dup2(nowhere.fileno(), 2)
    if mutant is not None:
        name = ".".join(mutant.path.relative_to(ROOT / "src").with_suffix("").parts)
        sys.meta_path.insert(0, MutantFinder(name, mutant.path, mutated(mutant)))
    options = ("-x", "-q", "-p", "no:cacheprovider", "-p", "no:xdist", "-m", "not long")
    return int(pytest.main([*options, "--basetemp", f"{folder}/tests", *tests]))


def try_group(group: str, count: int, seed: int) -> None:
    """Print the share of a sample that the tests kill, and the mutants that survive."""
    patterns, tests = GROUPS[group]
    paths = [path for pattern in patterns for path in sorted((ROOT / "src").glob(pattern))]
    tests = tuple(str(ROOT / test) for test in tests if (ROOT / test).exists())
    every = [mutant for path in paths for mutant in mutants_of(path)]
    sample = random.Random(seed).sample(every, min(count, len(every)))
    began = time.monotonic()
    if not survives(tests, None, 3600.0):
        raise SystemExit(f"{group}: the tests fail without a change")
    limit = 10.0 + 5.0 * (time.monotonic() - began)
    alive = []
    for number, mutant in enumerate(sample, 1):
        if survives(tests, mutant, limit):
            alive.append(mutant)
            place = f"{mutant.path.relative_to(ROOT)}:{mutant.line}"
            print(f"  survives: {place}: {mutant.text}", flush=True)
        elif number % 10 == 0:
            print(f"  {number} tried, {len(alive)} survive", flush=True)
    killed = len(sample) - len(alive)
    print(
        f"{group}: {killed} of {len(sample)} killed ({killed / len(sample):.0%}), "
        f"of {len(every)} mutants; seed {seed}, {time.monotonic() - began:.0f} s"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.split("\n\n")[0])
    parser.add_argument("groups", nargs="*", metavar="GROUP", help=", ".join(GROUPS))
    parser.add_argument("--count", type=int, default=40, help="mutants of each group")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    unknown = set(options.groups) - set(GROUPS)
    if unknown:
        parser.error(f"no group {', '.join(sorted(unknown))}; there are {', '.join(GROUPS)}")
    os.chdir(ROOT)
    for name in IMPORTED_BEFORE:
        importlib.import_module(name)
    for group in options.groups or GROUPS:
        try_group(group, options.count, options.seed)


if __name__ == "__main__":
    main()
