"""Tables of a TOML file: read, and checked for unknown keys and wrong types, each mistake is reported with its table."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import MISSING, fields
from functools import cache
from pathlib import Path
from types import UnionType
from typing import Any, TypeVar, get_args, get_origin, get_type_hints

from dembark.common.choices import Value, nearest, pick
from dembark.common.errors import DembarkError

from .expressions import Expression
from .model import Parameter, checked

Record = TypeVar("Record")
Types = type | tuple[type, ...]
# Of a formal order: a number, or an expression in the parameters.
ORDER = (int, float, str)
_WORDS = {str: "a text", int: "a whole number", float: "a number", bool: "true or false", list: "a list [...]", dict: "a table {...}"}


def load_toml(path: Path) -> dict[str, Any]:
    """Content of a TOML file; DembarkError naming the line when it is none."""
    try:
        return tomllib.loads(path.read_text(encoding="utf-8-sig"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, OSError) as error:
        raise DembarkError(f"{path} cannot be read", str(error)) from None


def wanted(types: Types) -> str:
    """What is expected where `types` are: `a text or a list [...]`."""
    kinds = types if isinstance(types, tuple) else (types,)
    return " or ".join(_WORDS[kind] for kind in kinds if not (kind is int and float in kinds))


@cache
def _hints(kind: type) -> dict[str, Any]:
    """The types of a record's fields; a case has hundreds of records."""
    return get_type_hints(kind)


class TableReader:
    """Checks the tables of one file; a reader of a kind of file builds on it."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def where(self, table: str) -> str:
        """A table of the file, for an error line."""
        return f"[{table}] of {self.path}"

    def fail(self, table: str, what: str, right: str = "", key: str = "") -> DembarkError:
        """The error to raise for a mistake in `table`, in the line of `key` where that is found."""
        line = self.line(table, key) if key else None
        return DembarkError(what, self.where(table) + (f", line {line}" if line else ""), right)

    def line(self, table: str, key: str) -> int | None:
        """The first line that holds `key` in `table`, which may stand in one line of the table above it; None when it is not found."""
        parts = _parts(table)
        start = r"\s*[\"']?{}[\"']?\s*[.=]"
        here, above = start.format(re.escape(key)), start.format(re.escape(parts[-1] if parts else "")) + rf".*\b{re.escape(key)}\s*="
        for number, header, text in self._lines():
            if not text and [*parts, key] == header[:len(parts) + 1]:
                return number
            if (header == parts and re.match(here, text)) or (parts and header == parts[:-1] and re.match(above, text)):
                return number
        return None

    def line_of_word(self, table: str, word: str) -> int | None:
        """The first line of `table`, which may stand in lines of the table above it, that holds `word`; None when it is not found."""
        parts, inside = _parts(table), False
        for number, header, text in self._lines():
            if header != parts:
                # Lines that go on with an entry begin with a space.
                new = re.match(r"[\"']?([^\s\"']+)[\"']?\s*[.=]", text)
                inside = bool(parts) and header == parts[:-1] and (inside if new is None else new.group(1) == parts[-1])
            if (inside or header == parts) and re.search(rf"(?<!\w){re.escape(word)}(?!\w)", text):
                return number
        return None

    def _lines(self) -> Iterator[tuple[int, list[str], str]]:
        """The lines of the file: number, the header that the line stands below, or is, in parts, and the text, empty for a header."""
        header: list[str] = []
        for number, text in enumerate(self.path.read_text(encoding="utf-8").splitlines(), start=1):
            found = re.fullmatch(r"\s*\[+\s*([^\[\]]+?)\s*\]+\s*(?:#.*)?", text)
            if found:
                header = [part.strip(" \"'") for part in found.group(1).split(".")]
            yield number, header, "" if found else text

    def pick(self, name: str, known: Iterable[str], what: str, table: str) -> str:
        """`name` if it is among `known`, else DembarkError naming the line and near matches."""
        names = list(known)
        if name not in names:
            line = self.line_of_word(table, name)
            return pick(name, names, what, self.where(table) + (f", line {line}" if line else ""))
        return name

    def value(self, table: str, parameter: Parameter, given: Value) -> Value:
        """`given` in the parameter's unit and type; DembarkError that names `table` when it is not allowed."""
        try:
            return checked(parameter, given)
        except DembarkError as error:
            raise self.fail(table, str(error)) from None

    def expression(self, table: str, text: str, known: Iterable[str]) -> Expression:
        """`text` as an expression in the parameters that are `known`."""
        try:
            expression = Expression(text)
        except DembarkError as error:
            raise self.fail(table, str(error)) from None
        for name in sorted(expression.names):
            self.pick(name, known, "parameter", table)
        return expression

    def order(self, table: str, data: Mapping[str, Any], known: Iterable[str]) -> Expression | None:
        """The formal order of a scheme that `data` gives, a number or an expression in the parameters that are `known`; None without."""
        return self.expression(table, str(data["formal_order"]), known) if "formal_order" in data else None

    def table(self, data: Mapping[str, Any], name: str, keys: Mapping[str, Types], required: Iterable[str] = ()) -> None:
        """DembarkError unless `data`, the table `name`, is one that has only `keys`, of these types, and all that are `required`."""
        if not isinstance(data, Mapping):
            raise self.fail(name, f"{data!r} is not a table", "write it as { key = value, ... }")
        for key, value in data.items():
            if key not in keys:
                raise self.fail(name, f"unknown key {key!r}", nearest(key, keys), key)
            if not isinstance(value, keys[key]) or (isinstance(value, bool) and keys[key] not in (bool, (bool,))):
                raise self.fail(name, f"{key} = {value!r} has the wrong type", f"it must be {wanted(keys[key])}", key)
        for key in required:
            if key not in data:
                raise self.fail(name, f"{key} is missing", f"it must be {wanted(keys[key])}")

    def texts(self, data: Mapping[str, Any], table: str, keys: Iterable[str]) -> None:
        """DembarkError unless the lists `keys` of `data` hold texts only."""
        for key in keys:
            if any(not isinstance(one, str) for one in data.get(key, ())):
                raise self.fail(table, f"{key} = {data[key]} does not hold texts only", "give a list of texts", key)

    def record(self, kind: type[Record], data: Any, table: str, **given: Any) -> Record:
        """The dataclass `kind` from the table `data`: keys are the fields that are not `given`, their types those of the fields, and a key
        is required where the field has no default. Texts lose the space around them."""
        own: list[Any] = [one for one in fields(kind) if one.name not in given]  # type: ignore[arg-type]
        hints = _hints(kind)  # type: ignore[arg-type]
        self.table(data, table, {one.name: _types(hints[one.name]) for one in own}, [one.name for one in own if one.default is MISSING])
        self.texts(data, table, [one.name for one in own if get_origin(hints[one.name]) is tuple])
        plain = {key: tuple(value) if isinstance(value, list) else value.strip() if isinstance(value, str) else value
                 for key, value in data.items()}
        return kind(**plain, **given)


def _parts(table: str) -> list[str]:
    return [] if table == "top level" else table.split(".")


def _types(hint: Any) -> Types:
    """The types in TOML of a field with this type hint."""
    found = [get_origin(one) or one for one in (get_args(hint) if isinstance(hint, UnionType) else (hint,))]
    kinds = [list if one is tuple else one for one in found if one is not type(None)]
    return (*kinds, *([int] if float in kinds else []))
