"""Records of impacts: both forms of the file hold the same, and what is no file of impacts is refused with one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from dembark.postproc import DumpError
from dembark.postproc.impacts import COLUMNS, RECORD, read_impacts

HEADER = f"# impacts that have ended, SI units; id_b < 0 is a wall: -1 = shell\n# {' '.join(COLUMNS)}\n"


def written(folder: Path, table: np.ndarray, header: str = HEADER) -> Path:
    """`table` (n, 17) as the engines write it, in both forms; the path of the text."""
    (folder / "impacts.bin").write_bytes(table.astype("<f8").tobytes())
    lines = (" ".join(f"{number:.12g}" for number in row) + "\n" for row in table)
    (folder / "impacts.txt").write_text(header + "".join(lines))
    return folder / "impacts.txt"


def some(count: int = 5) -> np.ndarray:
    table = np.random.default_rng(3).normal(size=(count, len(COLUMNS)))
    table[:, :2] = [[7, -1]] * count
    return table


@given(rows=arrays(float, st.tuples(st.integers(0, 4), st.just(len(COLUMNS))), elements=st.floats(-1e9, 1e9)))
def test_both_forms_hold_the_same_numbers(tmp_path_factory: pytest.TempPathFactory, rows: np.ndarray) -> None:
    rows[:, :2] = np.round(rows[:, :2])
    path = written(tmp_path_factory.mktemp("d"), rows)
    text, binary = read_impacts(path), read_impacts(path.with_suffix(".bin"))
    assert text.dtype == binary.dtype == RECORD and len(text) == len(binary) == len(rows)
    for name in COLUMNS:
        np.testing.assert_allclose(text[name], binary[name], rtol=1e-11)


def test_pandas_and_numpy_read_them_in_one_line(tmp_path: Path) -> None:
    table = some()
    path = written(tmp_path, table)
    np.testing.assert_allclose(pd.read_csv(path, sep=" ", comment="#", names=COLUMNS), table, rtol=1e-11)
    np.testing.assert_array_equal(np.memmap(path.with_suffix(".bin"), RECORD, "r")["peak_force"], table[:, 4])


def test_a_hundred_million_impacts_are_mapped(tmp_path: Path) -> None:
    """A file of 13.6 GB with a hole, which takes no room on the disk, and no memory here."""
    path = tmp_path / "impacts.bin"
    last = some(1)
    with path.open("wb") as file:
        file.write(some(1).tobytes())
        file.truncate((10**8 - 1) * RECORD.itemsize)
        file.seek(0, 2)
        file.write(last.tobytes())
    found = read_impacts(path)
    assert len(found) == 10**8 and found["time"][-1] == last[0, 2] and found["time"][10**7] == 0.0


def test_columns_are_found_by_their_names(tmp_path: Path) -> None:
    order = [*reversed(COLUMNS), "colour"]
    table = np.column_stack([some()[:, ::-1], np.ones(5)])
    path = written(tmp_path, table, f"# {' '.join(order)}\n")
    np.testing.assert_allclose(read_impacts(path)["time"], some()[:, 2], rtol=1e-11)


@pytest.mark.parametrize(("text", "message"), [
    (HEADER.replace(" friction_loss", "").replace(" turn_b", ""), "lacks the columns friction_loss turn_b"),
    ("", "lacks the columns id_a"),
    (HEADER + "1 2 3\n", "does not hold 17 numbers"),
    (HEADER + " ".join(["word"] * 17) + "\n", "does not hold 17 numbers"),
    (HEADER + " ".join(["1"] * 17) + "\n" + " ".join(["1"] * 16 + ["nan"]) + "\n", "impact 2 holds a number that is not finite")])
def test_what_is_no_file_of_impacts_is_refused(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "impacts.txt").write_text(text)
    with pytest.raises(DumpError, match=message) as error:
        read_impacts(tmp_path / "impacts.txt")
    assert "\n" not in str(error.value)


def test_what_is_no_file_of_records_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "impacts.bin"
    path.write_bytes(some().tobytes()[:-8])
    with pytest.raises(DumpError, match=r"672 bytes, which are no whole number of records of 136 bytes"):
        read_impacts(path)
    path.write_bytes(b"# text, not records of numbers".ljust(136))
    with pytest.raises(DumpError, match="holds no records of impacts"):
        read_impacts(path)
    with pytest.raises(DumpError, match="cannot be read: No such file"):
        read_impacts(tmp_path / "none.bin")
