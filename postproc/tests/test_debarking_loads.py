"""Loads that are taken together: alike in drum and duration, or refused; logs of all of them are kept."""

from __future__ import annotations

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from dumps import grains_text
from hypothesis import given
from hypothesis import strategies as st

from dembark.common.errors import DembarkError
from dembark.postproc.debarking import ForceRange, Load, Logs, Outcome, RemovalLaw, outcome
from dembark.postproc.debarking.report import dataset, figures, lines, pooled_values
from dembark.postproc.impacts import COLUMNS, RECORD
from dembark.validation.cli import main

RANGE, PERIOD = ForceRange(1000.0, 5000.0), 2.0


def impacts(logs: int, seconds: float, seed: int) -> np.ndarray:
    """Blows of 2 kN from below, 20 a second, on logs at random."""
    random, count = np.random.default_rng(seed), round(20 * seconds)
    found = np.zeros(count, RECORD)
    found["id_a"], found["id_b"], found["nz"] = random.integers(1, logs + 1, count), -1, 1.0
    found["peak_force"], found["relative_speed"], found["impulse"], found["duration"] = 2000.0, 1.0, 10.0, 0.01
    found["time"], found["turn_a"] = random.uniform(0.0, seconds, count), random.uniform(0.0, 2.0 * math.pi, count)
    return found


def load(logs: int, turns: float, period: float = PERIOD, seed: int = 0) -> Outcome:
    bodies = Logs(np.arange(1, logs + 1), np.full(logs, 0.1), np.full(logs, 30.0), 1.0)
    return outcome(Load(impacts(logs, turns * period, seed), bodies, 0.0, turns * period, period), RANGE, RemovalLaw(width=0.002))


@pytest.mark.parametrize("report", [pooled_values, lines, dataset, figures])
@pytest.mark.parametrize(("other", "message"), [
    ({"turns": 15.0}, "load 2 has 15 revolutions, load 1 has 5, .*--end 10, or .* separate"),
    ({"turns": 5.0, "period": 1.0}, "load 2 is of a drum with 1 s a revolution, load 1 of one with 2 s, .*--against")])
def test_loads_of_other_drums_or_durations_are_not_pooled(report: object, other: dict[str, float], message: str) -> None:
    assert callable(report)
    with pytest.raises(DembarkError, match=message) as error:
        report([load(3, 5.0), load(3, **other)])
    assert "\n" not in str(error.value)


def test_the_command_names_the_file_and_the_end_that_fits_all(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                                              capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    for name, turns in (("a", 5), ("b", 15)):
        (tmp_path / name).mkdir()
        np.savetxt(f"{name}/impacts.txt", impacts(2, turns * PERIOD, turns).view(float).reshape(-1, len(COLUMNS)), header=" ".join(COLUMNS))
        (tmp_path / name / "grains.dump").write_text(grains_text(0, np.eye(3)[:2], np.full(2, 0.1)))
        (tmp_path / name / "run.json").write_text(json.dumps({"time_step": 0.01, "steps": turns * 200}))
    words = ["debark", "a", "b", "--speed", "30 rpm", "--bark-force", "1 kN", "--wood-force", "5 kN", "--clears", "2 mm"]
    assert main([*words, "--out", "d.nc", "--plot", "p"]) == 2
    said = capsys.readouterr().err
    assert "b/impacts.txt has 15 revolutions, a/impacts.txt has 5" in said and said.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a", "b"]
    end = re.search(r"--end (\S+?),", said)
    assert end and main([*words, "--end", end[1]]) == 0
    assert "2 loads of 2 logs, 5 revolutions of 2 s each" in capsys.readouterr().out


@given(counts=st.lists(st.integers(1, 4), min_size=1, max_size=3), seed=st.integers(0, 9))
def test_the_file_holds_every_log_of_every_load(counts: list[int], seed: int) -> None:
    """Sums over its logs are those of the loads; where a load has fewer logs than another, the rest is NaN."""
    loads = [load(count, 1.0, seed=seed + number) for number, count in enumerate(counts)]
    found = dataset(loads)
    assert found.useful_impacts.sum(("log", "sector")).values.tolist() == [one.doses.useful.sum() for one in loads]
    np.testing.assert_allclose(found.mass.sum("log"), [30.0 * count for count in counts])
    for name in ("mass", "radius"):
        assert found[name].notnull().sum("log").values.tolist() == counts
    assert found.friction_work.isnull().all("sector").sum("log").values.tolist() == [max(counts) - count for count in counts]
