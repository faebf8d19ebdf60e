"""Contacts of a run: `contacts.dump`, or any local dump, as numpy arrays."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from .dumps.frames import NO_FLAGS, Array, ColumnsError, DumpError, RawFrame, check_periods, integers, less_edges, numbered, take
from .dumps.opening import Trajectory, open_dump
from .dumps.typed import TypedDump
from .dumps.units import KEPT_UNITS, unit_style

Column = int | str | Sequence[int | str]

_WIDTHS = {"first": 3, "second": 3, "branch": 3, "ids": 2, "forces": 3}
# What dembark's decks write: x1 y1 z1 x2 y2 z2 id1 id2 periodic fx fy fz, whatever the header calls them.
_DECK: Mapping[str, Column] = {"first": (1, 2, 3), "second": (4, 5, 6), "ids": (7, 8), "forces": (10, 11, 12)}
_DECK_COLUMNS = 12
_SAME = 1e-4  # of a branch, which six digits of a place hold
_ENOUGH = 10  # contacts, for a pair may well hang on a bridge
_PULLING = 0.9  # of the virial, which is 1 of repulsive forces on the wrong grain and -1 on the right one
_NUMBERED = re.compile(r"\w+\[(\d+)\]")
# What local/gran/vtk writes.
_LINES: Mapping[str, Column] = {"first": ("x1", "y1", "z1"), "second": ("x2", "y2", "z2"), "ids": ("id1", "id2"),
                                "forces": ("force[1]", "force[2]", "force[3]")}
# The flag `periodic` (columns counted from 0) is not needed: the nearest image says the same.
_DECK_LEFT_OUT = {8}


class ContactColumnsError(ColumnsError):
    """The parameter `columns`, which gives the meaning of each column of a dump of contacts, is needed or does not fit the file."""


@dataclass(frozen=True)
class ContactFrame:
    """The m contacts and liquid bridges between grains at one step; SI units.

    `first` (m, 3) is the position of grain 1, `branch` (m, 3) points from it to grain 2 (nearest image on periodic axes),
    `forces` (m, 3) is the force on grain 1 (N), `ids` (m, 2). `extra` holds every other column (m,) by its name.
    """

    step: int
    first: Array
    branch: Array
    forces: Array
    ids: NDArray[np.int64]
    extra: Mapping[str, Array] = field(default_factory=dict)


class ContactsDump(TypedDump[ContactFrame]):
    """Contacts as a sequence of ContactFrame, read one at a time."""

    def __init__(self, path: Trajectory, *, skip_truncated: bool = False, stream: bool = False, columns: Mapping[str, Column] | None = None,
                 units: str = "") -> None:
        """Open; DumpError for a missing, foreign or truncated file (see open_dump).

        Without `columns` the file must be one of dembark's decks, with twelve columns, or of the style local/gran/vtk. Else `columns`
        says which column, by its number from 1 or its name, is what: `first`, `second` (position of grain 2; or `branch`), `forces`,
        `ids`, and under any other name what is to be in `extra`, (m,) or (m, k). For `compute ... pair/gran/local pos id force`, all
        dumped in order, that is {"first": (1, 2, 3), "second": (4, 5, 6), "ids": (7, 8), "forces": (10, 11, 12)}. Columns without a
        name given are in `extra` under that of the dump. `units` is the unit style of a dump that does not name it.
        """
        super().__init__(open_dump(path, skip_truncated, stream=stream, units=units))
        self._columns, self._looked = columns, False
        if columns is not None:
            lacking = [name for name in ("first", "forces", "ids") if name not in columns]
            if lacking or ("second" in columns) == ("branch" in columns):
                raise ContactColumnsError(f"{self.path}: columns= must name {', '.join(lacking) or 'either second or branch'}")

    def at_step(self, step: int) -> ContactFrame:
        """The contacts of a step; DumpError when the dump has none."""
        number = int(np.searchsorted(self.steps, step))
        if number == len(self.steps) or self.steps[number] != step:
            raise DumpError(f"{self.path} has no frame of step {step}, as the grains have; write both at the same steps")
        return self[number]

    def _frame(self, raw: RawFrame) -> ContactFrame:
        where = f"{self.path}, step {raw.step}"
        check_periods(raw, where)
        if not raw.flagged:
            self._say(raw.step, NO_FLAGS)
        if not raw.columns and not len(raw.values):
            # A file without contacts that names no columns.
            nothing = np.empty((0, 3))
            return ContactFrame(raw.step, nothing, nothing, nothing, np.empty((0, 2), np.int64))
        given = _schema(raw, where) if self._columns is None else self._columns
        index = {name: _indices(raw, name, column, where) for name, column in given.items()}
        parts = {name: take(raw.values, columns) for name, columns in index.items()}
        used = {column for columns in index.values() for column in columns} | (_DECK_LEFT_OUT if given is _DECK else set())
        extra = {name: take(raw.values, [column]) for column, name in enumerate(raw.columns) if column not in used}
        branch = parts["branch"] if "branch" in parts else less_edges(parts["second"] - parts["first"], raw)
        extra |= {name: values for name, values in parts.items() if name not in _WIDTHS}
        ids = integers(parts["ids"], f"{where}: ids")
        # Whoever lists each pair twice does so in every frame: those up to the first that is not nearly empty are enough, for this takes as
        # long as reading them.
        if not self._looked and len(ids) and (twice := _listed_twice(ids, branch)):
            self._say(raw.step, f"the contact of grains {twice[0]} and {twice[1]} is listed twice, and counts twice, in stresses too; "
                      "list each pair once")
        if not self._looked and _attracts(branch, parts["forces"]):
            self._say(raw.step, "nearly all forces point from grain 1 to grain 2: if they are those on grain 2, stresses have the wrong "
                      "sign; exchange the places of the grains with columns=")
        self._looked |= len(ids) >= _ENOUGH
        style = unit_style(raw.units, where)
        factors = {name: style.factor(name) for name in extra}
        if style != unit_style("si", where):
            if kept := [name for name, factor in factors.items() if factor is None]:
                self._say(raw.step, KEPT_UNITS.format(", ".join(kept), raw.units))
            extra = {name: values * (factors[name] or 1.0) for name, values in extra.items()}
        return ContactFrame(raw.step, style.length * parts["first"], style.length * branch, style.force * parts["forces"],
                            ids, extra)


def _attracts(branch: Array, forces: Array) -> bool:
    """Whether the contacts pull, each weighed by its force times its branch: dry grains push, and among wet ones the loads push."""
    pull = np.einsum("ij,ij->i", forces, branch)
    return len(pull) >= _ENOUGH and bool(pull.sum() > _PULLING * np.abs(pull).sum())


def _listed_twice(ids: NDArray[np.int64], branch: Array) -> tuple[int, int] | None:
    """A pair of grains that stands in two rows with one branch, the other way round or not; pairs may touch through several faces of a
    small periodic box, with other branches."""
    low, high = ids.min(axis=1), ids.max(axis=1)
    order = np.lexsort((high, low))
    same = np.flatnonzero((np.diff(low[order]) == 0) & (np.diff(high[order]) == 0))
    for one, other in zip(order[same], order[same + 1], strict=True):
        turned = branch[other] if ids[one, 0] == ids[other, 0] else -branch[other]
        if np.abs(branch[one] - turned).max() <= _SAME * np.abs(branch[one]).max():
            return int(low[one]), int(high[one])
    return None


def _schema(raw: RawFrame, where: str) -> Mapping[str, Column]:
    if {"id1", "id2", "x1", "x2", "force[1]"} <= set(raw.columns):
        return _LINES
    advice = "name those of first, second, ids and forces with columns="
    if len(raw.columns) != _DECK_COLUMNS:
        raise ContactColumnsError(f"{where}: has {len(raw.columns)} columns instead of {_DECK_COLUMNS}; {advice}")
    numbers = [int(match.group(1)) for name in raw.columns if (match := _NUMBERED.fullmatch(name))]
    if sorted(numbers) == list(range(1, _DECK_COLUMNS + 1)) != numbers:
        raise ContactColumnsError(f"{where}: its {_DECK_COLUMNS} columns are not numbered in their order; {advice}")
    return _DECK


def _indices(raw: RawFrame, name: str, column: Column, where: str) -> list[int]:
    words = [column] if isinstance(column, int | str) else list(column)
    width = _WIDTHS.get(name, len(words))
    if len(words) != width or not words:
        raise ContactColumnsError(f"{where}: columns= gives {len(words)} columns for {name}, not {width or 1}")
    outside = [word for word in words if isinstance(word, int) and not 1 <= word <= len(raw.columns)]
    if outside:
        raise ContactColumnsError(f"{where}: columns= gives column {outside[0]} for {name}, but there are columns 1 to {len(raw.columns)}")
    return [word - 1 if isinstance(word, int) else numbered(raw.columns, [word], where)[0] for word in words]
