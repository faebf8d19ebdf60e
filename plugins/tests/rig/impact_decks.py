"""Decks of a few logs for fix lcp/impact, and what their runs left behind."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from rig import lammps_driver, liggghts_driver
from rig.liggghts_driver import Run, read_dump

# What engines with input scripts in LAMMPS's manner call differently: style of the atoms, velocities of ghosts, format of dumps, spin.
DRIVERS = {"liggghts": liggghts_driver, "lammps": lammps_driver}
ATOMS = {"liggghts": "granular", "lammps": "sphere"}
GHOSTS = {"liggghts": "communicate single vel yes", "lammps": "comm_modify vel yes"}
FORMAT = {"liggghts": "format", "lammps": "format line"}
SPIN = {"liggghts": "omegax {!r} omegay {!r} omegaz {!r}", "lammps": "omega {!r} {!r} {!r}"}

# Names of what the fix returns as a vector, in its order.
VECTOR = ("contacts", "active", "impacts", "peak", "impulse", "dissipated", "elastic", "pivots", "block_steps", "pivots_total",
          "certificate", "worst_certificate", "peak_so_far")
ATTITUDE = " ".join(f"f_hits[{i}]" for i in range(1, 9))  # of logs with a length: length, axis, quaternion
STATE = "id x y z vx vy vz omegax omegay omegaz fx fy fz tqx tqy tqz"
GROUND = ("wall plane ground y 0 lo stiffness 5e7 friction 0.3 wall plane left x -0.9 lo stiffness 5e7 "
          "wall plane right x 0.9 hi stiffness 5e7")
LOCAL = ("id_a", "id_b", "nx", "ny", "nz", "gap", "normal_force", "tx", "ty", "tz", "x", "y", "z")


@dataclass(frozen=True)
class Log:
    """A log in cross-section, or with a length in space: m, m/s, kg, rad/s."""

    position: tuple[float, float]
    velocity: tuple[float, ...] = (0.0, 0.0)
    radius: float = 0.1
    mass: float = 50.0
    spin: float | tuple[float, float, float] = 0.0
    type: int = 1
    z: float = 0.0
    length: float | None = None  # a line of the list of logs, with the axis
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)

    @property
    def spins(self) -> tuple[float, float, float]:
        return self.spin if isinstance(self.spin, tuple) else (0.0, 0.0, self.spin)


@dataclass
class Case:
    """A deck: logs, the words of the fix, and what runs."""

    logs: list[Log]
    words: str
    time_step: float
    run: str
    gravity: float = 0.0
    types: int = 1
    box: tuple[float, float, float, float, float, float] = (-3.0, 3.0, -3.0, 3.0, -0.5, 0.5)
    boundary: str = "f f f"
    dimension: int = 3
    before: str = ""  # further fixes, before the impacts
    after: str = ""
    every: int = 1000
    extra: list[str] = field(default_factory=list)
    local: str = ""  # a dump of the contacts with a force, each time that the logs are dumped
    motion: str = "nve/sphere"

    @property
    def in_space(self) -> bool:
        return any(word in self.words.split() for word in ("length", "logs"))

    def logs_file(self) -> str:
        """The list of logs with a length of their own."""
        return "# id length x y z\n" + "".join(f"{number} {log.length!r} {log.axis[0]!r} {log.axis[1]!r} {log.axis[2]!r}\n"
                                               for number, log in enumerate(self.logs, 1) if log.length is not None)

    def head(self, engine: str = "liggghts") -> str:
        """The part of the deck that a run from a restart file does not need."""
        lines = [f"region domain block {' '.join(repr(b) for b in self.box)} units box", f"create_box {self.types} domain"]
        lines += [f"create_atoms {log.type} single {log.position[0]!r} {log.position[1]!r} {log.z!r} units box" for log in self.logs]
        for number, log in enumerate(self.logs, 1):
            velocity = " ".join(f"v{axis} {v!r}" for axis, v in zip("xyz", log.velocity, strict=False))
            lines.append(f"set atom {number} diameter {2.0 * log.radius!r} {velocity}")
            lines.append(f"set atom {number} mass {log.mass!r}")
            if any(log.spins):
                lines.append(f"set atom {number} {SPIN[engine].format(*log.spins)}")
        return "\n".join(lines)

    def text(self, engine: str = "liggghts", *, head: str | None = None, run: str | None = None, ranks: int = 1,
             dump: str = "logs.dump") -> str:
        gravity = f"fix weight all gravity {self.gravity!r} vector 0 -1 0" if self.gravity else ""
        local = f"dump local all local {self.every} {self.local} " + " ".join(f"f_hits[{i}]" for i in range(1, 14))
        line = FORMAT[engine]
        atoms = f"{STATE} {ATTITUDE}" if self.in_space else STATE
        return "\n".join([
            f"log {log_name(dump)}", "units si", f"dimension {self.dimension}", f"atom_style {ATOMS[engine]}",
            "atom_modify map array sort 0 0.0", f"boundary {self.boundary}", "newton off", GHOSTS[engine], f"processors {ranks} 1 1",
            self.head(engine) if head is None else head, "neighbor 0.05 bin", "neigh_modify delay 0", self.before, gravity,
            f"fix hits all lcp/impact {self.words}", self.after, f"fix motion all {self.motion}", f"timestep {self.time_step!r}",
            *self.extra,
            f"dump logs all custom {self.every} {dump} {atoms}",
            f'dump_modify logs sort id {line} "%d{" %.17g" * (len(atoms.split()) - 1)}"',
            *([local, f'dump_modify local {line} "{" ".join(["%.17g"] * 13)}"'] if self.local else []),
            "thermo_style custom step atoms " + " ".join(f"f_hits[{i}]" for i in range(1, 14)),
            'thermo_modify norm no lost error format float "%.17g"', f"thermo {self.every}", self.run if run is None else run, ""])


def start(folder: Path, case: Case, *, engine: str = "liggghts", ranks: int = 1, **words: str | None) -> Run:
    if "logs" in case.words.split():
        folder.mkdir(parents=True, exist_ok=True)
        (folder / "logs.txt").write_text(case.logs_file())
    return DRIVERS[engine].run_deck(folder, case.text(engine, ranks=ranks, **words), ranks=ranks)


def run(folder: Path, case: Case, *, engine: str = "liggghts", ranks: int = 1, **words: str | None) -> Result:
    done = start(folder, case, engine=engine, ranks=ranks, **words)
    assert done.code == 0, done.output[-3000:]
    return Result(case, done, words.get("dump") or "logs.dump")


class Result:
    """Frames of the logs (columns as in STATE) and the vectors of the fix."""

    def __init__(self, case: Case, done: Run, dump: str) -> None:
        self.case, self.folder, self.output = case, done.folder, done.output
        self.steps, self.frames = read_dump(done.folder / dump)
        self.vectors = thermo((done.folder / log_name(dump)).read_text(errors="replace"))

    @property
    def last(self) -> NDArray[np.float64]:
        return self.frames[-1]

    @property
    def mass(self) -> NDArray[np.float64]:
        return np.array([log.mass for log in self.case.logs])

    def velocity(self, frame: int = -1) -> NDArray[np.float64]:
        return self.frames[frame][:, 4:7]

    def spin(self, frame: int = -1) -> NDArray[np.float64]:
        return self.frames[frame][:, 7:10]

    def axis(self, frame: int = -1) -> NDArray[np.float64]:
        return self.frames[frame][:, 17:20]

    def energy(self, frame: int = -1) -> float:
        """Of the motion, without spin."""
        return float(0.5 * self.mass @ (self.velocity(frame) ** 2).sum(axis=1))

    def vector(self, name: str, row: int = -1) -> float:
        return float(self.vectors[row, VECTOR.index(name)])

    def impacts(self, file: str = "impacts.txt") -> NDArray[np.float64]:
        return np.loadtxt(self.folder / file, ndmin=2)


def log_name(dump: str) -> str:
    """The engine's log beside the frames: what several ranks print may lose lines on its way through mpirun."""
    return f"{dump}.log"


