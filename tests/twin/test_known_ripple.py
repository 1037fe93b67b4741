"""What is nonlinear follows from the ripple that is there, not from the nominal one."""

from dataclasses import replace

import numpy as np
import pytest

from rippletwin.spectra.frequency_selection import select_fitted_frequencies
from rippletwin.twin.forward_jacobian import DifferentiableForward
from rippletwin.twin.twin import Twin
from synthetic_effects import AIR, TRUTH
from synthetic_observations import POINTS, make, with_known_ripple

TIMES = 1.6  # the ripple that is there over the nominal one


def lines(effects):
    """Twin and theta, with observations of the nominal ripple and of the ripple that is there."""
    made = [
        make(np.random.default_rng(1), effects, TRUTH, points=POINTS[:2], source=0.0, depth=depth)
        for depth in (1.0, TIMES)
    ]
    bench, theta = made[0][0], made[0][2].theta
    nominal, real = (select_fitted_frequencies(data, bench) for _, data, _ in made)
    return Twin(bench, nominal, effects=effects), theta, nominal, real


@pytest.mark.parametrize("effects", [(), AIR])
def test_readings_are_those_of_the_real_ripple_in_proportion(effects):
    """The readings of a ripple 1.6 times the nominal one, over 1.6: exactly so, with an orifice and
    with air in the line. With the nominal ripple alone they are wrong by more than 0.1 %."""
    twin, theta, nominal, real = lines(effects)
    known = twin.predict(with_known_ripple(nominal, TIMES), theta)
    for at_nominal, as_known, there in zip(
        twin.predict(nominal, theta), known, twin.predict(real, theta)
    ):
        size = np.linalg.norm(there)
        assert np.linalg.norm(TIMES * as_known - there) < 1e-8 * size
        assert np.linalg.norm(TIMES * at_nominal - there) > 1e-3 * size


def test_derivatives_are_those_of_the_readings():
    """Against central differences, of a wave speed, the load and the shaft's angle."""
    twin, theta, nominal, _ = lines(())
    forward = DifferentiableForward(twin, with_known_ripple(nominal, TIMES))
    slopes = forward.derivatives(theta)
    for name in ("wave_speed[2]", "load", "angle[point 1]"):
        k, ends = twin.index[name], []
        for side in (-1.0, 1.0):
            moved = theta.copy()
            moved[k] += side * 1e-3
            ends.append(np.concatenate(forward(moved), axis=1))
        quotient = (ends[1] - ends[0]) / 2e-3
        assert np.linalg.norm(slopes[k] - quotient) < 0.02 * np.linalg.norm(quotient)


def test_what_has_no_shaft_has_no_ripple():
    """An input impedance that could be measured beside the recordings, made from one of them."""
    twin, theta, nominal, _ = lines(())
    (known, *_) = with_known_ripple(nominal, TIMES)
    impedance = replace(known, kind="input_impedance", label="new", orders=None, source="known")
    plain = replace(impedance, corrected_ripple=None)
    assert np.array_equal(twin.predict([impedance], theta)[0], twin.predict([plain], theta)[0])
