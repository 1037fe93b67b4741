"""Universal file format, data sets 58: one function of time a sensor, Pa.

A channel is called as the first line of its data set's identification (id1). Numbers count the
functions of time in the order of the file.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyuff

from rippletwin.case.readers.file_checks import check_size, refuse_damaged
from rippletwin.case.readers.layout import Layout, choose
from rippletwin.case.readers.signals import Signals, numbers
from rippletwin.errors import InputError

FUNCTION, TIME_RESPONSES = 58, (0, 1)  # data set; general or time response
BYTES_PER_VALUE = 4
SAME_STEP = 1e-6  # relative


def read(path: Path, layout: Layout) -> Signals:
    """Read a recording from a universal file; raises InputError."""
    check_size(path, "file", path.stat().st_size // BYTES_PER_VALUE)
    guess = "is cut short or no universal file"
    with refuse_damaged(path, guess, "Export it again, as data sets 58"):
        file = pyuff.UFF(str(path))
        heads = {
            k: file.read_sets(k, header_only=True)
            for k, kind in enumerate(file.get_set_types())
            if kind == FUNCTION
        }
        functions = [k for k, head in heads.items() if head["func_type"] in TIME_RESPONSES]
        if not functions:
            raise ValueError("it has no data set 58 with a function of time")
        names = [str(heads[k]["id1"]).strip() for k in functions]
        sets = [file.read_sets(functions[k]) for k in choose(path, layout, names)]
    rows = [numbers(path, s, one["data"]) for s, one in zip(layout.sensors, sets)]
    lengths = sorted({row.size for row in rows})
    if len(lengths) > 1 or not lengths[0]:
        problem = f"{lengths} samples" if len(lengths) == 1 else f"lengths {lengths} differ"
        raise InputError(path, "file", problem, "Record the sensors together")
    return Signals(pressure=np.array(rows), **_time_axis(path, sets))


def _time_axis(path: Path, sets: list[dict]) -> dict:
    """The sampling rate of evenly spaced functions, or the times of others."""
    if not all(one["abscissa_spacing"] == 1 for one in sets):
        return {"time_s": np.asarray(sets[0]["x"], float)}
    steps = [float(one["abscissa_inc"]) for one in sets]
    if max(steps) - min(steps) > SAME_STEP * max(steps):
        problem = f"the time step differs between sensors: {steps}"
        raise InputError(path, "abscissa_inc", problem, "Record them together")
    if not steps[0] > 0:
        raise InputError(path, "abscissa_inc", f"{steps[0]:g} s", "Give a positive time step")
    return {"sampling_rate_hz": 1 / steps[0]}
