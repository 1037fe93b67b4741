"""Prior sensitivity: fits without an effect and with wide priors."""

from dataclasses import replace

import numpy as np
import pytest

from rippletwin.calibration.frequency_continuation import refine
from rippletwin.case.model import Uncertainty
from rippletwin.explanation.checks.prior_sensitivity import (
    compare_without_each_effect,
    fit_without_each_effect,
    refit_with_wide_priors,
    widen_priors,
)
from rippletwin.explanation.fit_jobs import FitJob, Workers
from rippletwin.spectra.frequency_selection import select_fitted_frequencies
from rippletwin.twin.effects.base import Place
from rippletwin.twin.effects.library import EFFECTS
from rippletwin.twin.twin import Twin
from synthetic_observations import make, rig

PRESSURE, ATMOSPHERE = 5e6, 101325.0  # Pa


def accepted(effect, values, **options):
    """(fit from the truth, workers)."""
    hypothesis = ((effect, Place(effect.element)),)
    names = {f"{effect.name}@{effect.element}.{k}": v for k, v in values.items()}
    options = {"source": 0.0, "noise": 500.0} | options
    bench, recorded, truth = make(np.random.default_rng(5), hypothesis, names, **options)
    data = select_fitted_frequencies(recorded, bench)
    base = Twin(bench, data)
    return refine(base, hypothesis, data, [truth.theta]), Workers(base, data)


def test_air_at_one_pressure_is_equivalent_to_a_slower_wave():
    """For a small ripple at one mean pressure, air only makes the oil more compressible by rho a^2
    C, so that the wave speed falls by the root of one plus that.

    With wide priors the wave speeds absorb all of it, and by how much they move is known."""
    values = {"gas_fraction": 0.02, "polytropic_exponent": 1.2}
    small = {"points": ((1000, PRESSURE),), "depth": 0.002, "noise": 0.1}
    fit, workers = accepted(EFFECTS["entrained_air"], values, **small)
    (base,) = workers.fit([FitJob(())])
    without = fit_without_each_effect(workers, base, fit)
    (result,) = compare_without_each_effect(workers, fit, without)
    assert result.effect == "entrained_air" and result.rivals and not result.refutes
    wide = refit_with_wide_priors(workers, [base], fit)[0][1].twin.values()
    with_air = fit.twin.values()
    fraction, n = (v for p, v in with_air.items() if p.startswith("entrained_air"))
    pressure = PRESSURE + ATMOSPHERE
    air = fraction * (ATMOSPHERE / pressure) ** (1 / n) / (n * pressure)
    for k in (1, 2, 3):
        speed = with_air[f"wave_speed[{k}]"]
        softer = fit.twin.rig.fluid.density * speed**2 * air
        delay = with_air[f"length[{k}]"] / speed * np.sqrt(1 + softer)
        assert wide[f"length[{k}]"] / wide[f"wave_speed[{k}]"] == pytest.approx(delay, rel=0.002)
    # The pull is that of the furthest parameter in standard deviations as stated.
    assert result.value == pytest.approx(wide[result.parameter])
    stated = 0.01 if result.parameter.startswith("length") else 0.05
    assert result.pull == pytest.approx(
        abs(np.log(result.value / result.nominal)) / stated, rel=0.05
    )


def test_no_line_parameter_absorbs_friction_that_grows_with_frequency():
    """Steady friction attenuates all frequencies alike, so no value of any line parameter gives the
    attenuation of unsteady friction, which grows with the root of frequency."""
    fit, workers = accepted(EFFECTS["unsteady_friction"], {})
    (base,) = workers.fit([FitJob(())])
    without = fit_without_each_effect(workers, base, fit)
    (result,) = compare_without_each_effect(workers, fit, without)
    assert not result.rivals and not result.refutes
    assert result.evidence == fit.evidence - without[0].stated.evidence > 100.0
    assert without[0].stated.evidence >= base.evidence


def test_a_line_parameter_that_explains_everything_refutes_an_effect():
    """The liquid is nine times as viscous as the data sheet says. A viscoelastic wall damps too,
    and is the best explanation that the data sheet allows.

    With wide priors and without the wall the data are fitted to their noise."""
    hypothesis = ((EFFECTS["viscoelastic_wall"], Place("segment 1")),)
    points = {"points": ((1000, PRESSURE),), "source": 0.0, "noise": 500.0}
    bench, recorded, _ = make(np.random.default_rng(5), values={"viscosity": 2.9e-4}, **points)
    data = select_fitted_frequencies(recorded, bench)
    workers = Workers(Twin(bench, data), data)
    base, wall = workers.fit([FitJob(()), FitJob(hypothesis)])
    without = fit_without_each_effect(workers, base, wall)
    (result,) = compare_without_each_effect(workers, wall, without)
    assert wall.evidence > base.evidence
    assert result.refutes and result.parameter == "viscosity"
    assert result.value == pytest.approx(2.9e-4, rel=0.02)


def test_wide_priors_are_never_narrower_than_stated():
    """Twenty times the stated uncertainty, at most 30 %, and at least as stated."""
    stated = Uncertainty(length=0.001, diameter=0.03, wave_speed=0.05, viscosity=0.4)
    wide = widen_priors(replace(rig(), uncertainty=stated)).uncertainty
    assert (wide.length, wide.diameter, wide.wave_speed) == (0.02, 0.3, 0.3)
    assert wide.viscosity == 0.4
