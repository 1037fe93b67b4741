"""Readings divided along the response to a flow at the pump and across it."""

import numpy as np
import pytest

from rippletwin.diagnosis.division import ACROSS, Division

COUNT = 7


@pytest.fixture(params=[1, 2, 3])
def response(request):
    rng = np.random.default_rng(request.param)
    return rng.normal(size=(2, request.param, COUNT, 2)) @ np.array([1.0, 1j])


def test_a_flow_makes_nothing_across(response):
    """Whatever the flow, its readings are along the response, with all of their power."""
    _, other = response
    divided = Division(other).divide(3j * other)
    np.testing.assert_allclose(divided[ACROSS], 0.0, atol=1e-12)
    np.testing.assert_allclose(np.abs(divided[0]) ** 2, 9.0 * np.sum(np.abs(other) ** 2, axis=0))


def test_divided_readings_come_back(response):
    """Dividing is unitary: powers stay, and the way back gives the readings."""
    readings, other = response
    division = Division(other)
    divided = division.divide(readings)
    np.testing.assert_allclose(division.at_sensors(divided), readings)
    np.testing.assert_allclose(np.sum(np.abs(divided) ** 2, 0), np.sum(np.abs(readings) ** 2, 0))


def test_variances_are_those_of_divided_noise():
    """The variance of each row is that of ten thousand draws of noise, which differs from sensor
    to sensor, to a tenth; so is the sensors' where the rows' noise is drawn."""
    rng = np.random.default_rng(0)
    response = rng.normal(size=(3, COUNT, 2)) @ np.array([1.0, 1j])
    variance = rng.uniform(0.5, 4.0, size=(3, COUNT))
    division = Division(response)
    noise = rng.normal(size=(10000, 3, COUNT, 2)) @ np.array([1.0, 1j]) * np.sqrt(variance / 2.0)
    found = np.mean(np.abs(division.divide(noise)) ** 2, axis=0)
    np.testing.assert_allclose(division.divide_variance(variance), found, rtol=0.1)
    found = np.mean(np.abs(division.at_sensors(noise)) ** 2, axis=0)
    np.testing.assert_allclose(division.variance_at_sensors(variance), found, rtol=0.1)
