"""Python's syntax trees, for several threads. Before 3.11.5 Python counts the depth of all of them together: two that parse at the same
time may get a SystemError."""

from __future__ import annotations

import ast
from threading import Lock

_ONE_AT_A_TIME = Lock()


def module(source: bytes) -> ast.Module:
    """The tree of a file; SyntaxError or ValueError as of ast.parse."""
    with _ONE_AT_A_TIME:
        return ast.parse(source)


def expression(text: str) -> ast.expr:
    """The tree of an expression; SyntaxError when `text` is none."""
    with _ONE_AT_A_TIME:
        return ast.parse(text, mode="eval").body
