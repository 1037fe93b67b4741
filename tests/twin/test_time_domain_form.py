"""Effects that state only their frequency domain: the time domain made of it.

Every library effect with a form of its own is run without it: the made form must lead to the same
ripple as the frequency domain, by the method of characteristics, which shares no solution with it.
"""

from dataclasses import replace

import numpy as np
import pytest

from rippletwin.errors import InputError
from rippletwin.line.time_domain.passive_fit import fit_passive_terms
from rippletwin.twin.effects.library import candidates
from rippletwin.twin.propagation import propagate
from rippletwin.twin.time_domain_form import MAX_FIT_ERROR
from two_domains import ORDERS, PRESSURE, SPEED_HZ, STEPS, corrected, misfit, rig, ripple

BEYOND = (
    "entrained_air", "gas_volume", "unsteady_friction", "load_dynamics-load (spool)", "leak",
    "passive_piece",
)  # fmt: skip
"""Nonlinear, a change of Z' along the line, of the mean flow, or a two-port that takes a stretch of
the line away: these need a form of their own."""
S = 2j * np.pi * np.linspace(20.0, 5500.0, 400)


def fitted():
    for load in ("orifice", "open"):
        for named in (True, False):
            for effect, place in candidates(rig(load), named):
                name = f"{effect.name}-{place}"
                gas_only = load == "open" and effect.medium != "gas"
                if gas_only or name.startswith(BEYOND) or effect.element == "source":
                    continue
                if effect.name == "source_impedance" or not name.endswith(("p1", "segment 1")):
                    yield pytest.param(effect, place, load, id=name)


@pytest.mark.parametrize("effect, place, load", list(fitted()))
def test_the_ripple_is_that_of_the_frequency_domain(effect, place, load):
    """Readings agree to 1 % of the ripple below 5 kHz, the bound of the how-to page, and to a third
    of what the effect changes."""
    alone = replace(effect, apply_in_time=None)
    twin, bare = corrected((alone, place), load=load), corrected(load=load)
    gas = load == "open"
    wave, pressure = ripple(1e-5 if gas else 1e-3), 1e5 if gas else PRESSURE
    chain = twin.respond(wave, SPEED_HZ, pressure, ORDERS)
    moc = propagate(twin, wave.flow, wave.flow, SPEED_HZ, pressure, steps=STEPS, tolerance=1e-4)
    off = misfit(moc.harmonics(ORDERS), chain)
    print(f"{effect.name} {place}: {off:.1e}")
    assert off < MAX_FIT_ERROR
    assert misfit(bare.respond(wave, SPEED_HZ, pressure, ORDERS), chain) > 3 * off


@pytest.mark.parametrize(
    "immittance",
    [
        1e-11 + 0.0 * S,
        1e-15 * S,
        1.0 / (3e3 + 1e3 * S + 1e-2 * np.abs(S) ** 2),
        np.sqrt(S),
        S / (S**2 + 60.0 * S + 6e3**2) + S / (S**2 + 6e3 * S + 1.6e4**2),
    ],
    ids=["leak", "volume", "hole", "boundary layer", "resonators"],
)
def test_a_passive_immittance_is_followed_and_stays_passive(immittance):
    """Known positive real functions are followed to 0.2 %, and the sum of terms has no negative
    real part on a grid ten times as fine and ten times as wide as the data (Brune 1931)."""
    fit = fit_passive_terms(S, immittance)
    assert fit.error < 2e-3
    wide = fit.at(2j * np.pi * np.linspace(2.0, 5.5e4, 20000))
    assert np.all(wide.real >= -1e-9 * np.abs(wide))


def test_what_is_not_passive_is_not_followed():
    """A negative conductance gives energy: no sum of passive terms follows it."""
    assert fit_passive_terms(S, -1e-11 + 0.0 * S).error > 0.5


def test_a_change_without_a_generic_form_is_refused():
    """Unsteady friction without a time-domain form: the message names what is missing."""
    effect, place = next((e, p) for e, p in candidates(rig()) if e.name == "unsteady_friction")
    twin, wave = corrected((replace(effect, apply_in_time=None), place)), ripple()
    with pytest.raises(InputError, match="changes `series`") as error:
        propagate(twin, wave.flow, wave.flow, SPEED_HZ, PRESSURE, steps=STEPS)
    assert error.value.field == "EFFECT.apply_in_time"
