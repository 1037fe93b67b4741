"""A lumped pump coupled to a pipe step by step in time, and what sensors read there."""

import numpy as np

from rippletwin.case.model import Fluid, Load, Rig, Segment, Sensor
from rippletwin.harmonics import peak_amplitudes
from rippletwin.pump.outlets import Pipe
from rippletwin.pump.simulation import simulate
from rippletwin.spectra.observation import Observation

OIL, LINE = Fluid(870.0, 3.2e-5), Segment(5.0, 0.02, 1200.0)
PUMP = {"pistons": 9, "bulk_modulus": 1.3e9}
PLACES, SPEED, LOAD = (0.5, 3.0), 1000.0, 9.5e6


def coupled(pump=PUMP, speed_rpm=SPEED, label="a"):
    """The rig of PUMP and what its sensors read where `pump` is coupled to the line."""
    rig = Rig(
        OIL,
        PUMP,
        (LINE,),
        tuple(Sensor(f"p{k}", x) for k, x in enumerate(PLACES, 1)),
        Load("orifice"),
    )
    truth = simulate(pump, OIL, speed_rpm, Pipe(LINE, PLACES, load_pressure=LOAD), min_steps=24576)
    orders = 9 * np.arange(1, 26)
    values = peak_amplitudes(truth.sensor_pressure)[:, orders]
    return rig, Observation(
        kind="periodic",
        label=label,
        frequency_hz=orders * speed_rpm / 60,
        orders=orders,
        values=values,
        covariance=np.tile(np.eye(2, dtype=complex), (len(orders), 1, 1)),
        mean=np.full(2, LOAD),
        speed_hz=speed_rpm / 60,
        load_pressure=LOAD,
        source="nominal",
        flow_ripple=None,
        sensors=rig.sensors,
    )
