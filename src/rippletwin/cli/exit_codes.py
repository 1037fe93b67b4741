"""Exit codes of the commands."""

DONE = 0
BAD_INPUT = 2
FOUND = 3
"""The command has finished and found what `--fail-on` names."""
INTERRUPTED, CLOSED_PIPE = 130, 141  # as a shell has them: 128 and the signal's number


def found_code(found, fail_on) -> int:
    """FOUND where one of the words of `found` is in `fail_on`, else DONE."""
    return FOUND if set(found) & set(fail_on) else DONE
