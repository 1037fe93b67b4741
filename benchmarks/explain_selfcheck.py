"""How often `rippletwin explain` is right on cases of the library's own making.

    python benchmarks/explain_selfcheck.py run FILE --kind none|single|pair [--first 0] [--cases 20]
        [--geometry]
    python benchmarks/explain_selfcheck.py summary FILE...

`run` appends one JSON line a case to FILE. A case is drawn from its number alone: a line of two to
four segments, two or three sensors, one to three operating points, 0.5 to 4 kPa of sensor noise,
nominal values off by their stated uncertainty, a nominal flow ripple whose backflow is wrong by a
few per cent in depth, width and timing, effects at random places with parameters from their priors.
With `--geometry` the ripple is the lumped pump's, its geometry is known, and the true pump has
another bulk modulus (4 %), port timing (0.3 deg) and dead volume (2 %, no parameter of the twin).

The recordings come from the same equations as the twin, so this measures the statistics of
explaining (false alarms, confusion, coverage) and not whether the equations are right.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from rippletwin.calibration.frequency_continuation import refine
from rippletwin.calibration.misfit import relative_misfit
from rippletwin.case.model import FlowRipple, Fluid, Load, Rig, Segment, Sensor
from rippletwin.explanation.checks.profile_intervals import effect_intervals, own_parameter_indices
from rippletwin.explanation.explain import explain_observations
from rippletwin.explanation.search.stepwise_search import applicable_candidates
from rippletwin.explanation.verdict.places import element_and_extent
from rippletwin.explanation.verdict.verdict_file import verdict_dict
from rippletwin.pump.outlets import ConstantPressure
from rippletwin.pump.simulation import simulate
from rippletwin.spectra.observation import Observation
from rippletwin.twin.effects.library import candidates
from rippletwin.twin.forward_model import ForwardModel
from rippletwin.twin.twin import Twin

REVOLUTIONS, SAMPLES = 160, 3072
DETECTABLE = 15.0  # log evidence of the true explanation, fitted from the truth, over none
EFFECTS = {"none": 0, "single": 1, "pair": 2}


def draw_rig(rng) -> Rig:
    """A line of two to four segments, 4 to 10 m long, with two or three sensors."""
    count = rng.integers(2, 5)
    lengths = rng.dirichlet(np.full(count, 3.0)) * rng.uniform(4.0, 10.0)
    line = tuple(
        Segment(float(x), float(rng.uniform(0.012, 0.025)), float(rng.uniform(900, 1350)))
        for x in lengths
    )
    total = float(np.sum(lengths))
    places = np.sort(rng.uniform(0.03, 0.95, rng.integers(2, 4))) * total
    while np.min(np.diff(places)) < 0.3:
        places = np.sort(rng.uniform(0.03, 0.95, len(places))) * total
    sensors = tuple(Sensor(f"p{k + 1}", float(x)) for k, x in enumerate(places))
    return Rig(Fluid(870.0, 3.2e-5), {"pistons": 9}, line, sensors, Load("orifice"))


def ripple(speed_hz, pressure, depth=0.5, width=0.04, timing=0.12) -> FlowRipple:
    """Kinematic ripple of nine pistons, each opening with a backflow that pressure deepens."""
    angle = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    flow = np.zeros_like(angle)
    for k in range(9):
        own = (angle + 2 * np.pi * k / 9) % (2 * np.pi)
        flow += np.where(own < np.pi, np.sin(own), 0.0)
        flow -= depth * np.exp(-0.5 * ((own - timing) / width) ** 2) * pressure / 1e7
    return FlowRipple(np.rad2deg(angle), flow / flow.mean() * 40e-6 * speed_hz, pressure)


def draw_pump(rng) -> tuple[dict, dict]:
    """The pump on the data sheet and the true one."""
    sheet = {
        "pistons": 9,
        "bulk_modulus": float(rng.uniform(1.2e9, 1.5e9)),
        "port_opening_deg": float(rng.uniform(12.0, 30.0)),
        "port_overlap_deg": float(rng.uniform(1.0, 5.0)),
        "dead_volume": float(rng.uniform(1.5e-6, 4e-6)),
    }
    true = {
        "bulk_modulus": sheet["bulk_modulus"] * float(np.exp(0.04 * rng.normal())),
        "port_timing_deg": 0.3 * float(rng.normal()),
        "dead_volume": sheet["dead_volume"] * float(np.exp(0.02 * rng.normal())),
    }
    return sheet, sheet | true


def pump_ripple(rig, pump: dict, speed_hz: float, pressure: float) -> FlowRipple:
    """The lumped pump's, as a file has it: an ideal source."""
    found = simulate(pump, rig.fluid, 60 * speed_hz, ConstantPressure(pressure))
    return FlowRipple(found.angle_deg, found.flow, pressure)


