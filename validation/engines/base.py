"""What an engine is to the harness: the protocol that each module of an engine implements, and what several of them need."""

from __future__ import annotations

import hashlib
import math
import os
import re
import shlex
import shutil
import subprocess
import tempfile
import tomllib
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar, Self

from dembark.common.checkout import checkout
from dembark.common.choices import Value
from dembark.common.errors import DembarkError
from dembark.common.extras import install_line

# Where the start of MPI programs is named, for engines without a launcher of their own.
LAUNCHER = "DEMBARK_MPIRUN"
# What dembark's part of the engines reads in the environment: how many contacts it computes at a time.
SWITCHES = ("DEMBARK_LANES",)
# What a case may need of an engine apart from a deck, by the names that `[needs]` of case.toml and the facts of engines use.
CAPABILITIES = {"bridges": "liquid bridges", "carried_liquid": "liquid carried by grains", "rolling_resistance": "couples against rolling",
                "own_inertia": "moments of inertia other than a sphere's",
                "creeping_friction": "friction of boxes without a spring", "periodic_fluid": "a fluid in a periodic box"}
DECK_NOTE = ("Written by dembark; SI units. Numbers with a comment are parameters. Others, the packing and the meshes were computed from "
             "them and do not follow a change by hand: write the deck anew with 'dembark deck --set'.")


@dataclass(frozen=True)
class EngineFacts:
    """What is known of an engine even where its program is not installed.

    `name` stands in commands, files and folders, `title` in text and figures; `program` is what has to be installed. Rates are in
    particle-steps per second and core. `restart_rate` turns the wall time between restart files into steps: a fixed number, because a
    measured one would make a run differ from host to host. `typical_rate` is that of a case without measured rates, and `measured_on` says
    where and when. `relative_cost` is that of a particle-step. `capabilities` are names of CAPABILITIES. An
    `optional` engine is left out of profiles where it is not installed, and they say so; campaigns run it where they name it.
    """

    name: str
    title: str
    program: str = ""
    deck: str = ""
    version_words: tuple[str, ...] = ()
    version_pattern: str = ""
    restart_suffix: str = ""
    colour: str = "#000000"
    marker: str = "o"
    relative_cost: float = 1.0
    restart_rate: float = 1e5
    typical_rate: float = 1e5
    measured_on: str = ""
    capabilities: tuple[str, ...] = ()
    optional: bool = False
    # Environment variables that say which program is meant.
    variables: tuple[str, ...] = ()
    # Its name, and whether one that is found on PATH will do.
    executable: str = ""
    on_path: bool = False
    # Where it is built below `build`, and by what target of make.
    built: str = ""
    target: str = ""
    # The extra of the Python package that brings it where there is no checkout.
    extra: str = ""
    # What brings parts that the program found may lack.
    own_build: str = ""
    # What makes the ids in its impact files count from 1.
    impact_id_offset: int = 0
    # What stands in a deck, or in what it includes, when it writes states to resume from.
    restart_words: tuple[str, ...] = ()
    # File name patterns of what it leaves in a run's folder and no result needs.
    leftovers: tuple[str, ...] = ()
    # How the line begins that it writes when a signal makes it stop, if it writes one.
    stop_message: str | None = None
    # How a deck is run in its folder.
    by_hand: str = ""
    # MPI processes, the environment variable that says how they are started, threads, and whether it can be started by hand, as
    # 'dembark <name>'.
    ranks: bool = False
    launcher: str = LAUNCHER
    threads: bool = False
    interactive: bool = False

    @classmethod
    def read(cls, name: str) -> Self:
        """The facts of the engine called `name` in facts.toml."""
        known = tomllib.loads(Path(__file__).with_name("facts.toml").read_text(encoding="utf-8"))[name]
        given: dict[str, Any] = {key: tuple(value) if isinstance(value, list) else value for key, value in known.items()}
        return cls(name, **given)

    def check_ranks(self, ranks: int) -> None:
        """DembarkError when a run shall have several MPI processes and the engine has none."""
        if ranks > 1 and not self.ranks:
            raise DembarkError(f"--ranks {ranks} with {self.title}", "", f"use --threads: {self.one_process}")

    def missing_capabilities(self, needed: Iterable[str]) -> list[str]:
        """What of `needed`, names of CAPABILITIES, it has not, in words."""
        return [CAPABILITIES[name] for name in needed if name not in self.capabilities]

    @property
    def one_process(self) -> str:
        """Why it takes no ranks, for the end of an error line."""
        return f"{self.title} runs in one process"


