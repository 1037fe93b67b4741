"""What a leak changes in the flow of the pump.

Independent truth: the pump simulated with the very leak.
"""

from dataclasses import replace

import numpy as np
import pytest

from rippletwin.case.model import Fluid, Load, Rig, Segment, Sensor
from rippletwin.diagnosis import pump_flow
from rippletwin.diagnosis.faults.library import FAULTS
from rippletwin.diagnosis.pump_flow import (
    NUMBERS,
    STEPS,
    TIMING_SD_DEG,
    UNCERTAIN,
    simulate_leak_flow,
    with_fitted_pump,
)
from rippletwin.harmonics import peak_amplitudes
from rippletwin.pump.faults import Cylinder, Slipper
from rippletwin.pump.geometry import Geometry
from rippletwin.pump.outlets import ConstantPressure
from rippletwin.pump.simulation import simulate
from rippletwin.twin.twin import Twin

OIL, PUMP = Fluid(870.0, 3.2e-5), {"pistons": 9, "discharge_coefficient": 0.65}
SPEED, PRESSURE = 1000.0, 9.5e6
ORDERS = np.arange(200)


def simulated(pump, fault=None):
    run = simulate(pump, OIL, SPEED, ConstantPressure(PRESSURE), fault, min_steps=STEPS)
    return peak_amplitudes(run.flow)[ORDERS]


def test_what_is_uncertain_of_the_pump_leaves_the_size_of_a_leak_alone():
    """At a constant pressure a leak's flow follows from its own area and discharge coefficient: a
    pump moved by a standard deviation of any number loses as much mean flow to it, to 2 %."""
    leak, area = simulate_leak_flow(PUMP, OIL, SPEED, PRESSURE, FAULTS["slipper"]), 4e-7
    lost = -leak.harmonics(area)[0].real
    assert lost > 0.0
    assert np.all(np.abs(leak.pump_slopes(area)[:, 0].real) < 0.02 * lost)


@pytest.mark.parametrize(("name", "fault"), [("slipper", Slipper), ("cylinder", Cylinder)])
def test_areas_between_the_simulated_ones_are_right(name, fault):
    """Small, middling and large leaks that are no nodes: within 2 % of the change, half of
    what the best of twins errs by."""
    flow = simulate_leak_flow(PUMP, OIL, SPEED, PRESSURE, FAULTS[name])
    healthy = simulated(PUMP)
    for area in (3.1e-8, 4.4e-7, 3.3e-6):
        truth = simulated(PUMP, fault(area)) - healthy
        found = flow.harmonics(area)[ORDERS]
        assert np.linalg.norm(found - truth) < 0.02 * np.linalg.norm(truth)


def test_slopes_are_what_another_pump_makes():
    """A dead volume larger by a standard deviation, at a leak that is no node: the change of the
    change to a quarter, and it is not small."""
    area, moved = (
        4e-7,
        PUMP | {"dead_volume": Geometry.dead_volume * (1 + UNCERTAIN["dead_volume"])},
    )
    changes = [simulated(pump, Slipper(area)) - simulated(pump) for pump in (PUMP, moved)]
    truth = changes[1] - changes[0]
    slopes = simulate_leak_flow(PUMP, OIL, SPEED, PRESSURE, FAULTS["slipper"]).pump_slopes(area)
    found = slopes[list(UNCERTAIN).index("dead_volume")][ORDERS]
    assert np.linalg.norm(found - truth) < 0.25 * np.linalg.norm(truth)
    assert np.linalg.norm(truth) > 0.005 * np.linalg.norm(changes[0])


