"""The lumped pump coupled to a twin's line.

Independent truth: the pump coupled to its pipe step by step in time.
"""

from dataclasses import replace

import numpy as np

from coupled_pump import LOAD, OIL, PUMP, SPEED, coupled
from rippletwin.calibration.misfit import relative_misfit
from rippletwin.calibration.shaft_angles import find_best_turn
from rippletwin.case.model import FlowRipple
from rippletwin.pump.outlets import ConstantPressure
from rippletwin.pump.simulation import simulate
from rippletwin.twin.pump_line_coupling import couple_pump_to_line
from rippletwin.twin.twin import Twin


def misfit_after(twin, o, steps):
    """Misfit, the shaft angle free, of a twin with so many steps of coupling."""
    known = o
    for _ in range(steps):
        (known,) = couple_pump_to_line(twin, [known])
    predicted = twin.predict([known])[0]
    turn, _ = find_best_turn(np.sum(np.conj(predicted) * o.values, axis=0), o.orders)
    return relative_misfit(o.values, predicted * np.exp(1j * o.orders * turn))


def test_steps_of_coupling_remove_the_error_of_a_mean_admittance():
    """With the true line and pump the twin's ripple is wrong by some per cent. The outlet pressure
    of the first step is as wrong; four steps leave 0.2 %, although the readings have no harmonics
    above 4 kHz, to which the ports couple those below."""
    rig, o = coupled()
    twin = Twin(rig, [o])
    before, one, four = (misfit_after(twin, o, steps) for steps in (0, 1, 4))
    print(before, one, four)
    assert before > 0.03
    assert one < 0.2 * before
    assert four < 0.002


def test_the_coupled_pump_is_the_fitted_one():
    """Two numbers of the pump are two standard deviations from the data sheet. Their parabolas and
    the mean admittance are wrong by some per cent; four steps of coupling leave 0.3 %."""
    off = {"bulk_modulus": -2.0, "discharge_coefficient": 2.0}
    rig, o = coupled()
    twin = Twin(rig, [o], uncertain_pump=True)
    theta = twin.theta.copy()
    for name, u in off.items():
        theta[twin.index[name]] = u
    twin = twin.with_(theta=theta)
    _, o = coupled({k: v for k, v in twin.fitted_pump().items() if k in PUMP or k in off})
    before, four = misfit_after(twin, o, 0), misfit_after(twin, o, 4)
    print(before, four)
    assert before > 0.05
    assert four < 0.003


def test_a_turned_shaft_changes_nothing():
    """The coupled ripple is in the pump's own angle: that of a recording which begins at another
    shaft angle is the same."""
    rig, o = coupled()
    twin = Twin(rig, [o])
    theta = twin.theta.copy()
    theta[twin.index["angle[a]"]] = 12.0
    (here,), (there,) = (
        couple_pump_to_line(twin, [o]),
        couple_pump_to_line(twin.with_(theta=theta), [o]),
    )
    np.testing.assert_allclose(
        here.flow_ripple.flow, there.flow_ripple.flow, atol=1e-6 * here.flow_ripple.flow.mean()
    )


def test_a_slow_shaft_is_coupled_as_far_as_the_ripple_resolves():
    """At 300 r/min harmonics to 4 kHz are shaft orders to 792. Twice that is more than the 1535
    orders of a ripple of 3072 samples. The coupled ripple is within 0.1 % of its range that of
    harmonics to order 765, whose double is resolved."""
    rig, o = coupled()

    def source(highest):
        orders = np.arange(9, highest + 1, 9)
        slow = replace(o, speed_hz=5.0, orders=orders, frequency_hz=5.0 * orders)
        (found,) = couple_pump_to_line(Twin(rig, [slow]), [slow])
        return found.flow_ripple.flow

    wide, narrow = source(792), source(765)
    np.testing.assert_allclose(wide, narrow, atol=1e-3 * np.ptp(narrow))


def test_a_given_ripple_is_an_ideal_source():
    """A ripple from a file has no pump to couple."""
    rig, o = coupled()
    simulated = simulate(PUMP, OIL, SPEED, ConstantPressure(LOAD))
    o = replace(o, flow_ripple=FlowRipple(simulated.angle_deg, simulated.flow))
    assert couple_pump_to_line(Twin(rig, [o]), [o]) is None
