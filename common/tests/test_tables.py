"""Tables that users write: what a spreadsheet makes of them is read or refused, never misread."""

from pathlib import Path

import pytest

from dembark.common.errors import DembarkError
from dembark.common.tables import read_table


def read(folder: Path, content: bytes) -> tuple[list[str], list[tuple[int, dict[str, str]]]]:
    path = folder / "own.csv"
    path.write_bytes(content)
    return read_table(path)


@pytest.mark.parametrize(("content", "line"), [
    (b"x,y\n1,2\n", 2), (b"\xef\xbb\xbfx,y\r\n1,2\r\n", 2), (b"x, y\n1, 2\n", 2), (b'"x",y\n\n"1",2\n\n', 3), (b"x,y,,\n1,2,,\n", 2),
    (b"# of 12 March, evening\nx,y\n1,2,,\n", 3)])
def test_the_same_table_as_others_write_it(content: bytes, line: int, tmp_path: Path) -> None:
    _, ((number, row),) = read(tmp_path, content)
    assert number == line and (row["x"], row["y"]) == ("1", "2")


def test_a_row_that_ends_early_has_empty_texts(tmp_path: Path) -> None:
    assert read(tmp_path, b"x,y,z\n1\n")[1] == [(2, {"x": "1", "y": "", "z": ""})]
    assert read(tmp_path, b"") == ([], []) and read(tmp_path, b"x,y\n") == (["x", "y"], [])
    # Only before the header: a row may be called so.
    assert read(tmp_path, b"name,y\n#1,2\n")[1] == [(2, {"name": "#1", "y": "2"})]


@pytest.mark.parametrize(("content", "words"), [
    (b"x,y\n0,7,0,01\n", "own.csv, line 2, has 4 fields, the header 2, separate fields by commas, and write the decimal point"),
    (b"x;y\n0,7;0,01\n", "own.csv, line 2, has 3 fields, the header 1"),
    (b"x,y,x\n1,2,3\n", "own.csv has two columns 'x'"),
    (b"x,\xdf\n1,2\n", "own.csv is not UTF-8 text"), (b"\xff\xfex\x00", "own.csv is not UTF-8 text")])
def test_a_table_that_would_be_misread_is_refused(content: bytes, words: str, tmp_path: Path) -> None:
    with pytest.raises(DembarkError) as caught:
        read(tmp_path, content)
    assert words in str(caught.value)


def test_a_table_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(DembarkError, match="cannot be read, No such file"):
        read_table(tmp_path / "none.csv")
