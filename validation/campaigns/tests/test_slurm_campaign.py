"""A campaign on a real Slurm that loses runs, scheduler and submitter: in the end every run is there once, and nothing else."""

from __future__ import annotations

import os
import signal
import sqlite3
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest
from harness import decks, environment, stand_in, wait_for  # noqa: F401
from slurm_cluster import Cluster

from dembark.common.files import read_json
from dembark.validation.runs import queue, site

pytestmark = pytest.mark.usefixtures("decks", "stand_in")

CAMPAIGN = """
[campaign]
name = "sizes"
engines = ["liggghts", "yade"]

[[sweeps]]
case = "box"
profile = "quick"
grid = { grain_diameter = ["4 mm", "6 mm"] }
fixed = { pause = 0.7 }

[resources]
memory = "200 MB"
time = "2 min"

# So short that both write a state every ten steps of their ten grains.
[resources.liggghts]
restart_interval = "0.0001 s"

[resources.yade]
restart_interval = "0.001 s"
"""
RUNS = 4


@pytest.fixture
def cluster_file(tmp_path: Path) -> Path:
    """A site's file: the shipped Slurm, asked after its jobs more often, and a preamble."""
    (tmp_path / "my site.toml").write_text(f"""base = "slurm"
preamble = '''
echo read by ${{SLURM_JOB_ID:-nobody}} >> "{tmp_path}/preamble.log"
export SITE=$UNSET
'''
[jobs]
poll = "1 s"
latency = "3 s"
""")
    return tmp_path / "my site.toml"


def jobs(results: Path) -> list[str]:
    """Numbers of the campaign's jobs that have not ended."""
    slurm = site.find("slurm")
    return [row.job for row in slurm.rows(queue.prefix(results)) or () if slurm.lives(row)]


class Campaign:
    """A campaign file, its folder, and `dembark` on it."""

    def __init__(self, folder: Path, environment: dict[str, str], text: str = CAMPAIGN) -> None:
        self.folder, self.file, self.results = folder, folder / "sizes.toml", folder / "results"
        self.environment = environment
        self.file.write_text(text)

    def start(self, *words: str) -> subprocess.Popen[bytes]:
        with (self.folder / "out").open("wb") as out, (self.folder / "error").open("wb") as error:
            return subprocess.Popen([sys.executable, "-m", "dembark.validation.cli", *words], cwd=self.folder, env=self.environment,
                                    stdout=out, stderr=error)

    def submit(self, cluster_file: Path) -> subprocess.Popen[bytes]:
        return self.start("submit", str(self.file), "--executor", str(cluster_file), "--out", str(self.results))

    def said(self) -> str:
        """What the process that was started last has written to its error output."""
        return (self.folder / "error").read_text()

    def end(self, process: subprocess.Popen[bytes], seconds: float = 900) -> tuple[int, str, str]:
        try:
            process.wait(seconds)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
            raise AssertionError(self.log() + self.said()) from None
        return process.returncode, (self.folder / "out").read_text(), self.said()

    def log(self) -> str:
        return "".join(path.read_text()[-2000:] for path in sorted(self.results.glob(".jobs/*.log")))

    def records(self) -> list[dict[str, object]]:
        """Records of all finished runs."""
        return [read_json(path) for path in sorted(self.results.glob("*/*/*/replica-*/run.json")) if "superseded" not in path.parts]

    def stored(self) -> list[tuple[str, int]]:
        """States and attempts of the runs in the store."""
        with closing(sqlite3.connect(self.results / "store.sqlite")) as store:
            return store.execute("SELECT state, attempts FROM runs").fetchall()


@pytest.fixture
def campaign(on_cluster: Cluster, tmp_path: Path, environment: dict[str, str]) -> Iterator[Campaign]:
    one = Campaign(tmp_path, environment | on_cluster.environment | {"PYTHONPATH": environment["PYTHONPATH"]})
    yield one
    for number in jobs(one.results):
        on_cluster.call("scancel", number, check=False)


def engines_at_work(results: Path, count: int) -> list[int]:
    """Processes of `count` or more stand-in engines that have each written a state; empty when they are fewer."""
    folders = {state.parent for state in results.glob("*/*/*/.replica-1.work-*/state.*.crc")}
    found = [int((folder / "pid").read_text()) for folder in sorted(folders) if (folder / "pid").is_file()]
    return found if len(found) >= count else []