@dataclass(frozen=True)
class DeckNumber:
    """A number or word of a deck (None: not set), or a table of them, and what it is, in words; derived ones have none."""

    value: Value | tuple[Value, ...]
    meaning: str = ""


@dataclass(frozen=True)
class RigidBody:
    """A rigid body of spheres: mass (kg), inertia (kg m², three rows) about the centre of mass, which is at `centre` (m), and the spheres,
    (x, y, z, radius) from there (m). Axes are along x, y and z. `lattice`: whether the spheres are points of a cubic lattice."""

    name: str
    mass: float
    inertia: tuple[tuple[float, float, float], ...]
    centre: tuple[float, float, float]
    spheres: tuple[tuple[float, float, float, float], ...]
    principal: bool
    lattice: bool

    @property
    def density(self) -> float:
        """kg/m³, of spheres whose masses add up to that of the body."""
        return self.mass / sum(4.0 / 3.0 * math.pi * radius**3 for *_, radius in self.spheres)

    @property
    def moments(self) -> tuple[float, ...]:
        """xx, yy, zz, xy, xz, yz of the inertia."""
        one = self.inertia
        return one[0][0], one[1][1], one[2][2], one[0][1], one[0][2], one[1][2]

    def about(self) -> str:
        """For the first line of its files."""
        return (f"Written by dembark; SI units. {self.name}: a rigid body of {len(self.spheres)} spheres, with the mass and the inertia of "
                "its surface's inside.")


