"""A campaign of stand-ins on a real Slurm that loses runs, scheduler and submitter: in the end every run is there once."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest
from harness import decks, environment, stand_in, start, wait_for  # noqa: F401
from slurm_cluster import Cluster

from dembark.common.files import read_json
from dembark.validation import results as tables
from dembark.validation.runs import site

pytestmark = [pytest.mark.usefixtures("decks", "stand_in"), pytest.mark.full]

CAMPAIGN = """
[campaign]
name = "sizes"
engines = ["liggghts", "yade"]
retries = 2

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
threads = 2
"""
RUNS = 4


class Campaign:
    """A campaign file, its folder, and `dembark` on it."""

    def __init__(self, folder: Path, environment: dict[str, str], cluster: Cluster) -> None:
        self.folder, self.file, self.results, self.cluster = folder, folder / "sizes.toml", folder / "a user's results", cluster
        self.environment = environment
        self.file.write_text(CAMPAIGN)
        text = (site.SHIPPED / "slurm.toml").read_text()
        (folder / "my site.toml").write_text(text.replace('preamble = """', f'''preamble = """
echo read by ${{SLURM_JOB_ID:-nobody}} >> "{folder}/preamble.log"
export SITE=$UNSET'''))

    def start(self, *words: str) -> subprocess.Popen[str]:
        return start(self.folder, self.environment, *words)

    def submit(self) -> subprocess.Popen[str]:
        return self.start("submit", str(self.file), "--executor", str(self.folder / "my site.toml"), "--out", str(self.results))

    def end(self, process: subprocess.Popen[str], code: int = 0) -> str:
        _, error = process.communicate(timeout=120)
        assert process.returncode == code, error
        return error

    def jobs(self) -> list[str]:
        """Elements in the queue."""
        return self.cluster.call("squeue", "--noheader", "--array", "--format=%i %T", check=False).splitlines()

    def log(self) -> str:
        return "".join(f"{path.name}: {path.read_text()[-2000:]}" for path in sorted(self.results.glob(".jobs/*.log")))

    def records(self) -> list[dict[str, object]]:
        """Records of all finished runs."""
        return [read_json(path) for path in sorted(self.results.glob("*/*/*/replica-*/run.json")) if "superseded" not in path.parts]


@pytest.fixture
def campaign(on_cluster: Cluster, tmp_path: Path, environment: dict[str, str]) -> Campaign:
    return Campaign(tmp_path, environment | on_cluster.environment | {"PYTHONPATH": environment["PYTHONPATH"]}, on_cluster)


def engines_at_work(results: Path, count: int) -> list[int]:
    """Processes of `count` or more stand-in engines that have each written a state; empty when they are fewer."""
    folders = {state.parent for state in results.glob("*/*/*/.replica-1.work-*/state.*.crc")}
    found = [int((folder / "pid").read_text()) for folder in sorted(folders) if (folder / "pid").is_file()]
    return found if len(found) >= count else []


def finish(campaign: Campaign, wait_for: Callable[..., object]) -> None:
    """Wait until the queue is empty; every run has to be there once, measured and reported."""
    wait_for(lambda: not campaign.jobs(), 400)
    records = campaign.records()
    assert len(records) == RUNS == len({record["inputs"] for record in records}), campaign.log()
    assert list(tables.runs(campaign.results)["state"]) == ["finished"] * RUNS
    assert not list(campaign.results.glob("**/.replica-*.work-*")) and not list(campaign.results.glob("**/.replica-*.status.json"))
    assert (campaign.results / "report.html").read_text().count("metrics.json\n") == RUNS, campaign.log()


def test_a_campaign_survives_kills_of_runs_the_scheduler_and_the_submitter(
        campaign: Campaign, on_cluster: Cluster, wait_for: Callable[..., object]) -> None:
    process = campaign.submit()
    wait_for(campaign.jobs, 120)
    process.kill()  # in the middle of its submissions, or after them
    process.communicate()
    # Elements of the first submission that wait or run are no reason to compute a run twice.
    assert "submitted" in campaign.end(campaign.start("resume", str(campaign.results)))
    killed, *_ = wait_for(lambda: engines_at_work(campaign.results, 2), 200)
    os.kill(killed, signal.SIGKILL)
    on_cluster.stop_controller()
    on_cluster.start_controller()
    status = campaign.start("status", str(campaign.results))
    out, _ = status.communicate(timeout=120)
    assert "running" in out
    finish(campaign, wait_for)
    again = [record for record in campaign.records() if record["attempts"] > 1]
    assert again and all(record["resumed_at"] for record in again)
    places = {line.split()[-1] for line in (campaign.folder / "preamble.log").read_text().splitlines()}
    assert "nobody" in places and len(places) > RUNS


def test_runs_of_a_lost_node_go_on_elsewhere(campaign: Campaign, on_cluster: Cluster, wait_for: Callable[..., object]) -> None:
    campaign.end(campaign.submit())
    try:
        wait_for(lambda: engines_at_work(campaign.results, 1), 200)
        on_cluster.lose_node(1)
        finish(campaign, wait_for)
    finally:
        on_cluster.start_node(1)
    assert any(record["attempts"] > 1 for record in campaign.records())
    on_cluster.wait_for_nodes()


def test_what_failed_by_its_own_fault_is_not_tried_again_before_the_next_submission(
        campaign: Campaign, wait_for: Callable[..., object]) -> None:
    campaign.file.write_text(CAMPAIGN.replace("pause = 0.7", 'behaviour = "exit"').replace('"4 mm", "6 mm"', '"4 mm"'))
    campaign.end(campaign.submit())
    wait_for(lambda: not campaign.jobs(), 300)
    assert campaign.records() == [] and campaign.log().count("exit code 1") == 2
    runs = tables.runs(campaign.results)
    assert list(runs["state"]) == ["failed"] * 2 and all("Lost atoms" in message for message in runs["message"])
    assert "submitted 2 runs" in campaign.end(campaign.start("resume", str(campaign.results)))
    wait_for(lambda: not campaign.jobs(), 300)
    assert campaign.log().count("exit code 1") == 4


@pytest.mark.parametrize(("before", "after", "words"), [
    ("threads = 2", "threads = 64", "configuration is not available"),
    ("threads = 2", 'threads = 2\ntime = "90 h"', "5400 min exceed the partition's limit of "),
])
def test_what_slurm_would_refuse_or_never_start_is_reported_in_one_line_before_anything_is_submitted(
        campaign: Campaign, before: str, after: str, words: str) -> None:
    campaign.file.write_text(CAMPAIGN.replace(before, after))
    error = campaign.end(campaign.submit(), 2)
    assert error.count("\n") == 1 and words in error
    assert not campaign.jobs()
