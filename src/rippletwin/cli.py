"""The command line: rippletwin COMMAND ...

A command is one function here that adds its parser and sets `run`; it imports what it needs when
it runs, so that the command line answers at once.
"""

from __future__ import annotations

import argparse
import math
import os
import signal
import sys
from contextlib import contextmanager
from pathlib import Path

from rippletwin import __version__
from rippletwin.errors import InputError

BAD_INPUT, INTERRUPTED, CLOSED_PIPE = 2, 130, 141  # exit codes; 128 and the signal's number
MAX_PROCESSES = 1024
EFFECTIVE = os.access in os.supports_effective_ids


def check(commands) -> None:
    """rippletwin check CASE"""
    parser = commands.add_parser("check", help="read a case and say what is in it")
    parser.add_argument("case", help="a folder with a rig.yaml")

    def run(arguments) -> int:
        from threadpoolctl import threadpool_limits

        from rippletwin.case.load import load_case
        from rippletwin.spectra.case_summary import summarise_case

        case = load_case(arguments.case)
        _warn(case)
        # one thread: the matrices are small, and threads only wait for each other
        with threadpool_limits(1), _progress_bars(passing=True) as progress:
            for line in summarise_case(case, progress):
                print(line, flush=True)
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
        _check_max_frequency(arguments.max_frequency)
        _check_out(arguments.out)
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
        _warn(case)
        observations = [observe(r, case.rig, piston_harmonics_only=True) for r in case.recordings]
        lowest = max(o.frequency_hz[0] for o in observations)
        if arguments.max_frequency is not None and arguments.max_frequency < lowest:
            raise InputError(
                "command line",
                "--max-frequency",
                f"{arguments.max_frequency:g} Hz leaves nothing of a recording, whose lowest "
                f"frequency is {lowest:.4g} Hz",
                "give a multiple of the pump's piston frequency, or leave it out",
            )
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

    parser.add_argument(
        "--effects",
        action="append",
        default=[],
        metavar="FILE",
        help="also try the effect that a Python file defines as EFFECT, again for more",
    )

    def run(arguments) -> int:
        import json

        _check_processes(arguments.processes)
        _check_out(arguments.out)
        # One thread a process: the matrices are small, and the processes share the cores.
        os.environ.setdefault("OMP_NUM_THREADS", "1")
        from rippletwin.case.load import load_case
        from rippletwin.explanation.checks.bootstrap import MIN_DRAWS
        from rippletwin.explanation.explain import explain as find
        from rippletwin.explanation.verdict.verdict_file import write_verdict
        from rippletwin.twin.effects.library import add_effects

        if arguments.bootstrap and arguments.bootstrap < MIN_DRAWS:
            raise InputError(
                "command line",
                "--bootstrap",
                f"{arguments.bootstrap} draws tell no threshold",
                f"give at least {MIN_DRAWS}, or leave it out",
            )
        case = load_case(arguments.case, states={"healthy"})
        add_effects(arguments.effects, case.rig)
        _warn(case)
        with _progress_bars(arguments.json_only) as progress:
            explanation = find(case, arguments.processes, progress, arguments.bootstrap)
        result = write_verdict(explanation, arguments.out)
        if not arguments.no_figures:
            from rippletwin.figures.explanation import draw

            draw(explanation, arguments.out, processes=arguments.processes)
        print(json.dumps(result) if arguments.json_only else result["sentence"])
        return 0

    parser.set_defaults(run=run)


def diagnose(commands) -> None:
    """rippletwin diagnose CASE --out DIR"""
    parser = commands.add_parser(
        "diagnose", help="say what is wrong with the pump in recordings of unknown state"
    )
    parser.add_argument("case", help="a folder with a rig.yaml")
    parser.add_argument("--out", required=True, help="folder for diagnosis.json and figures")
    parser.add_argument(
        "--twin",
        metavar="TWIN.json",
        help="the twin, as explain or calibrate wrote it; without it the healthy recordings are "
        "explained first, and verdict.json and twin.json are written too",
    )
    parser.add_argument(
        "--recording",
        action="append",
        default=[],
        metavar="LABEL",
        help="diagnose this one, again for more; all of unknown state by default",
    )
    parser.add_argument(
        "--faults",
        action="append",
        default=[],
        metavar="FILE",
        help="also try the fault that a Python file defines as FAULT, or one of the library that "
        "is not tried by default, by its name (valve_plate)",
    )
    parser.add_argument(
        "--effects",
        action="append",
        default=[],
        metavar="FILE",
        help="an effect of the twin that a Python file defines as EFFECT, again for more; explain "
        "tries it too",
    )
    parser.add_argument(
        "--networks",
        metavar="RESULTS",
        help="also ask the networks that a workflow has trained on randomised datasets",
    )
    parser.add_argument(
        "--json", action="store_true", help="print the diagnosis as JSON and nothing else"
    )
    parser.add_argument("--processes", type=int, default=2, help="processes to explain with")
    parser.add_argument("--no-figures", action="store_true", help="write no figures")

    def run(arguments) -> int:
        import json

        os.environ.setdefault("OMP_NUM_THREADS", "1")
        from rippletwin.case.load import load_case
        from rippletwin.diagnosis.diagnose import diagnose as find
        from rippletwin.diagnosis.diagnose import select_recordings
        from rippletwin.diagnosis.diagnosis_file import write_diagnosis
        from rippletwin.diagnosis.faults.library import select_faults
        from rippletwin.twin.effects.library import add_effects

        _check_out(arguments.out)
        _check_processes(arguments.processes)
        faults = select_faults(arguments.faults)
        states = None if arguments.recording else {"healthy", "unknown"}
        case = load_case(arguments.case, states=states)
        add_effects(arguments.effects, case.rig)
        _warn(case)
        recordings = select_recordings(case, arguments.recording)
        networks = _networks_of(arguments, case)
        with _progress_bars(arguments.json) as progress:
            twin = _twin_of(arguments, case, recordings, progress)
            found = find(case, twin, recordings, faults, progress)
        result = write_diagnosis(found, arguments.out, _answers(networks, recordings, case))
        if not arguments.no_figures:
            from rippletwin.figures.fault_posterior import draw

            draw(found, arguments.out)
        if arguments.json:
            print(json.dumps(result))
        else:
            print("\n".join(each["sentence"] for each in result["recordings"]))
        return 0

    parser.set_defaults(run=run)


