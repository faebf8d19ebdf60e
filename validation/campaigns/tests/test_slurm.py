"""The guards around Slurm, against a real one: what it would refuse is told before, and no job is left behind, doubled or lost."""

from __future__ import annotations

import datetime
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest
from slurm_cluster import Cluster

from dembark.common.errors import DembarkError, Interrupted
from dembark.validation import engines
from dembark.validation.campaigns import profiles, slurm
from dembark.validation.campaigns.spec import RunResources
from dembark.validation.engines.liggghts import Liggghts

SLURM = profiles.find("slurm")
LONG = ["--time=1", "--output=/dev/null", "--wrap=sleep 60"]


def profile(folder: Path, text: str) -> profiles.ExecutorProfile:
    """A profile with the shipped Slurm settings and `text`."""
    folder.mkdir(exist_ok=True)
    (folder / "config.yaml").write_text((SLURM.folder / "config.yaml").read_text() + text)
    return profiles.load(folder)


def submit(cluster: Cluster, results: Path, *words: str) -> int:
    """A job with a name as the executor gives it in the campaign `results`."""
    return int(cluster.call("sbatch", "--parsable", f"--job-name={slurm.job_prefix(results)}_5c1e", "--comment=rule_simulate_box", *words))


def test_keys_of_the_shipped_profiles_are_options_of_snakemake() -> None:
    from snakemake.cli import get_argument_parser

    known = {option.lstrip("-") for action in get_argument_parser()._actions for option in action.option_strings}
    assert {"slurm-status-command", "default-resources", "executor"} <= known
    for path in SLURM.folder.parent.glob("*/config.yaml"):
        settings = profiles.yaml.safe_load(path.read_text())
        assert set(settings) <= known, path
    assert profiles.find("local").executor == "local" and SLURM.executor == "slurm"


