"""Values of parameters, and names to choose from: what is not among them is refused with near matches."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from typing import Any

from .errors import DembarkError

Value = float | int | str | None


def nearest(name: str, known: Iterable[str]) -> str:
    """`known are ...` or `did you mean ...?`, for the end of an error line."""
    names = sorted(known)
    close = difflib.get_close_matches(name, names, n=3, cutoff=0.55)
    return f"did you mean {' or '.join(close)}?" if close else f"known are {', '.join(names) or 'none'}"


def no_parameter(name: str, known: Iterable[str]) -> str:
    """What is said of a parameter that is not among `known`."""
    return f"there is no parameter {name}, {nearest(name, known)}"


class Known(dict[str, Any]):
    """A dictionary of parameters whose KeyError names near matches."""

    def __missing__(self, name: str) -> Any:
        raise KeyError(no_parameter(name, self))


def pick(name: str, known: Iterable[str], what: str, where: str) -> str:
    """`name` if it is among `known`, else DembarkError naming near matches."""
    names = list(known)
    if name not in names:
        raise DembarkError(f"unknown {what} {name!r}", where, nearest(name, names))
    return name