@dataclass(frozen=True)
class Engine(ABC):
    """An engine that was found: `identity` changes when the program or dembark's part of it is rebuilt differently."""

    facts: ClassVar[EngineFacts]
    executable: Path
    version: str
    identity: str

    @abstractmethod
    def command(self, deck: Path, values: Mapping[str, Value], ranks: int = 1, threads: int = 1) -> list[str]:
        """Words that run `deck` with `values` (None = leave the deck's default) in the current folder."""

    @classmethod
    @abstractmethod
    def deck_text(cls, source: str, numbers: Mapping[str, DeckNumber], folders: Sequence[Path]) -> str:
        """The deck that runs, from its `source` in a case folder: with all numbers, and what it includes from `folders` in its place."""

    @classmethod
    def body_files(cls, body: RigidBody) -> dict[str, str]:
        """Files, by name, from which its decks take the body; DembarkError for an engine that takes none."""
        raise DembarkError(f"{cls.facts.title} takes no bodies of spheres", f"such as {body.name}")

    @classmethod
    def locate(cls) -> Path:
        """The program, or the folder above its `bin`, that the environment names, else the program that was built here, else, if one from
        elsewhere will do, that on PATH; DembarkError, with what to do, if there is none."""
        facts, tree = cls.facts, checkout()
        for variable in filter(os.environ.get, facts.variables):
            named = Path(os.environ[variable])
            path = named / "bin" / facts.executable if named.is_dir() else named
            if not _is_program(path):
                raise DembarkError(f"{variable}={path} is not a program", "", f"set {variable} to the engine's executable, or unset it")
            return path
        here = tree / "build" / facts.built if tree else None
        if here and _is_program(here):
            return here
        if facts.on_path and (elsewhere := shutil.which(facts.executable)):
            return Path(elsewhere)
        if here:
            where, way = f"{here} is not there" + (", nor is it on PATH" if facts.on_path else ""), f"build it with '{facts.target}'"
        else:
            where = "it is not on PATH" if facts.on_path else ""
            way = install_line(facts.extra) if facts.extra else f"build it with '{facts.target}' in a checkout of dembark"
        raise DembarkError(f"{facts.program} not found", where, f"{way} or set {facts.variables[0]} to its executable")

    @classmethod
    def pending(cls) -> str:
        """What is there when the first run has yet to build dembark's part; empty otherwise. DembarkError when that cannot be done."""
        return ""

    @classmethod
    def find(cls) -> Self:
        """The engine of this machine, asked for its version; DembarkError, with what to do, if there is none."""
        bare = cls(cls.locate(), "", "")
        command = [str(bare.executable), *cls.facts.version_words]
        version = _first_match(cls.facts.version_pattern, command, bare.environment())
        return replace(bare, version=version, identity=digest(bare.own_files()))

    @property
    def name(self) -> str:
        """Its name in commands, files and folders."""
        return self.facts.name

    def own_files(self) -> Iterable[Path]:
        """The files that decide how it computes: the program, the engine's library and dembark's part of it."""
        return [self.executable, *self.libraries(self.executable)]

    def libraries(self, program: Path) -> list[Path]:
        """The shared libraries of `program` that carry the engine's name; none of a script."""
        done = subprocess.run(["ldd", str(program)], capture_output=True, text=True, env=self.environment(), check=False)
        return [Path(path) for path in re.findall(rf"(/\S*/lib{re.escape(self.name)}[^/\s]*) \(", done.stdout)]

    def switches(self) -> dict[str, str]:
        """Environment variables by which a user changes how it computes, those that are set."""
        return {name: os.environ[name] for name in SWITCHES if name in os.environ}

    def missing_parts(self) -> Iterable[str]:
        """Parts that other builds of the program have, and what needs them: for users' own scripts, no case needs them."""
        return ()

    def build_folders(self) -> Iterable[Path]:
        """Folders where the CMake cache of the build of dembark's part may lie, the most likely first."""
        return self.executable.resolve().parents

    def launcher(self, ranks: int) -> list[str]:
        """Words that start `ranks` processes: those of the variable that the facts name, and -n, else Open MPI's mpirun."""
        return mpi_launcher(ranks, self.facts.launcher)

    def environment(self, threads: int = 1) -> dict[str, str]:
        """Environment for the engine: one thread unless asked for more, nothing of this Python's virtual environment or of a job step."""
        hidden = ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV", "DISPLAY")
        result = {key: value for key, value in os.environ.items() if key not in hidden and not _of_job_step(key, self.launcher(1))}
        # Ranks that wait for each other without yielding would halt a run with more ranks than free cores.
        result |= {"OMP_NUM_THREADS": str(threads), "PYTHONUNBUFFERED": "1", "OMPI_MCA_mpi_yield_when_idle": "1"}
        if os.geteuid() == 0:
            result |= {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
        return result


def texts(values: Mapping[str, Value]) -> dict[str, str]:
    """The values that are set, as decks read them: numbers with all their digits."""
    return {key: repr(value) if isinstance(value, float) else str(value) for key, value in values.items() if value is not None}


def _is_program(path: Path) -> bool:
    return path.is_file() and os.access(path, os.X_OK)


def end_with_parent(signal: str) -> list[str]:
    """Words before a command that let the system send it `signal` (`TERM`, `KILL`) when the process that started it has ended."""
    return ["setpriv", "--pdeathsig", signal, "--"] if shutil.which("setpriv") else []


def mpi_launcher(ranks: int, variable: str = LAUNCHER) -> list[str]:
    """Words that start `ranks` processes: those of the environment's `variable` (`srun --mpi=pmix`, `mpiexec`, ...) and -n, else Open MPI's
    mpirun."""
    named = shlex.split(os.environ.get(variable, ""))
    # Without binding, two runs that go on at the same time do not end up on the same core.
    return [*named, "-n", str(ranks)] if named else ["mpirun", "-np", str(ranks), "--bind-to", "none", "--oversubscribe"]


def call(words: Sequence[str | Path], folder: Path, environment: Mapping[str, str] | None = None,
         timeout: float = 120.0) -> subprocess.CompletedProcess[str]:
    """Run an engine in `folder` to its end, at most `timeout` (s); its output is text whatever bytes it wrote."""
    return subprocess.run([str(word) for word in words], cwd=folder, env=environment, capture_output=True, text=True, errors="replace",
                          stdin=subprocess.DEVNULL, timeout=timeout, check=False)


def digest(files: Iterable[Path]) -> str:
    """SHA-256 over the names and contents of `files`, in whatever order they are given."""
    total = hashlib.sha256()
    for path in sorted(files, key=lambda path: (path.name, path)):
        total.update(path.name.encode())
        total.update(path.read_bytes())
    return total.hexdigest()


def _of_job_step(variable: str, launcher: Sequence[str]) -> bool:
    # An MPI program that finds the variables of the job step it runs in takes itself for one of the step's ranks and ends when Slurm
    # started no PMI for it; mpirun would start its daemons through srun. Only srun has to know the job, for its own step.
    kept = {"SLURM_CONF"} | ({"SLURM_JOB_ID"} if Path(launcher[0]).name == "srun" else set())
    return variable.startswith(("SLURM_", "PMI_", "PMIX_")) and variable not in kept


def _first_match(pattern: str, command: list[str], environment: Mapping[str, str] | None = None) -> str:
    try:
        with tempfile.TemporaryDirectory(prefix="dembark-") as folder:
            done = call(command, Path(folder), environment)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise DembarkError(f"{command[0]} does not start", "", str(error)) from None
    found = re.search(pattern, done.stdout + done.stderr)
    if found:
        return found.group(1)
    last = (done.stderr or done.stdout).strip().splitlines()[-1:] or [f"exit code {done.returncode} and no output"]
    raise DembarkError(f"{command[0]} does not print its version", "", last[0])
