"""Both engines in a sweep on a real Slurm that loses a run, a node's patience, the scheduler and the submitter; then without faults."""

from __future__ import annotations

import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from slurm_cluster import Cluster

from dembark.common.errors import DembarkError
from dembark.common.files import read_json
from dembark.validation import engines
from dembark.validation import results as tables
from dembark.validation.case import folders
from dembark.validation.runs import restarts
from dembark.validation.runs import site as sites

pytestmark = pytest.mark.full

# Frozen, a run of seconds reaches its time limit of a minute.
CAMPAIGN = """
[campaign]
name = "friction"
engines = ["liggghts", "yade"]
replicas = 3

[[sweeps]]
case = "silo"
profile = "quick"
variant = "dry"
grid = { wall_friction = [0.3, 0.5] }
fixed = { grain_count = 400, grain_diameter = "6 mm", settle_time = 0.3, measure_time = 0.2, frames = 10 }

[resources]
memory = "400 MB"
time = "1 min"

[resources.liggghts]
restart_interval = "0.2 s"

[resources.yade]
restart_interval = "1 s"
"""
RUNS = 12
# Ranks that wait for each other leave the processor to others: here they are more than there are processors.
PATIENT = "export OMPI_MCA_mpi_yield_when_idle=1"
_STARTERS = ("setpriv", "stdbuf", "mpirun", "srun")


def dembark(folder: Path, *words: str) -> subprocess.Popen[str]:
    log = (folder / "dembark.log").open("a")
    with log:
        return subprocess.Popen([sys.executable, "-m", "dembark.validation.cli", *words], cwd=folder, stdout=log, stderr=log, text=True)


def at_work(results: Path, engine: str) -> tuple[Path, int] | None:
    """Work folder and process of a run in `engine` that has written a complete state."""
    for work in results.glob(f"*/*/{engine}/.replica-*.work-*"):
        if restarts.newest(work, engine) is None:
            continue
        for process in Path("/proc").glob("[0-9]*"):
            try:
                first, *words = (process / "cmdline").read_text(errors="replace").split("\0")
                if (process / "cwd").resolve() == work and "restart_every" in " ".join(words) and Path(first).name not in _STARTERS:
                    return work, int(process.name)
            except OSError:
                continue
    return None


def wait(question, seconds: float, folder: Path):
    deadline = time.monotonic() + seconds
    while not (answer := question()):
        logs = "".join(path.read_text()[-1000:] for path in folder.glob("results/.jobs/*.log"))
        assert time.monotonic() < deadline, (folder / "dembark.log").read_text()[-3000:] + logs
        time.sleep(0.1)
    return answer


def records(results: Path) -> dict[str, dict]:
    return {str(path.parent.relative_to(results)): read_json(path) for path in results.glob("*/*/*/replica-*/run.json")}


def quantities(results: Path) -> dict[tuple[str, str], dict]:
    return {(str(path.parent.relative_to(results)), one["name"]): one
            for path in results.glob("*/*/*/metrics.json") for one in read_json(path)["quantities"]}


