"""Reading a text dump: dembark beside MDAnalysis's LAMMPSDUMP, numpy.loadtxt and numpy.fromstring, on the same file in turn.

`python -m benchmarks.dump_parsing` prints and writes medians and the ratios to MDAnalysis of the same round. Every sample is taken in a
process of its own, whose peak of memory above its start is told too; its numbers must be those that were written.
"""

from __future__ import annotations

import argparse
import io
import itertools
import multiprocessing
import os
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import MDAnalysis
import numpy as np
from MDAnalysis.coordinates.LAMMPS import DumpReader
from rich.console import Console
from rich.table import Table

from benchmarks.measure import spread
from dembark.common.errors import DembarkError
from dembark.common.files import write_json
from dembark.postproc import GrainsDump, TextDump, universe

ROOT = Path(__file__).resolve().parents[1]
COLUMNS = "id type x y z ix iy iz vx vy vz omegax omegay omegaz fx fy fz radius mass"
# The words of the decks' dump commands.
FORMAT = "%d %d %.10g %.10g %.10g %d %d %d " + "%.7g " * 9 + "%.9g %.9g "
REFERENCE = "MDAnalysis LAMMPSDUMP"
GOAL = 10.0


@dataclass(frozen=True)
class Sample:
    """Seconds elapsed and of processor time, peak of memory above the start (MB), and what was read."""

    elapsed: float
    processor: float
    memory: float
    checksum: float


def write_dump(path: Path, grains: int, frames: int) -> float:
    """A dump as dembark's decks write it; the sum of all x, which every reader has to find."""
    random, total = np.random.default_rng(1), 0.0
    with path.open("w", encoding="ascii") as file:
        for step in range(frames):
            table = np.column_stack([
                np.arange(1, grains + 1), np.ones(grains), random.uniform(0.0, 1.0, (grains, 3)), np.zeros((grains, 3)),
                random.normal(0.0, 0.1, (grains, 3)), random.normal(0.0, 9.0, (grains, 3)), random.normal(0.0, 1e-3, (grains, 3)),
                random.uniform(0.002, 0.003, grains), random.uniform(1e-4, 2e-4, grains),
            ])
            file.write(f"ITEM: TIMESTEP\n{step * 1000}\nITEM: NUMBER OF ATOMS\n{grains}\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\n")
            file.write(f"ITEM: ATOMS {COLUMNS} \n")
            np.savetxt(file, table, fmt=FORMAT)
            total += sum(float(f"{value:.10g}") for value in table[:, 2])
    return total


def _blocks(path: Path) -> Iterator[str]:
    """The rows of each frame as one string."""
    with path.open(encoding="ascii") as file:
        while head := list(itertools.islice(file, 9)):
            yield "".join(itertools.islice(file, int(head[3])))


def by_text_dump(path: Path) -> float:
    """The reader of whole files."""
    return sum(float(raw.values[:, 2].sum()) for raw in TextDump(path))


def by_stream(path: Path) -> float:
    """The reader that holds one frame at a time."""
    return sum(float(raw.values[:, 2].sum()) for raw in TextDump(path, stream=True))


def by_grains_dump(path: Path) -> float:
    """Frames of grains, with positions made absolute and units known."""
    return sum(float(frame.positions[:, 0].sum()) for frame in GrainsDump(path))


def by_universe(path: Path) -> float:
    """dembark's reader inside MDAnalysis."""
    return sum(float(step.positions[:, 0].astype(float).sum()) for step in universe(path).trajectory)


def by_mdanalysis(path: Path) -> float:
    """MDAnalysis's own reader, which takes positions only."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return sum(float(step.positions[:, 0].astype(float).sum()) for step in DumpReader(str(path)))


def by_mdanalysis_columns(path: Path) -> float:
    """MDAnalysis's own reader with all columns."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return sum(float(step.positions[:, 0].astype(float).sum()) for step in DumpReader(str(path), additional_columns=True))


def by_loadtxt(path: Path) -> float:
    """numpy.loadtxt, frame by frame."""
    return sum(float(np.loadtxt(io.StringIO(block))[:, 2].sum()) for block in _blocks(path))


def by_fromstring(path: Path) -> float:
    """numpy.fromstring, frame by frame."""
    return sum(float(np.fromstring(block, sep=" ").reshape(-1, len(COLUMNS.split()))[:, 2].sum()) for block in _blocks(path))


SUBJECTS: dict[str, Callable[[Path], float]] = {
    REFERENCE: by_mdanalysis,
    "MDAnalysis LAMMPSDUMP, all columns": by_mdanalysis_columns,
    "numpy.loadtxt": by_loadtxt,
    "numpy.fromstring": by_fromstring,
    "dembark TextDump": by_text_dump,
    "dembark TextDump, stream": by_stream,
    "dembark GrainsDump": by_grains_dump,
    "dembark universe": by_universe,
}


def _memory(key: str) -> float:
    """A line of /proc/self/status in MB."""
    lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    return next(float(line.split()[1]) for line in lines if line.startswith(key)) / 1024.0


def _measure(name: str, path: Path, sender: multiprocessing.connection.Connection) -> None:
    # "5" sets the peak back to what is in use.
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")
    before, start, used = _memory("VmRSS"), time.perf_counter(), time.process_time()
    checksum = SUBJECTS[name](path)
    sender.send(Sample(time.perf_counter() - start, time.process_time() - used, max(_memory("VmHWM") - before, 0.0), checksum))