@pytest.mark.parametrize(("text", "words"), [
    ("groups:\n  simulate: g\n", "rejected by sbatch without a word"),
    ("group-components:\n  g: 5\n", "rejected by sbatch without a word"),
    ("slurm_partition: <partition>\n", "fill it in"),
    ("default-resources: 5\n", "name: value"),
    ("a: [1\n", "cannot be read"),
])
def test_a_mistake_in_a_profile_is_told_in_one_line(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(DembarkError, match=words) as caught:
        profile(tmp_path, text)
    assert "\n" not in str(caught.value) and str(tmp_path / "config.yaml") in str(caught.value)


def test_a_profile_that_is_not_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty").mkdir()
    for name, words in (("slrum", "did you mean slurm"), ("nowhere/at-all", "neither local, nor slurm"), ("empty", "with a config.yaml")):
        with pytest.raises(DembarkError, match=words):
            profiles.find(name)
    (tmp_path / "empty" / "config.yaml").touch()
    with pytest.raises(DembarkError, match="holds no keys"):
        profiles.find("empty")


def test_the_template_asks_to_be_filled_in() -> None:
    with pytest.raises(DembarkError, match="<partition>.*fill it in"):
        profiles.load(SLURM.folder.with_name("site"))
    assert subprocess.run(["bash", "-n", SLURM.folder.with_name("site") / "preamble.sh"], check=False).returncode == 0


def test_the_preamble_sets_the_environment(tmp_path: Path) -> None:
    one = profile(tmp_path, "")
    assert profiles.PREAMBLE_VARIABLE not in one.environment()
    (tmp_path / "preamble.sh").write_text("echo Loading openmpi\nexport SITE=\"two\nlines\" DEMBARK_MPIRUN='srun --mpi=pmix'\n"
                                          "echo $UNSET\nmodule() { true; }\nexport -f module\n")
    found = one.environment()
    assert found["SITE"] == "two\nlines" and found[profiles.PREAMBLE_VARIABLE] == str(tmp_path / "preamble.sh")
    assert not any("openmpi" in key for key in found) and "BASH_FUNC_module%%" in found
    (tmp_path / "preamble.sh").write_text("module load nothing\n")
    with pytest.raises(DembarkError, match="preamble.sh fails.*module"):
        one.environment()


def test_a_launcher_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    for key, value in {"SLURM_JOB_ID": "1", "SLURM_NODELIST": "n1", "PMI_RANK": "0", "SLURM_CONF": "/c"}.items():
        monkeypatch.setenv(key, value)
    engine = Liggghts(Path("/bin/lmp"), "", "")

    def known() -> set[str]:
        return {key for key in engine.environment() if key.startswith(("SLURM_", "PMI"))}

    assert engine.command(Path("d"), {}, 3)[:3] == ["mpirun", "-np", "3"] and known() == {"SLURM_CONF"}
    monkeypatch.setenv("DEMBARK_MPIRUN", "srun --mpi=pmix")
    words = engine.command(Path("d"), {}, 3)
    assert words[:4] == ["srun", "--mpi=pmix", "-n", "3"] and "/bin/lmp" in words and known() == {"SLURM_CONF", "SLURM_JOB_ID"}
    assert "srun" not in engine.command(Path("d"), {}, 1)
    assert slurm.request(RunResources(3, 1, 5e8, 590.0)) == {"mem_mb": 500, "runtime": 10, "tasks": 3, "cpus_per_task": 1, "mpi": "srun"}
    assert slurm.request(RunResources(threads=4)) == {"cpus_per_task": 4} and slurm.request(RunResources()) == {}


def test_what_slurm_would_take_passes(on_cluster: Cluster, tmp_path: Path) -> None:
    slurm.check(SLURM, [RunResources(1, 1, 5e8, 300), RunResources(4, 1, 4e9, 3600), RunResources(1, 4)])
    slurm.check(profiles.find("local"), [RunResources(99)])
    # What Snakemake works out by itself cannot be asked for beforehand.
    (tmp_path / "config.yaml").write_text((SLURM.folder / "config.yaml").read_text().replace("mem_mb: 2000", "mem_mb: attempt * 2000"))
    slurm.check(profiles.load(tmp_path), [])


@pytest.mark.parametrize(("text", "used", "words"), [
    ("", RunResources(8), "would refuse.*node configuration is not available.*tasks=8"),
    ("", RunResources(memory=5e10), "would refuse.*node configuration is not available.*mem_mb=50000"),
    ("", RunResources(time=3601), "would never start.*61 min exceed the partition's limit of 60 min"),
    ("  slurm_partition: mian\n", RunResources(), "would refuse.*mian.*slurm_partition=mian"),
    ("  constraint: gpu\n", RunResources(), "would refuse.*feature"),
])
def test_what_slurm_would_refuse_is_told_before_the_start(on_cluster: Cluster, tmp_path: Path, text: str, used: RunResources,
                                                          words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slurm, "_PAUSE", 0.05)
    with pytest.raises(DembarkError, match=words) as caught:
        slurm.check(profile(tmp_path, text), [used])
    assert "\n" not in str(caught.value)


def test_a_status_command_that_would_wait_for_ever_is_refused(on_cluster: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    asks_sacct = profile(tmp_path, "slurm-status-command: sacct\n")
    with pytest.raises(DembarkError, match="sacct does not answer.*accounting storage is disabled.*to squeue"):
        slurm.check(asks_sacct, [])
    (tmp_path / "scontrol").write_text("#!/bin/sh\necho 'MinJobAge               = 60 sec'\n")
    (tmp_path / "scontrol").chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:{on_cluster.environment['PATH']}")
    with pytest.raises(DembarkError, match="forgets jobs 60 s after their end.*to sacct"):
        slurm.check(SLURM, [])


def test_without_slurm_the_missing_commands_are_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(DembarkError, match="sbatch, squeue, scancel, scontrol not found"):
        slurm.check(SLURM, [])


@pytest.mark.parametrize("minute", [0, 5, 719])
def test_sacct_looks_back_over_midnight(monkeypatch: pytest.MonkeyPatch, minute: int) -> None:
    # Without a start time sacct begins at midnight, and jobs that ended before it are never seen to have ended.
    from snakemake_executor_plugin_slurm import job_status_query

    class Clock(datetime.datetime):
        @classmethod
        def now(cls, tz: datetime.tzinfo | None = None) -> datetime.datetime:
            return datetime.datetime(2024, 3, 1) + datetime.timedelta(minutes=minute)

    monkeypatch.setattr(job_status_query, "datetime", Clock)
    words = job_status_query.query_job_status_sacct("dembark").split()
    start = datetime.datetime.fromisoformat(words[words.index("--starttime") + 1])
    assert start <= datetime.datetime(2024, 2, 29)
    # squeue, which the shipped profiles ask, knows no dates at all.
    assert "time" not in job_status_query.query_job_status_squeue("dembark")
    assert SLURM.settings["slurm-status-command"] == "squeue"


def test_names_of_jobs_tell_campaigns_apart(tmp_path: Path) -> None:
    from snakemake_executor_plugin_slurm import ExecutorSettings

    names = {slurm.job_prefix(tmp_path / name) for name in ("a b", "a_b", "x/a b", "ü" * 80, "")}
    assert len(names) == 5 and all(len(name) <= 50 and name.isascii() and " " not in name for name in names)
    assert slurm.job_prefix(tmp_path / "x" / ".." / "a") == slurm.job_prefix(tmp_path / "a")
    assert "jobname_prefix" in ExecutorSettings.__dataclass_fields__
    with slurm.guarded(profiles.find("local"), tmp_path, threading.Event(), pytest.fail) as nothing:
        assert nothing == ([], None)


def test_jobs_left_by_a_dead_process_are_waited_for_or_cancelled(on_cluster: Cluster, tmp_path: Path) -> None:
    mine, other = tmp_path / "mine", tmp_path / "other"
    running = submit(on_cluster, mine, "--time=1", "--output=/dev/null", f"--wrap=sleep 2; touch {tmp_path}/worked")
    late = submit(on_cluster, mine, "--begin=now+1hour", *LONG)
    elsewhere = submit(on_cluster, other, *LONG)
    deadline = time.monotonic() + 20
    while on_cluster.jobs()[running][0] != "RUNNING" or on_cluster.jobs()[elsewhere][0] != "RUNNING":
        assert time.monotonic() < deadline
        time.sleep(0.1)
    assert {job.number: job.waits for job in slurm.jobs(mine)} == {str(running): False, str(late): True}
    assert slurm.jobs(mine)[0].what == "rule_simulate_box"
    told: list[str] = []
    assert slurm.adopt_or_cancel(mine, threading.Event(), told.append, interval=0.2) == (1, 1)
    assert (tmp_path / "worked").exists() and slurm.jobs(mine) == []
    assert told == ["1 waiting jobs of an earlier start cancelled", f"waiting for 1 jobs of an earlier start: {running}"]
    assert on_cluster.jobs()[late][0] == "CANCELLED" and on_cluster.jobs()[elsewhere][0] == "RUNNING"
    assert slurm.adopt_or_cancel(mine, threading.Event(), told.append) == (0, 0)
    stop = threading.Event()
    stop.set()
    with pytest.raises(Interrupted, match="1 jobs of an earlier start go on"):
        slurm.adopt_or_cancel(other, stop, told.append)
    assert [job.number for job in slurm.cancel_all(other)] == [str(elsewhere)]
    assert slurm.adopt_or_cancel(other, threading.Event(), told.append, interval=0.2)[1] == 0


def test_a_job_that_will_never_start_is_told_and_no_job_is_left_in_the_queue(on_cluster: Cluster, tmp_path: Path) -> None:
    told: list[str] = []
    with pytest.raises(ZeroDivisionError), slurm.guarded(SLURM, tmp_path, threading.Event(), told.append) as (words, watch):
        assert words == ["--slurm-jobname-prefix", slurm.job_prefix(tmp_path)]
        number = submit(on_cluster, tmp_path, "--time=600", "--output=/dev/null", "--wrap=true")
        deadline = time.monotonic() + 20
        while not told:
            assert time.monotonic() < deadline
            assert not watch(os.getpid())
            time.sleep(0.2)
        assert not watch(os.getpid())
        raise ZeroDivisionError
    assert len(told) == 2 and f"job {number} (rule_simulate_box) will not start: PartitionTimeLimit" in told[0]
    assert told[1] == "1 jobs were still in the queue and are cancelled" and slurm.jobs(tmp_path) == []


def test_a_workflow_that_waits_for_forgotten_jobs_is_noticed(on_cluster: Cluster, tmp_path: Path) -> None:
    log = tmp_path / "workflow.log"
    waiting, working = (subprocess.Popen(["sh", "-c", words], start_new_session=True) for words in ("exec sleep 60", "sleep 60; true"))
    try:
        log.write_text("SLURM run ID\n")
        told: list[str] = []
        watch = slurm.Watch(tmp_path, log, told.append)
        assert not watch(waiting.pid)
        os.utime(log, (time.time() - 500, time.time() - 500))
        assert not watch(working.pid)
        number = submit(on_cluster, tmp_path, *LONG)
        assert not watch(waiting.pid) and told == []
        on_cluster.call("scancel", str(number))
        slurm.adopt_or_cancel(tmp_path, threading.Event(), str, interval=0.2)
        assert watch(waiting.pid) and "forgotten jobs" in told[0]
    finally:
        for process in (waiting, working):
            os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def test_a_scheduler_that_restarts_is_waited_for(on_cluster: Cluster, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(slurm, "_PAUSE", 0.3)
    number = submit(on_cluster, tmp_path, *LONG)
    on_cluster.stop_controller()
    with ThreadPoolExecutor(1) as pool:
        found = pool.submit(slurm.jobs, tmp_path)
        time.sleep(1.0)
        # By this thread: daemons end with the thread that started them.
        on_cluster.start_controller()
        assert [job.number for job in found.result()] == [str(number)]


def test_liggghts_runs_with_mpi_in_a_job(on_cluster: Cluster, tmp_path: Path) -> None:
    try:
        engines.find("liggghts")
    except DembarkError as error:
        pytest.skip(str(error))
    deck = tmp_path / "deck.in"
    deck.write_text("atom_style granular\ncommunicate single vel yes\nregion box block 0 1 0 1 0 1 units box\ncreate_box 1 box\n")
    program = tmp_path / "run.py"
    program.write_text("import subprocess, sys\nfrom pathlib import Path\nfrom dembark.validation import engines\n"
                       "engine, ranks = engines.find('liggghts'), int(sys.argv[1])\n"
                       f"sys.exit(subprocess.run(engine.command(Path({str(deck)!r}), {{}}, ranks), env=engine.environment()).returncode)\n")
    # As the executor starts them: one rank as a step of its own, more in the allocation with most of Slurm's variables hidden.
    script = tmp_path / "job.sh"
    script.write_text(f"""#!/bin/bash
set -e
srun -n1 {sys.executable} {program} 1
for v in $(env | sed -n 's/^\\(SLURM_[A-Z_]*\\)=.*/\\1/p' | grep -v -e JOB_ID -e CONF); do unset $v; done
{sys.executable} {program} 2
DEMBARK_MPIRUN="srun --mpi=pmix" {sys.executable} {program} 2
""")
    log = tmp_path / "log"
    on_cluster.call("sbatch", "--wait", "--ntasks=2", "--time=1", f"--output={log}", str(script), check=False)
    text = log.read_text()
    assert text.count("1 by 1 by 1 MPI processor grid") == 1 and text.count("1 by 1 by 2 MPI processor grid") == 2, text
