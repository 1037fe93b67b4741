"""A hole in a tube's wall that nobody mentions: `explain`, against openwind's inversion."""

from __future__ import annotations

import contextlib
import io
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from openwind_tubes import (
    NOISE,
    NOMINAL_TEMPERATURE,
    Hole,
    Tube,
    air,
    impedance,
    with_noise,
    write_case,
)
from rippletwin.case.load import load_case
from rippletwin.explanation.explain import explain
from speed.result import Claim, Result, Table
from speed.timing import in_words

LENGTH, RADIUS = 0.2875, 2e-3  # m
HOLE, HOLE_RADIUS, HEIGHT = 0.1, 1.5e-3, 1.7e-3  # m, of the true tube
STARTS = (0.03, 0.07, 0.15, 0.2, 0.25)  # m, where the inversion is told that the hole may be
SECONDS_A_POINT = 10.0
EXPLAINED = "side_hole"


def measured(frequency_hz: np.ndarray, seed: int) -> np.ndarray:
    """Input impedance (F,) of the true tube over its characteristic one, with noise."""
    tube = Tube(LENGTH, RADIUS, (Hole(HOLE, HOLE_RADIUS, HEIGHT),))
    return with_noise(impedance(frequency_hz, tube), np.random.default_rng(seed))


def invert(frequency_hz: np.ndarray, start: float) -> tuple[float, float]:
    """Position (m) that openwind's inversion finds from `start`, and its processor seconds.

    It is told that there is one hole and how high its wall is; position and radius are free.
    """
    from openwind import InstrumentGeometry, InstrumentPhysics, Player
    from openwind.inversion import InverseFrequentialResponse

    target = 0.5 * (measured(frequency_hz, 1) + measured(frequency_hz, 2))
    geometry = InstrumentGeometry(
        [[0.0, LENGTH, RADIUS, RADIUS, "linear"]],
        [
            ["label", "position", "length", "radius"],
            ["hole", f"0.005<~{start}<{LENGTH - 0.005}", HEIGHT, f"2e-4<~1e-3<{0.95 * RADIUS}"],
        ],
    )
    begin = time.process_time()
    physics = InstrumentPhysics(
        geometry,
        NOMINAL_TEMPERATURE,
        Player(),
        losses=True,
        humidity=0.0,
        matching_volume=True,
        radiation_category="infinite_flanged",
    )
    inverse = InverseFrequentialResponse(physics, frequency_hz, [target])
    inverse.optimize_freq_model(max_iter=100)
    found = float(geometry.holes[0].position.get_value())
    return found, time.process_time() - begin


def run(quick: bool = False) -> Result:
    """Time and answer of both."""
    title, point = "Explaining", 7
    what = [
        f"An air tube of {1e3 * LENGTH:.0f} mm has a hole of {2e3 * HOLE_RADIUS:.0f} mm at "
        f"{1e3 * HOLE:.0f} mm; its impedance is calculated by openwind's finite elements, with "
        f"{100 * NOISE:.0f} % of noise. `explain` gets a data sheet without a hole and has its "
        "whole library to choose from. openwind's inversion is told that there is one hole, and "
        "fits its position and radius from a start.",
    ]
    if not find_spec("openwind"):
        claim = Claim("rippletwin explain, one point", None, SECONDS_A_POINT, "s", at_least=False)
        return Result(point, title, what, [claim], notes=["openwind is not installed."])
    frequency = np.linspace(100.0, 4000.0, 60 if quick else 391)
    with tempfile.TemporaryDirectory() as name, contextlib.redirect_stdout(io.StringIO()):
        folder = Path(name)
        runs = [measured(frequency, seed) for seed in (1, 2)]
        segment = {
            "length": LENGTH,
            "diameter": 2 * RADIUS * 1.01,
            "wave_speed": 1.002 * air()["c"],
        }
        write_case(folder, frequency, runs, segment)
        case = load_case(folder)
        begin = time.process_time()
        explanation = explain(case, processes=1)
        ours = time.process_time() - begin
        inverted = [invert(frequency, start) for start in (STARTS[:1] if quick else STARTS)]
    accepted = explanation.decision.accepted
    names = ", ".join(accepted.names).replace("_", " ")
    values = accepted.twin.values()
    position = next((v for k, v in values.items() if k == f"{EXPLAINED}@position.position"), None)
    seconds = np.array([each[1] for each in inverted])
    right = [abs(found - HOLE) < 0.01 * LENGTH for found, _ in inverted]
    rows = [
        [
            "rippletwin explain",
            "not told",
            in_words(ours),
            names,
            "none" if position is None else f"{1e3 * position:.1f} mm",
        ]
    ] + [
        [
            "openwind's inversion",
            f"{1e3 * start:.0f} mm",
            in_words(taken),
            "the hole that it is told",
            f"{1e3 * found:.1f} mm",
        ]
        for start, (found, taken) in zip(STARTS, inverted)
    ]
    return Result(
        point,
        title,
        what,
        claims=[
            Claim(
                "rippletwin explain, one point, one process", ours, SECONDS_A_POINT, "s",
                at_least=False, note="the target is for two processes",
            ),
            Claim(
                "error of the place that explain finds, of the tube's length",
                None if position is None else 100 * abs(position - HOLE) / LENGTH,
                1.0,
                "%",
                at_least=False,
            ),
            Claim("starts from which openwind's inversion finds the place",
                  100 * float(np.mean(right)), None, "%"),
            Claim("time of explain over that of one inversion", ours / float(np.median(seconds)),
                  None),
        ],
        tables=[
            Table("Hole in a tube", ["program", "start", "time", "what is found", "place"], rows)
        ],
    )  # fmt: skip
