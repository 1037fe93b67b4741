"""Starts of wave speeds, and the score test on starts along the line."""

from dataclasses import replace

import numpy as np
import pytest

from rippletwin.calibration import multistart
from rippletwin.calibration.frequency_continuation import refine
from rippletwin.calibration.multistart import (
    RANDOM_START_SD,
    RANDOM_STARTS,
    SCALINGS,
    choose_starts,
    select_distinct_modes,
)
from rippletwin.calibration.posterior import Posterior
from rippletwin.calibration.score_test import MAX_FOLLOWED, ScoreTest
from rippletwin.calibration.shaft_angles import align_shaft_angles
from rippletwin.explanation.fit_starts import transfer_theta, weak_effect_starts
from rippletwin.twin.parameters import coordinates
from rippletwin.twin.twin import Twin
from synthetic_effects import VOLUME
from synthetic_observations import POINTS, make


@pytest.mark.parametrize("place", [1.3, 4.4, 7.7])
def test_score_test_keeps_a_start_near_the_true_position(place):
    """The truth has a volume of 0.4 cm3. From a good fit without it, of starts all along the line
    the score test keeps one within an eighth of the shortest wavelength of the true position."""
    values = {"line_volume@position.position": place, "line_volume@position.volume": 4e-7}
    bench, observations, truth = make(np.random.default_rng(6), VOLUME, values, source=0.02)
    base = Twin(bench, observations)
    without = refine(base, (), observations, [truth.theta[: len(base.parameters)]])
    twin = base.with_(effects=VOLUME)
    thetas = []
    for start in weak_effect_starts(bench, VOLUME, 270):
        thetas.append(transfer_theta(without, VOLUME, base))
        for name, u in start.items():
            thetas[-1][twin.index[name]] = u
    kept = ScoreTest(base, Posterior(twin, observations), thetas).starts
    positions = [twin.values(theta)["line_volume@position.position"] for theta in kept]
    assert len(kept) == MAX_FOLLOWED
    assert min(abs(x - place) for x in positions) < 1000 / 4000 / 8


def test_starts_are_all_pairs_of_scalings_and_random_wave_speeds(monkeypatch):
    """A line of three segments without effects starts from 49 pairs of scalings, the longest
    segment's and the others', and from 400 draws of all wave speeds with their standard deviation;
    everything else is that of the data sheet. With an effect there are no draws."""
    monkeypatch.setattr(multistart, "align_shaft_angles", lambda model, theta, **_: (0.0, theta))
    bench, observations, _ = make(np.random.default_rng(1))
    base = Twin(bench, observations)
    thetas = np.array([t for _, t in choose_starts(Posterior(base, observations), ({},), 1000)])
    pairs, drawn = thetas[: len(SCALINGS) ** 2], thetas[len(SCALINGS) ** 2 :]
    assert {(t[0], t[1], t[2]) for t in pairs} == {(a, b, b) for a in SCALINGS for b in SCALINGS}
    assert len(drawn) == RANDOM_STARTS
    assert np.std(drawn[:, :3]) == pytest.approx(RANDOM_START_SD, rel=0.05)
    assert not np.any(thetas[:, 3:])
    model = Posterior(base.with_(effects=VOLUME), observations)
    assert len(choose_starts(model, ({},), 1000)) == len(SCALINGS) ** 2


def test_starts_behind_a_free_source_are_ranked_by_ratios_between_sensors():
    """Of an unknown source only ratios between sensors count. The truth has next to no misfit, a
    line with other wave speeds has; neither depends on how strong the source was."""
    bench, observations, truth = make(np.random.default_rng(4), source=0.0)
    misfits = []
    for strength in (1.0, 1e3):
        free = [
            replace(
                o,
                source="free",
                values=strength * o.values,
                covariance=strength**2 * o.covariance,
            )
            for o in observations
        ]
        model = Posterior(Twin(bench, free), free)
        theta = coordinates(model.twin.parameters, truth.values())
        wrong = theta + 2.0 * (np.arange(len(theta)) < 3)
        misfits.append([align_shaft_angles(model, t)[0] for t in (theta, wrong)])
    (true, other), stronger = misfits
    assert true < 0.01 * other
    np.testing.assert_allclose(stronger, misfits[0], rtol=1e-6)


def test_starts_behind_a_known_source_are_ranked_with_their_phase():
    """A reflection coefficient turned by half a radian, as a wrong wave speed turns it, misses by
    the chord of that angle: the source of an impedance has no free phase."""
    bench, (o, *_), _ = make(np.random.default_rng(4), sensors=1, points=POINTS[:1])
    o = replace(
        o, kind="input_impedance", source="known", orders=None, flow_ripple=None, normalised=True
    )
    twin = Twin(bench, [o], guessed_load=False)
    turned = np.exp(0.5j) * Posterior(twin, [o]).predict(twin.theta)
    o = replace(o, values=(1.0 + turned) / (1.0 - turned))
    misfit, _ = align_shaft_angles(Posterior(twin, [o]), twin.theta)
    assert misfit == pytest.approx(abs(1.0 - np.exp(0.5j)) ** 2, rel=1e-6)


def test_modes_near_a_better_one_are_dropped():
    """Of two modes that differ by 0.03 in one coordinate the better stays, and one farther away."""
    modes = [(2.0, np.array([0.0, 0.03])), (1.0, np.zeros(2)), (3.0, np.array([0.0, 1.0]))]
    assert [value for value, _ in select_distinct_modes(modes)] == [1.0, 3.0]
