"""The paper's line as the tests of both line solvers use it."""

import numpy as np

from paper_rig import OIL, SEGMENTS
from rippletwin.harmonics import one_period
from rippletwin.line.frequency_domain.line_network import FrequencyDomainLine
from rippletwin.line.frequency_domain.pipe_immittance import series_impedance, shunt_admittance
from rippletwin.line.time_domain.line_elements import Pipe

DENSITY, VISCOSITY = OIL.density, OIL.kinematic_viscosity
PIPES = tuple(Pipe(s.length, s.diameter, s.wave_speed) for s in SEGMENTS)
MEAN_PRESSURE, MEAN_FLOW, PUMPING_HZ = 9.484e6, 0.7e-3, 150.0
COEFFICIENT = MEAN_FLOW / np.sqrt(MEAN_PRESSURE)


def immittances(s, pipes=PIPES, friction="unsteady", viscosity=VISCOSITY):
    """Series and shunt (n, F) of the pipes, walls as they are."""
    series = [
        series_impedance(
            s, density=DENSITY, viscosity=viscosity, diameter=p.diameter, friction=friction
        )
        for p in pipes
    ]
    shunt = [
        shunt_admittance(s, density=DENSITY, wave_speed=p.wave_speed, diameter=p.diameter)
        * p.yielding(s)
        for p in pipes
    ]
    return np.array(series), np.array(shunt)


def network(s, pipes=PIPES, friction="unsteady", viscosity=VISCOSITY, **options):
    series, shunt = immittances(s, pipes, friction, viscosity)
    lengths = np.array([p.length for p in pipes])
    return FrequencyDomainLine(s=s, lengths=lengths, series=series, shunt=shunt, **options)


def ripple(orders, mean=MEAN_FLOW, depth=0.05, corner_hz=1000.0, base_hz=PUMPING_HZ):
    """A pump-like flow ripple: peak amplitudes (F,) at `orders`, falling as 1/f^2 above a corner.

    depth 0.05 is about 0.26 MPa rms at the first sensor of the paper's pipe.
    """
    k = np.asarray(orders)
    return depth * mean * np.exp(1j * k) / (1 + 1j * k * base_hz / corner_hz) ** 2


def samples(harmonics, orders, mean, count):
    """One period (count,) from peak amplitudes at whole orders."""
    return mean + one_period(harmonics, count, orders)


def misfit(a, b):
    """Norm of the difference over that of b."""
    return np.linalg.norm(a - b) / np.linalg.norm(b)
