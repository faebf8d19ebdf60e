"""Where the two engines are, which versions they have, and how they are called."""

from __future__ import annotations

import hashlib
import os
import re
import shlex
import shutil
import subprocess
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from dembark.common.errors import DembarkError
from dembark.validation.cases import checkout
from dembark.validation.parameters import Value

# An environment variable for each engine: which program it was that told its version, and the version.
_TOLD = "DEMBARK_TOLD_BY_"
NAMES = {"liggghts": "LIGGGHTS with dembark's styles", "yade": "YADE with dembark's laws"}


@dataclass(frozen=True)
class Engine:
    """An engine that was found: `identity` changes when the program or dembark's part of it is rebuilt differently."""

    name: str
    executable: Path
    version: str
    identity: str
    prefix: Path | None = None

    def command(self, deck: Path, values: Mapping[str, Value], ranks: int = 1, threads: int = 1) -> list[str]:
        """Words that run `deck` with `values` (None = leave the deck's default) in the current folder."""
        given = {key: repr(value) if isinstance(value, float) else str(value) for key, value in values.items() if value is not None}
        if self.name == "yade":
            if ranks > 1:
                raise DembarkError(f"--ranks {ranks} with YADE", "", "use --threads: YADE runs in one process")
            return [str(self.executable), f"-j{threads}", "-n", "-x", str(deck), *(f"{key}={value}" for key, value in given.items())]
        # Ranks would outlive a launcher that is killed, and go on writing.
        launcher = [*mpi_launcher(ranks), *end_with_parent("KILL")] if ranks > 1 else []
        variables = (word for key, value in given.items() for word in ("-var", key, value))
        return [*launcher, str(self.executable), "-in", str(deck), "-log", "none", *variables]

    def environment(self, threads: int = 1) -> dict[str, str]:
        """Environment for the engine: one thread unless asked for more, nothing of this Python's virtual environment or of a job step."""
        hidden = ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV", "DISPLAY")
        result = {key: value for key, value in os.environ.items() if key not in hidden and not _of_job_step(key)}
        # Ranks that wait for each other without yielding would halt a run with more ranks than free cores.
        result |= {"OMP_NUM_THREADS": str(threads), "PYTHONUNBUFFERED": "1", "OMPI_MCA_mpi_yield_when_idle": "1"}
        if self.name == "yade" and self.prefix:
            result["YADE_PREFIX"] = str(self.prefix)
            result["PATH"] = "/usr/bin:" + result.get("PATH", "")
        if os.geteuid() == 0:
            result |= {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
        return result


def end_with_parent(signal: str) -> list[str]:
    """Words before a command that let the system send it `signal` (`TERM`, `KILL`) when the process that started it has ended."""
    return ["setpriv", "--pdeathsig", signal, "--"] if shutil.which("setpriv") else []


def mpi_launcher(ranks: int) -> list[str]:
    """Words that start `ranks` processes: those of DEMBARK_MPIRUN (`srun --mpi=pmix`, `mpiexec`, ...) and -n, else Open MPI's mpirun."""
    named = shlex.split(os.environ.get("DEMBARK_MPIRUN", ""))
    # Without binding, two runs that go on at the same time do not end up on the same core.
    return [*named, "-n", str(ranks)] if named else ["mpirun", "-np", str(ranks), "--bind-to", "none", "--oversubscribe"]


def _of_job_step(variable: str) -> bool:
    # An MPI program that finds the variables of the job step it runs in takes itself for one of the step's ranks and ends when Slurm
    # started no PMI for it; mpirun would start its daemons through srun. Only srun has to know the job, for its own step.
    kept = {"SLURM_CONF"} | ({"SLURM_JOB_ID"} if Path(mpi_launcher(1)[0]).name == "srun" else set())
    return variable.startswith(("SLURM_", "PMI_", "PMIX_")) and variable not in kept


def _executable(path: Path, variable: str) -> Path:
    if not (path.is_file() and os.access(path, os.X_OK)):
        raise DembarkError(f"{variable}={path} is no program", "", f"set {variable} to the engine's executable, or unset it")
    return path


def _find_liggghts() -> Path:
    named = os.environ.get("DEMBARK_LIGGGHTS")
    if named:
        return _executable(Path(named), "DEMBARK_LIGGGHTS")
    tree = checkout()
    built = tree / "build/bin/liggghts-dembark" if tree else None
    if built and os.access(built, os.X_OK):
        return built
    on_path = shutil.which("liggghts-dembark")
    if on_path:
        return Path(on_path)
    raise DembarkError("liggghts-dembark not found", f"neither {built or 'in a build folder'} nor on PATH",
                       "build it with 'make liggghts' or set DEMBARK_LIGGGHTS to the executable")


def _find_yade() -> tuple[Path, Path]:
    named = os.environ.get("DEMBARK_YADE")
    if named:
        place = Path(named)
        prefix = place if place.is_dir() else place.parent.parent
        return _executable(place / "bin/yade" if place.is_dir() else place, "DEMBARK_YADE"), prefix
    tree = checkout()
    prefix = tree / "build/yade-overlay" if tree else None
    if prefix and os.access(prefix / "bin/yade", os.X_OK):
        return prefix / "bin/yade", prefix
    raise DembarkError("YADE with dembark's laws not found", f"no {prefix or 'build/yade-overlay'}",
                       "build it with 'make yade-plugin' or set DEMBARK_YADE to its folder or executable")


def call(words: Sequence[str | Path], folder: Path, environment: Mapping[str, str] | None = None,
         timeout: float = 120.0) -> subprocess.CompletedProcess[str]:
    """Run an engine in `folder` to its end, at most `timeout` (s); its output is text whatever it wrote.

    Stock LIGGGHTS prints bytes of freed memory after some errors: they need not be text.
    """
    return subprocess.run([str(word) for word in words], cwd=folder, env=environment, capture_output=True, text=True, errors="replace",
                          stdin=subprocess.DEVNULL, timeout=timeout, check=False)


def _digest(files: Iterable[Path]) -> str:
    total = hashlib.sha256()
    for path in sorted(files):
        total.update(path.name.encode())
        total.update(path.read_bytes())
    return total.hexdigest()


def _own_files(prefix: Path) -> list[Path]:
    # The overlay consists of links to YADE's own files; what is no link, or carries our name, is dembark's.
    return [path for suffix in ("*.so", "*.py") for path in (prefix / "lib").rglob(suffix)
            if path.is_file() and (not path.is_symlink() or "dembark" in path.name)]


def _first_match(pattern: str, command: list[str], environment: Mapping[str, str] | None = None) -> str:
    try:
        with tempfile.TemporaryDirectory(prefix="dembark-") as folder:
            done = call(command, Path(folder), environment)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise DembarkError(f"{command[0]} does not start", "", str(error)) from None
    found = re.search(pattern, done.stdout + done.stderr)
    if found:
        return found.group(1)
    last = (done.stderr or done.stdout).strip().splitlines()[-1:] or [f"exit code {done.returncode} without a word"]
    raise DembarkError(f"{command[0]} does not tell its version", "", last[0])


def _version(engine: Engine, pattern: str, *words: str) -> str:
    """The version that the program tells; asked once by a process and those that it starts, for a start takes a second or two."""
    facts = engine.executable.stat()
    asked = f"{engine.executable}:{facts.st_size}:{facts.st_mtime_ns}"
    told = os.environ.get(_TOLD + engine.name.upper(), "").rpartition("=")
    if told[0] == asked:
        return told[2]
    version = _first_match(pattern, [str(engine.executable), *words], engine.environment())
    os.environ[_TOLD + engine.name.upper()] = f"{asked}={version}"
    return version


@cache
def find(name: str) -> Engine:
    """The engine called `name` (`liggghts` or `yade`), asked for its version; DembarkError telling what to do if there is none."""
    if name == "liggghts":
        program = _find_liggghts()
        version = _version(Engine(name, program, "", ""), r"\(Version (?:LIGGGHTS-PUBLIC )?([^\s,)]+)", "-in", "/dev/null", "-log", "none")
        return Engine(name, program, version, _digest([program]))
    program, prefix = _find_yade()
    version = _version(Engine(name, program, "", "", prefix), r"[Yy]ade version:?\s*(\S+)", "--version")
    return Engine(name, program, version, _digest([program, *_own_files(prefix)]), prefix)
