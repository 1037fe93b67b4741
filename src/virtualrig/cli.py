"""Command line of the virtual rig: virtualrig record | check | conceal | population.

`record` records a case folder. `check` checks the numerics of concealed cases, and `conceal`
records a case drawn at random and seals its truth (docs/concealed.md). `population` records one rig
of a population, with recordings of unknown state, and seals their truth (docs/diagnosis_trial.md).
"""

import argparse
import json
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from multiprocessing import get_context
from pathlib import Path

import numpy as np

from virtualrig.conceal import record_concealed_case
from virtualrig.draw import draw_case, random_generator
from virtualrig.draw_population import draw_rig
from virtualrig.exact import check_numerics
from virtualrig.folder import (
    prepare_folder,
    recording_entry,
    ripple_name,
    write_recording,
    write_ripple,
    write_sheet,
    write_truth,
)
from virtualrig.nuisance_case import draw_nuisance_case, record_nuisance_case
from virtualrig.population import record_rig
from virtualrig.recorder import Point, nominal_ripple, record
from virtualrig.rig import SEAL, SHEET, Rig, RigError, read_rig, read_yaml
from virtualrig.seal import new_key, seal

_STATES = tuple(
    Point(f"{state}_1000_95", 1000.0, 9.5e6, 9.6, state)
    for state in ("healthy", "slipper", "cylinder")
)
_HEALTHY = tuple(
    Point(f"healthy_{speed}_{bar}", float(speed), bar * 1e5, 4.8)
    for speed, bar in ((1200, 60), (800, 95), (1200, 95), (1000, 60), (1000, 120), (800, 60))
)
_SEVERITIES = tuple(
    Point(f"{state}_{number}", 1000.0, 9.5e6, 9.6, state, area)
    for state, areas in (
        ("slipper", {1: 1.85e-7, 2: 3.33e-7, 4: 1.08e-6, 5: 1.94e-6}),
        ("cylinder", {1: 1.54e-7, 2: 2.78e-7, 3: 5.0e-7, 5: 1.62e-6}),
    )
    for number, area in areas.items()
)
POINTS = {"full": _STATES + _HEALTHY + _SEVERITIES, "smoke": _STATES + _HEALTHY[:1]}
"""Operating points: each state at 1000 r/min and 9.5 MPa, the healthy pump at others too, and four
more severities of either fault, whose areas with the sealed one are a factor of 1.8 apart."""


