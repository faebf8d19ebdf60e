"""All readers of the benchmark read the same numbers, and its ratios are those of each round."""

import json

import pytest

from benchmarks import dump_parsing
from benchmarks.dump_parsing import SUBJECTS, sample, write_dump
from dembark.common.errors import DembarkError


def test_every_reader_finds_the_sum_that_was_written(tmp_path):
    expected = write_dump(tmp_path / "a.dump", 40, 2)
    for name, read in SUBJECTS.items():
        assert read(tmp_path / "a.dump") == pytest.approx(expected, rel=1e-7), name


def test_other_numbers_are_not_timed(tmp_path):
    expected = write_dump(tmp_path / "a.dump", 5, 1)
    with pytest.raises(DembarkError, match="reads other numbers"):
        sample("numpy.loadtxt", tmp_path / "a.dump", 1.01 * expected)


def test_small_run_writes_its_table(tmp_path, capsys):
    assert dump_parsing.main(["--grains", "30", "--frames", "1", "--rounds", "1", "--out", str(tmp_path)]) in (0, 1)
    content = json.loads((tmp_path / "dump_parsing.json").read_text())
    assert [row["subject"] for row in content["rows"]] == list(SUBJECTS)
    assert "times as fast" in capsys.readouterr().out
    assert dump_parsing.main(["--rounds", "0"]) == 2
