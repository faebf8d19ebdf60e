"""What is reason when results cannot be measured."""

from __future__ import annotations

import warnings
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from dembark.common.errors import DembarkError
from dembark.postproc.replica import Replica
from dembark.validation import analysis, metrics, show
from dembark.validation.judge import measurement
from dembark.validation.judge.result import QuantityRecord, Result

HEADER = ("ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF ATOMS\n{count}\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\n"
          "ITEM: ATOMS id type x y z vx vy vz radius mass f_force_side[1] f_force_side[2] f_force_side[3]\n")


def replica(folder: Path, count: int, frames: int, force: float) -> Path:
    """A run whose grains the wall `side` pushes with `force` (N)."""
    folder.mkdir(parents=True)
    lines = "".join(f"{k + 1} 1 0.5 0.5 {0.001 * k} 0 0 0 0.001 1e-5 {force} 0 0\n" for k in range(count))
    (folder / "grains.dump").write_text("".join(HEADER.format(step=step, count=count) + lines for step in range(frames)))
    return folder


@pytest.mark.parametrize(("count", "frames", "force", "expected"), [
    (1, 5, 1.0, "1 grain"), (2, 1, 1.0, "2 grains, 1 frame"), (200, 5, 0.0, "nothing presses on a wall in the last frame"),
    (200, 5, 1.0, "")])
def test_what_is_too_small_is_named(tmp_path: Path, count: int, frames: int, force: float, expected: str) -> None:
    assert analysis.too_small(replica(tmp_path / "replica-1", count, frames, force)) == expected


def test_grains_that_left_are_counted(tmp_path: Path) -> None:
    folder = replica(tmp_path / "replica-1", 5, 2, 0.0)
    assert analysis.departed(folder) == ""
    for count in (6, 2):
        lines = replica(tmp_path / f"other-{count}", count, 1, 0.0) / "grains.dump"
        with (folder / "grains.dump").open("a") as dump:
            dump.write(lines.read_text().replace("TIMESTEP\n0", f"TIMESTEP\n{20 - count}"))
    assert analysis.departed(folder) == "replica-1: 4 of 6 grains are no longer in the last frame"
    assert analysis.departed(tmp_path / "nothing") == ""


def test_an_error_in_a_measurement_is_told_with_its_line(tmp_path: Path) -> None:
    case = SimpleNamespace(name="mine", folder=tmp_path, studies=("size",))
    (tmp_path / "measure.py").write_text("def measure(replicas):\n    return 1 / 0\n\n"
                                         "def study(name, points, along):\n    return points[along]\n")
    with pytest.raises(ZeroDivisionError) as caught:
        measurement.measure(case, [])
    reason = f"{tmp_path / 'measure.py'}, line 2, ZeroDivisionError: division by zero"
    assert analysis.reasons(tmp_path, caught.value, case) == (reason,)
    with pytest.raises(DembarkError, match=r"measure\.py, line 5, KeyError"):
        measurement.study(case, SimpleNamespace(name="size", along="grain_count"), {})
    replica(tmp_path / "replica-1", 1, 2, 1.0)
    small = "the run may be too small or too short to be measured: 1 grain, 2 frames"
    assert analysis.reasons(tmp_path, caught.value, case) == (reason, small)
    # Grains more or fewer do not mend a mistake.
    run = Replica(tmp_path, {"parameters": {"gravity": 9.81}})
    for code, kind, line in (("foo", NameError, "NameError: name 'foo' is not defined"), (
            "replicas[0].parameters['gravty']", KeyError, "KeyError: 'there is no parameter gravty, did you mean gravity?'"), (
            "open('film.csv')", FileNotFoundError, "FileNotFoundError: [Errno 2] No such file or directory: 'film.csv'")):
        (tmp_path / "measure.py").write_text(f"def measure(replicas):\n    return {code}\n\ndef study(name, points, along):\n    pass\n")
        with pytest.raises(kind) as caught:
            measurement.measure(case, [run])
        assert analysis.reasons(tmp_path, caught.value, case) == (f"{tmp_path / 'measure.py'}, line 2, {line}",)


def test_a_number_in_the_place_of_a_value_is_refused(tmp_path: Path) -> None:
    case = SimpleNamespace(name="mine", folder=tmp_path, studies=())
    (tmp_path / "measure.py").write_text("from dembark.postproc.measurement import Measurement\n\n"
                                         "def measure(replicas):\n    return Measurement({'rebound': 0.8})\n")
    with pytest.raises(DembarkError, match=r"measure of .*measure\.py returned rebound = 0\.8, give a Value with an Estimate"):
        measurement.measure(case, [])


def test_numerical_warnings_become_remarks_and_stay_errors_where_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        with analysis.collected_warnings() as remarks:
            np.float64(0.0) / np.float64(0.0)
        assert len(remarks) == 1 and "invalid value" in remarks[0] and "test_analysis.py, line" in remarks[0]
        warnings.simplefilter("error")
        with pytest.raises(RuntimeWarning), analysis.collected_warnings():
            np.float64(0.0) / np.float64(0.0)
    assert capsys.readouterr().err == ""


def test_open_verdicts_are_told_with_their_reason() -> None:
    quantities = tuple(QuantityRecord(name, 1.0, verdict, tolerance=0.1, reason=reason) for name, verdict, reason in (
        ("a", "info", "the run is too short"), ("b", "pass", ""), ("c", "info", "the run is too short"), ("d", "info", "")))
    assert show.open_lines(Result("box", "dry", "yade", quantities)) == ["open: a, c: the run is too short"]


def test_the_worst_steps_of_some_runs():
    found = [{"position": 1e-7, "velocity": 2e-3, "contact_steps": 31.0}, {}, {"position": 3e-7, "velocity": 1e-3, "contact_steps": 0.0}]
    assert metrics.worst(found) == {"position": 3e-7, "velocity": 2e-3, "contact_steps": 31.0}
    assert metrics.worst([{}]) == {}
