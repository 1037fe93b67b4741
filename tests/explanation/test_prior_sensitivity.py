"""What a free data sheet would make of the data without an effect."""

from dataclasses import replace

import numpy as np
import pytest

from rippletwin.calibration.frequency_continuation import refine
from rippletwin.case.model import Uncertainty
from rippletwin.explanation.checks.prior_sensitivity import (
    compare_without_each_effect,
    refit_with_wide_priors,
    widen_priors,
)
from rippletwin.explanation.fit_jobs import FitJob, Workers
from rippletwin.explanation.verdict.decision import Decision, withdraw_refuted_name
from rippletwin.spectra.frequency_selection import select_fitted_frequencies
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from synthetic_observations import make, rig

PRESSURE, ATMOSPHERE = 5e6, 101325.0  # Pa


def accepted(effect, values, **options):
    """(fit that knows the truth, workers without it)."""
    hypothesis = ((effect, Place(effect.element)),)
    names = {f"{effect.name}@{effect.element}.{k}": v for k, v in values.items()}
    options = {"source": 0.0, "noise": 500.0} | options
    bench, recorded, truth = make(np.random.default_rng(5), hypothesis, names, **options)
    data = select_fitted_frequencies(recorded, bench)
    base = Twin(bench, data)
    return refine(base, hypothesis, data, [truth.theta]), Workers(base, data)


def test_air_at_one_pressure_is_a_slower_wave():
    """To a small ripple at one mean pressure air in the oil is nothing but a slower wave: rho a^2 C
    more compressible, so that a falls by the root of one plus that. A sheet that may move takes it
    all up, and how far it moves is known."""
    values = {"gas_fraction": 0.02, "polytropic_exponent": 1.2}
    small = {"points": ((1000, PRESSURE),), "depth": 0.002, "noise": 0.1}
    fit, pool = accepted(EFFECTS["entrained_air"], values, **small)
    (base,) = pool.fit([FitJob(())])
    (found,) = compare_without_each_effect(pool, base, fit)
    assert found.effect == "entrained_air" and found.rivals and not found.refutes
    free = refit_with_wide_priors(pool, [base], fit)[0][1].twin.values()
    with_air = fit.twin.values()
    fraction, n = (v for p, v in with_air.items() if p.startswith("entrained_air"))
    pressure = PRESSURE + ATMOSPHERE
    air = fraction * (ATMOSPHERE / pressure) ** (1 / n) / (n * pressure)
    for k in (1, 2, 3):
        speed = with_air[f"wave_speed[{k}]"]
        softer = fit.twin.rig.fluid.density * speed**2 * air
        delay = with_air[f"length[{k}]"] / speed * np.sqrt(1 + softer)
        assert free[f"length[{k}]"] / free[f"wave_speed[{k}]"] == pytest.approx(delay, rel=0.002)
    # How far the sheet is left: of its furthest parameter, in deviations as stated.
    assert found.value == pytest.approx(free[found.parameter])
    stated = 0.01 if found.parameter.startswith("length") else 0.05
    assert found.pull == pytest.approx(abs(np.log(found.value / found.nominal)) / stated, rel=0.05)


def test_no_sheet_stands_in_for_friction_that_grows_with_frequency():
    """Attenuation by steady friction is the same at all frequencies: whatever the line's numbers,
    unsteady friction's root of frequency is not to be had."""
    fit, pool = accepted(EFFECTS["unsteady_friction"], {})
    (base,) = pool.fit([FitJob(())])
    (found,) = compare_without_each_effect(pool, base, fit)
    assert not found.rivals and not found.refutes
    assert found.evidence == fit.evidence - base.evidence > 100.0


def test_what_one_number_of_the_line_accounts_for_refutes_an_effect():
    """A liquid nine times as viscous as the sheet says takes the same share of every frequency. A
    wall that yields with delay damps too, and a fit with it is the best that the sheet allows; with
    the viscosity free and no wall the data are met to their noise."""
    hypothesis = ((EFFECTS["viscoelastic_wall"], Place("segment 1")),)
    points = {"points": ((1000, PRESSURE),), "source": 0.0, "noise": 500.0}
    bench, recorded, _ = make(np.random.default_rng(5), values={"viscosity": 2.9e-4}, **points)
    data = select_fitted_frequencies(recorded, bench)
    pool = Workers(Twin(bench, data), data)
    base, wall = pool.fit([FitJob(()), FitJob(hypothesis)])
    (found,) = compare_without_each_effect(pool, base, wall)
    assert wall.evidence > base.evidence
    assert found.refutes and found.parameter == "viscosity"
    assert found.value == pytest.approx(2.9e-4, rel=0.02)
    named = Decision("ambiguous", wall, (("viscoelastic_wall", "side_branch"),))
    assert withdraw_refuted_name(named, [found]) == Decision("unexplained", wall)
    assert withdraw_refuted_name(named, [replace(found, refutes=False)]) == named
    assert withdraw_refuted_name(Decision("consistent", base), [found]).verdict == "consistent"


def test_loosened_is_never_tighter_than_stated():
    """Twenty times the stated, at most 30 %, and no less than stated where that is more."""
    stated = Uncertainty(length=0.001, diameter=0.03, wave_speed=0.05, viscosity=0.4)
    free = widen_priors(replace(rig(), uncertainty=stated)).uncertainty
    assert (free.length, free.diameter, free.wave_speed) == (0.02, 0.3, 0.3)
    assert free.viscosity == 0.4
