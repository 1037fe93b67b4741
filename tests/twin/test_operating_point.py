"""The mean pressure before the load, from what was set and what the sensors read."""

from dataclasses import replace

import numpy as np
import pytest

from paper_rig import paper_rig
from rippletwin.case.model import Fluid
from rippletwin.errors import InputError
from rippletwin.twin.operating_point import operating_point
from rippletwin.twin.twin import Twin
from synthetic_recordings import point

RIG = replace(paper_rig(), fluid=Fluid(870.0, 6e-5))


def falls(flow):
    """Hagen-Poiseuille from each sensor to the load, Pa; written out, segment by segment."""
    ends = np.cumsum([s.length for s in RIG.line])
    lost = []
    for sensor in RIG.sensors:
        behind = np.clip(ends - sensor.position, 0.0, [s.length for s in RIG.line])
        per_metre = [128 * 870.0 * 6e-5 * flow / (np.pi * s.diameter**4) for s in RIG.line]
        lost.append(behind @ per_metre)
    return np.array(lost)


def estimate(load_pressure, means):
    """The load pressure of an observation that states `load_pressure`."""
    o = replace(point(RIG), load_pressure=load_pressure, mean=np.asarray(means, float))
    return operating_point(RIG, o, o.flow_ripple)


FLOW = float(np.mean(point(RIG).flow_ripple.flow))


@pytest.mark.parametrize("thicker", (0.85, 1.0, 1.2))
def test_the_sensors_correct_what_was_set(thicker):
    """Analytic: means that fall to 9.5 MPa, in oil that may be thicker than stated; 0.4 % too much
    was stated. The estimate is within 0.2 %."""
    means = 9.5e6 + thicker * falls(FLOW)
    assert (means[0] - means[-1]) / 9.5e6 > 0.004  # or the fall would not matter
    found = estimate(1.004 * 9.5e6, means)
    assert found.load_pressure == pytest.approx(9.5e6, rel=2e-3)
    assert found.coefficient * np.sqrt(found.load_pressure) == pytest.approx(FLOW, rel=1e-6)


def test_a_sensor_with_a_gain_error_is_outvoted():
    """One of three reads 5 % too much; the average would be 1.7 % off, this is within 0.1 %."""
    means = (9.5e6 + falls(FLOW)) * [1.0, 1.05, 1.0]
    assert estimate(9.5e6, means).load_pressure == pytest.approx(9.5e6, rel=1e-3)


def test_sensors_without_a_mean_are_ignored():
    """AC-coupled, or with an offset instead of a mean: the stated pressure is used."""
    assert estimate(9.5e6, [0.0, 2e4, -3e4]).load_pressure == 9.5e6


def test_a_spectrum_s_pressure_is_as_stated():
    """Its sensors have no means: an observation of one has the stated pressure in their place,
    which corrects nothing."""
    o = replace(
        point(RIG), kind="spectrum", source="free", flow_ripple=None, mean=np.full(3, 9.5e6)
    )
    assert operating_point(RIG, o, None).load_pressure == 9.5e6


def test_the_load_of_an_input_impedance_is_guessed():
    """Nothing tells the mean flow through an orifice behind a measured impedance, so that its prior
    is as wide as behind a free source."""
    o = replace(point(RIG), kind="input_impedance", flow_ripple=None, orders=None, sensors=())
    priors = [
        Twin(RIG, [replace(o, source=source)]).parameters[-1].prior for source in ("known", "free")
    ]
    assert priors[0] == priors[1]
    assert priors[0].scale > 10 * RIG.uncertainty.load


def test_no_mean_is_no_error_where_one_is_stated():
    o = replace(point(RIG), mean=None)
    assert operating_point(RIG, o, o.flow_ripple).load_pressure == o.load_pressure


def test_without_a_stated_pressure_the_sensor_nearest_the_load_tells_it():
    """Whatever the order of the sensors in the data sheet."""
    means = 9.5e6 + falls(FLOW)
    for order in ([0, 1, 2], [2, 0, 1]):
        rig = replace(RIG, sensors=tuple(RIG.sensors[k] for k in order))
        o = replace(point(rig), load_pressure=None, mean=means[order])
        nearest = np.argmax([sensor.position for sensor in RIG.sensors])
        assert operating_point(rig, o, o.flow_ripple).load_pressure == means[nearest]


def test_a_pump_that_delivers_nothing_is_refused():
    """Ports of 1 mm2 at 3000 r/min: the mean flow would be negative, and the orifice with it."""
    rig = replace(RIG, pump={"pistons": 9, "piston_diameter": 0.017, "port_area": 1e-6})
    o = replace(point(rig, speed_rpm=3000.0), flow_ripple=None)
    with pytest.raises(InputError, match="delivers nothing") as refused:
        Twin(rig, [o]).operating_point(o)
    assert "rig.yaml" in str(refused.value) and "r/min" in str(refused.value)