def draw(rng, kind: str, geometry: bool = False):
    """(rig, observations, twin at the truth)."""
    rig = draw_rig(rng)
    noise = rng.uniform(0.5e3, 4e3)
    speeds = rng.permutation([1000, 1200, 1500])[: rng.integers(1, 4)] / 60
    shape = {
        "depth": rng.uniform(0.3, 0.6),
        "width": rng.uniform(0.03, 0.06),
        "timing": rng.uniform(0.1, 0.16),
    }
    wrong = {
        "depth": shape["depth"] * (1 + 0.04 * rng.normal()),
        "width": shape["width"] * (1 + 0.02 * rng.normal()),
        "timing": shape["timing"] + 0.002 * rng.normal(),  # rad: a tenth of a degree
    }
    if geometry:
        # Numbers of its own, so that line and effects are those of the case without.
        sheet, pump = draw_pump(np.random.default_rng(rng.bit_generator.seed_seq.entropy))
        rig = replace(rig, pump=sheet)
    observations, true_ripples = [], []
    for k, speed in enumerate(speeds):
        pressure = float(rng.uniform(5e6, 16e6))
        orders = 9 * np.arange(1, int(4000 / (9 * speed)) + 1)
        count = len(rig.sensors)
        covariance = np.eye(count) * 4 * noise**2 / (SAMPLES * REVOLUTIONS)
        observations.append(
            Observation(
                "periodic",
                f"point {k + 1}",
                orders * speed,
                orders,
                np.ones((count, len(orders)), complex),
                np.tile(covariance.astype(complex), (len(orders), 1, 1)),
                np.full(count, pressure),
                speed,
                pressure,
                "nominal",
                pump_ripple(rig, sheet, speed, pressure)
                if geometry
                else ripple(speed, pressure, **wrong),
                rig.sensors,
            )
        )
        true_ripples.append(
            pump_ripple(rig, pump, speed, pressure)
            if geometry
            else ripple(speed, pressure, **shape)
        )
    effects = draw_effects(rng, rig, observations, EFFECTS[kind])
    twin = Twin(rig, observations, effects=effects)
    theta = np.clip(rng.normal(size=len(twin.theta)), -2.5, 2.5)
    for k, p in enumerate(twin.parameters):
        if p.flat:
            theta[k] = rng.uniform(-np.pi / 9, np.pi / 9) / 0.01
    true = [replace(o, flow_ripple=r) for o, r in zip(observations, true_ripples)]
    recorded = []
    for o, h in zip(observations, ForwardModel(twin, true)(theta)):
        error = rng.normal(size=(*h.shape, 2)) @ np.array([1, 1j]) / np.sqrt(2)
        recorded.append(replace(o, values=h + error * np.sqrt(o.covariance[0, 0, 0].real)))
    return rig, recorded, twin.with_(theta=theta)


def draw_effects(rng, rig, observations, count: int) -> tuple:
    """`count` different effects at places of theirs, every effect equally likely."""
    allowed = applicable_candidates(rig, observations)
    names = sorted({effect.name for effect, _ in allowed})
    chosen = rng.permutation(names)[:count]
    found = []
    for name in chosen:
        places = [c for c in candidates(rig) if c[0].name == name]
        found.append(places[rng.integers(len(places))])
    return tuple(found)