def test_the_slope_of_the_timing_is_told_as_the_port_plate_stands():
    """A plate half a degree late: what it makes of a leak's change beside turning it, as it turns
    the healthy flow; to a quarter. The turn alone would be several times as much."""
    area, late = 4e-7, PUMP | {"port_timing_deg": TIMING_SD_DEG}
    nominal, moved = (simulated(pump, Slipper(area)) - simulated(pump) for pump in (PUMP, late))
    truth = moved * np.exp(1j * np.radians(TIMING_SD_DEG) * ORDERS) - nominal
    slopes = simulate_leak_flow(PUMP, OIL, SPEED, PRESSURE, FAULTS["slipper"]).pump_slopes(area)
    found = slopes[NUMBERS.index("port_timing_deg")][ORDERS]
    assert np.linalg.norm(found - truth) < 0.25 * np.linalg.norm(truth)
    assert np.linalg.norm(truth) < 0.5 * np.linalg.norm(moved - nominal)


def test_slopes_of_a_port_that_opens_slowly_are_there():
    """A port that opens over 80 degrees, and over 92 when its opening is a standard deviation
    longer, never opens wholly then. The slope is what that pump makes, to a quarter."""
    area, slow = 4e-7, PUMP | {"port_opening_deg": 80.0}
    slower = slow | {"port_opening_deg": 80.0 * (1 + UNCERTAIN["port_opening_deg"])}
    changes = [simulated(pump, Slipper(area)) - simulated(pump) for pump in (slow, slower)]
    truth = changes[1] - changes[0]
    slopes = simulate_leak_flow(slow, OIL, SPEED, PRESSURE, FAULTS["slipper"]).pump_slopes(area)
    found = slopes[list(UNCERTAIN).index("port_opening_deg")][ORDERS]
    assert np.linalg.norm(found - truth) < 0.25 * np.linalg.norm(truth)


def test_a_leak_has_a_discharge_coefficient_of_its_own_where_the_sheet_has_none():
    """An area at 0.7 stands for as much leak as a larger one of a pump with a stated 0.65."""
    flow = simulate_leak_flow({"pistons": 9}, OIL, SPEED, PRESSURE, FAULTS["slipper"])
    truth = simulated(PUMP, Slipper(4e-7 * 0.7 / 0.65)) - simulated(PUMP)
    assert np.linalg.norm(flow.harmonics(4e-7)[ORDERS] - truth) < 0.01 * np.linalg.norm(truth)


def _twin(pump):
    rig = Rig(OIL, pump, (Segment(5.0, 0.02, 1200.0),), (Sensor("p1", 0.5),), Load("orifice"))
    return Twin(rig)


def test_a_pump_known_by_its_pistons_alone_delivers_the_ripple_s_mean_flow():
    """Eight times the flow of the default pump: twice its lengths, so that areas grow fourfold and
    volumes eightfold."""
    default = Geometry.from_dict({"pistons": 9})
    flow = 8.0 * default.displacement * 20.0
    twin = _twin({"pistons": 9})
    rig = replace(twin.rig, displacement=flow / 20.0)  # as recordings with a flow ripple tell it
    for scaled in (with_fitted_pump(twin, flow / 20.0), with_fitted_pump(Twin(rig))):
        found = Geometry.from_dict(scaled.rig.pump)
        assert found.displacement * 20.0 == pytest.approx(flow)
        for name, growth in (("pitch_radius", 2), ("port_area", 4), ("dead_volume", 8)):
            assert getattr(found, name) == pytest.approx(growth * getattr(default, name))


def test_runs_of_leaking_pumps_are_not_kept():
    """A pump at many operating points: of each only the healthy runs and the leak's flow stay."""
    pump_flow._simulated.cache_clear()
    simulate_leak_flow(PUMP, OIL, 1010.0, 9.1e6, FAULTS["slipper"])
    assert pump_flow._simulated.cache_info().currsize == 1 + len(pump_flow.NUMBERS)
    assert pump_flow._leak_flow.cache_info().maxsize


def test_a_pump_of_known_geometry_is_left_as_it_is():
    """A ripple's mean flow does not overrule the data sheet."""
    assert with_fitted_pump(_twin(dict(PUMP)), 0.05).rig.pump == PUMP
