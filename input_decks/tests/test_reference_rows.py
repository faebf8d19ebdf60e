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
    ("a,nan", "time", "table.csv, line 3, time = nan: give a finite number"),
    ("a,1", "tmie", "there is no column 'tmie', did you mean time?"),
])
def test_what_is_no_number_is_reported_with_its_line(line: str, column: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text(f"kind,time\nb,0\n{line}\n")
    (row,) = reference_rows(path, kind="a")
    with pytest.raises(DembarkError) as caught:
        row.number(column)
    assert words in str(caught.value)


@pytest.mark.parametrize(("text", "words"), [
    ("kind,time\na,0,5\n", "table.csv, line 2, has 3 fields, the header 2"),
    ("kind,time,time\na,1,2\n", "has two columns 'time'"),
    ("sort,time\na,1\n", "has no column 'kind', known are sort, time"),
])
def test_a_table_that_would_be_misread_is_refused(text: str, words: str, tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text(text)
    with pytest.raises(DembarkError) as caught:
        reference_rows(path, kind="a")
    assert words in str(caught.value)


def test_a_table_of_a_spreadsheet(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_bytes(b"\xef\xbb\xbftime, place\r\n0.5, 2\r\n")
    (row,) = reference_rows(path)
    assert row.number("time") == 0.5 and row.number("place") == 2.0
