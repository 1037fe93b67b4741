"""Preparation of `explain`: observe the recordings, and set up the twin and what it is fitted to.

Periodic recordings are observed as a whole and in two halves.
"""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from functools import partial

import numpy as np
from threadpoolctl import threadpool_limits

from rippletwin.case.model import Case, Recording, Rig
from rippletwin.errors import InputError
from rippletwin.explanation.fit_jobs import make_base
from rippletwin.explanation.localise.phase_modulation import with_phase_modulation
from rippletwin.explanation.localise.shaft_orders import ShaftOrders
from rippletwin.spectra.frequency_selection import select_fitted_frequencies
from rippletwin.spectra.observation import Observation, observe, revolutions_of
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.twin import Twin

HIGHEST_HZ = 4000.0  # of the harmonics that are fitted
REVOLUTIONS_OF_HALVES = 8  # of the least recording of which halves are compared


def quantity_error(case: Case) -> InputError | None:
    """What is told of a case whose healthy recordings are of two quantities; None of others. The
    error model of explaining has one size of the model error, relative to one quantity."""
    impedances = [r.label for r in case.healthy if r.kind == "input_impedance"]
    pressures = [r.label for r in case.healthy if r.kind != "input_impedance"]
    if not impedances or not pressures:
        return None
    return InputError(
        case.folder / "rig.yaml",
        "recordings",
        f"explain takes either pressures ({', '.join(pressures)}) or input impedances "
        f"({', '.join(impedances)})",
        "Give each a rig.yaml of its own; calibrate takes both in one",
    )


def observe_all(case: Case, processes: int) -> tuple[list, list, list]:
    """Observations of the healthy recordings, and of their early and late halves."""
    # Threads suffice: most of the time goes to linear algebra on large arrays, which releases the
    # interpreter. Each uses one thread of its own.
    with threadpool_limits(1), ThreadPoolExecutor(max(processes, 1)) as pool:
        parts = list(pool.map(partial(observe_whole_and_halves, rig=case.rig), case.healthy))
    whole = [part[0] for part in parts]
    early, late = ([part[k] for part in parts if len(part) > 1] for k in (1, 2))
    return whole, early, late


def observe_whole_and_halves(recording: Recording, rig: Rig) -> list[Observation]:
    """The observation of a recording; for a periodic one that is long enough also those of both
    halves.

    The scatter of a half is that of the whole recording: few revolutions do not tell it.
    """
    if recording.kind != "periodic":
        return [observe(recording, rig, HIGHEST_HZ)]
    revolutions = revolutions_of(recording, rig)
    count = len(revolutions.windows)
    whole = observe(recording, rig, HIGHEST_HZ, revolutions=revolutions)
    if count < REVOLUTIONS_OF_HALVES:
        return [whole]
    halves = []
    for part in (slice(0, count // 2), slice(count // 2, None)):
        windows, speed_hz = revolutions.windows[part], revolutions.speed_hz[part]
        cut = replace(revolutions, windows=windows, speed_hz=speed_hz)
        half = observe(recording, rig, HIGHEST_HZ, revolutions=cut)
        # A half that turns more slowly may reach an order higher.
        own = np.searchsorted(whole.orders, np.minimum(half.orders, whole.orders[-1]))
        covariance = whole.covariance[own] * (count / len(windows))
        halves.append(replace(half, covariance=covariance))
    return [whole, *halves]


def prepare_base(
    rig: Rig, observations: Sequence[Observation], modulation: ShaftOrders | None = None
) -> tuple[Twin, list[Observation]]:
    """The twin without effects, not yet fitted, and the observations as they are fitted.

    `modulation` is that of the shaft (`localise.phase_modulation`).
    """
    highest_hz = HIGHEST_HZ if observations[0].orders is not None else None
    data = select_fitted_frequencies(
        with_phase_modulation(observations, modulation), rig, highest_hz
    )
    base = make_base(rig, data)
    # Simulate the pump before the worker processes start: the twin keeps the result.
    ForwardModel(base, data)
    return base, data


def select_fitted_as(
    halves: Sequence[Observation], rig: Rig, data: Sequence[Observation]
) -> list[Observation]:
    """The halves of recordings as the whole ones, `data`, are fitted."""
    whole = {o.label: o for o in data}
    fitted = [
        replace(
            half,
            flow_ripple=whole[half.label].flow_ripple,
            modulation=whole[half.label].modulation,
            corrected_ripple=whole[half.label].corrected_ripple,
        )
        for half in halves
    ]
    return select_fitted_frequencies(fitted, rig, HIGHEST_HZ)
