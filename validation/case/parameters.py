"""The keys of a case: their types, units and ranges, and the check that a value fits."""

from __future__ import annotations

from dataclasses import dataclass

from dembark.common.choices import Value
from dembark.common.errors import DembarkError
from dembark.common.units import finite, to_si

UNSET = "auto"


@dataclass(frozen=True)
class Parameter:
    """One key of a case: default (None = not set), unit of plain numbers (`1` = dimensionless), and what is allowed."""

    name: str
    type: str
    doc: str
    value: Value = None
    unit: str = "1"
    optional: bool = False
    min: float | None = None
    max: float | None = None
    exclusive_min: bool = False
    exclusive_max: bool = False
    values: tuple[str, ...] = ()

    @property
    def range(self) -> str:
        """What is allowed, in words: `> 0`, `0 ... 1`, `smooth | rough`; empty when everything is."""
        if self.values:
            return " | ".join(self.values)
        lower = None if self.min is None else f"{'>' if self.exclusive_min else '>='} {self.min:g}"
        upper = None if self.max is None else f"{'<' if self.exclusive_max else '<='} {self.max:g}"
        return " and ".join(part for part in (lower, upper) if part)


def checked(parameter: Parameter, value: Value) -> Value:
    """`value` as the type that `parameter` declares, None when it is optional and not set; DembarkError when not allowed."""
    if value is None or (value == UNSET and UNSET not in parameter.values):
        if parameter.optional:
            return None
        raise DembarkError(f"{parameter.name} must have a value", parameter.range)
    if parameter.type == "choice":
        if value not in parameter.values:
            raise DembarkError(f"{parameter.name} = {value!r} is not allowed", f"allowed are {parameter.range}")
        return value
    if isinstance(value, str) and not (value == "inf" == str(parameter.value)):
        value = to_si(value, parameter.unit, parameter.name)
    value = float(value) if parameter.type == "float" else value
    # Only a case itself may mean "unlimited", by an infinite default; nan differs from everything.
    if value != parameter.value or parameter.type == "int":
        finite(value, parameter.name)
    if parameter.type == "int":
        if value != int(value):
            raise DembarkError(f"{parameter.name} = {value!r} is not a whole number", parameter.range)
        value = int(value)
    low = parameter.min is not None and (value <= parameter.min if parameter.exclusive_min else value < parameter.min)
    high = parameter.max is not None and (value >= parameter.max if parameter.exclusive_max else value > parameter.max)
    if low or high:
        unit = "" if parameter.unit == "1" else f" {parameter.unit}"
        raise DembarkError(f"{parameter.name} = {value:g}{unit} is out of range", f"allowed is {parameter.range}")
    return value
