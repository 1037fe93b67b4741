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
    nothing for the other, at whose state the viscosity is that of the twin."""
    twin, data, theta = observed
    twin = twin.with_(reference=["point 1"])
    moved = theta.copy()
    moved[twin.index["state[point 2]"]] = 2.0
    factor = twin.parameters[twin.index["state[point 2]"]].value(2.0)
    first, second = twin.predict(data, moved)
    assert np.array_equal(first, twin.predict(data, theta)[0])
    slope = twin.values(theta)["viscosity_slope"]
    other = twin.predict(data, with_line(twin, theta, factor, factor**slope))[1]
    # To the tolerance to which the orifice is solved.
    assert np.linalg.norm(second - other) < 1e-9 * np.linalg.norm(other)


def test_what_all_recordings_have_in_common_is_no_change_of_the_oil(observed):
    """The same state in all is a line of other wave speeds, and its viscosity is the parameter's:
    else states would take a part of what the viscosity of the data sheet is wrong by."""
    twin, data, theta = observed
    moved = theta.copy()
    for label in twin.labels:
        moved[twin.index[f"state[{label}]"]] = 2.0
    factor = twin.parameters[twin.index["state[point 1]"]].value(2.0)
    faster = twin.predict(data, with_line(twin, theta, factor, 1.0))
    for one, other in zip(twin.predict(data, moved), faster):
        assert np.linalg.norm(one - other) < 1e-9 * np.linalg.norm(other)


def with_line(twin, theta, wave_speeds, viscosity):
    """theta with all wave speeds and the viscosity multiplied."""
    factors = {f"wave_speed[{k}]": wave_speeds for k in range(1, len(twin.rig.line) + 1)}
    out = theta.copy()
    for name, change in (factors | {"viscosity": viscosity}).items():
        p = twin.parameters[twin.index[name]]
        out[twin.index[name]] = p.prior.coordinate(change * p.value(theta[twin.index[name]]))
    return out


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
