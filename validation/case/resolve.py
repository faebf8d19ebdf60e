"""From the defaults of a case to the numbers of one run: defaults < profile < variant < what the user sets."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping

from dembark.common.choices import Value, nearest, pick
from dembark.common.errors import DembarkError

from .model import Case, checked

UNLIMITED = 1e300


def settings(pairs: Iterable[str]) -> dict[str, str]:
    """`key=value` texts of a command line as a mapping."""
    result: dict[str, str] = {}
    for pair in pairs:
        key, equals, value = pair.partition("=")
        key, value = key.strip(), value.strip()
        if not equals or not key or not value:
            raise DembarkError(f"cannot read --set {pair!r}", "", 'write --set key=value or --set "key=value unit"')
        if key in result:
            raise DembarkError(f"--set {key} is given twice", "", "give each key once")
        result[key] = value
    return result


def merged(case: Case, profile: str | None = None, variant: str | None = None,
           changes: Mapping[str, Value] | None = None) -> dict[str, Value]:
    """As `resolve`, without a look at the constraints of the case."""
    where = f"in case {case.name}"
    values: dict[str, Value] = {name: checked(p, p.value) for name, p in case.parameters.items()}
    if profile is not None:
        values |= case.profiles[pick(profile, case.profiles, "profile", where)]
    if variant is not None:
        values |= case.variants[pick(variant, case.variants, "variant", where)]
    for key, value in (changes or {}).items():
        if key not in case.parameters:
            raise DembarkError(f"unknown parameter {key!r}", where, nearest(key, case.parameters))
        values[key] = checked(case.parameters[key], value)
    return values


def resolve(case: Case, profile: str | None = None, variant: str | None = None,
            changes: Mapping[str, Value] | None = None) -> dict[str, Value]:
    """All parameters of a run in SI units (None = optional and not set), in the order of the case file.

    Raises DembarkError for an unknown profile, variant or key (naming near matches), a value of wrong type, unit or range,
    and for a combination that a constraint of the case forbids.
    """
    values = merged(case, profile, variant, changes)
    where = f"in case {case.name}"
    for constraint in case.constraints:
        holds = constraint.expression.evaluated(values, where=where)
        if holds is not None and not holds:
            given = ", ".join(f"{name} = {values[name]}" for name in sorted(constraint.expression.names) if values[name] is not None)
            raise DembarkError(constraint.message, f"with {given} {where}", f"it must hold that {constraint.expression.text}")
    return values


def portable(values: Mapping[str, Value]) -> dict[str, Value]:
    """The same with infinities as +-1e300, which JSON files and the engines' inputs can carry."""
    return {key: math.copysign(UNLIMITED, value) if isinstance(value, float) and math.isinf(value) else value
            for key, value in values.items()}


def for_replica(values: Mapping[str, Value], replica: int) -> dict[str, Value]:
    """Parameters of the `replica`-th packing (counted from 1): the first has the seed of the case, each further one the next."""
    result = dict(values)
    if isinstance(result.get("seed"), int):
        result["seed"] = result["seed"] + replica - 1  # type: ignore[operator]
    return result
