"""The program: its commands, what errors and signals become, and exit codes.

A command is one module with a click command `command`, which returns its exit code or None for 0.
It imports what it needs when it runs, so that the command line answers at once.
"""

from __future__ import annotations

import io
import os
import signal
import sys
from collections.abc import Sequence

import click
from click.exceptions import Exit, NoArgsIsHelpError
from click.shell_completion import shell_complete

from rippletwin import __version__
from rippletwin.cli import (
    calibrate,
    check,
    completion,
    diagnose,
    explain,
    export,
    new,
    report,
    simulate,
)
from rippletwin.cli.exit_codes import BAD_INPUT, CLOSED_PIPE, INTERRUPTED
from rippletwin.errors import InputError, describe_write_error

HELP_WIDTH = 100  # columns at most
COMMANDS = {
    "new": new.command,
    "check": check.command,
    "calibrate": calibrate.command,
    "explain": explain.command,
    "diagnose": diagnose.command,
    "simulate": simulate.command,
    "export": export.command,
    "report": report.command,
    "completion": completion.command,
}


class InOrder(click.Group):
    """A group whose commands are listed in the order of the work."""

    def list_commands(self, context: click.Context) -> list[str]:
        return list(self.commands)


@click.group(
    cls=InOrder,
    commands=COMMANDS,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": HELP_WIDTH},
)
@click.version_option(__version__, message="%(version)s")
def program() -> None:
    """Diagnose axial piston pumps from pressure ripple, with a twin that says what it lacks."""


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command of `argv`, without the program's name; of the process where None.

    Returns the exit code. Bad input is reported on standard error with one line for each fault.
    After Ctrl-C, and where the reader of standard output has gone, nothing is printed.
    """
    if instruction := os.environ.get(completion.VARIABLE):
        return shell_complete(program, {}, completion.PROGRAM, completion.VARIABLE, instruction)
    if isinstance(sys.stdout, io.TextIOWrapper):  # a label in letters that the terminal has not
        sys.stdout.reconfigure(errors="backslashreplace")
    try:
        return _run(sys.argv[1:] if argv is None else list(argv))
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
    except OSError as error:  # the disk is full, or the folder read-only
        if (problem := describe_write_error(error)) is None:
            raise
        print(f"rippletwin: {problem}", file=sys.stderr)
        return BAD_INPUT


def _run(argv: list[str]) -> int:
    """The exit code of the command in `argv`; click's errors become ours."""
    try:
        with program.make_context(completion.PROGRAM, argv) as context:
            os.register_at_fork(after_in_child=_end_quietly)
            code = program.invoke(context) or 0
    except Exit as ended:  # --help and --version
        code = ended.exit_code
    except NoArgsIsHelpError as error:
        click.echo(error.format_message(), err=True)
        return error.exit_code
    except click.UsageError as error:
        path = completion.PROGRAM if error.ctx is None else error.ctx.command_path
        problem = error.format_message().rstrip(".")
        end = "" if problem.endswith("?") else "."
        print(f"rippletwin: command line: {problem}{end} See {path} --help", file=sys.stderr)
        return error.exit_code
    except click.Abort:  # Ctrl-C or the end of input at a question
        return INTERRUPTED
    if sys.stdout is not None:
        sys.stdout.flush()
    return code


def _end_quietly() -> None:
    """In a process that fits: let Ctrl-C end it without a traceback."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
