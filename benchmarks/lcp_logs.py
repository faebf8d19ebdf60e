"""Contact problems of logs in a drum and in a pile, as the impact model makes them, and as files in Matrix Market form.

`python -m benchmarks.lcp_logs FOLDER` writes <name>_M.mtx and <name>_q.mtx of each problem, w = M z + q, w >= 0, z >= 0, z w = 0, and its
solution <name>_z.mtx. `scipy.io.mmread` and all that reads Matrix Market files reads them.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.io import mmwrite
from scipy.spatial import cKDTree

from benchmarks.frame import ended, say
from benchmarks.lcp_cases import Problem
from dembark.common.errors import DembarkError
from dembark.physics import Drum, ImpactSystem, Plane, solve_lcp

STIFFNESS, WALL_STIFFNESS, G = 1e7, 5e7, 9.81  # N/m, N/m, m/s^2
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Logs:
    """Logs in cross-section at one moment: (b,) kg and m, (b, 2) m and m/s; the walls are at rest against a step."""

    mass: Floats
    radius: Floats
    position: Floats
    velocity: Floats
    walls: tuple[Plane | Drum, ...]

    def system(self, **how: Any) -> ImpactSystem:
        """The impact model with these logs and their weight."""
        return ImpactSystem(self.mass, self.radius, self.position, self.velocity, stiffness=STIFFNESS, gravity=(0.0, -G), walls=self.walls,
                            **how)

    def after(self, duration: float, dt: float) -> Logs:
        """The logs `duration` (s) later, with friction and damping, in steps of `dt` (s)."""
        motion = self.system(theta=0.5, friction=0.4, contact_damping=3000.0).run(duration, dt, every=10**9)
        return Logs(self.mass, self.radius, motion.position[-1], motion.velocity[-1], self.walls)

    @property
    def omega(self) -> float:
        """sqrt(s / m) of the lightest log, rad/s: that of the stiffest contact of two logs."""
        return float(np.sqrt(STIFFNESS / self.mass.min()))


def _loose(count: int, wide: float, high: float, seed: int, diameters: tuple[float, float], room: Callable[[Floats], NDArray[np.bool_]]
           ) -> tuple[Floats, Floats]:
    """Radii, and the lowest places of a loose lattice (m) that have room."""
    random = np.random.default_rng(seed)
    step = 1.02 * diameters[1]
    across, up = np.arange(-0.5 * wide + 0.5 * step, 0.5 * wide - 0.49 * step, step), np.arange(-high, high, step)
    lattice = np.stack([axis.ravel() for axis in np.meshgrid(across, up)], axis=1)
    places = lattice[room(lattice)][:count] + 0.009 * step * random.uniform(-1.0, 1.0, (count, 2))
    return 0.5 * random.uniform(*diameters, count), places


def pile(count: int = 60, seed: int = 1) -> Logs:
    """A pile between two stakes a second and a half after the logs began to fall, nearly at rest."""
    wide, thickest = 0.26 * np.sqrt(2.0 * count), 0.26
    radius, position = _loose(count, wide, 2.0 * wide, seed, (0.14, thickest), lambda x: x[:, 1] > 0.6 * thickest)
    walls = tuple(Plane(point=(x, 0.0), normal=normal, stiffness=WALL_STIFFNESS)
                  for x, normal in ((0.0, (0.0, 1.0)), (-0.5 * wide, (1.0, 0.0)), (0.5 * wide, (-1.0, 0.0))))
    logs = Logs(1600.0 * np.pi * radius**2, radius, position, np.zeros((count, 2)), walls)
    return logs.after(1.5, 0.4 / logs.omega)


def drum(count: int = 60, seed: int = 1) -> Logs:
    """A drum filled to a quarter that has turned for three seconds at 1.2 rad/s: logs roll, fall and hit each other."""
    thickest = 0.25
    size = float(np.sqrt(count * (0.175**2 + 0.15**2 / 12)))
    radius, position = _loose(count, 2.0 * size, size, seed, (0.1, thickest), lambda x: np.hypot(*x.T) < size - 0.55 * thickest)
    shell = Drum(radius=size, omega=1.2, stiffness=WALL_STIFFNESS)
    logs = Logs(850.0 * np.pi * radius**2, radius, position, np.zeros((count, 2)), (shell,))
    return logs.after(3.0, 0.4 / logs.omega)


def problem(logs: Logs, dt: float, kick: float = 1.0) -> Problem:
    """M = diag(1/k) + kick dt^2 G^T m^-1 G and q = gap + dt u + kick dt^2 G^T f/m (m/N and m) of the published scheme without friction.

    The candidates are the pairs whose gap the fastest logs could close in the step `dt` (s). kick: 1/2 for the first step of a run, whose
    velocities are those of the full step.
    """
    reach = 2.0 * dt * (2.0 * np.hypot(*logs.velocity.T).max() + G * dt)
    x, r = logs.position, logs.radius
    a, b = cKDTree(x).query_pairs(2.0 * r.max() + reach, output_type="ndarray").T
    normal = x[a] - x[b]
    apart = np.hypot(*normal.T)
    parts = [(a, b, normal / apart[:, None], apart - r[a] - r[b], STIFFNESS)]
    every, none = np.arange(len(r)), np.full(len(r), -1)
    for wall in logs.walls:
        if isinstance(wall, Drum):
            out = np.hypot(*x.T)
            parts.append((every, none, -x / out[:, None], wall.radius - out - r, wall.stiffness))
        else:
            inward = np.broadcast_to(wall.normal, x.shape)
            parts.append((every, none, inward, ((x - wall.point) * inward).sum(axis=1) - r, wall.stiffness))
    a, b, normal, gap = (np.concatenate([part[k] for part in parts]) for k in range(4))
    other = np.concatenate([np.full(len(part[0]), part[4]) for part in parts])
    near = gap <= reach
    a, b, normal, gap, other = a[near], b[near], normal[near], gap[near], other[near]
    k, pairs = np.arange(len(a)), b >= 0
    entries = np.concatenate([normal[:, 0], normal[:, 1], -normal[pairs, 0], -normal[pairs, 1]])
    rows = np.concatenate([2 * a, 2 * a + 1, 2 * b[pairs], 2 * b[pairs] + 1])
    response = sparse.csr_array((entries, (rows, np.concatenate([k, k, k[pairs], k[pairs]]))), shape=(2 * len(r), len(a)))
    scale = kick * dt**2
    matrix = sparse.csc_array(response.T @ sparse.diags_array(np.repeat(scale / logs.mass, 2)) @ response
                              + sparse.diags_array(1.0 / STIFFNESS + 1.0 / other))
    matrix.sort_indices()
    weight = np.tile([0.0, -G], len(r))
    return Problem(matrix, gap + response.T @ (dt * logs.velocity.ravel() + scale * weight))


def problems(count: int = 60) -> dict[str, Problem]:
    """By name: the drum and the pile at a step that resolves impacts (omega tau = 0.2) and at long ones."""
    return {f"{name} {phase:g}": problem(logs, phase / logs.omega)
            for name, logs in (("drum", drum(count)), ("pile", pile(count))) for phase in (0.2, 4.0, 40.0)}


def write(folder: Path, count: int) -> list[Path]:
    """Three files of each problem."""
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for name, one in problems(count).items():
        about = f"{name}: {count} logs, omega tau at the end of the name; LCP w = M z + q of contact forces z (N) and gaps w (m)"
        stem = folder / name.replace(" ", "_")
        for part, numbers in (("M", one.M), ("q", one.q[:, None]), ("z", solve_lcp(one.M, one.q).z[:, None])):
            path = stem.with_name(f"{stem.name}_{part}.mtx")
            mmwrite(path, numbers, comment=about, precision=17, symmetry="symmetric" if part == "M" else "general")
            written.append(path)
    return written


def run(words: list[str] | None) -> None:
    """Write the files."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.lcp_logs", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("folder", type=Path, help="where the files are written")
    parser.add_argument("--logs", type=int, default=60, help="logs in the drum and in the pile (default %(default)s)")
    given = parser.parse_args(words)
    if given.logs < 12:
        raise DembarkError("--logs is too small", "", "give at least 12")
    for path in write(given.folder, given.logs):
        say(f"wrote {path}")


def main(words: list[str] | None = None) -> int:
    """The exit code is 2 when an option is wrong."""
    return ended(lambda: run(words))


if __name__ == "__main__":
    sys.exit(main())
