"""Campaigns as users run them, with a stand-in for both engines: submitted, looked at, killed, resumed; nothing is lost or done twice."""

from __future__ import annotations

import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any
from unittest.mock import ANY

import pytest
from harness import command, decks, engine_pid, environment, lives, stand_in, stand_in_analysis, start, wait_for  # noqa: F401

from dembark.common.files import read_json
from dembark.common.lock import lock
from dembark.validation import results as tables
from dembark.validation.campaigns.estimate import wall_clock
from dembark.validation.cli import main
from dembark.validation.runs.folder import look

Command = Callable[..., tuple[int, str, str]]

pytestmark = pytest.mark.usefixtures("decks", "stand_in", "stand_in_analysis")

CAMPAIGN = """
[campaign]
name = "boxes"
description = "Boxes."
profile = "quick"
engines = ["liggghts"]
retries = 2

[[sweeps]]
title = "Behaviours"
case = "box"
grid = { behaviour = ["kill", "exit", "ok"] }

[[sweeps]]
case = "box"
variant = "wet"
engines = ["yade"]
replicas = 2
grid = { grain_diameter = ["4 mm"] }

[resources]
memory = "10 MB"
time = "1 min"
restart_interval = "0.0001 s"
"""


def logs(results: Path) -> str:
    return "".join((results / name).read_text() for name in ("campaign.log",) if (results / name).is_file())


# A scheduler that numbers jobs, keeps those of the first submission in its queue, and starts none.
SITE = '''
submit = "wc -l < queue; grep -m 1 job-name {script} | cut -d= -f2 >> queue"
header = "# job-name={name}"
array = ""
index = "0"
after = "# after {jobs}"
queued = "grep -x -n {name} queue | cut -d: -f1"
'''