@pytest.fixture
def real_engines(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both engines, and a copy of the case: whoever edits its deck meanwhile would change the inputs."""
    shutil.copytree(folders.package_root() / "silo", tmp_path / "decks" / "silo")
    monkeypatch.setenv("DEMBARK_DECKS", str(tmp_path / "decks"))
    try:
        for name in ("liggghts", "yade"):
            engines.find(name)
    except DembarkError as error:
        pytest.skip(str(error))


def write_site(folder: Path, preamble: str = "") -> Path:
    """The shipped Slurm with a preamble."""
    file = folder / "site.toml"
    head, _, _ = (sites.SHIPPED / "slurm.toml").read_text().partition("preamble = ")
    file.write_text(f"{head}preamble = '''{preamble}'''\n")
    return file


def jobs(cluster: Cluster) -> list[str]:
    return cluster.call("squeue", "--noheader", "--array", "--format=%i", check=False).splitlines()


def submit(folder: Path, file: Path, site: Path) -> subprocess.Popen[str]:
    return dembark(folder, "submit", str(file), "--executor", str(site), "--out", str(folder / "results"))


def ended(cluster: Cluster) -> list[str]:
    """States of all elements that Slurm remembers."""
    return cluster.call("squeue", "--all", "--states=all", "--noheader", "--array", "--format=%T").splitlines()


def with_faults(folder: Path, site: Path, cluster: Cluster) -> tuple[Path, Path]:
    """Submit, kill the submitter, resume, kill a LIGGGHTS at work, restart the scheduler, freeze a YADE; the folders of both runs."""
    results = folder / "results"
    process = submit(folder, folder / "friction.toml", site)
    wait(lambda: jobs(cluster), 120, folder)
    process.kill()
    process.wait()
    assert dembark(folder, "resume", str(results)).wait(120) == 0, (folder / "dembark.log").read_text()
    killed, number = wait(lambda: at_work(results, "liggghts"), 300, folder)
    os.kill(number, signal.SIGKILL)
    cluster.stop_controller()
    cluster.start_controller()
    frozen, number = wait(lambda: at_work(results, "yade"), 300, folder)
    os.kill(number, signal.SIGSTOP)
    return killed, frozen


def test_a_sweep_of_both_engines_survives_and_gives_the_numbers_of_one_without_faults(
        tmp_path: Path, on_cluster: Cluster, real_engines: None) -> None:
    site, results, clean = write_site(tmp_path), tmp_path / "results", tmp_path / "clean"
    (tmp_path / "friction.toml").write_text(CAMPAIGN)
    killed, frozen = with_faults(tmp_path, site, on_cluster)
    wait(lambda: not jobs(on_cluster), 1200, tmp_path)
    assert {"TIMEOUT", "FAILED"} <= set(ended(on_cluster))

    # Every run complete, exactly once, and nothing left.
    found = records(results)
    assert len(found) == RUNS == len({record["inputs"] for record in found.values()})
    assert not list(results.glob("*/*/*/.replica-*.work-*"))
    for work in (killed, frozen):
        record = found[str((work.parent / work.name[1:].partition(".work-")[0]).relative_to(results))]
        assert record["attempts"] == 2 and len(record["resumed_at"]) == 1 and record["resumed_at"][0] > 0
    assert list(tables.runs(results)["state"]) == ["finished"] * RUNS
    report = (results / "report.html").read_text()
    for place in {Path(key).parent for key in found}:
        assert (results / place / "metrics.json").is_file() and read_json(results / place / "metrics.json")["replicas_missing"] == []
        assert place.parts[1].partition("=")[2] in report

    process = dembark(tmp_path, "submit", str(tmp_path / "friction.toml"), "--out", str(clean), "--cores", "2")
    assert process.wait(1200) == 0, (tmp_path / "dembark.log").read_text()[-4000:]
    reference = records(clean)
    assert {key: one["inputs"] for key, one in reference.items()} == {key: one["inputs"] for key, one in found.items()}
    for key, one in found.items():
        if one["attempts"] == 1 or one["resume"] == "exact":
            assert (results / key / "grains.dump").read_bytes() == (clean / key / "grains.dump").read_bytes(), key
    numbers, expected = quantities(results), quantities(clean)
    assert set(numbers) == set(expected) and len(tables.quantities(results)) == len(numbers)
    for key, quantity in numbers.items():
        low, high = expected[key]["interval"] or (expected[key]["value"],) * 2
        assert quantity["value"] is None or low <= quantity["value"] <= high, key


@pytest.mark.parametrize("launcher", ["", "srun --mpi=pmix"])
def test_a_run_with_mpi_loses_a_rank_and_goes_on(tmp_path: Path, on_cluster: Cluster, real_engines: None, launcher: str) -> None:
    site = write_site(tmp_path, f'export DEMBARK_MPIRUN="{launcher}"\n{PATIENT}')
    results, file = tmp_path / "results", tmp_path / "ranks.toml"
    text = CAMPAIGN.replace('engines = ["liggghts", "yade"]', 'engines = ["liggghts"]').replace("replicas = 3", "replicas = 1")
    file.write_text(text.replace("[0.3, 0.5]", "[0.3]").replace('restart_interval = "0.2 s"', 'restart_interval = "0.1 s"\nranks = 2'))
    assert submit(tmp_path, file, site).wait(120) == 0, (tmp_path / "dembark.log").read_text()
    _, number = wait(lambda: at_work(results, "liggghts"), 300, tmp_path)
    os.kill(number, signal.SIGKILL)
    wait(lambda: not jobs(on_cluster), 600, tmp_path)
    (record,) = records(results).values()
    assert record["attempts"] == 2 and record["resumed_at"][0] > 0 and record["provenance"]["ranks"] == 2
    assert record["command"][0] == (launcher.split(maxsplit=1)[0] if launcher else "mpirun")
    assert (results / "report.html").is_file()
