"""Rows of tables of reference data: what is no number in them is reported with file and line."""

import math
from pathlib import Path

import pytest

from dembark.common.errors import DembarkError
from dembark.input_decks.common.estimates import reference_rows


def test_rows_are_chosen_by_texts_and_read_as_numbers(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text("kind,time,place\na,0.5,\nb,1e-1,2\n")
    (row,) = reference_rows(path, kind="a")
    assert row.number("time") == 0.5 and row.number("place", 0.0) == 0.0 and math.isnan(row.number("place", math.nan))


@pytest.mark.parametrize(("line", "column", "words"), [
    ("a,zero", "time", "table.csv, line 3, time = 'zero' is not a number"),
    ('a,"0,5"', "time", "write the decimal point"),
    ("a,", "time", "time = '' is not a number"),
    ("a", "time", "time = '' is not a number"),
    ("a,1", "tmie", "there is no column 'tmie', did you mean time?"),
])
def test_what_is_no_number_is_reported_with_its_line(line: str, column: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text(f"kind,time\nb,0\n{line}\n")
    (row,) = reference_rows(path, kind="a")
    with pytest.raises(DembarkError) as caught:
        row.number(column)
    assert words in str(caught.value)
