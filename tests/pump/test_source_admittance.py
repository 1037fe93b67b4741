"""The pump as a source with an admittance, against the pump coupled to a pipe."""

import numpy as np

from default_pump import LOAD, OIL, PIPE, POSITIONS, SPEED
from rippletwin.harmonics import peak_amplitudes
from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine
from rippletwin.line.frequency_domain.pipe_immittance import series_impedance, shunt_admittance
from rippletwin.pump.geometry import Geometry
from rippletwin.pump.outlets import ConstantPressure, Pipe
from rippletwin.pump.simulation import simulate
from rippletwin.pump.source_admittance import source_admittance


def network(free, orders, admittance, load):
    """The pipe, driven at shaft `orders` by the flow of `free` beside `admittance`, into `load`."""
    s = 2j * np.pi * orders * SPEED / 60
    return FrequencyDomainLine(
        s=s,
        lengths=np.array([PIPE.length]),
        series=series_impedance(
            s, density=OIL.density, viscosity=OIL.kinematic_viscosity,
            diameter=PIPE.diameter, friction="steady",
        )[None],
        shunt=shunt_admittance(
            s, density=OIL.density, wave_speed=PIPE.wave_speed, diameter=PIPE.diameter
        )[None],
        source_flow=peak_amplitudes(free.flow)[orders],
        source_admittance=admittance,
        load=("admittance", load),
        sensor_positions=np.array(POSITIONS),
    )  # fmt: skip


def test_norton_source_drives_a_line_as_the_coupled_pump_does(piped):
    """Flow into a constant pressure and mean chamber compliance stand in for the coupled pump.

    Independent truth: the pump coupled to the pipe step by step in time. The source drives the
    same pipe in the frequency domain; without its admittance the pressure would be off by a
    quarter at the lowest harmonics and by more than itself overall.
    """
    free = simulate({}, OIL, SPEED, ConstantPressure(piped.outlet_pressure.mean()))
    orders = 9 * np.arange(1, 28)
    s = 2j * np.pi * orders * SPEED / 60
    truth = peak_amplitudes(piped.sensor_pressure)[:, orders]

    def error(admittance, count):
        line = network(free, orders, admittance, piped.flow.mean() / (2 * LOAD))
        difference = (line.readings() - truth)[:, :count]
        return np.linalg.norm(difference) / np.linalg.norm(truth[:, :count])

    assert error(free.source_admittance(s), 5) < 0.05
    assert error(free.source_admittance(s), 27) < 0.2
    assert error(0.0, 27) > 1.0


def test_air_in_the_chambers_yields_too():
    """At 2 MPa 2 % of air is a third of the chambers' compliance. Independent truth as above: with
    it the pressures at the lowest harmonics are right to 15 %, without it twice as wrong."""
    pump, load = {"air_fraction": 0.02}, 2e6
    piped = simulate(pump, OIL, SPEED, Pipe(PIPE, POSITIONS, load_pressure=load))
    free = simulate(pump, OIL, SPEED, ConstantPressure(piped.outlet_pressure.mean()))
    orders = 9 * np.arange(1, 6)
    s = 2j * np.pi * orders * SPEED / 60
    truth = peak_amplitudes(piped.sensor_pressure)[:, orders]
    off = []
    for fraction in (0.02, 0.0):
        geometry = Geometry.from_dict({"air_fraction": fraction})
        admittance = source_admittance(
            geometry, OIL.density, free.pressure_mean, free.chamber_pressure, s
        )
        readings = network(free, orders, admittance, piped.flow.mean() / (2 * load)).readings()
        off.append(np.linalg.norm(readings - truth) / np.linalg.norm(truth))
    assert off[0] < 0.15 and off[1] > 1.7 * off[0]
