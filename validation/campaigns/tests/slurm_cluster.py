"""A private Slurm on this machine: munged, slurmctld and one slurmd for each virtual node, in a folder of its own, ended by process id."""

from __future__ import annotations

import os
import secrets
import shutil
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "squeue", "scancel", "scontrol", "sinfo", "srun")
_PORTS = range(20000, 32000, 16)  # below the range that the kernel hands out to clients
_GRACE = 5.0

# No accounting data base: status queries go to slurmctld, which keeps ended jobs for MinJobAge. No cgroups, no systemd, and more
# processors than there may be: tests of the life of jobs need several at a time, not speed.
_CONFIGURATION = """\
ClusterName=dembark{port}
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={port}
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge/socket
StateSaveLocation={folder}/controller
SlurmdSpoolDir={folder}/node-%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd-%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SchedulerType=sched/backfill
SchedulerParameters=sched_interval=2,bf_interval=2,default_queue_depth=200
SlurmdParameters=config_overrides
ReturnToService=2
SlurmctldTimeout=30
SlurmdTimeout=10
MinJobAge=300
KillWait=5
OverTimeLimit=0
InactiveLimit=0
MailProg=/bin/true
DefMemPerCPU=100
{nodes}
PartitionName=main Nodes=ALL Default=YES MaxTime={longest} DefaultTime=5 State=UP
"""


def missing() -> str:
    """Why there can be no private Slurm here; empty when there can."""
    absent = [name for name in PROGRAMS if not _program(name)]
    if absent:
        return f"Slurm is not installed ({', '.join(absent)} missing): packages slurm-wlm and munge"
    return "" if os.geteuid() == 0 else "slurmd starts jobs as other users, which needs root"


def _program(name: str) -> str | None:
    return shutil.which(name, path=f"{os.environ.get('PATH', '')}:/usr/sbin:/sbin")


def _wait(question: Callable[[], object], seconds: float, what: str) -> None:
    deadline = time.monotonic() + seconds
    while not question():
        if time.monotonic() > deadline:
            raise RuntimeError(f"{what} within {seconds:g} s")
        time.sleep(0.1)


