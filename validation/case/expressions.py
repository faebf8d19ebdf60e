"""Conditions between parameters, written in a case file, evaluated without giving the file any power beyond arithmetic."""

from __future__ import annotations

import ast
import math
import operator
from collections.abc import Callable, Mapping, Sequence
from typing import Any

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


class _Unset(Exception):
    """A value that is needed is not set."""


def _outside_first(node: ast.AST) -> set[str]:
    """Names in `node` that are not within a call of `first`."""
    if isinstance(node, ast.Name):
        return {node.id} - _CONSTANTS.keys()
    parts: list[ast.AST] = list(ast.iter_child_nodes(node))
    if isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
        parts = [] if node.func.id == "first" else list(node.args)
    return set().union(*(_outside_first(part) for part in parts))


class Expression:
    """A parsed condition, e.g. `kinetic_friction <= static_friction or grain_count < 100`."""

    def __init__(self, text: str) -> None:
        """Parse `text`; DembarkError for anything but arithmetic, comparisons, and/or/not, pi, first, and the functions min, max, abs,
        sqrt, ceil, floor, round, sin and cos.

        `first(a, b)` is the first of its values that is set.
        """
        self.text = text
        try:
            self._body = ast.parse(text, mode="eval").body
        except SyntaxError:
            raise DembarkError(f"{text!r} is no expression") from None
        self.names = frozenset(self._names(self._body))
        self._needed = frozenset(_outside_first(self._body))

    def _names(self, node: ast.AST) -> set[str]:
        match node:
            case ast.Name(id=name):
                return {name} - _CONSTANTS.keys()
            case ast.Constant(value=value) if isinstance(value, (int, float, str)):
                return set()
            case ast.BinOp(left=left, op=op, right=right) if type(op) in _BINARY:
                parts: list[ast.AST] = [left, right]
            case ast.UnaryOp(op=op, operand=operand) if type(op) in _UNARY:
                parts = [operand]
            case ast.BoolOp(values=values):
                parts = list(values)
            case ast.Compare(left=left, ops=ops, comparators=others) if all(type(op) in _COMPARE for op in ops):
                parts = [left, *others]
            case ast.Call(func=ast.Name(id=name), args=args, keywords=[]) if name in _FUNCTIONS:
                parts = list(args)
            case ast.Call(func=ast.Name(id="first"), args=args, keywords=[]) if args:
                parts = list(args)
            case _:
                raise DembarkError(f"{self.text!r} holds something other than arithmetic and comparisons")
        return set().union(*(self._names(part) for part in parts))

    def __call__(self, values: Mapping[str, Any]) -> Any:
        """Result for `values`; None when a parameter that it names has no value, because then there is nothing to hold.

        Within `first(...)` one value is enough.
        """
        if any(values.get(name) is None for name in self._needed):
            return None
        try:
            return self._value(self._body, values)
        except _Unset:
            return None

    def _value(self, node: ast.AST, values: Mapping[str, Any]) -> Any:  # noqa: PLR0911 - one return for each kind of node
        match node:
            case ast.Name(id=name) if name in _CONSTANTS:
                return _CONSTANTS[name]
            case ast.Name(id=name):
                if values.get(name) is None:
                    raise _Unset
                return values[name]
            case ast.Constant(value=value):
                return value
            case ast.BinOp(left=left, op=op, right=right):
                return _BINARY[type(op)](self._value(left, values), self._value(right, values))
            case ast.UnaryOp(op=op, operand=operand):
                return _UNARY[type(op)](self._value(operand, values))
            case ast.BoolOp(op=op, values=parts):
                test = all if isinstance(op, ast.And) else any
                return test(self._value(part, values) for part in parts)
            case ast.Compare(left=left, ops=ops, comparators=others):
                sides = [self._value(side, values) for side in (left, *others)]
                return all(_COMPARE[type(op)](a, b) for op, a, b in zip(ops, sides, sides[1:], strict=False))
            case ast.Call(func=ast.Name(id="first"), args=args):
                return self._first(args, values)
            case ast.Call(func=ast.Name(id=name), args=args):
                return _FUNCTIONS[name](*(self._value(arg, values) for arg in args))
        raise AssertionError(f"unchecked node {node!r}")

    def _first(self, nodes: Sequence[ast.AST], values: Mapping[str, Any]) -> Any:
        for node in nodes:
            try:
                return self._value(node, values)
            except _Unset:
                continue
        raise _Unset
