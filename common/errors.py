"""Errors for users: one line each, and the exit code."""

import shlex


class DembarkError(Exception):
    """A user's mistake (exit code 2): the message says what is wrong, where, and what would be right."""

    exit_code = 2

    def __init__(self, *parts: str) -> None:
        """Join `parts` (what, where, what would be right) into one line without line breaks."""
        super().__init__(", ".join(" ".join(part.split()) for part in parts if part))


class RunError(DembarkError):
    """A run, measurement or report that failed although it was asked for rightly (exit code 1)."""

    exit_code = 1


class Killed(RunError):
    """The engine was ended from outside (a signal, a time limit, a lost node): another attempt may go on where this one was."""


class Interrupted(RunError):
    """The user or the machine ended the work (SIGINT, SIGTERM)."""

    exit_code = 130


def pasteable(*words: object) -> str:
    """A command in quotes, for a line of text: what stands between them can be pasted, also with spaces in a path."""
    text = shlex.join(map(str, words))
    return f'"{text}"' if "'" in text else f"'{text}'"
