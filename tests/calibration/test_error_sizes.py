"""Sizes of errors against their closed form."""

import numpy as np
import pytest

from rippletwin.calibration.error_sizes import (
    MIN_MODEL_ERROR,
    SMOOTH_SDS,
    ErrorSizes,
    find_most_likely_sizes,
)

COUNT = 60


def costs_of(truth):
    """Costs of three independent samples of COUNT numbers with the root mean squares `truth`: twice
    minus their log likelihood, which is least at these."""

    def costs(grids):
        along = [
            COUNT * (2.0 * np.log(values) + (size / values) ** 2)
            for values, size in zip(grids, truth)
        ]
        return along[0][:, None, None] + along[1][:, None] + along[2]

    return costs


@pytest.mark.parametrize("near", [False, True])
def test_sizes_are_the_root_mean_squares_wherever_they_lie(near):
    """40 sizes, wherever they lie between values of a grid, are found to 1 %."""
    for factor in np.geomspace(1.0, 2.0, 40):
        truth = ErrorSizes(0.02 * factor, 0.05 * factor, 0.08 * factor)
        present = ErrorSizes(*(1.1 * size for size in truth))
        found = find_most_likely_sizes(costs_of(truth), present, True, near)
        np.testing.assert_allclose(found, truth, rtol=0.01)


def test_sizes_near_the_present_ones_settle():
    """Estimated again and again from afar they come to rest at the truth."""
    truth = ErrorSizes(0.0213, 0.0471, 0.0377)
    sizes = ErrorSizes(0.3, 0.3, 0.3)
    for _ in range(12):
        sizes = find_most_likely_sizes(costs_of(truth), sizes, True, near=True)
    again = find_most_likely_sizes(costs_of(truth), sizes, True, near=True)
    np.testing.assert_allclose(sizes, truth, rtol=0.01)
    np.testing.assert_allclose(again, sizes, rtol=1e-6)


def test_sizes_stay_within_their_bounds():
    """A model error below the least one is the least, a smooth error above the largest that."""
    truth = ErrorSizes(3.0, 0.05, 1e-4)
    found = find_most_likely_sizes(costs_of(truth), ErrorSizes(0.1, 0.1, 0.1), True, near=False)
    assert found.model == pytest.approx(MIN_MODEL_ERROR)
    assert found.smooth == pytest.approx(SMOOTH_SDS[-1])


def test_without_a_nominal_source_there_is_no_smooth_error():
    """The model error alone is sought."""
    costs = lambda grids: costs_of((1.0, 1.0, 0.08))([np.ones(1), np.ones(1), grids[2]])  # noqa: E731
    found = find_most_likely_sizes(costs, ErrorSizes(0.0, 0.001, 0.1), False, near=False)
    assert found.smooth == 0.0 and found.model == pytest.approx(0.08, rel=0.01)
