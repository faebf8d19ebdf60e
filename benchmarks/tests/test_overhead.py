"""The time beside the engine is what no engine ran in, of runs one after the other and side by side."""

import json
import os
from pathlib import Path

import pytest

from benchmarks.overhead import Sample, covered, engine_time, main, replayer, rows


def test_engines_side_by_side_count_once() -> None:
    assert covered([(0.0, 2.0), (1.0, 3.0), (5.0, 6.0), (5.2, 5.4)]) == pytest.approx(4.0)
    assert covered([]) == 0.0


def recorded(folder: Path) -> Path:
    for number, end in ((1, 100.0), (2, 101.0), (3, 104.0)):
        one = folder / f"replica-{number}"
        one.mkdir(parents=True)
        (one / "run.json").write_text(json.dumps({"provenance": {"wall_time": 2.0, "versions": {"liggghts": "3.8.0"}}}))
        (one / "engine.log").write_text("dembark: steps 1 time_step 1\ndembark: resumed at step 1 exactly\ndembark: finished\n")
        os.utime(one / "engine.log", (end, end))
    return folder


def test_the_engines_ran_until_they_wrote_their_last_line(tmp_path: Path) -> None:
    assert engine_time(recorded(tmp_path)) == pytest.approx(5.0)


def test_a_replayed_engine_tells_its_version(tmp_path: Path) -> None:
    text = replayer(recorded(tmp_path / "recorded"), tmp_path).read_text()
    assert "Version LIGGGHTS-PUBLIC 3.8.0, replayed" in text and "sleep 2.0" in text and "${number%%.*}" in text


def test_medians_and_the_goal() -> None:
    before, now = rows({"before": [Sample(9.0, 4.0, 3.0), Sample(8.0, 4.0, 2.0), Sample(10.0, 4.0, 9.0)], "now": [Sample(5.0, 4.0, 1.0)]})
    assert (before["beside_engine"], before["processor"], before["met"]) == (5.0, 3.0, False)
    assert (now["beside_engine"], now["met"]) == (1.0, True)


def test_mistakes_get_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--rounds", "0"]) == 2
    assert main(["--program", "old=/nowhere/dembark", "--rounds", "1"]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert lines[0].startswith("benchmarks.overhead: --rounds 0") and "there is no program /nowhere/dembark" in lines[1] and len(lines) == 2
