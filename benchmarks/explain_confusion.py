"""Confusion matrix of the effects on a rig: which can be told apart, and by how much evidence.

    python benchmarks/explain_confusion.py CASE [--strength -2] [--out FILE.md] [--processes 2]

For every effect of the library in turn, the healthy recordings of CASE are replaced by predictions
of a twin with that effect. Line and load are off by their stated uncertainty. The effect's
parameters are `strength` prior standard deviations from their medians; those with a prior centred
on zero are exp(strength) deviations from it, and positions are at the middle. Sensor noise is as
recorded, and the ripple is wrong by SOURCE_ERROR, smoothly in frequency. Every effect at every
place is then fitted. A cell is the log evidence of the column's effect at its best place less that
of the true effect at its best place: at 0 the two cannot be told apart, at -3 the true one is
twenty times as probable.

The predictions come from the twin's own equations. The benchmark shows what the data can tell, not
whether the equations are right.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np
from tqdm import tqdm

from rippletwin.calibration.misfit import relative_misfit
from rippletwin.calibration.smooth_source import smooth_basis
from rippletwin.case.load import load_case
from rippletwin.explanation.fit_jobs import open_workers
from rippletwin.explanation.search.single_effects import fit_single_effects
from rippletwin.explanation.search.stepwise_search import applicable_candidates
from rippletwin.explanation.stages.preparation import HIGHEST_HZ
from rippletwin.spectra.frequency_selection import select_fitted_frequencies
from rippletwin.spectra.observation import observe
from rippletwin.twin.twin import Twin

SOURCE_ERROR = 0.02
ALIKE = 3.0  # log evidence: twenty to one
SHOWN = 30.0  # log evidence: cells further below the true effect stay empty


def effects_to_try(rig, observations) -> list:
    """Each effect once: in the line's second segment or at its first place."""
    chosen = {}
    for effect, place in applicable_candidates(rig, observations):
        if effect.name not in chosen or place.element == "segment 2":
            chosen[effect.name] = (effect, place)
    return list(chosen.values())


def coordinate(parameter, strength: float) -> float:
    """Coordinate of an effect's parameter at `strength`."""
    if parameter.prior.kind == "lognormal":
        return strength
    centred = parameter.prior.kind == "normal" and parameter.prior.centre == 0.0
    return float(np.exp(strength)) if centred else 0.0


def synthetic_recordings(rig, observations, effect, strength, rng):
    """(observations of a twin with the effect, relative change that the effect makes)."""
    twin = Twin(rig, observations, effects=(effect,))
    own = f"{effect[0].name}@{effect[1]}."
    theta = rng.normal(size=len(twin.theta)).clip(-2, 2)
    for k, p in enumerate(twin.parameters):
        if p.flat or p.name.startswith(own):
            theta[k] = 0.0 if p.flat else coordinate(p, strength)
    with_effect = twin.with_(theta=theta).predict(observations)
    base = Twin(rig, observations)
    common = [theta[twin.index[p.name]] for p in base.parameters]
    without = base.with_(theta=np.array(common)).predict(observations)
    made = []
    for o, h in zip(observations, with_effect):
        basis = smooth_basis(o.frequency_hz, np.zeros(len(o.frequency_hz)))
        wrong = 1.0 + SOURCE_ERROR * (_complex(rng, len(basis)) @ basis)
        root = np.linalg.cholesky(o.covariance + 1e-12 * np.eye(len(h)))
        noise = np.einsum("fst,tf->sf", root, _complex(rng, *h.shape))
        made.append(replace(o, values=wrong * h + noise))
    share = relative_misfit(np.concatenate(with_effect, 1), np.concatenate(without, 1))
    return made, share


def _complex(rng, *shape) -> np.ndarray:
    return (rng.normal(size=(*shape, 2)) @ np.array([1, 1j])) / np.sqrt(2)


def best_of_each(rig, observations, processes: int) -> dict[str, tuple[float, str]]:
    """Name -> (log evidence that it adds to the line, place) of each effect at its best place."""
    with open_workers(Twin(rig, observations), observations, processes) as pool:
        base, _, singles = fit_single_effects(pool, applicable_candidates(rig, observations))
    best = {}
    for fit in singles:  # best first
        gain, place = fit.evidence - base.evidence, str(fit.hypothesis[-1][1])
        best.setdefault(fit.names[-1], (gain, place))
    return best


def table(rows: list[tuple]) -> str:
    """Markdown: true effects down, fitted effects across; cells within SHOWN of the true effect."""
    names = [effect.name for (effect, _), _, _ in rows]
    heads = " | ".join(str(k + 1) for k in range(len(names)))
    lines = [
        f"| true effect | change of the ripple | log evidence | fitted place | {heads} |",
        "|---|---|---|---|" + "---|" * len(names),
    ]
    for k, ((effect, place), share, best) in enumerate(rows):
        gain, fitted_place = best[effect.name]
        cells = []
        for name in names:
            less = best[name][0] - gain if name in best else -np.inf
            text = f"{less:.0f}" if less > -SHOWN else ""
            cells.append(f"**{text}**" if less > -ALIKE and name != effect.name else text)
        title = f"{k + 1} {effect.name.replace('_', ' ')}, {place}"
        lines.append(
            f"| {title} | {share:.1%} | {gain:.0f} | {fitted_place} | {' | '.join(cells)} |"
        )
    return "\n".join(lines) + "\n"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("case", type=Path)
    parser.add_argument("--strength", type=float, default=-2.0)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--processes", type=int, default=2)
    options = parser.parse_args()
    case = load_case(options.case, states={"healthy"})
    observations = select_fitted_frequencies(
        [observe(r, case.rig, HIGHEST_HZ) for r in case.healthy], case.rig, HIGHEST_HZ
    )
    rows = []
    for k, effect in enumerate(tqdm(effects_to_try(case.rig, observations), unit="effect")):
        rng = np.random.default_rng(k)
        made, share = synthetic_recordings(case.rig, observations, effect, options.strength, rng)
        rows.append((effect, share, best_of_each(case.rig, made, options.processes)))
        page = table(rows)
        if options.out:
            options.out.write_text(page)
    print(page)


if __name__ == "__main__":
    main()
