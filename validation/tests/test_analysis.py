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


PAIR = "Value(Estimate(0.8, 0.0), Estimate(0.8, 0.0)"
CURVE = "profile('h', 'Height', 't', 'h', [0.0, 1.0], [[1.0, 2.0]])"


@pytest.mark.parametrize(("returned", "words"), [
    ("Measurement({'rebound': 0.8})", "returned rebound = 0.8, give a Value with an Estimate"),
    ("Measurement({'rebound': Value(0.8)})", "returned rebound with the estimate 0.8, give an Estimate, such as"),
    ("Measurement({'rebound': Value(Estimate(0.8, 0.0), 0.8)})", "returned rebound with the reference 0.8, give an Estimate"),
    ("Measurement({'rebound': Value(Estimate('0.8', 0.0))})", "with the estimate '0.8' ± 0.0, give a real number"),
    ("Measurement({'rebound': Value(Estimate(0.8j, 0.0))})", "with the estimate 0.8j ± 0.0, give a real number"),
    ("Measurement({'rebound': Value(Estimate([0.8], 0.0))})", "with the estimate [0.8] ± 0.0, give a real number"),
    ("Measurement({'rebound': Value(Estimate(0.8, -0.1))})", "with the estimate 0.8 ± -0.1, give a half-width of 0 or more"),
    (f"Measurement({{'rebound': {PAIR}, reason=3)}})", "returned rebound with reason = 3, give a text"),
    (f"Measurement({{'rebound': {PAIR}, half='x')}})", "returned rebound with half = 'x', give a real number"),
    ("Measurement({}, remarks='two frames')", "returned one text as remarks, give a list of texts"),
    ("Measurement({}, [{'x': 1}])", "returned profiles that are no curves, make each with profile"),
    (f"Measurement({{}}, [{CURVE}, {CURVE}])", "returned two curves called h, give each a name of its own"),
    (f"Measurement({{}}, [{CURVE.replace('2.0', '2.0, 3.0')}])", "the curve h has 2 places, but 3 values"),
    (f"Measurement({{}}, [{CURVE.replace('[[1.0, 2.0]]', '[1.0, 2.0]')}])", "the curve h has 2 places, but one number, one number values"),
    (f"Measurement({{}}, [{CURVE.replace('2.0]])', '2.0]], reference=[1.0])')}])", "the curve h has 2 places, but 2, 1 values"),
    (f"Measurement({{}}, [{CURVE.replace('[[1.0, 2.0]]', '[]')}])", "the curve h has 2 places, but no values"),
    (f"Measurement({{}}, [{CURVE.replace('h', 'a/h', 1)}])", "a curve is called 'a/h', files are named after it"),
])
def test_what_cannot_be_judged_or_drawn_is_refused(returned: str, words: str, tmp_path: Path) -> None:
    case = SimpleNamespace(name="mine", folder=tmp_path, studies=())
    (tmp_path / "measure.py").write_text("from dembark.postproc.measurement import Estimate, Measurement, Value, profile\n\n"
                                         f"def measure(replicas):\n    return {returned}\n")
    with pytest.raises(DembarkError) as caught:
        measurement.measure(case, [])
    assert words in str(caught.value), str(caught.value)


def test_a_measurement_in_order_passes(tmp_path: Path) -> None:
    case = SimpleNamespace(name="mine", folder=tmp_path, studies=())
    (tmp_path / "measure.py").write_text(
        "import numpy as np\nfrom dembark.postproc.measurement import Estimate, Measurement, Value, profile\n\n"
        f"def measure(replicas):\n    one = {CURVE.replace('2.0]])', '2.0]], reference=np.ones(2), reference_half=0.1)')}\n"
        "    return Measurement({'a': Value(Estimate(np.float32(0.8), np.inf)), 'b': Value(Estimate(np.nan, np.nan))}, [one], ['said'])\n")
    found = measurement.measure(case, [])
    assert set(found.values) == {"a", "b"} and found.profiles[0]["reference_low"] == [0.9, 0.9]


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
