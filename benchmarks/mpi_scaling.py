"""Particle-steps per second and core, by number of grains, MPI ranks (LIGGGHTS) and threads (YADE): `python -m benchmarks.mpi_scaling`.

The settled bed of the other benchmarks, periodic sideways; larger ones are the same bed repeated sideways. Every process is bound to
cores of its own. What counts is processor time of the loop over the steps, so that other work on the machine enters little: the
speed-up is what N cores of one's own would do. Samples are taken in turn, and medians shown.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import statistics
import sys
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from benchmarks.measure import HERE, clock_library, read_log, settled_bed
from dembark.common.errors import DembarkError, RunError
from dembark.common.files import write_json
from dembark.validation.engines import Engine, call, find
from dembark.validation.provenance import collect

ROOT = HERE.parent
# Grains along a side of the bed's square base are 20; these beds are settled as they are, larger ones are tiles of the largest.
SETTLED = (2500, 20000)
_HEADER = 12


@dataclass
class Point:
    """Grains in an engine on `cores` cores (ranks or threads), its timed steps, and samples of the loop's seconds."""

    engine: str
    grains: int
    cores: int
    steps: int
    seconds: list[float] = field(default_factory=list)

    def rates(self) -> list[float]:
        """Particle-steps per second and core of each sample."""
        return [self.grains * self.steps / (seconds * self.cores) for seconds in self.seconds]


def tiled(bed: str, times: int) -> str:
    """The data file `bed` of a settled bed, repeated `times` in x and in y; its box has to begin at 0 in both."""
    lines = bed.splitlines()
    count = int(lines[2].split()[0])
    width = float(lines[5].split()[1])
    rows = [line.split() for line in lines[_HEADER - 1:] if line.strip()]
    head = lines[:_HEADER - 1]
    head[2] = f"{count * times * times} atoms"
    head[5], head[6] = (f"0 {width * times:.17g} {axis}lo {axis}hi" for axis in "xy")
    body = []
    for number, (i, j) in enumerate((i, j) for i in range(times) for j in range(times)):
        for own, kind, diameter, density, x, y, z in rows:
            place = f"{float(x) + i * width:.17g} {float(y) + j * width:.17g} {z}"
            body.append(f"{int(own) + number * count} {kind} {diameter} {density} {place}")
    return "\n".join([*head, *body]) + "\n"


def bed_of(cache: Path, grains: int) -> tuple[Path, float]:
    """Data file of a bed of `grains`, kept in `cache`, and the width of its base (m)."""
    if grains in SETTLED:
        return settled_bed(cache, grains, say).path, 0.1
    times = round((grains / SETTLED[-1]) ** 0.5)
    if times < 2 or times * times * SETTLED[-1] != grains:
        known = [*SETTLED, *(SETTLED[-1] * k * k for k in (2, 3, 4))]
        raise DembarkError(f"--grains {grains}", "", f"choose among {', '.join(map(str, known))}, ...")
    base = settled_bed(cache, SETTLED[-1], say).path
    target = base.with_name(f"{base.stem}-{times}x{times}.data")
    if not target.exists():
        part = target.with_suffix(".part")
        part.write_text(tiled(base.read_text(encoding="utf-8"), times), encoding="utf-8")
        part.replace(target)
    return target, 0.1 * times


def liggghts_seconds(engine: Engine, bed: Path, ranks: int, relax: int, steps: int, library: Path) -> float:
    """Processor time of a rank for `steps` steps of replay.in with friction after Finnie and Rabinowicz."""
    variables = {"bed": bed, "tangential": "finnie_rabinowicz", "relax": relax, "steps": steps}
    words = [str(engine.executable), "-in", str(HERE / "replay.in"), "-log", "log"]
    words += [word for key, value in variables.items() for word in ("-var", key, str(value))]
    # env is the program that mpirun starts, so that only the ranks get the other clock.
    timed = ["env", f"LD_PRELOAD={library}", *words]
    command = ["mpirun", "-np", str(ranks), "--bind-to", "core", *timed] if ranks > 1 else [*_pinned(1), *timed]
    with tempfile.TemporaryDirectory(prefix="dembark-bench-") as name:
        done = call(command, Path(name), engine.environment(), timeout=3600)
        log = Path(name) / "log"
        text = log.read_text(encoding="utf-8", errors="replace") if log.exists() else done.stdout + done.stderr
    if done.returncode:
        raise RunError(f"LIGGGHTS with {ranks} ranks ended with exit code {done.returncode}", (done.stderr or done.stdout)[-300:])
    return read_log(text).loop


def yade_seconds(engine: Engine, bed: Path, width: float, threads: int, relax: int, steps: int) -> float:
    """Processor time of a thread for `steps` steps of yade_bed.py under the same law."""
    words = [*_pinned(threads), str(engine.executable), f"-j{threads}", "-n", "-x", str(HERE / "yade_bed.py")]
    with tempfile.TemporaryDirectory(prefix="dembark-bench-") as name:
        done = call([*words, f"bed={bed}", f"width={width}", "law=dembark", f"relax={relax}", f"steps={steps}", "samples=1"], Path(name),
                    engine.environment(threads), timeout=3600)
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    if done.returncode or not lines:
        raise RunError(f"YADE with {threads} threads ended with exit code {done.returncode}", (done.stderr or done.stdout)[-300:])
    return float(json.loads(lines[-1])["loop"]) / threads