def run_case(number: int, kind: str, geometry: bool = False) -> dict:
    """Draw, explain and score one case."""
    rng = np.random.default_rng([number, EFFECTS[kind]])
    rig, observations, truth = draw(rng, kind, geometry)
    base = Twin(rig, observations, uncertain_pump=True)
    start = time.process_time()
    e = explain_observations(rig, observations, processes=1)
    seconds = time.process_time() - start
    v = verdict_dict(e)
    at = dict(zip((p.name for p in truth.parameters), truth.theta))
    parameters = base.with_(effects=truth.effects).parameters
    theta = np.array([at.get(p.name, 0.0) for p in parameters])
    known = refine(base, truth.effects, observations, [theta])
    measured = np.concatenate([o.values for o in observations], axis=1)
    floor = relative_misfit(measured, np.concatenate(truth.predict(observations), axis=1))
    accepted, told = e.decision.accepted, {x["name"] for x in v["effects"]}
    actual = [(effect.name, str(place)) for effect, place in truth.effects]
    classes = [set(names) for names in v["equivalents"]]
    right = {n for n, _ in actual if n in told or any(n in c and c & told for c in classes)}
    return {
        "number": number,
        "kind": kind,
        "points": len(observations),
        "sensors": len(rig.sensors),
        "truth": actual,
        "strength": known.evidence - e.search.base.evidence,
        "verdict": v["verdict"],
        "told": [(x["name"], x["element"]) for x in v["effects"]],
        "best": [(a.name, str(b)) for a, b in e.search.best.hypothesis],
        "right": sorted(right),
        "wrong": sorted(told - {n for n, _ in actual} - {x for c in classes for x in c}),
        "placed": placed(rig, truth, e),
        "gain": e.search.log_bayes_factor(e.search.best),
        "missed": known.evidence - e.search.best.evidence,
        "top_single": e.search.log_bayes_factor(e.search.single_effect_fits[0]),
        "alarms": list(e.alarms.raised),
        "pull": e.alarms.pull[0],
        "disagreement": e.alarms.disagreement[0],
        "base_floor": e.search.base.model_error,
        "floor": e.search.best.model_error,
        "folds": e.validation.disagreement,
        "held": held(truth, accepted),
        "z": z_scores(truth, accepted),
        "z_line": z_scores(truth, accepted, line=True),
        "held_out": [v["fit"][k]["held_out"] for k in ("before", "after")],
        "truth_misfit": floor,
        "seconds": seconds,
    }


def placed(rig, truth, e) -> bool | None:
    """Whether a named true effect is at its place; None where no true effect was named."""
    own = {}
    for effect, place, values in truth.effect_values(truth.theta):
        own[effect.name] = (place, values)
    results = []
    for entry in effect_intervals(e.decision.accepted):
        name = entry["effect"].name
        if name not in own:
            continue
        place, values = own[name]
        if "position" in values:
            low, high = element_and_extent(
                rig, entry["effect"], entry["place"], entry["parameters"]
            )[1]
            results.append(low - 0.25 <= float(values["position"]) <= high + 0.25)
        else:
            results.append(place.element == entry["place"].element)
    return all(results) if results else None


def held(truth, accepted) -> list[bool]:
    """Whether the 95 % intervals of the effects' parameters hold the truth."""
    found = []
    for _, _, own in own_parameter_indices(accepted.twin):
        for k in own:
            name = accepted.twin.parameters[k].name
            if name in truth.index:
                low, high = accepted.interval(k)
                found.append(low <= truth.theta[truth.index[name]] <= high)
    return found


def z_scores(truth, accepted, line=False) -> dict:
    """(fitted - true)/sd of the parameters of effects, or of the line, in prior coordinates."""
    twin, sd, found = accepted.twin, accepted.sd, {}
    for k, p in enumerate(twin.parameters):
        if p.flat or ("@" in p.name) == line or p.name not in truth.index:
            continue
        found[p.name] = float((twin.theta[k] - truth.theta[truth.index[p.name]]) / sd[k])
    return found


