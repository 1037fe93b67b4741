"""The one error a user's input can raise: it names the file, the field and the remedy."""

from __future__ import annotations


class InputError(ValueError):
    """Bad user input.

    Parameters
    ----------
    file : where the fault is (a path as the user wrote it).
    field : which key, column or dataset of that file.
    problem : what is wrong with it, with the offending value.
    remedy : what the user can do about it.
    """

    def __init__(self, file, field: str, problem: str, remedy: str):
        self.file, self.field, self.problem, self.remedy = str(file), field, problem, remedy
        super().__init__(f"{self.file}: {field}: {problem}. {remedy}")