def thermo(output: str) -> NDArray[np.float64]:
    """The vectors of the fix of every line of thermo output in a log."""
    rows = []
    reading = False
    for line in output.splitlines():
        words = line.split()
        if words[:2] == ["Step", "Atoms"]:
            reading = True
        elif reading and len(words) == 2 + len(VECTOR):
            rows.append([float(word) for word in words[2:]])
        else:
            reading = False
    return np.array(rows)


def pile(count: int = 30, *, steps: int = 2000, **settings: Any) -> Case:
    """Logs of unequal diameter that fall between two walls, on both sides of x = 0."""
    logs = []
    for i in range(count):
        radius = 0.1 * (1.0 + 0.2 * math.sin(37.0 * i))
        logs.append(Log((-0.72 + 0.25 * (i % 6) + 0.004 * math.sin(91.0 * i), 0.15 + 0.26 * (i // 6)),
                        (math.sin(53.0 * i), -1.5 + math.sin(17.0 * i)), radius=radius, mass=2500.0 * radius**2))
    return Case(logs, f"stiffness 1e7 contact_damping 20000 friction 0.4 0.3 1e-4 impacts impacts.txt {GROUND}", 2e-5, f"run {steps}",
                gravity=9.81, box=(-1.0, 1.0, -0.5, 2.5, -0.5, 0.5), **{"every": steps, **settings})


def assert_same(a: NDArray[np.float64], b: NDArray[np.float64], tolerance: float) -> None:
    """Two frames: each quantity, three columns, relative to its largest value."""
    assert (a[:, 0] == b[:, 0]).all()
    found = {name: np.abs(a[:, k : k + 3] - b[:, k : k + 3]).max() / max(np.abs(a[:, k : k + 3]).max(), 1e-300)
             for k, name in ((1, "position"), (4, "velocity"), (7, "spin"), (10, "force"), (13, "torque"))}
    assert max(found.values()) <= tolerance, found


def rolled(folder: Path, factor: float, words: str, engine: str, **settings: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Speeds and spins, every 20 steps of 1e-4 s, of a log that begins to slide at 1 m/s on a floor with the friction 0.3, until it rolls;
    `factor`: its moment of inertia over m r^2.

    Friction leaves v0 / (1 + factor) of the speed, and the angular momentum about the line of contact as it was, also while the friction
    spring swings between log and floor; both are asserted.
    """
    mass, s = 50.0, 1e6
    static = mass * 9.81 * 2.0 / s  # deformation of log and floor under the weight
    case = Case([Log((-1.0, 0.1 - static), (1.0, 0.0), mass=mass)],
                f"stiffness {s!r} {words} wall plane floor y 0 lo stiffness {s!r} friction 0.3", 1e-4, "run 4000", gravity=9.81, every=20,
                **settings)
    speed, spin = np.array([(frame[0, 4], frame[0, 9]) for frame in run(folder, case, engine=engine).frames]).T
    arm = 0.1 - 0.5 * static
    assert mass * arm * (speed - 1.0) == pytest.approx(factor * mass * 0.1**2 * spin, rel=1e-6, abs=1e-9)
    assert speed[50:].mean() == pytest.approx(1.0 / (1.0 + factor), rel=1e-2)
    assert -arm * spin[50:].mean() == pytest.approx(speed[50:].mean(), rel=1e-2)
    return speed, spin