def _pinned(cores: int) -> list[str]:
    chosen = sorted(os.sched_getaffinity(0))[-cores:]
    return ["taskset", "--cpu-list", ",".join(map(str, chosen))] if shutil.which("taskset") else []


def say(line: str) -> None:
    """Tell on stderr what goes on."""
    print(f"dembark: {line}", file=sys.stderr, flush=True)


def measure(points: Sequence[Point], cache: Path, rounds: int, relax: int) -> None:
    """Take `rounds` samples of every point, in turn."""
    library = clock_library(cache)
    for turn in range(rounds):
        for point in points if turn % 2 == 0 else reversed(points):
            engine, (bed, width) = find(point.engine), bed_of(cache, point.grains)
            say(f"round {turn + 1} of {rounds}: {point.engine}, {point.grains} grains, {point.cores} cores")
            if point.engine == "liggghts":
                seconds = liggghts_seconds(engine, bed, point.cores, relax, point.steps, library)
            else:
                seconds = yade_seconds(engine, bed, width, point.cores, max(1, relax // 10), point.steps)
            point.seconds.append(seconds)


HEADS = ["engine", "grains", "cores", "steps", "particle-steps / (s core)", "least-greatest", "speed-up", "1e6 steps take"]


def rows(points: Iterable[Point]) -> list[list[str]]:
    """Cells of the table: medians, with the speed-up over one core of the same engine and bed where that was measured."""
    points = list(points)
    alone = {(point.engine, point.grains): statistics.median(point.rates()) for point in points if point.cores == 1}
    table = []
    for point in points:
        rates = point.rates()
        rate = statistics.median(rates)
        one = alone.get((point.engine, point.grains))
        hours = 1e6 * point.grains / (rate * point.cores) / 3600
        speed_up = f"{rate * point.cores / one:.2f}" if one else ""
        table.append([point.engine, str(point.grains), str(point.cores), str(point.steps), f"{rate:.3g}",
                      f"{min(rates):.3g}-{max(rates):.3g}", speed_up, f"{hours:.2g} h"])
    return table


def markdown(points: Iterable[Point], facts: dict[str, object]) -> str:
    """The table with what it was measured on."""
    lines = ["| " + " | ".join(HEADS) + " |", "|" + " --- |" * len(HEADS), *("| " + " | ".join(row) + " |" for row in rows(points))]
    load = f"load {facts['load']:.1f} before and {facts['load_after']:.1f} after"
    machine = f"{facts['date']}, {facts['cpu']}, {facts['cores']} cores, {load}"
    return "\n".join([*lines, "", f"Processor time, medians of {facts['rounds']} samples. {machine}.", ""])


def parsed(words: list[str] | None) -> argparse.Namespace:
    """The options of the command line; ends the program when one is wrong."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.mpi_scaling", description=__doc__)
    cores = len(os.sched_getaffinity(0))
    parser.add_argument("--grains", type=int, nargs="+", default=[2500, 20000], help="2500, 20000, or 20000 times a square")
    powers = [2**k for k in range(cores.bit_length()) if 2**k <= cores]
    parser.add_argument("--cores", type=int, nargs="+", help="ranks (LIGGGHTS) and threads (YADE)", default=powers)
    parser.add_argument("--engine", choices=["liggghts", "yade"], action="append")
    parser.add_argument("--rounds", type=int, default=3, help="samples of each")
    parser.add_argument("--relax", type=int, default=100, help="steps before the timed ones (a tenth in YADE)")
    parser.add_argument("--work", type=float, default=4e6, help="particle-steps of a sample of LIGGGHTS (a tenth in YADE)")
    parser.add_argument("--out", type=Path, default=ROOT / "results/bench", help="folder of mpi_scaling.json and .md")
    given = parser.parse_args(words)
    if min(*given.grains, *given.cores, given.rounds, given.relax, given.work) < 1:
        raise DembarkError("--grains, --cores, --rounds, --relax and --work", "", "give numbers from 1 on")
    if max(given.cores) > cores:
        raise DembarkError(f"--cores {max(given.cores)}", f"this process may use {cores}", "")
    return given


def planned(engines: Sequence[str], grains: Sequence[int], cores: Sequence[int], work: float) -> list[Point]:
    """All points, with as many steps as come to about the same work."""
    share = {"liggghts": 1.0, "yade": 0.1}
    return [Point(engine, count, number, max(10, round(work * share[engine] / count)))
            for engine in engines for count in grains for number in cores]


def main(words: list[str] | None = None) -> int:
    """Measure, print and write the table; exit code 1 when a run failed, 2 for a mistake of the user."""
    try:
        given = parsed(words)
        cache = ROOT / "build/bench"
        cache.mkdir(parents=True, exist_ok=True)
        points = planned(given.engine or ["liggghts", "yade"], given.grains, sorted(given.cores), given.work)
        facts = {**collect(find(points[0].engine)), "date": datetime.now(UTC).isoformat(timespec="seconds"), "rounds": given.rounds,
                 "load": os.getloadavg()[0]}
        measure(points, cache, given.rounds, given.relax)
        facts["load_after"] = os.getloadavg()[0]
        given.out.mkdir(parents=True, exist_ok=True)
        write_json(given.out / "mpi_scaling.json", {"points": [asdict(point) for point in points], "provenance": facts})
        text = markdown(points, facts)
        (given.out / "mpi_scaling.md").write_text(text, encoding="utf-8")
    except DembarkError as error:
        say(str(error))
        return error.exit_code
    print(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
