"""Particle-steps a second of the SPH solver and of `pair_style sph/coupled`, beside stock LIGGGHTS, LAMMPS and PySPH on one cube of water,
in processor time of one core. LAMMPS and PySPH are left out where they are not installed.

`python -m benchmarks.sph` samples in turn, prints and writes medians. All have h = 1.3 dx, artificial viscosity and the same step, all but
LAMMPS the cubic spline; dembark diffuses the density, too, and computes densities and forces in two loops over all pairs. It is measured
with Wendland's kernel as well, at the step that it usually takes, in a tank, whose walls are particles, and with a free body in the middle.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.lcp import ONE_THREAD, SYSTEM_PYTHON
from benchmarks.measure import HERE, clock_library, read_lammps, read_log, stock_liggghts
from dembark.common.errors import DembarkError, RunError
from dembark.common.files import write_json
from dembark.physics.sph import SphFluid, lattice, tank_walls
from dembark.validation.engines import absent, find

ROOT = Path(__file__).resolve().parents[1]
SOUND, GAMMA = 40.0, 7.0
GOAL = 2.0  # of the rate over that of the stock code


def step_of(dx: float) -> float:
    """0.2 h/(c + c/10), s: stock LIGGGHTS is not stable much beyond it."""
    return 0.2 * 1.3 * dx / (1.1 * SOUND)


def dembark_rate(count: int, steps: int, *, kernel: str, walls: bool, longer: float = 1.0) -> float:
    """Particle-steps a second (processor time) of the fluid in a cube of `count` particles a side; `longer`: than the stock code's step."""
    dx = 1.0 / count
    points = lattice([0, 0, 0], [1, 1, 1], dx)
    water = SphFluid(points, spacing=dx, sound_speed=SOUND, gravity=[0, 0, -9.81], kernel=kernel, gamma=GAMMA,
                     pressure=9810.0 * (1.0 - points[:, 2]) if walls else 0.0)
    if walls:
        water.add_wall(tank_walls([0, 0, 0], [1, 1, 1 + 4 * dx], dx))
    dt = longer * step_of(dx)
    water.run(2 * dt, dt)
    begin = time.process_time()
    water.run(steps * dt, dt)
    return len(points) * steps / (time.process_time() - begin)


def engine_rate(program: Path, deck: str, count: int, steps: int, environment: Mapping[str, str], **more: object) -> float:
    """The same of an engine with one of the decks here, without walls; all particles count."""
    dx = 1.0 / count
    given = {"dx": dx, "mass": 1000.0 * dx**3, "h": 1.3 * dx, "skin": 0.26 * dx, "sound": SOUND, "dt": step_of(dx), "steps": steps,
             "stiffness": 1000.0 * SOUND**2 / GAMMA, **more}
    words = [str(program), "-in", str(HERE / deck), "-log", "log",
             *(word for key, value in given.items() for word in ("-var", key, repr(value)))]
    with tempfile.TemporaryDirectory(prefix="dembark-bench-") as name:
        done = subprocess.run(words, cwd=name, env=dict(environment), capture_output=True, text=True, errors="replace",
                              stdin=subprocess.DEVNULL, check=False)
        log = Path(name) / "log"
        text = log.read_text(encoding="utf-8", errors="replace") if log.exists() else done.stdout + done.stderr
        if done.returncode:
            raise RunError(f"{program.name} ended with exit code {done.returncode} in {deck}", (text.strip().splitlines() or [""])[-1])
        sample = read_lammps(text, wall_clock=False) if deck == "sph_lammps.in" else read_log(text)
    if not sample.loop > 0.0:
        raise RunError(f"{steps} steps of {count}^3 particles are too short to be timed", "give more --steps")
    return count**3 * steps / sample.loop


def pysph_rate(count: int, steps: int) -> float:
    """The same of PySPH; RunError when it fails."""
    words = [SYSTEM_PYTHON, str(HERE / "sph_pysph.py"), str(count), str(steps), str(SOUND), repr(step_of(1.0 / count))]
    with tempfile.TemporaryDirectory(prefix="dembark-bench-") as name:
        done = subprocess.run(words, cwd=name, env=dict(os.environ) | ONE_THREAD, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RunError("PySPH did not finish", (done.stderr.strip().splitlines() or ["it says nothing"])[-1])
    found = json.loads(done.stdout.splitlines()[-1])
    return count**3 * int(found["steps"]) / float(found["seconds"])


def measure(count: int, steps: int, rounds: int, cache: Path, say: Callable[[str], None]) -> list[dict[str, Any]]:
    """One entry a subject: its rates (1/s), their median, and the median ratio to the stock code of the same round."""
    ours, clock = find("liggghts"), {"LD_PRELOAD": str(clock_library(cache))}

    def coupled(block: int) -> float:
        return engine_rate(ours.executable, "sph_coupled.in", count, steps, ours.environment() | clock, block=block)

    subjects: dict[str, Callable[[], float]] = {
        "stock LIGGGHTS": lambda: engine_rate(stock_liggghts(), "sph.in", count, steps, os.environ | clock),
        "dembark in LIGGGHTS, cubic spline, delta = 0.1": lambda: coupled(0),
        "dembark in LIGGGHTS with a free body": lambda: coupled(1),
        "dembark, cubic spline, delta = 0.1": lambda: dembark_rate(count, steps, kernel="cubic_spline", walls=False),
        "dembark, Wendland C2, delta = 0.1": lambda: dembark_rate(count, steps, kernel="wendland_c2", walls=False),
        "dembark, Wendland C2, at twice the step":
            lambda: dembark_rate(count, steps, kernel="wendland_c2", walls=False, longer=2.0),
        "dembark, Wendland C2, at twice the step, in a tank":
            lambda: dembark_rate(count, steps, kernel="wendland_c2", walls=True, longer=2.0),
    }
    if not absent(["lammps"]):
        lammps = find("lammps")
        subjects["LAMMPS, sph/taitwater"] = lambda: engine_rate(lammps.executable, "sph_lammps.in", count, steps, lammps.environment())
    if subprocess.run([SYSTEM_PYTHON, "-c", "import pysph"], capture_output=True, check=False).returncode == 0:
        subjects["PySPH, cubic spline, delta = 0.1"] = lambda: pysph_rate(count, steps)
    rates: dict[str, list[float]] = {name: [] for name in subjects}
    for turn in range(rounds):
        for name, take in subjects.items():
            say(f"round {turn + 1} of {rounds}: {name}")
            rates[name].append(take())
    first = np.array(rates["stock LIGGGHTS"])
    return [{"subject": name, "rates": found, "rate": statistics.median(found), "ratio": float(np.median(np.array(found) / first))}
            for name, found in rates.items()]


def main() -> int:
    """Exit code 1 and a line when the stock code is missing or fails."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--side", type=int, default=40, help="particles along the side of the cube")
    parser.add_argument("--steps", type=int, default=50)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--out", type=Path, default=ROOT / "build/bench/sph.json")
    given = parser.parse_args()
    given.out.parent.mkdir(parents=True, exist_ok=True)
    try:
        rows = measure(given.side, given.steps, given.rounds, given.out.parent, lambda line: print(line, file=sys.stderr))
    except DembarkError as error:
        print(f"dembark: {error}", file=sys.stderr)
        return 1
    write_json(given.out, {"side": given.side, "steps": given.steps, "goal": GOAL, "rows": rows})
    for row in rows:
        print(f"{row['subject']:52} {row['rate'] / 1e6:6.2f} million particle-steps/s, {row['ratio']:5.2f} of stock")
    return 0


if __name__ == "__main__":
    sys.exit(main())
