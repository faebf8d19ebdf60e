"""Reading a text dump: dembark and MDAnalysis's LAMMPSDUMP, numpy.loadtxt and numpy.fromstring, on the same file in turn.

`python -m benchmarks.dump_parsing` prints and writes medians and the ratios to MDAnalysis of the same round. Every sample is taken in a
process of its own, whose peak of memory above its start is measured too; its numbers must be those that were written.
"""

from __future__ import annotations

import argparse
import io
import itertools
import multiprocessing
import sys
import tempfile
import time
import warnings
from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from MDAnalysis.coordinates.LAMMPS import DumpReader

from benchmarks import frame
from benchmarks.frame import Sample, spread
from dembark.common.errors import DembarkError
from dembark.postproc import GrainsDump, TextDump, universe

COLUMNS = "id type x y z ix iy iz vx vy vz omegax omegay omegaz fx fy fz radius mass"
# The words of the decks' dump commands.
FORMAT = "%d %d %.10g %.10g %.10g %d %d %d " + "%.7g " * 9 + "%.9g %.9g "
REFERENCE = "MDAnalysis LAMMPSDUMP"
GOAL = 10.0


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
    """TextDump, which indexes the frames first."""
    return sum(float(raw.values[:, 2].sum()) for raw in TextDump(path))


def by_stream(path: Path) -> float:
    """TextDump without an index."""
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
    sender.send({"elapsed": time.perf_counter() - start, "processor": time.process_time() - used,
                 "memory": max(_memory("VmHWM") - before, 0.0), "checksum": checksum})


def sample(name: str, path: Path, expected: float) -> Sample:
    """One reading in a process of its own: seconds elapsed and of processor time, peak of memory above the start (MB); DembarkError when
    its numbers are not those `expected`."""
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    child = context.Process(target=_measure, args=(name, path, sender))
    child.start()
    sender.close()
    try:
        found: dict[str, float] = receiver.recv()
    except EOFError:
        raise DembarkError(f"{name} did not read {path}") from None
    finally:
        child.join()
    # MDAnalysis keeps single precision.
    if not abs(found["checksum"] - expected) <= 1e-6 * abs(expected):
        raise DembarkError(f"{name} reads other numbers", f"their sum is {found['checksum']:.9g} instead of {expected:.9g}")
    return found


HEADS = ("reader", "elapsed / s", "MB/s", "times as fast", "processor / s", "times as fast (processor)", "peak memory / MB",
         f"goal {GOAL:g} x")


def cells(row: Mapping[str, Any], megabytes: float) -> list[str]:
    """A row of the table."""
    fast = [f"{1.0 / row[f'{clock}_ratio_median']:.3g} ({1.0 / row[f'{clock}_ratio_max']:.3g}-{1.0 / row[f'{clock}_ratio_min']:.3g})"
            for clock in ("elapsed", "processor")]
    return [row["subject"], spread(row, "elapsed"), f"{megabytes / row['elapsed_median']:.3g}", fast[0], spread(row, "processor"), fast[1],
            f"{row['memory_max']:.0f}", {True: "met", False: "MISSED", None: ""}[met(row)]]


def met(row: Mapping[str, Any]) -> bool | None:
    """Whether a subject with a goal reaches it."""
    return 1.0 / row["elapsed_ratio_median"] >= GOAL if row["subject"].startswith("dembark TextDump") else None


def parsed(words: list[str] | None) -> argparse.Namespace:
    """The options of the command line."""
    parser = frame.parser("dump_parsing", __doc__, rounds=3)
    parser.add_argument("--grains", type=int, default=50000, help="grains in a frame (default %(default)s)")
    parser.add_argument("--frames", type=int, default=3, help="frames (default %(default)s)")
    given = parser.parse_args(words)
    frame.at_least_one(given, "grains", "frames")
    return given


def measure(given: argparse.Namespace) -> int:
    """Run, print and write the table; 1 when a goal is missed."""
    with tempfile.TemporaryDirectory(prefix="dembark-") as folder:
        path = Path(folder) / "grains.dump"
        expected = write_dump(path, given.grains, given.frames)
        size = path.stat().st_size / 1e6
        samples = frame.in_turn("dump", {name: partial(sample, name, path, expected) for name in SUBJECTS}, given.rounds)
    rows = frame.summary(samples, ("elapsed", "processor", "memory"))
    frame.write(given.out, "dump_parsing", "Reading a text dump", [
        f"{given.frames} frames of {given.grains} grains, {size:.0f} MB; median (least-greatest) of {given.rounds} rounds.",
        frame.markdown(HEADS, (cells(row, size) for row in rows))], rows, frame.facts(("MDAnalysis", "numpy")))
    return int(any(met(row) is False for row in rows))


def main(words: list[str] | None = None) -> int:
    """The exit code is 1 when the goal is missed, 2 when an option is wrong."""
    return frame.ended(lambda: measure(parsed(words)))


if __name__ == "__main__":
    sys.exit(main())