def sample(name: str, path: Path) -> Sample:
    """One reading in a process of its own."""
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    child = context.Process(target=_measure, args=(name, path, sender))
    child.start()
    sender.close()
    try:
        return receiver.recv()
    except EOFError:
        raise DembarkError(f"{name} did not read {path}") from None
    finally:
        child.join()


def measure(path: Path, expected: float, rounds: int, say: Callable[[str], None]) -> dict[str, list[Sample]]:
    """`rounds` samples of every subject, in turn; DembarkError when one reads other numbers."""
    samples: dict[str, list[Sample]] = {name: [] for name in SUBJECTS}
    for number in range(rounds):
        # Every second round runs backwards, so that a machine that slows down steadily favours nobody.
        for name in list(SUBJECTS)[:: 1 if number % 2 == 0 else -1]:
            say(f"round {number + 1} of {rounds}: {name}")
            one = sample(name, path)
            # MDAnalysis keeps single precision.
            if not abs(one.checksum - expected) <= 1e-6 * abs(expected):
                raise DembarkError(f"{name} reads other numbers", f"their sum is {one.checksum:.9g} instead of {expected:.9g}")
            samples[name].append(one)
    return samples


def rows(samples: dict[str, list[Sample]], megabytes: float) -> list[dict[str, Any]]:
    """One entry a subject: times, how many times faster than the reference in the same round, peak of memory."""
    found = []
    for name, own in samples.items():
        row: dict[str, Any] = {"subject": name, "memory": max(one.memory for one in own)}
        for clock in ("elapsed", "processor"):
            times = [getattr(one, clock) for one in own]
            row[clock] = spread(times)
            row[f"{clock}_ratio"] = spread([getattr(other, clock) / one for one, other in zip(times, samples[REFERENCE], strict=True)])
        row["speed"] = megabytes / row["elapsed"]["median"]
        row["met"] = row["elapsed_ratio"]["median"] >= GOAL if name.startswith("dembark TextDump") else None
        found.append(row)
    return found


HEADS = ["reader", "elapsed / s", "MB/s", "times as fast", "processor / s", "times as fast (processor)", "peak memory / MB",
         f"goal {GOAL:g} x"]


def texts(row: dict[str, Any]) -> list[str]:
    """Cells of a row as a reader wants them."""
    def ratio(clock: str) -> str:
        part = row[f"{clock}_ratio"]
        return f"{part['median']:.3g} ({part['min']:.3g}-{part['max']:.3g})"

    goal = "" if row["met"] is None else "met" if row["met"] else "MISSED"
    return [row["subject"], f"{row['elapsed']['median']:.3f}", f"{row['speed']:.3g}", ratio("elapsed"), f"{row['processor']['median']:.3f}",
            ratio("processor"), f"{row['memory']:.0f}", goal]


def parsed(words: list[str] | None) -> argparse.Namespace:
    """The options of the command line; ends the program when one is wrong."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.dump_parsing", description=__doc__.splitlines()[0])
    parser.add_argument("--grains", type=int, default=50000, help="grains in a frame (default %(default)s)")
    parser.add_argument("--frames", type=int, default=3, help="frames (default %(default)s)")
    parser.add_argument("--rounds", type=int, default=3, help="samples of each reader (default %(default)s)")
    parser.add_argument("--out", type=Path, default=ROOT / "results/bench", help="folder of dump_parsing.json")
    given = parser.parse_args(words)
    if min(given.grains, given.frames, given.rounds) < 1:
        raise DembarkError("--grains, --frames and --rounds", "", "give whole numbers from 1 on")
    return given


def main(words: list[str] | None = None) -> int:
    """Run, print and write the table; the exit code is 1 when the goal is missed, 2 when an option is wrong."""
    console = Console(width=None if sys.stdout.isatty() else 160)
    try:
        given = parsed(words)
        with tempfile.TemporaryDirectory(prefix="dembark-") as folder:
            path = Path(folder) / "grains.dump"
            expected = write_dump(path, given.grains, given.frames)
            size = path.stat().st_size / 1e6
            found = rows(measure(path, expected, given.rounds, lambda line: print(line, file=sys.stderr)), size)
    except DembarkError as error:
        print(error, file=sys.stderr)
        return error.exit_code
    what = f"{given.frames} frames of {given.grains} grains, {size:.0f} MB; median (least-greatest) of {given.rounds} rounds"
    table = Table(*HEADS, title=what)
    for row in found:
        table.add_row(*texts(row))
    console.print(table)
    given.out.mkdir(parents=True, exist_ok=True)
    facts = {"date": datetime.now(UTC).isoformat(timespec="seconds"), "cores": os.cpu_count(), "load": os.getloadavg()[0],
             "grains": given.grains, "frames": given.frames, "megabytes": size,
             "mdanalysis": MDAnalysis.__version__, "numpy": np.__version__}
    write_json(given.out / "dump_parsing.json", {"rows": found, "provenance": facts})
    return 0 if all(row["met"] is not False for row in found) else 1


if __name__ == "__main__":
    sys.exit(main())