@pytest.fixture
def queue(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The queue of that scheduler, and the campaign."""
    monkeypatch.chdir(tmp_path)
    Path("queue").write_text("of another user\n", encoding="utf-8")
    Path("boxes.toml").write_text(CAMPAIGN, encoding="utf-8")
    Path("site.toml").write_text(SITE, encoding="utf-8")
    return tmp_path / "queue"


def awaited(job: str, results: str = "results") -> set[str]:
    (after,) = re.findall(r"^# after (.*)$", Path(results, ".jobs", f"{job}.sh").read_text(encoding="utf-8"), re.MULTILINE)
    return set(after.split(":"))


def test_a_report_waits_for_the_jobs_of_earlier_submissions(queue: Path, command: Command) -> None:
    for words in (["submit", "boxes.toml", "--executor", "site.toml", "--out", "results"], ["resume", "results"]):
        assert command(*words) == (0, ANY, ANY)
    jobs = queue.read_text(encoding="utf-8").splitlines()
    (first, second) = (number for number, name in enumerate(jobs) if name.endswith("report"))
    assert {str(number) for number in range(2, first + 2)} <= awaited(jobs[second])


def test_a_run_that_runs_is_submitted_to_be_repeated(queue: Path, command: Command) -> None:
    """It may fail, and the submission that started it may have been cut off before its retries."""
    words = ["--executor", "site.toml", "--out", "results"]
    assert command("submit", "boxes.toml", *words) == (0, ANY, ANY)
    before = len(queue.read_text(encoding="utf-8").splitlines())
    place = next(line for path in sorted(Path("results/.jobs").glob("*.runs")) for line in path.read_text().splitlines() if "yade" in line)
    held = tables.lock_file(Path("results", place))
    held.parent.mkdir(parents=True, exist_ok=True)
    with lock(held, "held"):
        code, _, said = command("resume", "results")
    assert code == 0 and "1 of 5 runs are finished or running" in said
    jobs = queue.read_text(encoding="utf-8").splitlines()[before:]
    again = [job for job in jobs if place in Path("results/.jobs", f"{job}.runs").read_text(encoding="utf-8").splitlines()]
    assert len(again) == 2
    assert all("--again" in Path("results/.jobs", f"{job}.sh").read_text(encoding="utf-8") for job in again)
    assert {str(number) for number in range(2, before + 1)} <= awaited(again[0])


ELSEWHERE = ["--executor", "site.toml", "--out", "my results", "--write-only"]


def submitted_elsewhere() -> subprocess.CompletedProcess[str]:
    """What the newest script that submits the jobs says; it starts in another folder."""
    *_, script = sorted(Path("my results/.jobs").glob("*.submit"), key=lambda path: path.stat().st_mtime_ns)
    return subprocess.run(["bash", script.resolve()], cwd="/", capture_output=True, text=True, check=False)


@pytest.fixture
def elsewhere(queue: Path) -> Path:
    """The same scheduler for scripts that start elsewhere. It answers as Slurm does with a name of a cluster, and refuses while there is a
    file `full`."""
    text = SITE.replace("submit = \"", f"submit = \"cd {queue.parent}; [ ! -e full ] || exit 1; ")
    text = text.replace("wc -l < queue", "echo $(wc -l < queue)';cluster'")
    Path("site.toml").write_text(text.replace("grep -x", f"cd {queue.parent}; grep -x"), encoding="utf-8")
    return queue


def test_jobs_that_are_only_written_are_submitted_by_their_script(elsewhere: Path, command: Command) -> None:
    code, _, said = command("submit", "boxes.toml", *ELSEWHERE)
    (script,) = Path("my results/.jobs").glob("*.submit")
    assert code == 0 and f"bash '{script.resolve()}'" in said and elsewhere.read_text(encoding="utf-8") == "of another user\n"
    for _ in range(2):  # the second time there is nothing left to submit
        done = submitted_elsewhere()
        assert done.returncode == 0, done.stderr
    jobs = elsewhere.read_text(encoding="utf-8").splitlines()[1:]
    assert len(jobs) == len(set(jobs)) == len(list(Path("my results/.jobs").glob("*.sh")))
    # As in a direct submission: retries follow the attempt before, the report all of them.
    waits = {number: awaited(job, "my results") for number, job in enumerate(jobs, start=1)
             if "# after" in Path("my results/.jobs", f"{job}.sh").read_text(encoding="utf-8")}
    *attempts, report = range(1, len(jobs) + 1)
    repeated = [waits[one] for one in attempts if one in waits]
    assert {"1"} in repeated and {"2"} in repeated and waits[report] == {str(one) for one in attempts if {str(one)} not in repeated}


def test_a_script_whose_job_is_refused_goes_on_where_it_stopped(elsewhere: Path, command: Command) -> None:
    assert command("submit", "boxes.toml", *ELSEWHERE) == (0, ANY, ANY)
    Path("full").touch()
    done = submitted_elsewhere()
    assert done.returncode == 1 and done.stderr.count("\n") == 1 and "refused" in done.stderr and "-1.sh" in done.stderr
    Path("full").unlink()
    assert submitted_elsewhere().returncode == 0
    jobs = elsewhere.read_text(encoding="utf-8").splitlines()[1:]
    assert len(jobs) == len(set(jobs)) == len(list(Path("my results/.jobs").glob("*.sh")))


def test_what_is_resumed_elsewhere_waits_for_the_jobs_of_before(elsewhere: Path, command: Command) -> None:
    assert command("submit", "boxes.toml", *ELSEWHERE) == (0, ANY, ANY)
    assert submitted_elsewhere().returncode == 0
    before = elsewhere.read_text(encoding="utf-8")
    assert command("resume", "my results", "--write-only") == (0, ANY, ANY)
    done = submitted_elsewhere()
    assert done.returncode == 1 and "of an earlier submission" in done.stderr and elsewhere.read_text(encoding="utf-8") == before
    elsewhere.write_text("of another user\n", encoding="utf-8")
    assert submitted_elsewhere().returncode == 0


def test_write_only_needs_a_site(queue: Path, command: Command) -> None:
    code, _, said = command("submit", "boxes.toml", "--out", "results", "--write-only")
    assert code == 2 and "--write-only" in said and "--executor" in said and not Path("results").exists()


def test_jobs_start_dembark_in_a_container(queue: Path, command: Command) -> None:
    """The preamble is for the jobs, which start outside of it."""
    Path("site.toml").write_text(SITE + """
container = "enter /images/dembark.sif"
preamble = "module load enter"
""", encoding="utf-8")
    assert command("submit", "boxes.toml", "--executor", "site.toml", "--out", "results") == (0, ANY, ANY)
    for path in Path("results/.jobs").glob("*.sh"):
        *_, preamble, body = path.read_text(encoding="utf-8").strip().splitlines()
        assert preamble == "module load enter" and body.startswith("exec enter /images/dembark.sif env ")
        assert f" {sys.executable} -m dembark.validation.runs.job " in body


@pytest.fixture
def signals() -> Iterator[None]:
    """The handlers of signals are afterwards what they were."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.usefixtures("signals")
def test_a_dry_run_says_what_it_will_cost_and_leaves_nothing(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "c.toml").write_text(CAMPAIGN)
    assert main(["submit", "c.toml", "--dry-run", "--cores", "2"]) == 0
    out = capsys.readouterr().out
    rows = {tuple(line.split()[:3]): line.split()[3:] for line in out.splitlines() if line.startswith("box ")}
    assert rows["box", "wet_grain_diameter=0.004", "yade"][:6] == ["2", "2", "1", "100", "0.001", "s"]
    # 100 steps of 10 grains, five runs; 2e6 and 3e5 particle-steps a second for cases that nothing is known of.
    assert "boxes: 5 runs; to do: 5e+03 particle-steps" in out and "yade 3e+05" in out and "liggghts 2e+06" in out
    assert not (tmp_path / "results").exists()


def test_faults_are_tried_again_and_a_changed_file_repeats_nothing(tmp_path: Path, command: Command) -> None:
    (tmp_path / "c.toml").write_text(CAMPAIGN)
    code, out, error = command("submit", "c.toml")
    results = tmp_path / "results/campaigns/boxes"
    assert code == 1 and "4 of 5 runs finished" in out and "not finished: box dry_behaviour=exit liggghts 1: " in out, error + logs(results)
    attempts = {(run.variant, run.replica): (run.state, run.attempt) for run in tables.runs(results).itertuples()}
    assert attempts == {("dry_behaviour=ok", 1): ("finished", 1), ("dry_behaviour=kill", 1): ("finished", 2),
                        ("dry_behaviour=exit", 1): ("failed", 1), ("wet_grain_diameter=0.004", 1): ("finished", 1),
                        ("wet_grain_diameter=0.004", 2): ("finished", 1)}
    assert re.search("kill liggghts 1: finished in .* in attempt 2", error)
    # What failed by its own fault is started once, what was killed again.
    assert error.count("exit liggghts 1: FAILED") == 1 and error.count("exit liggghts 1: started") == 1
    assert error.count("kill liggghts 1: stopped after") == 1
    assert "box dry_behaviour=ok liggghts 1: finished in" in (results / "campaign.log").read_text()
    state = look(results)
    assert state.headline == "boxes: 4 of 5 done, 0 running, 0 waiting, 1 failed; no process runs it now" and state.measured == 3
    found = tables.quantities(results)
    assert list(found["value"]) == [1, 1, 2] and list(found["parameters.behaviour"]) == ["kill", "ok", "ok"]
    assert [sweep["title"] for sweep in read_json(results / "plan.json")["sweeps"]] == ["Behaviours", ""]
    made = {path: path.stat().st_mtime_ns for path in results.glob("*/*/*/replica-*/run.json")}

    # The faulty point is taken out, another comes in, and what is derived is lost: only the new run is made.
    changed = CAMPAIGN.replace('"exit", ', "").replace('["4 mm"]', '["4 mm", "5 mm"]')
    (tmp_path / "c.toml").write_text(changed)
    for path in (results / "plan.json", results / "report.html", *results.glob("*/*/*/metrics.json")):
        path.unlink()
    code, out, error = command("submit", "c.toml")
    assert code == 0 and error.count("already finished; reusing") == 4 and "6 of 6 runs finished" in out, error
    assert {path: path.stat().st_mtime_ns for path in made} == made
    assert list(tables.runs(results)["state"]) == ["finished"] * 6 and len(tables.quantities(results)) == 4
    facts = read_json(results / "plan.json")
    assert (results / "campaign.toml").read_text() == changed and facts["campaign"] == "boxes"
    assert facts["submitted"]["file"] == str(tmp_path / "c.toml") and len(facts["runs"]) == 6
    assert look(results).complete and str(results / "report.html") in out


OWN = """
[campaign]
name = "crates"
profile = "quick"
engines = ["liggghts"]
[[sweeps]]
case = "crate"
[sweeps.grid]
grain_diameter = ["4 mm", "5 mm"]
"""


@pytest.mark.parametrize("how", ["option", "relative variable"])
def test_a_campaign_of_own_cases_goes_on_from_anywhere(tmp_path: Path, decks: Path, command: Command,
                                                       monkeypatch: pytest.MonkeyPatch, how: str) -> None:
    own, elsewhere = tmp_path / "own", tmp_path / "elsewhere"
    shutil.copytree(decks / "box", own / "crate")
    elsewhere.mkdir()
    (own / "crate" / "case.toml").write_text((own / "crate" / "case.toml").read_text().replace('name = "box"\n', ""))
    (tmp_path / "c.toml").write_text(OWN)
    monkeypatch.setenv("DEMBARK_CASES", "" if how == "option" else "own")
    code, _, error = command(*(["--cases", "own"] if how == "option" else []), "submit", "c.toml", "--out", "done")
    assert code == 0, error
    shutil.rmtree(next((tmp_path / "done").glob("crate/*/liggghts/replica-1")))
    monkeypatch.delenv("DEMBARK_CASES")
    code, out, error = command("resume", str(tmp_path / "done"), folder=elsewhere)
    assert code == 0 and "2 of 2 runs finished" in out and error.count("already finished; reusing") == 1, error
    own.rename(tmp_path / "gone")
    monkeypatch.delenv("DEMBARK_CASES", raising=False)
    code, _, error = command("resume", str(tmp_path / "done"), folder=elsewhere)
    assert code == 2 and "own is gone" in error and error.count("\n") == 1


def test_a_folder_with_other_things_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "c.toml").write_text(CAMPAIGN)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine/thesis.tex").touch()
    for words, expected in ((("submit", "c.toml", "--out", "mine"), "not empty"), (("resume", "mine"), "not a campaign's folder"),
                            (("status", "mine"), "not a campaign's folder"), (("submit", "c.toml", "--out", "c.toml"), "is a file"),
                            (("export", "gone"), "gone is not a folder"), (("report", "mine"), "no results in")):
        assert main(list(words)) == 2
        error = capsys.readouterr().err
        assert expected in error and error.count("\n") == 1
    assert [path.name for path in (tmp_path / "mine").iterdir()] == ["thesis.tex"]


