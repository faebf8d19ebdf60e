"""Tables for terminals of any width."""

import io

import pytest
from rich.console import Console

from dembark.validation import show
from dembark.validation.judge.result import QuantityRecord, Result

RESULT = Result("silo", "dry", "liggghts", (
    QuantityRecord("a", -2.7495139e-06, "pass", "a quantity with a name that is longer than any column of a terminal may be", "m/s^2",
                   (-1.2345678e-05, 1.939e-05), reference=-1.234e-105, reference_interval=(-1e-105, 1e-105), deviation=-0.08902777,
                   tolerance=0.001, evidence="experiment", control="none"),
    QuantityRecord("b", None, "info", "", reason="too short")), "quick")


def printed(width: int) -> str:
    out = io.StringIO()
    Console(file=out, width=width).print(show.quantity_table(RESULT, width))
    return out.getvalue()


@pytest.mark.parametrize("width", [60, 72, 80, 100, 120, 200])
def test_numbers_are_never_split(width: int) -> None:
    text = printed(width)
    assert max(map(len, text.splitlines())) <= width
    words = text.split()
    assert {"-2.75e-06", "-1.234e-105", "-0.08903", "pass"} <= set(words)
    for column, cells in {"95 % interval": ("-1.235e-05", "1.939e-05"), "tolerance": ("0.001",), "unit": ("m/s^2",)}.items():
        head, _, table = text.partition("quantity ")
        # What is not shown is named.
        assert (column in " ".join(head.split()).partition("also shows")[2]) == (cells[0] not in table)
    assert ("also shows" in text) == (width < 160)