def _networks_of(arguments, case) -> dict:
    """The networks in the folder that the command line names, none where it names none."""
    if arguments.networks is None:
        return {}
    from rippletwin.diagnosis.network_answers import find_networks

    return find_networks(arguments.networks, case.rig)


def _answers(networks: dict, recordings, case) -> dict:
    """What networks say of recordings, by label, with a warning where they are not asked."""
    if not networks:
        return {}
    from rippletwin.diagnosis.network_answers import ask_networks

    answers = ask_networks(networks, recordings, case.rig)
    for label, said in answers.items():
        if len(said) < len(networks):
            print(
                f"rippletwin: warning: {label}: not shown to networks of another operating point",
                file=sys.stderr,
            )
    return answers


def _twin_of(arguments, case, recordings, progress):
    """The twin that the command line names, or the one that explains the healthy recordings."""
    if arguments.twin is not None:
        from rippletwin.twin.twin_file import load_twin

        return load_twin(arguments.twin)
    from dataclasses import replace

    from rippletwin.explanation.explain import explain as find
    from rippletwin.explanation.verdict.verdict_file import write_verdict

    diagnosed = {recording.label for recording in recordings}
    known = tuple(r for r in case.recordings if r.label not in diagnosed)
    explanation = find(replace(case, recordings=known), arguments.processes, progress)
    write_verdict(explanation, arguments.out)
    return explanation.twin


@contextmanager
def _progress_bars(quiet: bool = False, passing: bool = False):
    """A function of (what, done, total) that draws one bar for each `what` on standard error.

    Nothing is drawn where standard error is no terminal. `passing` bars are for work that is
    mostly short: they appear after two seconds, and go when they are full.
    """
    from tqdm import tqdm

    bars = {}

    def progress(what: str, done: int, total: int) -> None:
        if what not in bars:
            bars[what] = tqdm(
                total=total,
                desc=what,
                disable=True if quiet else None,
                leave=not passing,
                delay=2.0 if passing else 0.0,
            )
        bars[what].update(done - bars[what].n)
        if passing and done >= total:
            bars.pop(what).close()

    try:
        yield progress
    finally:
        for bar in bars.values():
            bar.close()


def _warn(case) -> None:
    """Write a case's warnings to standard error."""
    for warning in case.warnings:
        print(f"rippletwin: warning: {warning}", file=sys.stderr)


def _check_max_frequency(value: float | None) -> None:
    if value is not None and not (math.isfinite(value) and value > 0):
        raise InputError(
            "command line",
            "--max-frequency",
            f"{value:g} is no frequency",
            "give a positive number of Hz, or leave it out",
        )


def _check_processes(value: int) -> None:
    if not 1 <= value <= MAX_PROCESSES:
        raise InputError(
            "command line",
            "--processes",
            f"{value} processes cannot be started",
            f"give a number from 1 to {MAX_PROCESSES}; as many as there are processors is best",
        )


def _check_out(out: str) -> None:
    """Raise InputError where results could not be written to the folder `out`.

    This is asked before anything is fitted, so that hours of fitting are not lost at the end.
    """
    problem = "no folder is named" if not out.strip() else None
    try:
        place = Path(out).absolute()
        while problem is None and not place.exists():
            place = place.parent
        if problem is None and not place.is_dir():
            problem = f"{place} is a file, not a folder"
        elif problem is None and not os.access(place, os.W_OK | os.X_OK, effective_ids=EFFECTIVE):
            problem = f"you are not allowed to write to {place}"
    except (OSError, ValueError) as error:
        problem = f"cannot be opened ({getattr(error, 'strerror', None) or error})"
    if problem is not None:
        raise InputError("command line", "--out", problem, "name a folder that you may write to")


COMMANDS = (check, calibrate, explain, diagnose)


def _end_quietly() -> None:
    """In a process that fits: let Ctrl-C end it without a traceback."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def main(argv: list[str] | None = None) -> int:
    """Run one command.

    Returns the exit code: 0; 2 for bad input, which is reported on standard error with one line
    for each fault; 130 after Ctrl-C and 141 where the reader of standard output has gone, both
    without a word.
    """
    parser = argparse.ArgumentParser(prog="rippletwin", description=__doc__.splitlines()[0])
    parser.add_argument("--version", action="version", version=__version__)
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for add in COMMANDS:
        add(commands)
    arguments = parser.parse_args(argv)
    try:
        os.register_at_fork(after_in_child=_end_quietly)
        code = arguments.run(arguments)
        if sys.stdout is not None:
            sys.stdout.flush()
        return code
    except InputError as error:
        for each in error.errors:
            print(f"rippletwin: {each}", file=sys.stderr)
        return BAD_INPUT
    except KeyboardInterrupt:
        return INTERRUPTED
    except BrokenPipeError:
        # What is left in the buffer has no reader: it goes nowhere when the interpreter ends.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return CLOSED_PIPE


if __name__ == "__main__":
    sys.exit(main())