def test_a_campaign_goes_on_after_its_submitter_was_killed(
        tmp_path: Path, environment: dict[str, str], command: Command, wait_for: Callable[..., Any], engine_pid: Callable[[Path], int],
        lives: Callable[[int], bool]) -> None:
    head, _, _ = CAMPAIGN.partition('[[sweeps]]\ncase = "box"\nvariant')
    text = head.replace('"kill", "exit", "ok"', '"hang", "ok"') + '[resources]\nrestart_interval = "0.0001 s"\n'
    (tmp_path / "c.toml").write_text(text)
    process = start(tmp_path, environment, "submit", "c.toml", "--out", "o", "--cores", "2")
    results = tmp_path / "o"
    wait_for((results / "box/dry_behaviour=ok/liggghts/metrics.json").is_file, 120)
    pid = engine_pid(results / "box/dry_behaviour=hang")
    state = look(results)
    assert state.running and [one.state for one in state.states].count("running") == 1
    process.kill()
    _, error = process.communicate(timeout=90)
    assert "Traceback" not in error
    wait_for(lambda: not lives(pid))
    time.sleep(0.5)
    state = look(results)
    assert not state.running and "no process runs it now" in state.headline
    record = results / "box/dry_behaviour=ok/liggghts/replica-1/run.json"
    made = record.stat().st_mtime_ns

    # It hangs only in its first attempt: when it goes on from a restart file it comes to its end. Another campaign does not get in between.
    (tmp_path / "d.toml").write_text(text.replace('"boxes"', '"others"'))
    code, out, error = command("resume", "o")
    assert code == 0 and "2 of 2 runs finished" in out, error + logs(results)
    assert record.stat().st_mtime_ns == made
    assert list(tables.runs(results)["state"]) == ["finished"] * 2 and len(tables.quantities(results)) == 2
    code, _, error = command("submit", "d.toml", "--out", "o")
    assert code == 2 and "belongs to the campaign boxes" in error


@pytest.mark.usefixtures("signals")
def test_two_submissions_of_one_campaign_do_not_mix(
        tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "c.toml").write_text(CAMPAIGN)
    with lock(tmp_path / "o/.lock", "held"):
        assert main(["submit", "c.toml", "--out", "o"]) == 2
    assert "is being run by another process" in capsys.readouterr().err and list((tmp_path / "o").iterdir()) == []


@pytest.mark.parametrize(("costs", "cores", "expected"), [
    ([], 4, 0.0), ([(3.0, 1)], 1, 3.0), ([(3.0, 1)] * 4, 2, 6.0), ([(4.0, 2), (4.0, 2)], 2, 8.0), ([(1.0, 8)], 2, 1.0),
    ([(5.0, 1), (3.0, 1), (2.0, 1)], 2, 5.0),
])
def test_time_on_some_cores(costs: list[tuple[float, int]], cores: int, expected: float) -> None:
    assert wall_clock(costs, cores) == expected
