"""The complete chain with stand-ins: nothing is repeated, nothing stale is reported, failures stop nothing else."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from harness import command, decks, engine_pid, environment, lives, stand_in, stand_in_analysis, start, wait_for  # noqa: F401

from dembark.common.files import read_json
from dembark.validation import engines
from dembark.validation.campaigns.plan import of_profile, studies
from dembark.validation.case import folders
from dembark.validation.judge.result import result_files, unplanned
from dembark.validation.results import states

Command = Callable[..., tuple[int, str, str]]

pytestmark = pytest.mark.usefixtures("decks", "stand_in", "stand_in_analysis")


def reported(results: Path) -> list[str]:
    """What the stand-in of the report lists."""
    return (results / "report.html").read_text().partition("<!--")[0].split()


def set_default(decks: Path, variant: str, line: str) -> None:
    path = decks / "box" / "case.toml"
    head, _, tail = path.read_text().partition(f"[variants.{variant}]\n")
    path.write_text(f"{head}[variants.{variant}]\n{line}\n{tail}")


def test_all_runs_then_none_again_then_only_what_changed(tmp_path: Path, command: Command, decks: Path) -> None:
    code, out, error = command("validate", "--profile", "quick")
    results = tmp_path / "results" / "quick"
    assert code == 0, error
    assert "3 of 3 runs finished; 2 of 3 checks passed, 1 FAILED" in out and str(results / "report.html") in out
    assert reported(results) == [
        "box/dry/liggghts/metrics.json", "box/dry/yade/metrics.json", "box/wet/liggghts/metrics.json"]
    assert read_json(results / "box/dry/comparison.json")["engines"] == ["liggghts", "yade"]
    assert not (results / "box/wet/comparison.json").exists()
    assert error.count("finished in") == 3 + 3 + 1 + 1 + 1  # runs, measurements, a comparison, the verification and the report
    made = {path: path.stat().st_mtime_ns for path in results.glob("*/*/*/replica-1/run.json")}

    code, out, error = command("validate", "--profile", "quick")
    assert code == 0 and error.count("already finished; reusing") == 3 and "started" not in error
    assert {path: path.stat().st_mtime_ns for path in made} == made

    set_default(decks, "wet", "grain_count = 12")
    code, out, error = command("validate", "--profile", "quick")
    assert code == 0 and error.count("already finished; reusing") == 2 and error.count("1: finished in") == 1
    assert sum(path.stat().st_mtime_ns != before for path, before in made.items()) == 1
    assert read_json(results / "box/wet/liggghts/metrics.json")["parameters"]["grain_count"] == 12


def test_a_report_of_old_runs_names_those_that_would_be_made_otherwise_now(command: Command, decks: Path, stand_in: Path) -> None:
    assert command("validate")[0] == 0
    assert command("report")[2] == ""
    set_default(decks, "wet", "grain_count = 12")
    code, _, error = command("report")
    assert code == 0 and error == ("dembark: the runs of box wet liggghts are of another case, deck or engine than those of now; make them "
                                   "again with 'dembark validate --profile quick --results results'\n")
    stand_in.write_bytes(stand_in.read_bytes() + b"# another version\n")
    engines.find.cache_clear()
    assert "box dry liggghts and 2 more are of another" in command("report")[2]
    # What cannot be planned has no such line.
    (decks / "box" / "case.toml").write_text("")
    assert "of another case" not in command("report")[2]


STUDY = """[variants.large]
grain_count = 30
[variants.huge]
grain_count = 40
[studies.size]
title = "Sizes"
along = "grain_count"
variants = ["dry", "large", "huge"]
[runs]
"""


def test_studies_are_planned_for_engines_that_run_all_their_variants(decks: Path) -> None:
    path = decks / "box" / "case.toml"
    path.write_text(path.read_text().replace("[runs]\n", STUDY).replace(
        '{variant = "wet", engines = ["liggghts"]}', '{variant = "large"}, {variant = "huge", engines = ["yade"]}'))
    assert [str(place) for _, place, _ in studies(one.place for one in of_profile("quick"))] == ["box/study-size/yade"]
    path.write_text(path.read_text().replace(', engines = ["yade"]', ""))
    folders.load.cache_clear()
    assert [str(place) for _, place, _ in studies(one.place for one in of_profile("quick"))] == [
        "box/study-size/liggghts", "box/study-size/yade"]


def test_a_line_of_runs_may_give_an_engine_its_own_number_of_replicas(decks: Path) -> None:
    path = decks / "box" / "case.toml"
    path.write_text(path.read_text().replace('standard = [{variant = "dry"}]', 'standard = [{variant = "dry", replicas = {yade = 1}}]'))
    assert {one.runs[0].engine.name: len(one.runs) for one in of_profile("standard")} == {"liggghts": 3, "yade": 1}


def test_a_study_is_inputs_hash_its_variants_and_again_when_one_of_them_changes(tmp_path: Path, command: Command,
                                                                            decks: Path) -> None:
    path = decks / "box" / "case.toml"
    path.write_text(path.read_text().replace("[runs]\n", STUDY).replace(
        '{variant = "dry"}, {variant = "wet", engines = ["liggghts"]}',
        '{variant = "dry", engines = ["liggghts"]}, {variant = "large", engines = ["liggghts"]}, '
        '{variant = "huge", engines = ["liggghts"]}'))
    code, _, error = command("validate", "--profile", "quick")
    results = tmp_path / "results" / "quick"
    assert code == 0, error
    assert read_json(results / "box/study-size/liggghts/metrics.json")["parameters"]["numbers"] == [10, 30, 40]
    assert "box/study-size/liggghts/metrics.json" in (results / "report.html").read_text()

    path.write_text(path.read_text().replace("grain_count = 40", "grain_count = 50"))
    code, _, error = command("validate", "--profile", "quick")
    assert code == 0 and read_json(results / "box/study-size/liggghts/metrics.json")["parameters"]["numbers"] == [10, 30, 50]


def test_a_failed_run_is_missing_in_the_report_and_nothing_stale_takes_its_place(
        tmp_path: Path, command: Command, decks: Path) -> None:
    assert command("validate")[0] == 0
    results = tmp_path / "results" / "quick"
    set_default(decks, "wet", 'behaviour = "kill"')
    code, out, error = command("validate")
    assert code == 1
    assert "2 of 3 runs finished" in out and "not finished: box wet liggghts 1: " in out and "SIGKILL" in out
    assert "dembark: the validation is incomplete" in error
    assert reported(results) == ["box/dry/liggghts/metrics.json", "box/dry/yade/metrics.json"]
    found = {state.folder: state for state in states(results)}
    assert {place: state.state for place, state in found.items()} == {
        "box/dry/liggghts/replica-1": "finished", "box/dry/yade/replica-1": "finished", "box/wet/liggghts/replica-1": "stopped"}
    assert "SIGKILL" in found["box/wet/liggghts/replica-1"].message
    assert (results / "box/wet/liggghts/superseded/replica-1/run.json").is_file()


def test_a_variant_that_is_no_longer_planned_does_not_count(tmp_path: Path, command: Command, decks: Path) -> None:
    assert command("validate")[0] == 0
    path, results = decks / "box" / "case.toml", tmp_path / "results" / "quick"
    path.write_text(path.read_text().replace(', {variant = "wet", engines = ["liggghts"]}', ""))
    code, out, _ = command("validate")
    assert code == 0 and "2 of 2 runs finished; 2 of 2 checks passed, none failed" in out
    assert {str(path.relative_to(results).parent) for path in result_files(results)} == {"box/dry", "box/dry/liggghts", "box/dry/yade"}
    # What was measured is kept, and named.
    assert (results / "box/wet/liggghts/metrics.json").is_file() and unplanned(results) == [Path("box/wet/liggghts")]


def test_replicas_that_are_no_longer_wanted_do_not_count(tmp_path: Path, command: Command, decks: Path) -> None:
    words = ("validate", "--profile", "standard", "--engine", "liggghts")
    assert command(*words)[0] == 0
    metrics = tmp_path / "results/standard/box/dry/liggghts/metrics.json"
    assert read_json(metrics)["quantities"][0]["value"] == 3
    path = decks / "box" / "case.toml"
    path.write_text(path.read_text().replace("replicas = 3", "replicas = 2"))
    assert command(*words)[0] == 0
    assert read_json(metrics)["quantities"][0]["value"] == 2


def test_a_measurement_that_fails_is_told(tmp_path: Path, command: Command) -> None:
    folder = tmp_path / "results/quick/box/wet/liggghts"
    folder.mkdir(parents=True)
    (folder / "unmeasurable").touch()
    code, out, _ = command("validate")
    assert code == 1 and "problem: " in out and "ValueError: cannot be measured" in out and "report.html" in out


@pytest.mark.parametrize("number", [signal.SIGTERM, pytest.param(signal.SIGINT, marks=pytest.mark.full), signal.SIGKILL])
def test_an_interrupted_workflow_goes_on_where_it_was(
        tmp_path: Path, environment: dict[str, str], command: Command, decks: Path, number: int, wait_for: Callable[..., object],
        engine_pid: Callable[[Path], int], lives: Callable[[int], bool]) -> None:
    set_default(decks, "wet", 'behaviour = "hang"')
    process = start(tmp_path, environment, "validate", "--cores", "3")
    results = tmp_path / "results" / "quick"
    wait_for(lambda: len(list(results.glob("box/dry/*/replica-1/run.json"))) == 2, 60)
    if number == signal.SIGKILL:
        # A process for steps that is being started when its parent is killed dies of that with a trace of Python's own.
        wait_for((results / "box/dry/comparison.json").is_file, 60)
    pid = engine_pid(results / "box/wet")
    process.send_signal(number)
    _, error = process.communicate(timeout=60)
    assert process.returncode == (-9 if number == signal.SIGKILL else 130) and "Traceback" not in error
    wait_for(lambda: not lives(pid))
    time.sleep(0.5)
    path = decks / "box" / "case.toml"
    path.write_text(path.read_text().replace('behaviour = "hang"\n', ""))
    code, _, error = command("validate")
    assert code == 0 and error.count("already finished; reusing") == 2 and error.count("1: finished in") == 1
    assert not list(results.glob("**/.replica-1.part-*"))


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
@pytest.mark.parametrize(("words", "what"), [
    (["run", "box", "--engine", "liggghts", "--out", "run"], "dembark.validation.metrics.measure"),
    (["report"], "dembark.validation.report.build"),
])
def test_a_signal_ends_measurements_and_reports_that_this_process_makes(
        command: Command, monkeypatch: pytest.MonkeyPatch, number: int, words: list[str], what: str) -> None:
    assert command("validate")[0] == 0

    def interrupted(*_: object) -> None:
        os.kill(os.getpid(), number)
        time.sleep(1.0)
        pytest.fail("the signal changed nothing")

    monkeypatch.setattr(what, interrupted)
    code, _, error = command(*words)
    assert code == 130 and error.splitlines()[-1] == "dembark: interrupted"


def test_two_validations_of_one_profile_do_not_mix(
        tmp_path: Path, environment: dict[str, str], command: Command, decks: Path, engine_pid: Callable[[Path], int]) -> None:
    set_default(decks, "wet", 'behaviour = "hang"')
    first = start(tmp_path, environment, "validate")
    engine_pid(tmp_path / "results/quick/box/wet")
    code, _, error = command("validate")
    assert code == 2 and "another validation" in error
    first.terminate()
    first.communicate(timeout=60)
