"""Sensors are called as their owner calls them: commas, dots and brackets are part of a name."""

from types import SimpleNamespace

import numpy as np

from rippletwin.explanation.checks.profile_intervals import sensor_intervals
from rippletwin.explanation.fit_starts import common_coordinates


def test_the_gain_of_a_sensor_with_brackets_is_told():
    """ "p1 [Pa]" ends as the name of its parameter does."""
    parameter = SimpleNamespace(
        name="gain[p1 [Pa]]", place="sensor p1 [Pa]", unit="1", value=lambda u: 1.0 + 0.01 * u
    )
    twin = SimpleNamespace(parameters=[parameter], theta=np.array([2.0]))
    fit = SimpleNamespace(twin=twin, interval=lambda k: (1.0, 3.0))
    assert sensor_intervals(fit) == {
        "p1 [Pa]": {"gain": {"value": 1.02, "ci95": [1.01, 1.03], "unit": "1"}}
    }


def test_a_sensor_with_a_dot_keeps_its_fitted_values():
    """The name of a parameter ends behind the last dot."""
    name = "sensor_delay@sensor AI0.1.delay"
    twin = SimpleNamespace(index={name: 0, "length[1]": 1}, theta=np.array([0.7, 0.1]))
    hypothesis = ((SimpleNamespace(name="sensor_delay"), "sensor AI0.1"),)
    assert common_coordinates(SimpleNamespace(twin=twin), hypothesis) == {name: 0.7}
