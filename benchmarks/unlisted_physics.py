"""Does explain locate and reproduce series elements and short two-ports that no library has?

    python benchmarks/unlisted_physics.py FIRST LAST [--networks]

Draws the cases FIRST to LAST (numbers from 1000), each with one element that is not in the library
at a random place: an orifice plate, a bend, a leaking joint, a series resonator, a piece of hose of
another impedance or an in-line chamber. Prints the place by the stand-in, and the misfit on data
that were left out, against that of the calibrated line. With --networks only the networks are
fitted, to the line without named effects, and the errors are those of all data: seconds instead of
minutes a case. The model error and the error of the pump's ripple count together: a line in a wrong
local mode leaves to the pump what it cannot fit.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from rippletwin.explanation.explain import explain_observations
from rippletwin.explanation.fit_jobs import FitJob, open_workers
from rippletwin.explanation.search.passive_networks import fit_passive_networks
from rippletwin.explanation.stages.preparation import prepare_base
from rippletwin.explanation.verdict.verdict_file import verdict_dict
from rippletwin.line.frequency_domain.line_network import Insert
from rippletwin.twin.effects.base import Effect, Place, on_line, position_place
from selfcheck_cases import draw_case

KINDS = ("orifice plate", "bend", "leaking joint", "series resonator", "hose piece", "chamber")
RIGHT_PLACE = 0.05  # of the line's length
MARGIN = 0.1  # of the line's length, at both ends of it, without an element


def unlisted(kind: str, position: float, rng) -> Effect:
    """The element as an effect without parameters."""
    size = rng.uniform(size=3)

    def lumped(network, state, values, place):
        s, x = network.s, on_line(network, position)
        inertance = state.density / state.area(0)  # of a metre of pipe
        series = 0.0 * s
        if kind == "orifice plate":
            series = 10 ** (8.7 + 0.9 * size[0]) + s * inertance * (0.02 + 0.1 * size[1])
        elif kind == "series resonator":
            w = 2 * np.pi * (500.0 + 2000.0 * size[0])
            peak = 10 ** (8.8 + 0.8 * size[1])
            band = (0.1 + 0.4 * size[2]) * w * s
            series = peak * band / (s**2 + band + w**2)
        else:
            series = s * inertance * (0.1 + 0.3 * size[0])
        network.inserts.append(Insert(x, "series", series))
        if kind == "leaking joint":
            network.inserts.append(Insert(x, "shunt", 10 ** (-11.6 + 0.8 * size[1]) + 0.0 * s))

    def piece(network, state, values, place):
        """A piece of other diameter or wave speed, cut out of the line."""
        hose = kind == "hose piece"
        length = 0.1 + 0.2 * size[0]
        speed = 0.4 + 0.3 * size[1] if hose else 1.0
        area = (1.0 + 0.3 * size[2] if hose else 2.0 + 1.5 * size[1]) ** 2
        ends = np.cumsum(network.lengths)
        low, high = position - 0.5 * length, position + 0.5 * length
        edges = np.unique(np.r_[0.0, ends, np.clip([low, high], 0.0, ends[-1])])
        middles = 0.5 * (edges[1:] + edges[:-1])
        index = np.searchsorted(ends, middles)
        inside = ((middles > low) & (middles < high))[:, None]
        network.series = network.series[index] / np.where(inside, area, 1.0)
        network.shunt = network.shunt[index] * np.where(inside, area / speed**2, 1.0)
        network.lengths = np.diff(edges)

    apply = piece if kind in ("hose piece", "chamber") else lumped
    return Effect(kind, "position", "any", "", "", lambda rig, p: (), position_place, apply)


def draw_unlisted_case(number: int) -> tuple:
    """(kind of element, its position in m, rig, observations) of a case."""
    rng, kind = np.random.default_rng(number), KINDS[number % len(KINDS)]
    truth: list[float] = []

    def draw(rng, rig):
        truth.append(float(rng.uniform(MARGIN, 1.0 - MARGIN) * rig.length))
        return ((unlisted(kind, truth[0], rng), Place("position")),)

    rig, observations, _ = draw_case(rng, "single", draw_unlisted=draw, points=2)
    return kind, truth[0], rig, observations


def run_networks(number: int, processes: int) -> tuple[str, bool, bool]:
    """A line of text, whether the place is right, and whether the errors are a fifth."""
    kind, truth, rig, observations = draw_unlisted_case(number)
    base, data = prepare_base(rig, observations)
    with open_workers(base, data, processes) as workers:
        (line,) = workers.fit([FitJob(())])
        fits = fit_passive_networks(workers, line)
    best = fits[0] if fits else line
    places = [v for name, v in best.twin.values().items() if name.endswith(".position")]
    off = abs(places[0] - truth) / rig.length if places else np.inf
    before, after = (np.hypot(fit.model_error, fit.source_sd) for fit in (line, best))
    text = (
        f"{number} {kind} at {truth:.2f} of {rig.length:.1f} m, {len(rig.sensors)} sensors, "
        f"{len(data)} points: {best.label}; off by {off:.1%}; model error "
        f"{line.model_error:.1%} -> {best.model_error:.1%}, error of the ripple "
        f"{line.source_sd:.0%} -> {best.source_sd:.0%}"
    )
    return text, bool(off <= RIGHT_PLACE), bool(after <= 0.2 * before)


def run(number: int, processes: int) -> tuple[str, bool, bool]:
    """A line of text, whether the place is right, and whether the unseen misfit is."""
    kind, truth, rig, observations = draw_unlisted_case(number)
    began = time.process_time()
    explanation = explain_observations(rig, observations, processes=processes)
    spent = time.process_time() - began
    verdict = verdict_dict(explanation)
    fit, rest = verdict["fit"], verdict["remainder"]
    ratio = fit["after"]["held_out"] / fit["before"]["held_out"]
    place = verdict["mismatch"]["where"]["position_m"] if verdict["mismatch"]["where"] else None
    if rest is not None and rest["stand_in"] is not None:
        place = [rest["stand_in"]["parameters"]["position"]["value"]] * 2
    off = np.inf if place is None else abs(np.mean(place) - truth) / rig.length
    text = (
        f"{number} {kind} at {truth:.2f} of {rig.length:.1f} m, {len(rig.sensors)} sensors, "
        f"{len(observations)} points: {verdict['verdict']} {explanation.decision.accepted.label}; "
        f"off by {off:.1%}; unseen {fit['before']['held_out']:.1%} -> "
        f"{fit['after']['held_out']:.1%}; law: {rest and rest['law']}; {spent:.0f} s"
    )
    return text, bool(off <= RIGHT_PLACE), bool(ratio <= 0.2)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("first", type=int)
    parser.add_argument("last", type=int)
    parser.add_argument("--networks", action="store_true")
    parser.add_argument("--processes", type=int, default=1)
    arguments = parser.parse_args()
    results = []
    for number in range(arguments.first, arguments.last + 1):
        one = run_networks if arguments.networks else run
        text, *right = one(number, arguments.processes)
        results.append(right)
        print(text, flush=True)
    places, misfits = np.mean(results, axis=0)
    print(f"right place {places:.0%}, misfit or errors at most a fifth {misfits:.0%}")


if __name__ == "__main__":
    main()
