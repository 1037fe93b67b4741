"""The lumped pump coupled to a twin's line.

Independent truth: the pump coupled to its pipe step by step in time.
"""

import numpy as np

from rippletwin.calibration.misfit import relative_misfit
from rippletwin.case.model import Fluid, Load, Rig, Segment, Sensor
from rippletwin.harmonics import peak_amplitudes
from rippletwin.pump.outlets import Pipe
from rippletwin.pump.simulation import simulate
from rippletwin.spectra.observation import Observation
from rippletwin.twin.pump_line_coupling import couple_pump_to_line
from rippletwin.twin.twin import Twin

OIL, LINE = Fluid(870.0, 3.2e-5), Segment(5.0, 0.02, 1200.0)
PUMP = {"pistons": 9, "bulk_modulus": 1.3e9}
PLACES, SPEED, LOAD = (0.5, 3.0), 1000.0, 9.5e6


def coupled():
    """A rig and what its sensors read where the pump is coupled to the line."""
    rig = Rig(
        OIL,
        PUMP,
        (LINE,),
        tuple(Sensor(f"p{k}", x) for k, x in enumerate(PLACES, 1)),
        Load("orifice"),
    )
    truth = simulate(PUMP, OIL, SPEED, Pipe(LINE, PLACES, load_pressure=LOAD))
    orders = 9 * np.arange(1, 26)
    values = peak_amplitudes(truth.sensor_pressure)[:, orders]
    return rig, Observation(
        kind="periodic",
        label="a",
        frequency_hz=orders * SPEED / 60,
        orders=orders,
        values=values,
        covariance=np.tile(np.eye(2, dtype=complex), (len(orders), 1, 1)),
        mean=np.full(2, LOAD),
        speed_hz=SPEED / 60,
        load_pressure=LOAD,
        source="nominal",
        flow_ripple=None,
        sensors=rig.sensors,
    )


def test_coupling_removes_most_of_the_error_of_a_mean_admittance():
    """With the true line and pump the twin's ripple is wrong by some per cent; coupled, by little
    more than half of that, although the outlet pressure it uses was as wrong."""
    rig, o = coupled()
    twin = Twin(rig, [o])
    before = relative_misfit(o.values, twin.predict([o])[0])
    (known,) = couple_pump_to_line(twin, [o])
    after = relative_misfit(o.values, twin.predict([known])[0])
    print(f"{before:.2%} {after:.2%}")
    assert before > 0.03
    assert after < 0.6 * before


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


def test_a_given_ripple_is_an_ideal_source():
    """A ripple from a file has no pump to couple."""
    rig, o = coupled()
    (known,) = couple_pump_to_line(Twin(rig, [o]), [o])
    assert couple_pump_to_line(Twin(rig, [known]), [known]) is None
