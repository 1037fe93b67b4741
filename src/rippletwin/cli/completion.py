"""rippletwin completion SHELL: the script that completes commands and options in a shell."""

from __future__ import annotations

import json

import click

from rippletwin.cli import options

PROGRAM, VARIABLE = "rippletwin", "_RIPPLETWIN_COMPLETE"
SHELLS = ("bash", "zsh", "fish")


@click.command("completion", short_help="print the script that completes commands in a shell")
@click.argument("shell", type=click.Choice(SHELLS))
@options.json_output
@click.pass_context
def command(context: click.Context, shell: str, as_json: bool) -> None:
    """Print the script that completes commands and options in SHELL.

    For bash, put this line into ~/.bashrc: eval "$(rippletwin completion bash)"
    """
    from click.shell_completion import get_completion_class

    program = context.find_root().command
    script = get_completion_class(shell)(program, {}, PROGRAM, VARIABLE).source()
    print(json.dumps({"shell": shell, "script": script}) if as_json else script)
