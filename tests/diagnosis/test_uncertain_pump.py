"""Flow of pumps about the fitted one against pumps that really have those numbers, simulated."""

from dataclasses import replace

import numpy as np
import pytest

import leaking_pump
from rippletwin.diagnosis.faults.library import FAULTS
from rippletwin.diagnosis.pump_flow import (
    NUMBERS,
    STEPS,
    TIMING_SD_DEG,
    UNCERTAIN,
    simulate_leak_flow,
    with_fitted_pump,
)
from rippletwin.diagnosis.uncertain_pump import SDS, UncertainPump, number_slopes
from rippletwin.harmonics import peak_amplitudes
from rippletwin.pump.faults import Slipper
from rippletwin.pump.geometry import Geometry
from rippletwin.pump.outlets import ConstantPressure
from rippletwin.pump.ripple_sensitivity import KEYS
from rippletwin.pump.simulation import simulate
from rippletwin.twin.twin import Twin

ORDERS, AREA = np.arange(1, 181), 4e-7
POINT = leaking_pump.OIL, leaking_pump.SPEED, leaking_pump.LOAD
PISTONS_ORDERS = ORDERS % leaking_pump.PISTONS == 0
SHEET = leaking_pump.SHEET


def simulated(pump, fault=None):
    """Flow at ORDERS of a fresh simulation."""
    outlet = ConstantPressure(leaking_pump.LOAD)
    run = simulate(pump, leaking_pump.OIL, leaking_pump.SPEED, outlet, fault, min_steps=STEPS)
    return peak_amplitudes(run.flow)[ORDERS]


def moved_by(name, z):
    """The pump of the data sheet with a number moved by z standard deviations, and the turn of its
    port plate at ORDERS."""
    sheet = Geometry.from_dict(SHEET)
    if name in UNCERTAIN:
        return SHEET | {name: getattr(sheet, name) * (1 + z * UNCERTAIN[name])}, 1.0
    turn = np.exp(1j * ORDERS * np.radians(z * TIMING_SD_DEG))
    return SHEET | {name: sheet.port_timing_deg + z * TIMING_SD_DEG}, turn


@pytest.mark.parametrize(
    ("name", "z"),
    [
        ("dead_volume", -1.0),
        ("bulk_modulus", -1.0),
        ("port_area", -0.5),
        ("port_timing_deg", -1.0),
        ("port_opening_deg", 1.0),
    ],
)
def test_a_drawn_number_is_what_a_pump_with_it_makes(name, z):
    """Mostly on the other side of the pump than the simulations behind the slopes: the healthy
    ripple to a third of what the number changes in it; the change by a leak that is no node to
    1.5 % of itself, and nearer than the change of the pump that was not moved."""
    flows = UncertainPump(SHEET, *POINT, ORDERS)
    numbers = z * np.equal(NUMBERS, name)
    pump, turn = moved_by(name, z)
    healthy, nominal = simulated(pump), simulated(SHEET)
    found, truth = flows.healthy(numbers), healthy * turn
    own = PISTONS_ORDERS
    moved = np.linalg.norm((truth - nominal)[own])
    assert moved > 0.05 * np.linalg.norm(nominal[own])
    assert np.linalg.norm((found - truth)[own]) < moved / 3
    leak = simulate_leak_flow(SHEET, *POINT, FAULTS["slipper"])
    change = (simulated(pump, Slipper(AREA)) - healthy) * turn
    left = np.linalg.norm(flows.change(leak, AREA, numbers) - change)
    still = np.linalg.norm(flows.change(leak, AREA, 0 * numbers) - change)
    assert left < 0.015 * np.linalg.norm(change) and left < still


def test_slopes_are_those_of_the_fitted_pump():
    """Each parameter of a twin moved by a little: the pump that the diagnosis fits has moved by
    what the slopes say, a discharge coefficient as the ports' area; none moves the line."""
    observation = leaking_pump.record("a")
    twin = Twin(leaking_pump.rig(), [observation], uncertain_pump=True)
    slopes, step, told = number_slopes(twin), 1e-5, set()
    for k, parameter in enumerate(twin.parameters):
        theta = twin.theta + step * np.eye(len(twin.theta))[k]
        found = []
        for each in (twin, twin.with_(theta=theta)):
            sheet = Geometry.from_dict(with_fitted_pump(each).rig.pump)
            found.append(np.array([getattr(sheet, name) for name in NUMBERS]))
        sds = np.array([SDS[name] * (found[0][j] if name in UNCERTAIN else 1.0)
                        for j, name in enumerate(NUMBERS)])  # fmt: skip
        expected = np.divide(found[1] - found[0], sds, out=np.zeros(len(sds)), where=sds != 0)
        np.testing.assert_allclose(slopes[:, k], expected / step, atol=1e-3)
        told |= {name for name, slope in zip(NUMBERS, slopes[:, k]) if slope}
        assert parameter.place == "pump" or not slopes[:, k].any()
    assert told >= {"bulk_modulus", "dead_volume", "port_area", "port_timing_deg"}


def test_numbers_that_the_sheet_leaves_out_come_in_one_order():
    """That of the parameters: twin.json has the same bytes whatever the order of sets, which
    differs from one process to the next."""
    twin = Twin(leaking_pump.rig(), [leaking_pump.record("a")], uncertain_pump=True)
    fitted = [KEYS[p.name] for p in twin.parameters if p.place == "pump"]
    added = [key for key in fitted if key not in SHEET]
    assert len(added) > 4
    assert list(twin.fitted_pump()) == [*SHEET, *added]


def test_a_twin_without_numbers_of_a_pump_has_no_slopes():
    """What it draws of them is then the data sheet's tolerance, see `SignalSource`."""
    twin = Twin(replace(leaking_pump.rig(), pump=dict(SHEET)))
    assert not number_slopes(twin).any()
