"""Particle-steps per second and core, by number of grains, MPI ranks (LIGGGHTS) and threads (YADE): `python -m benchmarks.mpi_scaling`.

The settled bed of the other benchmarks, periodic sideways; larger ones are the same bed repeated sideways. Every process is bound to
cores of its own. What counts is processor time of the loop over the steps, so that other work on the machine enters little: the
speed-up is what N cores of one's own would do.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace
from functools import partial

import pandas as pd

from benchmarks import frame
from benchmarks.beds import Bed, keep, pinned, run_deck, run_yade, settled_bed, with_clock
from benchmarks.frame import Sample
from dembark.common.errors import DembarkError
from dembark.validation.engines import find

# Grains along a side of the bed's square base are 20; these beds are settled as they are, larger ones are tiles of the largest.
SETTLED = (2500, 20000)
_HEADER = 11
HEADS = ("engine", "grains", "cores", "steps", "particle-steps / (s core)", "least-greatest", "speed-up", "1e6 steps take")
# Work of a sample over that of LIGGGHTS.
_SHARE = {"liggghts": 1.0, "yade": 0.1}


@dataclass(frozen=True)
class Point:
    """Grains in an engine on `cores` cores (ranks or threads), and its timed steps."""

    engine: str
    grains: int
    cores: int
    steps: int

    @property
    def name(self) -> str:
        """For people."""
        return f"{self.engine}, {self.grains} grains, {self.cores} cores"

    def sample(self, relax: int) -> Sample:
        """Processor seconds of a core, and particle-steps per second and core."""
        engine, bed = find(self.engine), bed_of(self.grains)
        if self.engine == "liggghts":
            variables = {**bed.variables, "tangential": "finnie_rabinowicz", "relax": relax, "steps": self.steps}
            # env is the program that mpirun starts, so that only the ranks get the other clock.
            before = ["mpirun", "-np", str(self.cores), "--bind-to", "core"] if self.cores > 1 else pinned()
            seconds = run_deck([*before, *with_clock(), engine.executable], "replay.in", variables, engine.environment())["loop"]
        else:
            seconds = run_yade(engine, bed, "dembark", max(1, relax // 10), self.steps, threads=self.cores)["loop"] / self.cores
        return {"seconds": seconds, "rate": self.grains * self.steps / (seconds * self.cores)}


def tiled(bed: str, times: int) -> str:
    """The data file `bed` of a settled bed, repeated `times` in x and in y; its box has to begin at 0 in both."""
    lines = bed.splitlines()
    count, width = int(lines[2].split()[0]), float(lines[5].split()[1])
    head, rows = lines[:_HEADER], [line.split() for line in lines[_HEADER:] if line.strip()]
    head[2] = f"{count * times * times} atoms"
    head[5], head[6] = (f"0 {width * times:.17g} {axis}lo {axis}hi" for axis in "xy")
    body = [f"{int(own) + (i * times + j) * count} {' '.join(about)} {float(x) + i * width:.17g} {float(y) + j * width:.17g} {z}"
            for i in range(times) for j in range(times) for own, *about, x, y, z in rows]
    return "\n".join([*head, *body]) + "\n"


def bed_of(grains: int) -> Bed:
    """The bed of `grains`."""
    if grains in SETTLED:
        return settled_bed(grains)
    times = round((grains / SETTLED[-1]) ** 0.5)
    if times < 2 or times * times * SETTLED[-1] != grains:
        known = [*SETTLED, *(SETTLED[-1] * k * k for k in (2, 3, 4))]
        raise DembarkError(f"--grains {grains}", "", f"choose among {', '.join(map(str, known))}, ...")
    base = settled_bed(SETTLED[-1])
    target = base.path.with_name(f"{base.path.stem}-{times}x{times}.data")
    if not target.exists():
        keep(target, tiled(base.path.read_text(encoding="utf-8"), times))
    return replace(base, path=target, width=times * base.width)


def rows(points: Iterable[Point], samples: pd.DataFrame) -> list[list[str]]:
    """Cells of the table: medians, with the speed-up over one core of the same engine and bed where that was measured."""
    points, rates = list(points), samples.groupby("subject")["rate"].agg(["median", "min", "max"])
    alone = {(point.engine, point.grains): rates.loc[point.name, "median"] for point in points if point.cores == 1}
    table = []
    for point in points:
        rate, low, high = rates.loc[point.name]
        one = alone.get((point.engine, point.grains))
        table.append([point.engine, str(point.grains), str(point.cores), str(point.steps), f"{rate:.3g}", f"{low:.3g}-{high:.3g}",
                      f"{rate * point.cores / one:.2f}" if one else "", f"{1e6 * point.grains / (rate * point.cores) / 3600:.2g} h"])
    return table


def parsed(words: list[str] | None) -> argparse.Namespace:
    """The options of the command line."""
    cores = len(os.sched_getaffinity(0))
    parser = frame.parser("mpi_scaling", __doc__, rounds=3)
    parser.add_argument("--grains", type=int, nargs="+", default=[2500, 20000], help="2500, 20000, or 20000 times a square")
    parser.add_argument("--cores", type=int, nargs="+", help="ranks (LIGGGHTS) and threads (YADE)",
                        default=[2**k for k in range(cores.bit_length()) if 2**k <= cores])
    parser.add_argument("--engine", choices=list(_SHARE), action="append")
    parser.add_argument("--relax", type=int, default=100, help="steps before the timed ones (a tenth in YADE)")
    parser.add_argument("--work", type=float, default=4e6, help="particle-steps of a sample of LIGGGHTS (a tenth in YADE)")
    given = parser.parse_args(words)
    frame.at_least_one(given, "relax", "work")
    if min(*given.grains, *given.cores) < 1 or max(given.cores) > cores:
        raise DembarkError("--grains or --cores", f"this process may use {cores} cores", "give numbers from 1 on")
    return given


def planned(engines: Iterable[str], grains: Iterable[int], cores: Iterable[int], work: float) -> list[Point]:
    """All points, with as many steps as come to about the same work."""
    return [Point(engine, count, number, max(10, round(work * _SHARE[engine] / count)))
            for engine in engines for count in grains for number in cores]


def measure(given: argparse.Namespace) -> None:
    """Run, print and write the table."""
    points = planned(given.engine or _SHARE, given.grains, sorted(given.cores), given.work)
    known = frame.facts(**{name: find(name).version for name in {point.engine for point in points}})
    samples = frame.in_turn("scaling", {point.name: partial(point.sample, given.relax) for point in points}, given.rounds)
    found = [{**asdict(point), "seconds": samples.loc[samples["subject"] == point.name, "seconds"].tolist()} for point in points]
    frame.write(given.out, "mpi_scaling", "Particle-steps per second and core", [
        f"Processor time, medians of {given.rounds} samples.", frame.markdown(HEADS, rows(points, samples))], found, known)


def main(words: list[str] | None = None) -> int:
    """The exit code is 1 when a run failed, 2 for a mistake of the user."""
    return frame.ended(lambda: measure(parsed(words)))


if __name__ == "__main__":
    sys.exit(main())
