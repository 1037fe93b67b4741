"""The command line: rippletwin COMMAND ..."""

from rippletwin.cli.program import main

__all__ = ["main"]
