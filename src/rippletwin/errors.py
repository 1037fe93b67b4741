"""The error a user's input can raise: it names the file, the field, the problem and the remedy."""

from __future__ import annotations

import errno
from collections.abc import Iterable

CANNOT_WRITE = {
    errno.ENOSPC: "Make room on the disk",
    errno.EDQUOT: "Make room in your quota",
    errno.EFBIG: "Allow larger files",
    errno.EROFS: "Name a folder that can be written",
    errno.EACCES: "Name a folder that you may write",
}
"""Why a file cannot be written -> what to do."""

MAX_SHOWN = 300  # characters of one part of a message


class InputError(ValueError):
    """Bad user input.

    Parameters
    ----------
    file : where the fault is (a path as the user wrote it).
    field : which key, column or dataset of that file.
    problem : what is wrong with it, with the offending value.
    remedy : what the user can do about it.

    A message is one line. Text that comes from a file is shortened and made printable.
    """

    def __init__(self, file, field: str, problem: str, remedy: str):
        self.file = str(file)
        self.field, self.problem, self.remedy = map(printable, (field, problem, remedy))
        super().__init__(f"{printable(self.file)}: {self.field}: {self.problem}. {self.remedy}")

    @property
    def errors(self) -> tuple[InputError, ...]:
        """The faults that this error reports: itself."""
        return (self,)

    def __reduce__(self):
        return InputError, (self.file, self.field, self.problem, self.remedy)


class InputErrors(InputError):
    """Several faults at once. `file`, `field`, `problem` and `remedy` are those of the first;
    the text has one fault a line."""

    def __init__(self, errors: Iterable[InputError]):
        self._errors = tuple(one for error in errors for one in error.errors)
        first = self._errors[0]
        super().__init__(first.file, first.field, first.problem, first.remedy)

    @property
    def errors(self) -> tuple[InputError, ...]:
        """The faults that this error reports."""
        return self._errors

    def __str__(self) -> str:
        return "\n".join(str(error) for error in self._errors)

    def __reduce__(self):
        return InputErrors, (self._errors,)


def raise_any(errors: Iterable[InputError]) -> None:
    """Raise one InputError for all of `errors`; nothing where there are none."""
    errors = [one for error in errors for one in error.errors]
    if len(errors) > 1:
        raise InputErrors(errors)
    if errors:
        raise errors[0]


def describe_write_error(error: BaseException) -> str | None:
    """What to do where a file could not be written; None for any other error."""
    if not isinstance(error, OSError) or error.errno not in CANNOT_WRITE:
        return None
    where = f"{printable(error.filename)}: " if error.filename else ""
    return (
        f"{where}not written: {error.strerror}. {CANNOT_WRITE[error.errno]} and run it again; "
        "what was finished is kept"
    )


def printable(text: object, length: int = MAX_SHOWN) -> str:
    """`text` on one line, control characters escaped, its middle left out beyond `length`."""
    text = str(text)
    if len(text) > length:
        text = f"{text[: length - length // 4]} ... {text[-length // 4 :]}"
    return "".join(map(_escaped, text))


def _escaped(character: str) -> str:
    if character.isprintable():
        return character
    return " " if character.isspace() else repr(character)[1:-1]
