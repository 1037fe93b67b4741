"""Constants of the tool, halved and doubled by `benchmarks/constants.py`."""

import subprocess
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from constants import CONSTANTS
from scaled_constants import scale_constant, scaled

BENCHMARKS = Path(__file__).parents[2] / "benchmarks"


@pytest.mark.parametrize(("module", "name"), CONSTANTS.values())
def test_every_constant_exists_and_can_be_scaled(module, name):
    """Proves that the table does not name a constant that has been renamed or moved."""
    value = getattr(import_module(f"rippletwin.{module}"), name)
    assert scaled(value, 1.0) is not None
    assert repr(scaled(value, 2.0)) != repr(value)


def test_constants_derived_from_a_scaled_one_follow():
    """Proves that other modules see the scaled value, and so does what is derived from it."""
    code = (
        f"import sys; sys.path.insert(0, {str(BENCHMARKS)!r})\n"
        "from scaled_constants import scale_constant\n"
        "scale_constant('rippletwin.explanation.thresholds', 'LITTLE_MODEL_ERROR', 0.5)\n"
        "from rippletwin.explanation.thresholds import GOOD_MODEL_ERROR\n"
        "from rippletwin.explanation.checks import alarms\n"
        "print(GOOD_MODEL_ERROR, alarms.LITTLE_MODEL_ERROR, alarms.HALVES_MODEL_ERROR)"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert [float(word) for word in run.stdout.split()] == pytest.approx([0.0025, 0.002, 0.001])


def test_a_module_that_is_imported_already_is_refused():
    """Proves that a setting cannot be lost silently."""
    with pytest.raises(ValueError, match=r"error_sizes: imported before"):
        scale_constant("rippletwin.calibration.error_sizes", "MIN_MODEL_ERROR", 2.0)


def test_all_kinds_of_constants_are_scaled():
    """Proves that whole numbers stay whole and positive, and that tables are scaled by entry."""
    assert scaled(3, 0.1) == 1
    assert scaled(8, 0.5) == 4 and isinstance(scaled(8, 0.5), int)
    assert scaled((0.03, 0.01), 2.0) == (0.06, 0.02)
    assert scaled({"a": 0.5, "b": (1.0,)}, 2.0) == {"a": 1.0, "b": (2.0,)}
    np.testing.assert_allclose(scaled(np.array([1.0, 2.0]), 0.5), [0.5, 1.0])
