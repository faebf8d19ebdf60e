"""Jobs of a scheduler, against a real Slurm: what it would refuse is told before, and no job is left behind, doubled or lost."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from pathlib import Path

import pytest
from harness import decks, stand_in, wait_for  # noqa: F401
from slurm_cluster import Cluster

from dembark.common.errors import DembarkError, Interrupted, Killed, RunError
from dembark.validation import engines
from dembark.validation.campaigns import expand
from dembark.validation.engines.liggghts import Liggghts
from dembark.validation.runs import queue, site
from dembark.validation.runs.plan import Plan, Resources
from dembark.validation.runs.queue import Queue

SLURM = site.find("slurm")
QUICK = 'base = "slurm"\n[jobs]\npoll = "0.3 s"\nlatency = "1 s"\n'


def written(folder: Path, text: str = QUICK) -> site.Site:
    """A site's file with `text`."""
    (folder / "site.toml").write_text(text)
    return site.find(str(folder / "site.toml"))


@pytest.mark.parametrize(("text", "words"), [
    ('base = "slrum"', "base = 'slrum' is not known"),
    ('base = "slurm"\n[jobs]\noptions = "-p <partition>"', "<partition> in options is a place for your own value"),
    ('base = "slurm"\n[jobs]\nat_a_time = 0', "at_a_time = 0 is out of range"),
    ('base = "slurm"\n[jobs]\npoll = "10"', "'10' is no duration"),
    ('base = "slurm"\n[jobs]\njobs = 5', "unknown key 'jobs'"),
    ('base = "slurm"\n[commands]\nsubmit = "sbatch {skript}"', "{skript} in submit is not known"),
    ('base = "slurm"\n[answers]\njob = "("', "job is no regular expression"),
    ('base = "slurm"\n[answers]\nline = "(?P<job>x)"', "line has no group"),
    ('[commands]\nsubmit = "qsub"\nstatus = "qstat"', "cancel is missing"),
    ("a = [1\n", "cannot be read"),
])
def test_a_mistake_in_a_sites_file_is_told_in_one_line(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(DembarkError) as caught:
        written(tmp_path, text)
    assert words in str(caught.value) and "\n" not in str(caught.value) and str(tmp_path / "site.toml") in str(caught.value)


def test_a_site_that_is_not_there_and_the_template() -> None:
    with pytest.raises(DembarkError, match="did you mean slurm"):
        site.find("slrum")
    with pytest.raises(DembarkError, match=r"<partition>.*fill it in"):
        site.find(str(site.SHIPPED / "site.toml"))


def test_the_preamble_sets_the_environment(tmp_path: Path) -> None:
    text = "preamble = '''\necho Loading openmpi\nexport SITE=\"two\nlines\" DEMBARK_MPIRUN=\"srun --mpi=pmix\"\necho $UNSET\n'''\n"
    found = written(tmp_path, text + QUICK).environment()
    assert found["SITE"] == "two\nlines" and found["DEMBARK_MPIRUN"] == "srun --mpi=pmix" and not any("openmpi" in key for key in found)
    with pytest.raises(DembarkError, match=r"preamble of .*site\.toml fails.*module"):
        written(tmp_path, "preamble = 'module load nothing'\n" + QUICK).environment()


@pytest.mark.parametrize("preamble", [None, "", "   ", "# nothing", "\n# one\n\n# two\n", "true # a remark", "export A=1"])
def test_a_preamble_may_be_empty_or_hold_remarks_alone(tmp_path: Path, preamble: str | None) -> None:
    """None: the template, filled in as its page says."""
    text = (site.SHIPPED / "site.toml").read_text().replace("<partition>", "main").replace("<account>", "me")
    if preamble is not None:
        text = QUICK if preamble == "" else f"preamble = {preamble!r}\n{QUICK}".replace("'", '"')
    assert written(tmp_path, text).environment()["PATH"]


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
    assert SLURM.asked(Resources(3, 1, 5e8, 590.0)) == {
        "ranks": 3, "threads": 1, "cores": 3, "memory_mb": 500, "minutes": 10, "seconds": 590}
    assert SLURM.asked(Resources(threads=4)) == {
        "ranks": 1, "threads": 4, "cores": 4, "memory_mb": 2000, "minutes": 30, "seconds": 1800}


def test_names_of_jobs_tell_campaigns_apart(tmp_path: Path) -> None:
    names = {queue.prefix(tmp_path / name) for name in ("a b", "a_b", "x/a b", "ü" * 80, "")}
    assert len(names) == 5 and all(len(name) <= 42 and name.isascii() and " " not in name for name in names)
    assert queue.prefix(tmp_path / "x" / ".." / "a") == queue.prefix(tmp_path / "a")


def test_what_slurm_would_take_passes(on_cluster: Cluster) -> None:
    site.check(SLURM, [Resources(1, 1, 5e8, 300), Resources(4, 1, 4e9, 3600), Resources(1, 4)])


@pytest.mark.parametrize(("options", "used", "words"), [
    ("", Resources(8), "would refuse.*node configuration is not available.*ranks=8"),
    ("", Resources(memory=5e10), "would refuse.*node configuration is not available.*memory_mb=50000"),
    ("", Resources(time=3601), "would never start.*61 min exceed the partition's limit of 60 min"),
    ("--partition=mian", Resources(), "would refuse.*mian"),
    ("--constraint=gpu", Resources(), "would refuse.*feature"),
])
def test_what_slurm_would_refuse_is_told_before_the_start(on_cluster: Cluster, tmp_path: Path, options: str, used: Resources,
                                                          words: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(site, "_PAUSE", 0.05)
    with pytest.raises(DembarkError, match=words) as caught:
        site.check(written(tmp_path, f'{QUICK}options = "--nodes=1 {options}"\n'), [used])
    assert "\n" not in str(caught.value)


def test_without_slurm_the_missing_commands_are_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(DembarkError, match="sbatch, squeue, scancel not found"):
        site.check(SLURM, [])


# --- the queue, with job scripts that stand in for the job ------------------------------------------------------------


class Campaign:
    """A queue of the small case's runs on the private Slurm; each job does what `script` says, in the place of the run."""

    def __init__(self, folder: Path, plan: Plan, monkeypatch: pytest.MonkeyPatch) -> None:
        self.results, self.plan, self.said, self.told = folder / "results", plan, list[str](), dict[str, object]()
        self.program = folder / "program"
        self.site = written(folder)
        self.queues: list[Queue] = []
        monkeypatch.setattr(sys, "executable", str(self.program))

    def script(self, text: str) -> None:
        """`$report` is the file to tell in, `$out` the folder of the run, `$inputs` its hash."""
        words = 'while [ $# -gt 0 ]; do case $1 in --report) report=$2; out=$(dirname $2);; --inputs) inputs=$2;; esac; shift; done\n'
        self.program.write_text(f"#!/bin/bash\n{words}{text}\n")
        self.program.chmod(0o755)

    def start(self, index: int = 0, queue_of: Queue | None = None) -> Future[object]:
        (run,) = self.plan.series[index].runs
        one = queue_of or self.queue()
        return one.start(run, self.results / self.plan.series[index].place, Resources(time=60, memory=1e8),
                         lambda **facts: self.told.update(facts))

    def queue(self) -> Queue:
        self.queues.append(Queue(self.site, self.results, self.plan, self.said.append))
        return self.queues[-1]


@pytest.fixture
def campaign(tmp_path: Path, decks: Path, stand_in: Path, on_cluster: Cluster,
             monkeypatch: pytest.MonkeyPatch) -> Iterator[Campaign]:
    one = Campaign(tmp_path, expand.plan("quick"), monkeypatch)
    yield one
    for each in one.queues:
        each._end.set()


FINISH = 'mkdir -p $out/replica-1; echo "{\\"inputs\\": \\"$inputs\\"}" > $out/replica-1/run.json'


def test_a_job_tells_its_progress_and_its_end(campaign: Campaign) -> None:
    told = json.dumps({"state": "running", "step": 7, "steps": 9, "host": "n1"}).replace('"', '\\"')
    campaign.script(f'echo "{told}" > $report; sleep 2; {FINISH}')
    assert campaign.start().result(60) is None
    assert campaign.told["step"] == 7 and campaign.told["state"] == "running" and str(campaign.told["job"]).isdigit()
    campaign.queues[0].close()
    assert campaign.said == []


@pytest.mark.parametrize(("text", "error", "words"), [
    ('echo \'{"state": "failed", "message": "it blew up"}\' > $report; exit 1', RunError, "it blew up"),
    ('echo \'{"state": "stopped", "message": "it goes on from step 5"}\' > $report; exit 1', Killed, "goes on from step 5"),
    ("echo no module; exit 3", Killed, "its job [0-9]+ ended as FAILED, see .*log"),
])
def test_how_a_job_ended_is_told_by_its_files(campaign: Campaign, text: str, error: type[Exception], words: str) -> None:
    campaign.script(text)
    with pytest.raises(error, match=words) as caught:
        campaign.start().result(60)
    assert isinstance(caught.value, Killed) == (error is Killed)


def test_jobs_of_a_dead_submitter_are_adopted_or_cancelled(campaign: Campaign, on_cluster: Cluster,
                                                           wait_for: Callable[..., object]) -> None:
    campaign.script(f"echo x >> $out/started; sleep 4; {FINISH}")
    campaign.start()
    number = wait_for(lambda: campaign.told.get("job"), 60)
    stray = on_cluster.call("sbatch", "--parsable", f"--job-name={queue.prefix(campaign.results)}00000000", "--output=/dev/null",
                            "--wrap=sleep 60")
    campaign.queues[0]._end.set()
    campaign.queues[0]._thread.join()
    campaign.told.clear()
    assert campaign.start().result(60) is None
    assert campaign.told["job"] == number and len(list(campaign.results.glob("*/*/*/started"))) == 1
    (started,) = campaign.results.glob("*/*/*/started")
    assert started.read_text() == "x\n" and on_cluster.jobs()[int(stray)][0] == "CANCELLED"
    assert campaign.said == ["1 jobs of an earlier start cancelled", f"waiting for 1 jobs of an earlier start: {number}"]


def test_what_is_under_way_is_taken_back(campaign: Campaign, wait_for: Callable[..., object]) -> None:
    campaign.script("sleep 60")
    future = campaign.start()
    wait_for(lambda: campaign.told.get("job"), 60)
    campaign.queues[0].close()
    with pytest.raises(Interrupted):
        future.result(1)
    assert campaign.said == ["1 jobs were still in the queue and are cancelled"]
    wait_for(lambda: not [row for row in SLURM.rows(queue.prefix(campaign.results)) or () if SLURM.lives(row)], 60)


def test_a_scheduler_that_is_away_is_waited_for(campaign: Campaign, on_cluster: Cluster, monkeypatch: pytest.MonkeyPatch,
                                               wait_for: Callable[..., object]) -> None:
    monkeypatch.setattr(queue, "_SILENCE", 0.5)
    campaign.script(f"sleep 1; {FINISH}")
    on_cluster.stop_controller()
    future = campaign.start()
    wait_for(lambda: campaign.said, 60)
    on_cluster.start_controller()
    assert future.result(60) is None and campaign.said == ["the scheduler does not answer; waiting for it"]


def test_a_refused_submission_fails_its_run_and_a_hopeless_one_is_told(campaign: Campaign, on_cluster: Cluster,
                                                                      wait_for: Callable[..., object]) -> None:
    campaign.script("sleep 60")
    (run,) = campaign.plan.series[0].runs
    one, out = campaign.queue(), campaign.results / campaign.plan.series[0].place
    with pytest.raises(RunError, match=r"its job was refused, .*configuration is not available"):
        one.start(run, out, Resources(memory=1e12), lambda **facts: None).result(60)
    one.start(run, out, Resources(time=36000, memory=1e8), lambda **facts: None)
    wait_for(lambda: campaign.said, 60)
    assert "will not start: PartitionTimeLimit" in campaign.said[0]
    one.close()


def test_another_scheduler_is_served_by_its_commands(tmp_path: Path, decks: Path, stand_in: Path,
                                                     monkeypatch: pytest.MonkeyPatch,
                                                     wait_for: Callable[..., object]) -> None:
    """One like PBS, that tells no names: jobs are processes, their list is a folder."""
    spool = tmp_path / "spool"
    spool.mkdir()
    for name, text in {"qsub": f'"${{@: -1}}" & echo $! > {spool}/$!; echo "$!.server"',
                       "qdel": 'for j in "$@"; do kill ${j%.server}; done',
                       "qstat": f'cd {spool}; for j in *; do kill -0 $j 2>/dev/null && echo "$j.server some R"; done; true'}.items():
        (tmp_path / name).write_text(f"#!/bin/bash\n{text}\n")
        (tmp_path / name).chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    campaign = Campaign(tmp_path, expand.plan("quick"), monkeypatch)
    campaign.site = written(tmp_path, """
[jobs]
poll = "0.2 s"
latency = "1 s"
options = "-q main"
[commands]
submit = "qsub -N {name} -l select=1:ncpus={cores}:mem={memory_mb}mb -l walltime={seconds} {options} {script}"
status = "qstat -u {user}"
cancel = "qdel {jobs}"
[answers]
job = '^(?P<job>\\\\S+)'
line = '^(?P<job>\\\\S+) \\\\S+ (?P<state>\\\\S+)'
waiting = ["Q", "H"]
running = ["R", "E"]
""".replace("\\\\", "\\"))
    site.check(campaign.site, [Resources()])
    campaign.script(f"echo x >> $out/started; sleep 4; {FINISH}")
    campaign.start()
    number = str(wait_for(lambda: campaign.told.get("job"), 60))
    assert number.endswith(".server")
    # Its submitter is killed; the number is all that the next one knows of the job.
    campaign.queues[0]._end.set()
    campaign.queues[0]._thread.join()
    campaign.queues.append(Queue(campaign.site, campaign.results, campaign.plan, campaign.said.append, known=lambda name: number))
    assert campaign.start(queue_of=campaign.queues[1]).result(60) is None
    assert (campaign.results / campaign.plan.series[0].place / "started").read_text() == "x\n"
    campaign.queues[1].close()
    assert campaign.said == []


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
    script = tmp_path / "job.sh"
    script.write_text(f"""#!/bin/bash
set -e
{sys.executable} {program} 1
{sys.executable} {program} 2
DEMBARK_MPIRUN="srun --mpi=pmix" {sys.executable} {program} 2
""")
    log = tmp_path / "log"
    on_cluster.call("sbatch", "--wait", "--ntasks=2", "--time=2", f"--output={log}", str(script), check=False)
    text = log.read_text()
    assert text.count("1 by 1 by 1 MPI processor grid") == 1 and text.count("1 by 1 by 2 MPI processor grid") == 2, text
