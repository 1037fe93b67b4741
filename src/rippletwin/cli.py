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
        from rippletwin.case import load_case
        from rippletwin.case.report import report

        for line in report(load_case(arguments.case)):
            print(line)
        return 0

    parser.set_defaults(run=run)


COMMANDS = (check,)


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