def test_a_campaign_survives_kills_of_a_run_the_scheduler_and_the_submitter(
        campaign: Campaign, on_cluster: Cluster, cluster_file: Path, wait_for: Callable[..., object]) -> None:
    process = campaign.submit(cluster_file)
    try:
        killed, held, *_ = wait_for(lambda: process.poll() is None and engines_at_work(campaign.results, 2), 400)
        os.kill(held, signal.SIGSTOP)
        os.kill(killed, signal.SIGKILL)
        on_cluster.stop_controller()
        on_cluster.start_controller()
    finally:
        process.kill()
        process.wait()
    # Its jobs live on, and those of a second start would be the same runs again.
    process = campaign.start("resume", str(campaign.results))
    wait_for(lambda: process.poll() is not None or "of an earlier start" in campaign.said(), 400)
    os.kill(held, signal.SIGCONT)
    code, out, error = campaign.end(process)
    assert code == 0, campaign.log() + out + error
    assert "waiting for" in error and f"{RUNS} of {RUNS} runs finished" in out
    records = campaign.records()
    assert len(records) == RUNS == len({record["inputs"] for record in records})
    killed = [record for record in records if record["attempts"] > 1]
    assert killed and all(record["resumed_at"] for record in killed)
    assert sorted(state for state, _ in campaign.stored()) == ["finished"] * RUNS
    assert jobs(campaign.results) == [] and not list(campaign.results.glob("**/.replica-*.work-*"))
    assert (campaign.results / "report.html").read_text().count("metrics.json\n") == RUNS
    places = {line.split()[-1] for line in (campaign.folder / "preamble.log").read_text().splitlines()}
    assert "nobody" in places and len(places) > RUNS


@pytest.mark.slow
def test_runs_of_a_lost_node_go_on_elsewhere(campaign: Campaign, on_cluster: Cluster, cluster_file: Path,
                                             wait_for: Callable[..., object]) -> None:
    process = campaign.submit(cluster_file)
    try:
        wait_for(lambda: process.poll() is None and engines_at_work(campaign.results, 1), 400)
        # All four fit on the first node.
        on_cluster.lose_node(1)
        code, out, error = campaign.end(process, 600)
    finally:
        on_cluster.start_node(1)
    assert code == 0, campaign.log() + out + error
    records = campaign.records()
    assert len(records) == RUNS and any(record["resumed_at"] and record["attempts"] == 2 for record in records)
    on_cluster.wait_for_nodes()


@pytest.mark.slow
def test_a_terminated_submitter_takes_its_jobs_back_and_they_go_on_later(
        campaign: Campaign, cluster_file: Path, wait_for: Callable[..., object]) -> None:
    """Its measurements are jobs as well."""
    campaign.file.write_text(CAMPAIGN + '[resources.measure]\nmemory = "200 MB"\ntime = "2 min"\n')
    process = campaign.submit(cluster_file)
    wait_for(lambda: process.poll() is None and engines_at_work(campaign.results, 1), 400)
    process.terminate()
    code, _, error = campaign.end(process, 400)
    assert code == 130 and "interrupted" in error
    wait_for(lambda: not jobs(campaign.results), 120)
    code, out, error = campaign.end(campaign.start("resume", str(campaign.results)))
    assert code == 0, campaign.log() + out + error
    records = campaign.records()
    assert len(records) == RUNS and any(record["resumed_at"] and record["attempts"] == 2 for record in records)
    assert len(list(campaign.results.glob("*/*/*/.measure.job.json"))) == RUNS == len(list(campaign.results.glob("*/*/*/metrics.json")))


def test_what_slurm_refuses_is_told_before_anything_is_submitted(campaign: Campaign, on_cluster: Cluster, cluster_file: Path) -> None:
    before = set(on_cluster.jobs())
    campaign.file.write_text(CAMPAIGN.replace("2 min", "61 min"))
    code, _, error = campaign.end(campaign.submit(cluster_file))
    assert code == 2 and error.count("\n") == 1 and "61 min exceed the partition's limit of 60 min" in error
    assert set(on_cluster.jobs()) == before and not (campaign.results / ".jobs").exists()
