"""A value that the data sheet takes for exact (uncertainty 0) keeps its value in every fit."""

from dataclasses import replace

import numpy as np
import pytest

from paper_rig import paper_rig
from rippletwin.case.model import Uncertainty
from rippletwin.twin.parameters import coordinates, line_parameters, values
from rippletwin.twin.priors import lognormal, normal


@pytest.mark.parametrize("prior", [normal(0.42, 0.0), lognormal(1020.0, 0.0)])
def test_prior_without_width(prior):
    """Its coordinate is 0 and its value the data sheet's, alone or in an array."""
    with np.errstate(all="raise"):
        assert prior.coordinate(prior.centre) == 0.0
        assert np.array_equal(prior.coordinate(np.array([0.1, 0.2])), [0.0, 0.0])
        assert prior.value(prior.coordinate(2.0)) == prior.centre


def test_exact_data_sheet_has_coordinates():
    """Values by name go to coordinates and back where every uncertainty is 0."""
    exact = Uncertainty(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    parameters = line_parameters(replace(paper_rig(), uncertainty=exact))
    nominal = values(parameters, np.zeros(len(parameters)))
    assert np.array_equal(coordinates(parameters, nominal), np.zeros(len(parameters)))