def main(arguments: list[str] | None = None) -> int:
    """Entry point; returns the exit status."""
    options = _parser().parse_args(arguments)
    try:
        options.run(options)
    except (RigError, OSError) as error:
        print(f"virtualrig: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        print("virtualrig: interrupted; the case folder is incomplete", file=sys.stderr)
        return 130
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="virtualrig", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    commands = parser.add_subparsers(dest="command", required=True)
    make = commands.add_parser("record", help="record operating points into a new case folder")
    make.add_argument("--out", type=Path, required=True, help="case folder to write (new or empty)")
    make.add_argument(
        "--seed",
        type=int,
        default=0,
        help="of the noise, the wander of the speed, the settings and the shaft angles",
    )
    make.add_argument("--processes", type=int, default=1, help="operating points at a time")
    make.add_argument("--seconds", type=float, help="length of every recording")
    make.add_argument(
        "--points", default="full", help="full, smoke, or a YAML file with a list `points`"
    )
    make.add_argument("--sheet", type=Path, default=SHEET, help="what the rig's owner knows")
    make.add_argument("--sealed", type=Path, default=SEAL, help="what the rig really is")
    make.add_argument(
        "--flow-ripple",
        action="store_true",
        help="add flow ripples that the sheet's pump gives on the sheet's line",
    )
    make.add_argument("--true-flow", type=Path, help="folder for the true outlet flow (sealed)")
    make.set_defaults(run=_record)
    check = commands.add_parser("check", help="numerics of concealed cases against exact solutions")
    check.add_argument("--out", type=Path, required=True, help="JSON file to write")
    check.set_defaults(run=_check)
    hide = commands.add_parser("conceal", help="record one case drawn at random and seal its truth")
    hide.add_argument("--case", type=int, required=True, help="which of the cases, from 0")
    hide.add_argument(
        "--bench",
        choices=("nuisance", "clean"),
        default="nuisance",
        help="rigs with nuisance physics beside the effect, or without",
    )
    hide.set_defaults(run=_conceal)
    drawn = commands.add_parser("population", help="record one rig of a population, states unknown")
    drawn.add_argument("--rig", type=int, required=True, help="which of the rigs, from 0")
    drawn.set_defaults(run=_population)
    for command in (hide, drawn):
        command.add_argument(
            "--out", type=Path, required=True, help="case folder to write (new or empty)"
        )
        command.add_argument("--seal", type=Path, required=True, help="sealed truth to write")
        command.add_argument("--key", type=Path, required=True, help="key of the seal to write")
    for command in (check, hide, drawn):
        command.add_argument("--commit", required=True, help="hash of the tool that is to be tried")
        command.add_argument("--number", type=int, required=True, help="number of the trial")
    for command in (check, hide):
        command.add_argument("--cases", type=int, required=True, help="how many cases it has")
    return parser


def _points(choice: str) -> tuple[Point, ...]:
    if choice in POINTS:
        return POINTS[choice]
    listing = read_yaml(choice).get("points")
    try:
        points = tuple(Point(**entry) for entry in listing)
        for point in points:
            for name in ("speed_rpm", "load_pressure", "seconds"):
                if not getattr(point, name) > 0:
                    raise TypeError(f"{point.label}: {name} must be above zero")
    except TypeError as error:
        raise RigError(f"{choice}: field points: {error}") from None
    labels = [point.label for point in points]
    twice = sorted({label for label in labels if labels.count(label) > 1})
    if twice:
        raise RigError(f"{choice}: field points: label {', '.join(twice)} is there twice")
    return points


def _record(options: argparse.Namespace) -> None:
    _at_least(options, "processes", 1)
    _at_least(options, "seed", 0)
    points = _points(options.points)
    if options.seconds is not None:
        if not options.seconds > 0:
            raise RigError(f"--seconds {options.seconds}: must be positive")
        points = tuple(replace(point, seconds=options.seconds) for point in points)
    known, rig = read_rig(options.sheet, options.sealed)
    unknown = {fault for point in points for fault in point.faults} - set(rig.faults)
    if unknown:
        raise RigError(f"{options.sealed}: field faults: no {', '.join(sorted(unknown))}")
    prepare_folder(options.out, options.true_flow)
    work = partial(_record_point, options, known, rig)
    pool = ProcessPoolExecutor(options.processes, get_context("fork"))
    try:
        for number, label in enumerate(pool.map(work, range(len(points)), points), 1):
            print(f"virtualrig: {number}/{len(points)} {label}", file=sys.stderr, flush=True)
    finally:
        pool.shutdown(cancel_futures=True)
    entries = [recording_entry(point, options.flow_ripple and not point.faults) for point in points]
    write_sheet(options.out, known, entries)


def _record_point(options: argparse.Namespace, known: dict, rig: Rig, index: int, point: Point):
    """Record and write one operating point; returns its label."""
    take = record(rig, point, np.random.default_rng([options.seed, index]))
    write_recording(options.out / "recordings" / f"{point.label}.h5", take)
    if options.true_flow is not None:
        write_truth(options.true_flow / f"{point.label}.h5", take)
    if options.flow_ripple and not point.faults:
        write_ripple(options.out / ripple_name(point), *nominal_ripple(known, point))
    return point.label


def _at_least(options: argparse.Namespace, name: str, least: int) -> None:
    """Raises RigError where an option is below `least`."""
    value = getattr(options, name)
    if value < least:
        raise RigError(f"--{name} {value}: must be at least {least}")


def _check(options: argparse.Namespace) -> None:
    _at_least(options, "cases", 1)
    checks = check_numerics(options.cases, options.commit, options.number)
    options.out.write_text(json.dumps([vars(check) for check in checks], indent=1) + "\n")
    for check in checks:
        print(f"virtualrig: {check}", file=sys.stderr)
    wrong = [str(check) for check in checks if not check.passed]
    if wrong:
        options.out.unlink()
        raise RigError(f"the numerics are not good enough: {'; '.join(wrong)}")


def _conceal(options: argparse.Namespace) -> None:
    _keep_truth_out(options)
    if not 0 <= options.case < options.cases:
        raise RigError(f"--case {options.case}: there are {options.cases} cases, from 0")
    trial = (options.commit, options.number)
    rng = random_generator(*trial, "recording", options.case)
    if options.bench == "nuisance":
        case = draw_nuisance_case(options.cases, *trial, options.case)
        truth = record_nuisance_case(case, options.out, rng)
    else:
        drawn = draw_case(options.cases, *trial, options.case)
        truth = record_concealed_case(drawn, options.out, rng)
    _write_seal(options, truth)


def _population(options: argparse.Namespace) -> None:
    _keep_truth_out(options)
    if options.rig < 0:
        raise RigError(f"--rig {options.rig}: rigs count from 0")
    trial = (options.commit, options.number)
    rng = random_generator(*trial, "population recording", options.rig)
    report = partial(print, "virtualrig: recorded", file=sys.stderr, flush=True)
    truth = record_rig(draw_rig(*trial, options.rig), options.out, rng, report)
    _write_seal(options, truth)


def _keep_truth_out(options: argparse.Namespace) -> None:
    """Raises RigError where the seal or its key would lie in the case folder, or would replace
    another file; makes their folders."""
    if options.seal.resolve() == options.key.resolve():
        raise RigError(f"--key {options.key}: is the file of --seal; name another")
    for path, name in ((options.seal, "--seal"), (options.key, "--key")):
        if path.resolve().is_relative_to(options.out.resolve()):
            raise RigError(f"{name} {path}: lies in the case folder; keep the truth out of it")
        if path.exists():
            raise RigError(f"{name} {path}: is there already; name a new file")
        path.parent.mkdir(parents=True, exist_ok=True)


def _write_seal(options: argparse.Namespace, truth: dict) -> None:
    key = new_key()
    options.seal.write_text(json.dumps(seal(truth, key)) + "\n")
    options.key.write_bytes(key)
    options.key.chmod(0o400)
