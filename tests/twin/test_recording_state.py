"""The state of a recording: all wave speeds and the viscosity while it was made."""

import numpy as np
import pytest

from rippletwin.spectra.frequency_selection import select_fitted_frequencies
from rippletwin.twin import twin_file
from rippletwin.twin.forward_jacobian import DifferentiableForward
from rippletwin.twin.twin import Twin
from synthetic_effects import HOSE, TRUTH
from synthetic_observations import POINTS, make


@pytest.fixture(scope="module")
def observed():
    """A line with a hose at two operating points: twin with states, observations."""
    bench, recorded, truth = make(np.random.default_rng(1), HOSE, TRUTH, 3, POINTS[:2])
    data = select_fitted_frequencies(recorded, bench)
    twin = Twin(bench, data, friction="unsteady", effects=HOSE, changing_state=True)
    theta = np.zeros(len(twin.theta))
    for name, k in truth.index.items():
        theta[twin.index[name]] = truth.theta[k]
    return twin, data, theta


def test_a_state_changes_the_line_of_its_recording_alone(observed):
    """The same as a line with other wave speeds and another viscosity for that recording, and
    nothing for the other."""
    twin, data, theta = observed
    moved = theta.copy()
    moved[twin.index["state[point 2]"]] = 2.0
    factor = twin.parameters[twin.index["state[point 2]"]].value(2.0)
    first, second = twin.predict(data, moved)
    assert np.array_equal(first, twin.predict(data, theta)[0])
    slope = twin.values(theta)["viscosity_slope"]
    factors = {f"wave_speed[{k}]": factor for k in range(1, len(twin.rig.line) + 1)}
    other = theta.copy()
    for name, change in (factors | {"viscosity": factor**slope}).items():
        p = twin.parameters[twin.index[name]]
        other[twin.index[name]] = p.prior.coordinate(change * p.value(theta[twin.index[name]]))
    # To the tolerance to which the orifice is solved.
    other = twin.predict(data, other)[1]
    assert np.linalg.norm(second - other) < 1e-9 * np.linalg.norm(other)


def test_its_derivative_is_the_difference_quotient(observed):
    """Against central differences of the prediction."""
    twin, data, theta = observed
    forward = DifferentiableForward(twin, data)
    theta = theta.copy()
    theta[twin.index["state[point 1]"]] = 1.0  # else the viscosity's slope changes nothing
    slopes = forward.derivatives(theta)
    for label in ("state[point 1]", "state[point 2]", "viscosity_slope"):
        k, step = twin.index[label], 1e-3
        ends = []
        for side in (-1.0, 1.0):
            moved = theta.copy()
            moved[k] += side * step
            ends.append(np.concatenate(forward(moved), axis=1))
        quotient = (ends[1] - ends[0]) / (2.0 * step)
        assert np.linalg.norm(slopes[k] - quotient) < 0.02 * np.linalg.norm(quotient)


def test_one_recording_has_no_state_and_a_file_keeps_it(observed):
    """With one recording the wave speeds themselves are free. twin.json keeps the choice."""
    twin, data, _ = observed
    single = Twin(twin.rig, data[:1], changing_state=True)
    assert not any(name.startswith(("state", "viscosity_slope")) for name in single.index)
    again = twin_file.from_dict(twin_file.to_dict(twin))
    assert again.changing_state and again.index == twin.index
