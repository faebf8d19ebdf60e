"""Conditions between parameters, written in a case file, evaluated without giving the file any power beyond arithmetic."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from itertools import pairwise
from typing import Any

from dembark.common.choices import nearest
from dembark.common.errors import DembarkError

_BINARY: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul, ast.Div: operator.truediv, ast.Pow: operator.pow,
}
_UNARY: dict[type[ast.unaryop], Callable[[Any], Any]] = {ast.USub: operator.neg, ast.UAdd: operator.pos, ast.Not: operator.not_}
_COMPARE: dict[type[ast.cmpop], Callable[[Any, Any], Any]] = {
    ast.Lt: operator.lt, ast.LtE: operator.le, ast.Gt: operator.gt, ast.GtE: operator.ge, ast.Eq: operator.eq, ast.NotEq: operator.ne,
}
_FUNCTIONS: dict[str, Callable[..., Any]] = {"min": min, "max": max, "abs": abs, "sqrt": math.sqrt, "ceil": math.ceil, "floor": math.floor,
                                             "round": round, "sin": math.sin, "cos": math.cos}
_CONSTANTS = {"pi": math.pi}


Values = Mapping[str, Any]


class _Unset(Exception):
    """A value that is needed is not set."""


class Expression:
    """A parsed condition, e.g. `kinetic_friction <= static_friction or grain_count < 100`; `names`: the parameters in it."""

    def __init__(self, text: str) -> None:
        """Parse `text`; DembarkError for anything but arithmetic, comparisons, and/or/not, pi, first, and the functions min, max, abs,
        sqrt, ceil, floor, round, sin and cos.

        `first(a, b)` is the first of its values that is set.
        """
        self.text, self.names, self._needed = text, frozenset[str](), frozenset[str]()
        try:
            body = ast.parse(text, mode="eval").body
        except SyntaxError:
            raise DembarkError(f"{text!r} is no expression") from None
        self._value = self._read(body, needed=True)

    def __call__(self, values: Values) -> Any:
        """Result for `values`; None when a parameter that it names has no value, because then there is nothing to hold.

        Within `first(...)` one value is enough.
        """
        if any(values.get(name) is None for name in self._needed):
            return None
        try:
            return self._value(values)
        except _Unset:
            return None

    def evaluated(self, values: Values, name: str = "", where: str = "") -> Any:
        """The same; DembarkError when it cannot be evaluated, with the `name` that it gives a value to, if any, and `where`."""
        try:
            return self(values)
        except (ArithmeticError, ValueError, TypeError) as error:
            raise DembarkError(f"{f'{name} = ' if name else ''}{self.text!r} cannot be evaluated", where, str(error)) from None

    def __reduce__(self) -> tuple[type[Expression], tuple[str]]:
        # Functions do not go to other processes; the text does.
        return Expression, (self.text,)

    def _read(self, node: ast.AST, needed: bool) -> Callable[[Values], Any]:  # noqa: PLR0911 - one return for each kind of node
        """The function that evaluates `node`; `needed`: not within a call of `first`."""
        match node:
            case ast.Name(id=name):
                return self._name(name, needed)
            case ast.Constant(value=value) if isinstance(value, (int, float, str)):
                return lambda _: value
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
                return self._applied(_BINARY[type(op)], [left, right], needed)
            case ast.UnaryOp(op=op, operand=operand) if type(op) in _UNARY:
                return self._applied(_UNARY[type(op)], [operand], needed)
            case ast.BoolOp(op=op, values=nodes):
                parts, test = [self._read(part, needed) for part in nodes], all if isinstance(op, ast.And) else any
                return lambda values: test(part(values) for part in parts)
            case ast.Compare(left=left, ops=ops, comparators=others) if all(type(op) in _COMPARE for op in ops):
                tests = [_COMPARE[type(op)] for op in ops]
                return self._applied(lambda *sides: all(test(*two) for test, two in zip(tests, pairwise(sides), strict=True)),
                                     [left, *others], needed)
            case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in _FUNCTIONS:
                return self._applied(_FUNCTIONS[name], args, needed)
            case ast.Call(func=ast.Name(id="first"), args=args, keywords=[]) if args:
                return partial(_first, [self._read(part, needed=False) for part in args])
            case ast.Call(func=ast.Name(id=name)):
                raise DembarkError(f"{self.text!r} has an unknown call of {name}()", "", nearest(name, [*_FUNCTIONS, "first"]))
        raise DembarkError(f"{self.text!r} holds something other than arithmetic and comparisons")

    def _name(self, name: str, needed: bool) -> Callable[[Values], Any]:
        if name in _CONSTANTS:
            return lambda _: _CONSTANTS[name]
        self.names |= {name}
        self._needed |= {name} if needed else set()

        def value(values: Values) -> Any:
            if values.get(name) is None:
                raise _Unset
            return values[name]

        return value

    def _applied(self, function: Callable[..., Any], nodes: Sequence[ast.AST], needed: bool) -> Callable[[Values], Any]:
        parts = [self._read(part, needed) for part in nodes]
        return lambda values: function(*(part(values) for part in parts))


def _first(parts: Sequence[Callable[[Values], Any]], values: Values) -> Any:
    for part in parts:
        with suppress(_Unset):
            return part(values)
    raise _Unset
