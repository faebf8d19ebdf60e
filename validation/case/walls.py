"""[walls] of a case.toml: where the walls of a run are, for `dembark fields`, `walls` and `render`, which know no case.

A wall is named after its columns f_force_<name> in the dump. It is a plane (`origin`, `normal` to the grains) or a cylinder about an axis
(`origin`, `axis`, `radius`), at rest or with a steady `velocity` from the time `since` on; any other motion is named in `motion`. A free
`box` has a `size`, and a place by the columns <name>_x to <name>_qz of time.csv; a name that ends in * stands for several. Numbers may be
expressions in the parameters and in what a setup.py derives.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from dembark.common.errors import DembarkError

from .expressions import Expression
from .model import Case
from .tables import TableReader, Types

_NUMBER: Types = (int, float, str)
_COMMON: dict[str, Types] = {"kind": str, "origin": list, "velocity": list, "since": _NUMBER, "motion": str}
_KINDS: dict[str, dict[str, Types]] = {"plane": {**_COMMON, "normal": list}, "cylinder": {**_COMMON, "axis": list, "radius": _NUMBER},
                                     "box": {"kind": str, "size": list}}
_NEEDED = {"plane": (), "cylinder": ("radius",), "box": ("size",)}


def read(reader: TableReader, data: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """The walls by name, their expressions still texts; DembarkError for what cannot be one."""
    for name, entry in data.items():
        table = f"walls.{name}"
        if not isinstance(entry, dict):
            raise reader.fail(table, f"{entry!r} is not a table", 'write it as { kind = "plane", ... }')
        kind = reader.pick(str(entry.get("kind")), _KINDS, "kind of wall", table)
        reader.table(entry, table, _KINDS[kind], _NEEDED[kind])
        for key, value in entry.items():
            if isinstance(value, list) and (len(value) != 3 or not all(isinstance(one, int | float | str) for one in value)):
                raise reader.fail(table, f"{key} = {value} is no vector", "give three numbers or expressions", key)
            for text in value if isinstance(value, list) else [value]:
                if isinstance(text, str) and key not in ("kind", "motion"):
                    try:
                        Expression(text)
                    except DembarkError as error:
                        raise reader.fail(table, str(error), key=key) from None
    return {name: dict(entry) for name, entry in data.items()}


def resolved(case: Case, values: Mapping[str, Any]) -> dict[str, dict[str, Any]]:
    """The walls of a run with these `values` (parameters and derived numbers), all numbers in SI units; DembarkError where one has none."""
    def number(value: Any, name: str, key: str) -> float:
        where = f"[walls] of case {case.name}, {name}"
        found = Expression(value).evaluated(values, key, where) if isinstance(value, str) else value
        if not isinstance(found, int | float):
            raise DembarkError(f"{key} = {value!r} is not a number", where, "a parameter in it has no value")
        return float(found)

    return {name: {key: value if key in ("kind", "motion") else
                   [number(one, name, key) for one in value] if isinstance(value, list) else number(value, name, key)
                   for key, value in wall.items()}
            for name, wall in case.walls.items()}
