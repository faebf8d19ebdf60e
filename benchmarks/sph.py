"""Particle-steps a second of the SPH solver and of `pair_style sph/coupled`, of stock LIGGGHTS, LAMMPS and PySPH on one cube of water,
in processor time of one core. LAMMPS and PySPH are left out where they are not installed.

`python -m benchmarks.sph` writes medians. All have h = 1.3 dx, artificial viscosity and the same step, all but
LAMMPS the cubic spline; dembark diffuses the density, too, and computes densities and forces in two loops over all pairs. It is measured
with Wendland's kernel as well, at the step that it usually takes, in a tank, whose walls are particles, and with a free body in the middle;
and on two ranks and two threads, each, with what they wait for each other.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from time import process_time
from typing import Any

from benchmarks import frame
from benchmarks.beds import run_deck, stock_liggghts, with_clock
from benchmarks.frame import HERE, Sample
from benchmarks.lcp import ONE_THREAD, SYSTEM_PYTHON
from dembark.common.errors import RunError
from dembark.physics.sph import SphFluid, lattice, tank_walls
from dembark.validation.engines import absent, call, find

SOUND, GAMMA = 40.0, 7.0


def step_of(dx: float) -> float:
    """0.2 h/(c + c/10), s: stock LIGGGHTS is not stable much beyond it."""
    return 0.2 * 1.3 * dx / (1.1 * SOUND)


def dembark_rate(count: int, steps: int, *, kernel: str, walls: bool, longer: float = 1.0, threads: int = 1) -> float:
    """Particle-steps a second of processor time, of all threads, in a cube of fluid of `count` particles a side; `longer`: than the stock
    code's step."""
    dx = 1.0 / count
    points = lattice([0, 0, 0], [1, 1, 1], dx)
    water = SphFluid(points, spacing=dx, sound_speed=SOUND, gravity=[0, 0, -9.81], kernel=kernel, gamma=GAMMA, threads=threads,
                     pressure=9810.0 * (1.0 - points[:, 2]) if walls else 0.0)
    if walls:
        water.add_wall(tank_walls([0, 0, 0], [1, 1, 1 + 4 * dx], dx))
    dt = longer * step_of(dx)
    water.run(2 * dt, dt)
    begin = process_time()
    water.run(steps * dt, dt)
    return len(points) * steps / (process_time() - begin)


def engine_rate(program: Sequence[str | Path], deck: str, count: int, steps: int, environment: Mapping[str, str], **more: object) -> float:
    """The same of an engine with one of the decks here, without walls; all particles count."""
    dx = 1.0 / count
    given = {"dx": dx, "mass": 1000.0 * dx**3, "h": 1.3 * dx, "skin": 0.26 * dx, "sound": SOUND, "dt": step_of(dx), "steps": steps,
             "stiffness": 1000.0 * SOUND**2 / GAMMA, **more}
    seconds = run_deck(program, deck, given, environment, wall_clock=False)["loop"]
    if not seconds > 0.0:
        raise RunError(f"{steps} steps of {count}^3 particles are too short to be timed", "give more --steps")
    return count**3 * steps / seconds


def pysph_rate(count: int, steps: int) -> float:
    """The same of PySPH; RunError when it fails."""
    words = map(str, (SYSTEM_PYTHON, HERE / "sph_pysph.py", count, steps, SOUND, step_of(1.0 / count)))
    done = call([*words], HERE, os.environ | ONE_THREAD, 3600)
    if done.returncode:
        raise RunError("PySPH did not finish", (done.stderr.strip().splitlines() or ["no output"])[-1])
    found = json.loads(done.stdout.splitlines()[-1])
    return count**3 * int(found["steps"]) / float(found["seconds"])


def subjects(count: int, steps: int) -> dict[str, Callable[[], Sample]]:
    """What is compared, the stock code first; a sample is a rate."""
    ours, clock = find("liggghts"), with_clock()

    def coupled(block: int, ranks: int = 1) -> float:
        launcher: Sequence[str | Path] = ours.launcher(ranks) if ranks > 1 else []
        return engine_rate([*launcher, *clock, ours.executable], "sph_coupled.in", count, steps, ours.environment(), block=block) / ranks

    def own(kernel: str, walls: bool = False, longer: float = 1.0, threads: int = 1) -> float:
        return dembark_rate(count, steps, kernel=kernel, walls=walls, longer=longer, threads=threads)

    found: dict[str, Callable[[], float]] = {
        "stock LIGGGHTS": lambda: engine_rate([*clock, stock_liggghts()], "sph.in", count, steps, os.environ),
        "dembark in LIGGGHTS, cubic spline, delta = 0.1": lambda: coupled(0),
        "dembark in LIGGGHTS with a free body": lambda: coupled(1),
        "dembark, cubic spline, delta = 0.1": lambda: own("cubic_spline"),
        "dembark, Wendland C2, delta = 0.1": lambda: own("wendland_c2"),
        "dembark, Wendland C2, at twice the step": lambda: own("wendland_c2", longer=2.0),
        "dembark, Wendland C2, at twice the step, in a tank": lambda: own("wendland_c2", walls=True, longer=2.0),
    }
    if (os.cpu_count() or 1) > 1:
        found["dembark in LIGGGHTS, cubic spline, delta = 0.1, each of two ranks"] = lambda: coupled(0, ranks=2)
        found["dembark, Wendland C2, delta = 0.1, each of two threads"] = lambda: own("wendland_c2", threads=2)
    if not absent(["lammps"]):
        lammps = find("lammps")
        found["LAMMPS, sph/taitwater"] = lambda: engine_rate([lammps.executable], "sph_lammps.in", count, steps, lammps.environment())
    if subprocess.run([SYSTEM_PYTHON, "-c", "import pysph"], capture_output=True, check=False).returncode == 0:
        found["PySPH, cubic spline, delta = 0.1"] = lambda: pysph_rate(count, steps)
    return {name: lambda take=take: {"rate": take()} for name, take in found.items()}  # type: ignore[misc]


def measure(count: int, steps: int, rounds: int) -> list[dict[str, Any]]:
    """An entry for each subject: its rates (1/s), and their ratios to the stock code of the same round."""
    return frame.summary(frame.in_turn("SPH", subjects(count, steps), rounds), ["rate"])


def run(words: Sequence[str] | None) -> None:
    """Measure, print and write the table."""
    parser = frame.parser("sph", __doc__, rounds=3)
    parser.add_argument("--side", type=int, default=40, help="particles along the side of the cube")
    parser.add_argument("--steps", type=int, default=50)
    given = parser.parse_args(words)
    frame.at_least_one(given, "side", "steps")
    rows, known = measure(given.side, given.steps, given.rounds), frame.facts(side=given.side, steps=given.steps)
    table = frame.markdown(("subject", "particle-steps / s", "over stock"), (
        [row["subject"], frame.spread(row, "rate", ".3g"), frame.spread(row, "rate_ratio", ".2f")] for row in rows))
    frame.write(given.out, "sph", "Particle-steps of SPH in a second", [table], rows, known)


def main(words: Sequence[str] | None = None) -> int:
    """The exit code is 1 when a run failed, 2 when the stock code is missing or an option is wrong."""
    return frame.ended(lambda: run(words))


if __name__ == "__main__":
    sys.exit(main())
