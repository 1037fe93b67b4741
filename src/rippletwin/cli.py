"""The command line: rippletwin COMMAND ...

A command is one function here that adds its parser and sets `run`; it imports what it needs when
it runs, so that the command line answers at once.
"""

from __future__ import annotations

import argparse
import sys

from rippletwin import __version__
from rippletwin.errors import InputError


def check(commands) -> None:
    """rippletwin check CASE"""
    parser = commands.add_parser("check", help="read a case and say what is in it")
    parser.add_argument("case", help="a folder with a rig.yaml")

    def run(arguments) -> int:
        from rippletwin.case.load import load_case
        from rippletwin.spectra.case_summary import summarise_case

        for line in summarise_case(load_case(arguments.case)):
            print(line)
        return 0

    parser.set_defaults(run=run)


def calibrate(commands) -> None:
    """rippletwin calibrate CASE --out DIR"""
    parser = commands.add_parser("calibrate", help="fit the twin to a case's healthy recordings")
    parser.add_argument("case", help="a folder with a rig.yaml")
    parser.add_argument("--out", required=True, help="folder for twin.json and report.md")
    parser.add_argument(
        "--friction",
        choices=("none", "steady", "unsteady"),
        default="steady",
        help="the line's friction law; steady is the paper's",
    )
    parser.add_argument("--max-frequency", type=float, metavar="HZ", help="use nothing above it")

    def run(arguments) -> int:
        from rippletwin.calibration import report
        from rippletwin.calibration.calibrate import Settings
        from rippletwin.calibration.calibrate import calibrate as fit
        from rippletwin.case.load import load_case
        from rippletwin.spectra.observation import observe
        from rippletwin.twin.twin import Twin

        case = load_case(arguments.case, states={"healthy"})
        if not case.recordings:
            raise InputError(
                f"{arguments.case}/rig.yaml",
                "recordings",
                "none has state: healthy",
                "calibration needs at least one healthy recording",
            )
        observations = [observe(r, case.rig, piston_harmonics_only=True) for r in case.recordings]
        twin = Twin(case.rig, observations, friction=arguments.friction)
        settings = Settings(max_frequency_hz=arguments.max_frequency)
        calibration = fit(twin, observations, settings, progress=print)
        report.save(calibration, arguments.out)
        before, after = calibration.before, calibration.after
        print(f"relative misfit {before.relative:.1%} -> {after.relative:.1%}")
        print(f"Theil's coefficient {before.theil:.3f} -> {after.theil:.3f}")
        for warning in calibration.warnings:
            print(f"warning: {warning}")
        return 0

    parser.set_defaults(run=run)


def explain(commands) -> None:
    """rippletwin explain CASE --out DIR"""
    parser = commands.add_parser(
        "explain", help="say what physics the twin lacks, and where, with verdict.json"
    )
    parser.add_argument("case", help="a folder with a rig.yaml")
    parser.add_argument("--out", required=True, help="folder for verdict.json, twin.json, figures")
    parser.add_argument(
        "--json-only", action="store_true", help="print the verdict as JSON and nothing else"
    )
    parser.add_argument("--processes", type=int, default=2, help="processes to fit with")
    parser.add_argument("--no-figures", action="store_true", help="write no figures")
    parser.add_argument(
        "--bootstrap",
        type=int,
        default=0,
        metavar="N",
        help="where something is named, N recordings drawn without it and fitted with the whole "
        "library say what chance gives (at least 10; each takes a good part of the first search)",
    )

    def run(arguments) -> int:
        import json
        import os

        # One thread a process: the matrices are small, and the processes share the cores.
        os.environ.setdefault("OMP_NUM_THREADS", "1")
        from tqdm import tqdm

        from rippletwin.case.load import load_case
        from rippletwin.explanation.checks.bootstrap import MIN_DRAWS
        from rippletwin.explanation.explain import explain as find
        from rippletwin.explanation.verdict.verdict_file import write_verdict

        if arguments.bootstrap and arguments.bootstrap < MIN_DRAWS:
            raise InputError(
                "command line",
                "--bootstrap",
                f"{arguments.bootstrap} draws tell no threshold",
                f"give at least {MIN_DRAWS}, or leave it out",
            )
        case = load_case(arguments.case, states={"healthy"})
        bars = {}

        def progress(what, done, total):
            if what not in bars:
                bars[what] = tqdm(total=total, desc=what, disable=arguments.json_only)
            bars[what].update(done - bars[what].n)

        try:
            explanation = find(case, arguments.processes, progress, arguments.bootstrap)
        finally:
            for bar in bars.values():
                bar.close()
        result = write_verdict(explanation, arguments.out)
        if not arguments.no_figures:
            from rippletwin.figures.explanation import draw

            draw(explanation, arguments.out, processes=arguments.processes)
        print(json.dumps(result) if arguments.json_only else result["sentence"])
        return 0

    parser.set_defaults(run=run)


COMMANDS = (check, calibrate, explain)


def main(argv: list[str] | None = None) -> int:
    """Run one command; bad input is told on standard error and ends with exit code 2."""
    parser = argparse.ArgumentParser(prog="rippletwin", description=__doc__.splitlines()[0])
    parser.add_argument("--version", action="version", version=__version__)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for add in COMMANDS:
        add(commands)
    arguments = parser.parse_args(argv)
    try:
        return arguments.run(arguments)
    except InputError as error:
        print(f"rippletwin: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
