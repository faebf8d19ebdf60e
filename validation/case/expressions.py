"""Expressions in the parameters of a case, written in a case file, without any power beyond arithmetic and comparisons."""

from __future__ import annotations

import ast
import math
from collections.abc import Mapping
from types import CodeType
from typing import Any

from dembark.common.choices import nearest
from dembark.common.errors import DembarkError

from . import syntax

# A parameter may have the name of a function: calls are renamed.
_FUNCTIONS = {"min": min, "max": max, "abs": abs, "sqrt": math.sqrt, "ceil": math.ceil, "floor": math.floor, "round": round,
              "sin": math.sin, "cos": math.cos}
# Whole numbers of more bits are those of a slip; Python would compute any number of digits.
_BITS = 1024
_CONSTANTS = {"pi": math.pi}
_ALLOWED = (ast.Name, ast.Load, ast.BinOp, ast.Add, ast.Sub, ast.Mult, ast.Div, ast.Pow, ast.UnaryOp, ast.USub, ast.UAdd, ast.Not,
            ast.BoolOp, ast.And, ast.Or, ast.Compare, ast.Lt, ast.LtE, ast.Gt, ast.GtE, ast.Eq, ast.NotEq)

Values = Mapping[str, Any]


def _power(base: float, exponent: float) -> float:
    """base ** exponent; OverflowError where it is too large, ValueError where it is not real."""
    if isinstance(base, int) and isinstance(exponent, int):
        if exponent * base.bit_length() > _BITS:
            raise OverflowError("the number is too large")
        return base**exponent
    return math.pow(base, exponent)


_CALLED = {"power()": _power, **{f"{name}()": function for name, function in _FUNCTIONS.items()}}


class Expression:
    """A parsed condition, e.g. `kinetic_friction <= static_friction or grain_count < 100`; `names`: the parameters in it."""

    def __init__(self, text: str) -> None:
        """Parse `text`; DembarkError for anything but arithmetic, comparisons, and/or/not, pi, first, and the functions min, max, abs,
        sqrt, ceil, floor, round, sin and cos.

        `first(a, b)` is the first of its values that is set.
        """
        try:
            body = syntax.expression(text)
        except SyntaxError:
            raise DembarkError(f"{text!r} is not an expression") from None
        self.text, reader = text, _Reader(text)
        self._code = reader.compiled(body)
        self._needed, self._parts = frozenset(reader.names), reader.parts
        self.names: frozenset[str] = self._needed.union(*(part.names for part in self._parts))

    def __call__(self, values: Values) -> Any:
        """Result for `values`; None when a parameter that it names has no value, because then there is nothing to hold.

        Within `first(...)` one value is enough.
        """
        if any(values.get(name) is None for name in self._needed):
            return None

        def first(*numbers: int) -> Any:
            found = next((value for number in numbers if (value := self._parts[number](values)) is not None), None)
            if found is None:
                raise _Unset
            return found

        try:
            return eval(self._code, {"__builtins__": {}, **_CALLED, "first()": first, **values, **_CONSTANTS})
        except _Unset:
            return None

    def evaluated(self, values: Values, name: str = "", where: str = "") -> Any:
        """The same; DembarkError when it cannot be evaluated, with the `name` that it gives a value to, if any, and `where`."""
        try:
            return self(values)
        except (ArithmeticError, ValueError, TypeError) as error:
            raise DembarkError(f"{f'{name} = ' if name else ''}{self.text!r} cannot be evaluated", where, str(error)) from None

    def __reduce__(self) -> tuple[type[Expression], tuple[str]]:
        # Compiled code does not go to other processes; the text does.
        return Expression, (self.text,)


class _Unset(Exception):
    """No argument of `first` is set."""


class _Reader(ast.NodeTransformer):
    """Refuses what is not allowed, and collects `names`; arguments of `first` become the numbers of `parts`, expressions of their own."""

    def __init__(self, text: str) -> None:
        self.text, self.names, self.parts = text, set[str](), list[Expression]()

    def compiled(self, body: ast.expr) -> CodeType:
        return compile(ast.fix_missing_locations(ast.Expression(self.visit(body))), self.text, "eval")

    def generic_visit(self, node: ast.AST) -> ast.AST:
        if not isinstance(node, _ALLOWED):
            raise DembarkError(f"{self.text!r} holds something other than arithmetic and comparisons")
        return super().generic_visit(node)

    def visit_Constant(self, node: ast.Constant) -> ast.AST:
        return node if isinstance(node.value, int | float | str) else self.generic_visit(node)

    def visit_Name(self, node: ast.Name) -> ast.AST:
        self.names |= {node.id} - _CONSTANTS.keys()
        return node

    def visit_BinOp(self, node: ast.BinOp) -> ast.AST:
        self.generic_visit(node)
        return ast.Call(ast.Name("power()", ast.Load()), [node.left, node.right], []) if isinstance(node.op, ast.Pow) else node

    def visit_Call(self, node: ast.Call) -> ast.AST:
        if not isinstance(node.func, ast.Name) or node.keywords:
            return self.generic_visit(node)
        if node.func.id == "first" and node.args:
            first = len(self.parts)
            self.parts += [Expression(ast.unparse(one)) for one in node.args]
            node.args = [ast.Constant(number) for number in range(first, len(self.parts))]
        elif node.func.id not in _FUNCTIONS:
            raise DembarkError(f"{self.text!r} has an unknown call of {node.func.id}()", "", nearest(node.func.id, [*_FUNCTIONS, "first"]))
        else:
            node.args = [self.visit(one) for one in node.args]
        node.func = ast.Name(f"{node.func.id}()", ast.Load())
        return node
