"""Import of modules with a constant halved or doubled, and with it all that is derived from it."""

from __future__ import annotations

import ast
import importlib.abc
import importlib.machinery
import importlib.util
import sys
from collections.abc import Mapping

import numpy as np

SCALE = "_scaled_constant"  # name of `scaled` inside the module


def scaled(value, factor: float):
    """`value` times `factor`: a number, an array, or the entries of a tuple or a mapping.

    A whole number stays one, and at least 1.
    """
    if isinstance(value, Mapping):
        return {name: scaled(entry, factor) for name, entry in value.items()}
    if isinstance(value, tuple):
        return tuple(scaled(entry, factor) for entry in value)
    if isinstance(value, int):
        return max(1, round(value * factor))
    return np.asarray(value) * factor if isinstance(value, np.ndarray) else value * factor


def scale_constant(module: str, name: str, factor: float) -> None:
    """From now on `module` is imported with its constant `name` multiplied by `factor`.

    Raises ValueError if the module has been imported already: others may hold its old value.
    """
    if module in sys.modules:
        raise ValueError(f"{module}: imported before its constant {name} was scaled")
    sys.meta_path.insert(0, _Finder(module, name, factor))


class _Finder(importlib.abc.MetaPathFinder):
    def __init__(self, module: str, name: str, factor: float):
        self._module, self._name, self._factor = module, name, factor

    def find_spec(self, fullname, path, target=None):
        if fullname != self._module:
            return None
        spec = importlib.machinery.PathFinder.find_spec(fullname, path)
        loader = _Loader(fullname, spec.origin, self._name, self._factor)
        return importlib.util.spec_from_file_location(fullname, spec.origin, loader=loader)


class _Loader(importlib.machinery.SourceFileLoader):
    def __init__(self, module: str, path: str, name: str, factor: float):
        super().__init__(module, path)
        self._name, self._factor = name, factor

    def get_code(self, fullname):
        """The module's code, never from a cache."""
        path = self.get_filename(fullname)
        tree = ast.parse(self.get_data(path))
        assignments = [node for node in tree.body if self._name in _assigned(node)]
        if len(assignments) != 1:
            raise ValueError(f"{path}: assigns {self._name} {len(assignments)} times, not once")
        (node,) = assignments
        node.value = ast.Call(
            ast.Name(SCALE, ast.Load()), [node.value, ast.Constant(self._factor)], []
        )
        return compile(ast.fix_missing_locations(tree), path, "exec", dont_inherit=True)

    def exec_module(self, module):
        module.__dict__[SCALE] = scaled
        super().exec_module(module)


def _assigned(node: ast.stmt) -> set[str]:
    """Names that a statement assigns to."""
    targets = node.targets if isinstance(node, ast.Assign) else []
    if isinstance(node, ast.AnnAssign) and node.value is not None:
        targets = [node.target]
    return {each.id for t in targets for each in ast.walk(t) if isinstance(each, ast.Name)}