@dataclass
class Cluster:
    """A running Slurm: `folder` holds its state and logs, `environment` lets any Slurm command reach it."""

    folder: Path
    nodes: int
    processors: int
    memory: int
    longest: int
    port: int
    _daemons: dict[str, subprocess.Popen[bytes]] = field(default_factory=dict)

    @property
    def environment(self) -> dict[str, str]:
        """Variables for clients, added to those of this process; nothing of a Slurm that this process may itself run in."""
        clean = {key: value for key, value in os.environ.items() if not key.startswith(("SLURM_", "SBATCH_", "SRUN_", "PMI"))}
        return clean | {"SLURM_CONF": str(self.folder / "slurm.conf"), "PATH": f"{clean.get('PATH', '')}:/usr/sbin:/sbin"}

    def call(self, *words: str, check: bool = True) -> str:
        """Output of a Slurm command."""
        done = subprocess.run(words, env=self.environment, capture_output=True, text=True, timeout=60, check=False)
        if check and done.returncode:
            raise RuntimeError(f"{' '.join(words)}: {done.stderr.strip()}")
        return done.stdout.strip()

    def jobs(self) -> dict[int, tuple[str, str]]:
        """State and comment of all jobs that slurmctld remembers, by number."""
        rows = (line.split("|") for line in self.call("squeue", "--all", "--states=all", "--noheader", "--format=%A|%T|%k").splitlines())
        return {int(number): (state, comment) for number, state, comment in rows}

    def start(self) -> None:
        """Start all daemons and wait until every node takes jobs."""
        for name in ("controller", "munge"):
            (self.folder / name).mkdir(mode=0o755)
        self._write_configuration()
        self._start_munge()
        self.start_controller()
        for number in range(1, self.nodes + 1):
            self.start_node(number)
        self.wait_for_nodes()

    def wait_for_nodes(self) -> None:
        """Wait until every node is idle."""
        _wait(lambda: self.call("sinfo", "--noheader", "--Node", "--states=idle", "--format=%N", check=False).count("n") >= self.nodes, 60,
              f"not all nodes became idle, see {self.folder}/*.log,")

    def _write_configuration(self) -> None:
        host = socket.gethostname().partition(".")[0]
        nodes = "\n".join(f"NodeName=n{k} NodeHostname={host} NodeAddr=127.0.0.1 Port={self.port + k} CPUs={self.processors} "
                          f"RealMemory={self.memory} State=UNKNOWN" for k in range(1, self.nodes + 1))
        text = _CONFIGURATION.format(port=self.port, host=host, folder=self.folder, nodes=nodes, longest=self.longest)
        (self.folder / "slurm.conf").write_text(text)
        # Nothing here uses control groups; asked for by name, version 1 does not look for them, which a container may lack.
        (self.folder / "cgroup.conf").write_text("CgroupPlugin=cgroup/v1\nIgnoreSystemd=yes\n")

    def _start_munge(self) -> None:
        place = self.folder / "munge"
        key = place / "key"
        key.write_bytes(secrets.token_bytes(128))
        key.chmod(0o400)
        self._spawn("munged", "--foreground", "--force", f"--socket={place}/socket", f"--key-file={key}", f"--pid-file={place}/pid",
                    f"--log-file={place}/log", f"--seed-file={place}/seed", "--num-threads=2")
        _wait((place / "socket").exists, 60, "munged opened no socket")

    def _spawn(self, name: str, *words: str, key: str = "") -> None:
        # A test run that is killed takes its daemons along; so does the end of the thread that started them.
        guard = ["setpriv", "--pdeathsig", "KILL", "--"] if shutil.which("setpriv") else []
        log = (self.folder / f"{key or name}.out").open("ab")
        with log:
            self._daemons[key or name] = subprocess.Popen(
                [*guard, str(_program(name)), *words], env=self.environment, cwd=self.folder, stdin=subprocess.DEVNULL, stdout=log,
                stderr=subprocess.STDOUT, start_new_session=True)

    def start_controller(self) -> None:
        """Start slurmctld, which goes on from its saved state."""
        self._spawn("slurmctld", "-D")
        _wait(lambda: "UP" in self.call("scontrol", "ping", check=False), 60, f"slurmctld did not answer, see {self.folder}/slurmctld.log,")

    def stop_controller(self, number: int = signal.SIGTERM) -> None:
        """End slurmctld: running jobs go on, nothing can be submitted or asked; by SIGKILL it also forgets jobs of the last seconds."""
        self._end("slurmctld", number)

    def start_node(self, number: int) -> None:
        """Start the slurmd of node `number` (from 1)."""
        self._spawn("slurmd", "-D", "-N", f"n{number}", key=f"slurmd-n{number}")

    def lose_node(self, number: int) -> None:
        """End the slurmd of node `number` and every job's process on it, all at once, as if its power were gone."""
        name = f"n{number}"
        self._end(f"slurmd-{name}", signal.SIGKILL)
        for process in self.processes():
            place = Path("/proc", str(process))
            try:
                mine = f"SLURMD_NODENAME={name}".encode() in (place / "environ").read_bytes().split(b"\0")
                if mine or (place / "comm").read_text().startswith("slurmstepd"):
                    os.kill(process, signal.SIGKILL)
            except OSError:
                continue

    def _end(self, name: str, number: int = signal.SIGTERM) -> None:
        process = self._daemons.pop(name, None)
        if process is None:
            return
        process.send_signal(number)
        try:
            process.wait(_GRACE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

    def stop(self) -> None:
        """End all jobs, then all daemons, then whatever process of a job is still there."""
        if "slurmctld" in self._daemons:
            self.call("scancel", "--user=root", "--full", "--signal=KILL", check=False)
            self.call("scancel", "--user=root", check=False)
        for name in [*(name for name in self._daemons if name.startswith("slurmd")), "slurmctld", "munged"]:
            self._end(name)
        for process in self.processes():
            try:
                os.kill(process, signal.SIGKILL)
            except ProcessLookupError:
                continue

    def processes(self) -> list[int]:
        """Processes that belong to this Slurm: jobs, their steps, and clients; known by their environment."""
        mark, found = f"SLURM_CONF={self.folder}/slurm.conf".encode(), []
        for path in Path("/proc").glob("[0-9]*/environ"):
            try:
                if mark in path.read_bytes().split(b"\0"):
                    found.append(int(path.parent.name))
            except OSError:
                continue
        return [number for number in found if number != os.getpid()]


def _free_port(count: int) -> int:
    """First of `count` ports in a row that nobody listens on; two test runs at a time begin at different places."""
    begin = os.getpid() % len(_PORTS)
    for first in (*_PORTS[begin:], *_PORTS[:begin]):
        probes = [socket.socket() for _ in range(count)]
        try:
            for number, probe in enumerate(probes):
                probe.bind(("127.0.0.1", first + number))
            return first
        except OSError:
            continue
        finally:
            for probe in probes:
                probe.close()
    raise RuntimeError("no free ports for Slurm")


@contextmanager
def running(folder: Path, nodes: int = 2, processors: int = 4, memory: int = 8000, longest: int = 60) -> Iterator[Cluster]:
    """A Slurm in the empty `folder` with `nodes` virtual nodes of `processors` each (`memory` in MB, `longest` job in min)."""
    cluster = Cluster(folder.resolve(), nodes, processors, memory, longest, _free_port(nodes + 1))
    try:
        cluster.start()
        yield cluster
    finally:
        cluster.stop()
