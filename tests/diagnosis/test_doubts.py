"""Numbers that cannot be trusted are told: in diagnosis.json, and so on the page."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

import leaking_pump
from rippletwin.calibration.laplace import UNCONVERGED_GAIN
from rippletwin.diagnosis import pump_flow
from rippletwin.diagnosis.doubts import find_doubts
from rippletwin.diagnosis.faults.library import FAULTS
from rippletwin.diagnosis.integration import Density


def diagnosis(log_density, periodic=True, expected_gain=0.0):
    """Of one slipper, with the log density of its leak area on a grid."""
    return SimpleNamespace(
        model=SimpleNamespace(flows={"slipper": SimpleNamespace(periodic=periodic)}),
        severities={"slipper": None},
        expected_gain=expected_gain,
        best=SimpleNamespace(cut_off={"slipper": Density(GRID, log_density).cut_off}),
    )


GRID = np.linspace(-1.0, 1.0, 41)


@pytest.mark.parametrize(
    ("middle", "width", "words"),
    [
        (0.0, 0.2, []),
        (0.95, 0.2, ["larger than any that was tried"]),
        (-0.95, 0.2, ["smaller than any that was tried"]),
        (0.0, 2.0, ["smaller than", "larger than"]),
    ],
    ids=["inside", "at the upper end", "at the lower end", "everywhere"],
)
def test_a_leak_at_the_end_of_what_was_tried(middle, width, words):
    """A posterior that the grid cuts off says so; one that ends within it says nothing."""
    found = find_doubts(diagnosis(-0.5 * ((GRID - middle) / width) ** 2))
    assert len(found) == len(words)
    assert all(word in text for word, text in zip(words, found))


def test_a_fit_of_the_pump_that_did_not_converge():
    """A step that promises more than decides between explanations is a doubt, with its size."""
    inside = -8.0 * GRID**2
    assert not find_doubts(diagnosis(inside, expected_gain=0.9 * UNCONVERGED_GAIN))
    (told,) = find_doubts(diagnosis(inside, expected_gain=7.24))
    assert "did not converge" in told and "promises 7.2 of log posterior" in told


def test_a_pump_that_does_not_become_periodic(monkeypatch):
    """One simulation of a leak that stops before it repeats itself marks the fault's flows, and
    with them the diagnosis."""
    for kept in (pump_flow._simulated, pump_flow._leak_flow):
        kept.cache_clear()
    simulate = pump_flow.simulate
    done = []

    def cut_short(*arguments, **options):
        done.append(simulate(*arguments, **options))
        return replace(done[-1], converged=len(done) != 3)

    monkeypatch.setattr(pump_flow, "simulate", cut_short)
    point = leaking_pump.SHEET, leaking_pump.OIL, leaking_pump.SPEED, leaking_pump.LOAD
    flow = pump_flow.simulate_leak_flow(*point, FAULTS["slipper"])
    for kept in (pump_flow._simulated, pump_flow._leak_flow):
        kept.cache_clear()
    assert len(done) > 3 and all(run.converged for run in done) and not flow.periodic
    assert "periodic" in find_doubts(diagnosis(-8.0 * GRID**2, flow.periodic))[0]