def summary(rows: list[dict]) -> str:
    """Rates as text."""
    lines = []
    for kind in EFFECTS:
        cases = [r for r in rows if r["kind"] == kind]
        if not cases:
            continue
        lines.append(f"{kind}: {len(cases)} cases, {np.mean([r['seconds'] for r in cases]):.0f} s")
        if kind == "none":
            alarms = [r for r in cases if r["verdict"] not in ("consistent", "calibration_only")]
            lines.append(f"  false alarms {len(alarms)}: {[r['number'] for r in alarms]}")
            lines.append(f"  largest model error: {max(r['floor'] for r in cases):.4f}")
            top = sorted((r["top_single"] for r in cases), reverse=True)
            lines.append("  largest evidence of any single effect: " + _row(top[:8]))
            pulls = sorted((r["pull"] for r in cases), reverse=True)
            lines.append("  pull: " + _row(pulls[:8]))
            apart = sorted((r["disagreement"] for r in cases), reverse=True)
            lines.append("  disagreement: " + _row(apart[:8]))
            continue
        seen = [r for r in cases if r["strength"] > DETECTABLE]
        lines.append(f"  detectable (true explanation's evidence > {DETECTABLE:g}): {len(seen)}")
        verdicts = {}
        for r in seen:
            verdicts[r["verdict"]] = verdicts.get(r["verdict"], 0) + 1
        lines.append(f"  verdicts: {verdicts}")
        some = sum(bool(r["right"]) and not r["wrong"] for r in seen)
        every = sum(len(r["right"]) == len(r["truth"]) and not r["wrong"] for r in seen)
        lines.append(f"  at least one right and none wrong: {some}; all right: {every}")
        lines.append(f"  wrong names: {sum(bool(r['wrong']) for r in seen)}")
        where = [r["placed"] for r in seen if r["placed"] is not None]
        lines.append(f"  right place: {sum(where)} of {len(where)}")
        missed = [r["number"] for r in seen if r["missed"] > 3.0]
        lines.append(f"  optimiser behind the truth by more than 3: {missed}")
        folds = sorted((r["folds"] for r in seen if r["right"]), reverse=True)
        lines.append("  folds' disagreement where right: " + _row(folds[:8]))
        good = [r for r in seen if len(r["right"]) == len(r["truth"]) and not r["wrong"]]
        inside = [x for r in good for x in r["held"]]
        holding = f"{sum(inside):.0f} of {len(inside)}"
        lines.append(f"  intervals of effects that hold the truth: {holding}")
        for key in ("z", "z_line"):
            z = np.array([x for r in good for x in r[key].values()])
            if len(z):
                lines.append(
                    f"  {key}: {np.mean(np.abs(z) < 1.96):.1%} of {len(z)} within 1.96 deviations, "
                    f"rms {np.sqrt(np.mean(np.clip(z, -9, 9) ** 2)):.2f}"
                )
        if good:
            lines.append(f"  largest model error of these: {max(r['floor'] for r in good):.4f}")
        ratio = [r["held_out"][1] / r["truth_misfit"] for r in good]
        if ratio:
            lines.append(f"  held-out misfit over the truth's: median {np.median(ratio):.2f}")
        for r in seen:
            if not r["right"] or r["wrong"]:
                lines.append(
                    f"    {r['number']}: {r['truth']} told {r['verdict']} {r['told']} "
                    f"best {r['best']} strength {r['strength']:.0f} missed {r['missed']:.0f} "
                    f"floor {r['floor']:.3f} folds {r['folds']:.1f}"
                )
    return "\n".join(lines)


def _row(values) -> str:
    return " ".join(f"{x:.1f}" for x in values)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(dest="command", required=True)
    running = commands.add_parser("run")
    running.add_argument("file", type=Path)
    running.add_argument("--kind", choices=EFFECTS, required=True)
    running.add_argument("--first", type=int, default=0)
    running.add_argument("--cases", type=int, default=20)
    running.add_argument("--geometry", action="store_true")
    commands.add_parser("summary").add_argument("files", type=Path, nargs="+")
    arguments = parser.parse_args()
    if arguments.command == "summary":
        lines = [x for f in arguments.files for x in f.read_text().splitlines()]
        print(summary([json.loads(x) for x in lines]))
        return
    for number in range(arguments.first, arguments.first + arguments.cases):
        row = run_case(number, arguments.kind, arguments.geometry)
        with open(arguments.file, "a") as file:
            file.write(json.dumps(row, default=float) + "\n")
        print(number, row["truth"], row["verdict"], row["told"], f"{row['seconds']:.0f} s")


if __name__ == "__main__":
    main()
