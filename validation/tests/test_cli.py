"""The commands as users type them: one line for a mistake, tables for results, exit codes that scripts can rely on."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from dembark.common.files import read_json
from dembark.validation import engines
from dembark.validation.case import folders
from dembark.validation.cli import main

Dembark = Callable[..., "subprocess.CompletedProcess[str]"]

pytestmark = pytest.mark.usefixtures("decks", "stand_in")


@pytest.fixture
def dembark(command: Callable[..., tuple[int, str, str]], stand_in_analysis: None) -> Dembark:
    """The command in the test's folder."""
    return lambda *words: subprocess.CompletedProcess(words, *command(*words))


@pytest.mark.parametrize(("words", "expected"), [
    (["rnu"], "Did you mean 'run'"),
    (["run", "box"], "--engine"),
    (["run", "bxo", "--engine", "yade"], "did you mean box"),
    (["run", "box", "--engine", "ydae"], "did you mean yade"),
    (["run", "box", "--engine", "yade", "--profile", "quikc"], "did you mean quick"),
    (["run", "box", "--engine", "yade", "--variant", "wett"], "did you mean wet"),
    (["run", "box", "--engine", "yade", "--set", "grain_cuont=5", "--out", "o"], "did you mean grain_count"),
    (["run", "box", "--engine", "yade", "--set", "grain_count=5"], "--out is missing"),
    (["run", "box", "--engine", "yade", "--ranks", "2"], "--threads"),
    (["run", "box", "--engine", "yade", "--ranks", "0"], "--ranks"),
    (["validate", "--case", "bxo"], "did you mean box"),
    (["report", "--results", "nowhere"], "no results in"),
    (["cases", "bxo"], "did you mean box"),
])
def test_a_mistake_gets_one_line_and_exit_code_2(words: list[str], expected: str, capsys: pytest.CaptureFixture[str], tmp_path: Path,
                                                 monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(words) == 2
    last = capsys.readouterr().err.splitlines()[-1]
    assert last.startswith("dembark: ") and expected in last


def test_a_missing_engine_gets_the_command_that_makes_it(
        monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    monkeypatch.setattr(engines.base, "checkout", lambda: tmp_path)
    monkeypatch.setenv("PATH", "/usr/bin")
    for engine, variable, advice in (("liggghts", "DEMBARK_LIGGGHTS", "make liggghts"), ("yade", "DEMBARK_YADE", "make yade-plugin")):
        monkeypatch.delenv(variable)
        engines.find.cache_clear()
        assert main(["run", "box", "--engine", engine]) == 2
        error = capsys.readouterr().err
        assert advice in error and error.count("\n") == 1
    assert main(["doctor"]) == 1
    # A long path makes the table break its lines.
    found = " ".join(capsys.readouterr().out.split())
    assert found.count("MISSING") >= 2 and "make yade-plugin" in found


def test_cases_shows_every_key(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["cases"]) == 0
    assert "box" in capsys.readouterr().out
    assert main(["cases", "box"]) == 0
    shown = capsys.readouterr().out
    for key in folders.find("box").parameters.values():
        assert key.name in shown and key.doc in shown
    assert "not set" in shown and "> 0" in shown and "dry (liggghts, yade)" in shown


def test_run_measures_and_shows_verdicts(dembark: Dembark, tmp_path: Path) -> None:
    done = dembark("run", "box", "--engine", "liggghts", "--variant", "wet", "--set", "grain_diameter=4 mm", "--out", "o")
    assert done.returncode == 0, done.stderr
    assert "FAIL" in done.stdout and "0 of 1 check passed, 1 FAILED" in done.stdout and str(tmp_path / "o/metrics.json") in done.stdout
    assert "  evidence (not stated): 0 of 1 check passed, 1 FAILED" in done.stdout.splitlines()
    assert "box wet liggghts 1: finished" in done.stderr
    assert read_json(tmp_path / "o/metrics.json")["parameters"]["grain_diameter"] == 0.004


def test_a_check_that_nothing_measures_is_told(dembark: Dembark, tmp_path: Path) -> None:
    path = tmp_path / "decks/box/case.toml"
    path.write_text(path.read_text() + '\n[quantities.gone]\nlabel = "gone"\nevidence = "theory"\ntolerance = 0.1\nwhy = "noise"\n')
    done = dembark("run", "box", "--engine", "liggghts", "--out", "o")
    assert "declared, not measured in this run: gone" in done.stdout.splitlines(), done.stderr
    done = dembark("validate", "--case", "box", "--engine", "liggghts")
    assert "  declared, but measured by no run: box: gone" in done.stdout.splitlines(), done.stderr + done.stdout


def test_a_failed_check_counts_only_when_asked(dembark: Dembark, tmp_path: Path) -> None:
    """The wet box fails a check: exit code 0 as ever, 1 with --strict."""
    words = ("run", "box", "--engine", "liggghts", "--variant", "wet", "--out", "o")
    first, second = dembark(*words, "--restart-interval", "1 s"), dembark(*words, "--strict")
    assert (first.returncode, second.returncode) == (0, 1)
    assert "1 FAILED" in first.stdout and second.stderr.splitlines()[-1] == "dembark: 1 check failed, --strict makes this an error"
    # By the fixed rate of restarts, a million particle-steps a second.
    assert read_json(tmp_path / "o/replica-1/run.json")["restart_every"] == 100_000


def test_a_failure_is_told_once(dembark: Dembark) -> None:
    done = dembark("run", "box", "--engine", "liggghts", "--profile", "standard", "--set", "behaviour=exit", "--out", "o")
    assert done.returncode == 1
    for number in (1, 2, 3):
        assert done.stderr.count(f"replica-{number}.log") == 1
    assert done.stderr.count("Lost atoms") == 3


def test_tables_are_as_wide_as_asked_for_when_piped(dembark: Dembark, monkeypatch: pytest.MonkeyPatch) -> None:
    widths = []
    for columns in ("60", "200"):
        monkeypatch.setenv("COLUMNS", columns)
        widths.append(max(map(len, dembark("cases", "box").stdout.splitlines())))
    assert widths[0] <= 60 < widths[1] <= 200


def test_run_makes_all_replicas_with_their_own_seeds(dembark: Dembark, tmp_path: Path) -> None:
    done = dembark("run", "box", "--engine", "yade", "--profile", "standard")
    assert done.returncode == 0, done.stderr
    folder = tmp_path / "results/standard/box/dry/yade"
    assert [read_json(folder / f"replica-{k}/run.json")["seed"] for k in (1, 2, 3)] == [7, 8, 9]
    assert "already finished; reusing" in dembark("run", "box", "--engine", "yade", "--profile", "standard").stderr


def test_more_replicas_keep_those_that_are_there(dembark: Dembark, tmp_path: Path) -> None:
    words = ("run", "box", "--engine", "liggghts", "--profile", "standard", "--out", "o")
    assert dembark(*words).returncode == 0
    folder = tmp_path / "o"
    before = {k: (folder / f"replica-{k}/run.json").read_bytes() for k in (1, 2, 3)}
    done = dembark(*words, "--set", "replicas=4")
    assert done.returncode == 0, done.stderr
    assert {k: (folder / f"replica-{k}/run.json").read_bytes() for k in (1, 2, 3)} == before
    assert (folder / "replica-4/run.json").is_file()
    assert read_json(folder / "metrics.json")["parameters"]["replicas"] == 4


def test_results_of_other_inputs_are_replaced_only_when_asked(dembark: Dembark, tmp_path: Path) -> None:
    words = ("run", "box", "--engine", "liggghts", "--out", "o")
    assert dembark(*words).returncode == 0
    before = (tmp_path / "o/replica-1/run.json").read_bytes()
    done = dembark(*words, "--set", "grain_count=11")
    assert done.returncode == 2 and "--force" in done.stderr
    assert (tmp_path / "o/replica-1/run.json").read_bytes() == before
    assert dembark(*words, "--set", "grain_count=11", "--force").returncode == 0
    assert read_json(tmp_path / "o/metrics.json")["parameters"]["grain_count"] == 11


def test_a_folder_with_other_things_is_refused(dembark: Dembark, tmp_path: Path) -> None:
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/thesis.tex").touch()
    done = dembark("run", "box", "--engine", "liggghts", "--out", "mine")
    assert done.returncode == 2 and "not empty" in done.stderr
    assert [path.name for path in (tmp_path / "mine").iterdir()] == ["thesis.tex"]


def test_a_failed_run_gets_exit_code_1_and_no_metrics(dembark: Dembark, tmp_path: Path) -> None:
    done = dembark("run", "box", "--engine", "liggghts", "--set", "behaviour=exit", "--out", "o")
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].startswith("dembark: box dry liggghts 1 failed, the engine ended with exit code 1")
    assert not (tmp_path / "o/metrics.json").exists() and (tmp_path / "o/failed/replica-1.log").is_file()
    # Mended, the same folder can be used again.
    assert dembark("run", "box", "--engine", "liggghts", "--out", "o").returncode == 0


def test_report_is_built_again_from_results(dembark: Dembark, tmp_path: Path) -> None:
    assert dembark("run", "box", "--engine", "liggghts").returncode == 0
    done = dembark("report", "--profile", "quick")
    assert done.returncode == 0 and str(tmp_path / "results/quick/report.html") in done.stdout


def test_yade_gets_all_words() -> None:
    done = subprocess.run([sys.executable, "-m", "dembark.validation.cli", "yade", "--version", "-x"], capture_output=True, text=True,
                          check=False)
    assert done.stdout.startswith("Yade version") and done.returncode == 0


def test_help_and_no_words(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0 and main(["run", "--help"]) == 0
    assert "KEY=VALUE" in capsys.readouterr().out
