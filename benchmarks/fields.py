"""Measure coarse graining: `python -m benchmarks.fields`.

One frame of a dense disordered packing (a simple cubic lattice with jitter, three contacts a grain) is spread onto a grid. Wall time
counts; processor time says what a machine without other work would need at least.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Sequence
from functools import partial

import numpy as np
import pandas as pd

from benchmarks import frame
from benchmarks.frame import Sample, spread
from dembark import _fields
from dembark.common.errors import DembarkError
from dembark.postproc.contacts import ContactFrame
from dembark.postproc.fields.coarse_graining import coarse_grain
from dembark.postproc.fields.grid import Grid
from dembark.postproc.grains import GrainFrame

DIAMETER = 0.005
CASES = (("gaussian", 1.5), ("gaussian", 0.75), ("gaussian", 3.0), ("lucy", 3.0), ("heaviside", 2.0))  # widths in diameters


def packing(edge: int, seed: int = 1) -> tuple[GrainFrame, ContactFrame]:
    """`edge`^3 grains in a periodic cube and three contacts for each, in an order without meaning."""
    random = np.random.default_rng(seed)
    axis = (np.arange(edge) + 0.5) * DIAMETER
    place = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    place += random.normal(0.0, 0.1 * DIAMETER, place.shape)
    count, length = len(place), edge * DIAMETER
    place %= length
    number = np.arange(count).reshape(edge, edge, edge)
    pairs = np.concatenate([np.stack([number.ravel(), np.roll(number, -1, way).ravel()], axis=1) for way in range(3)])
    pairs = pairs[random.permutation(len(pairs))]
    branch = place[pairs[:, 1]] - place[pairs[:, 0]]
    branch -= length * np.round(branch / length)
    velocities, omegas = random.normal(size=(2, count, 3))
    grains = GrainFrame(
        step=0, low=np.zeros(3), high=np.full(3, length), periodic=np.ones(3, bool), ids=np.arange(1, count + 1), types=np.ones(count, int),
        positions=place, wrapped=place, velocities=velocities, omegas=omegas, forces=np.zeros((count, 3)),
        radii=np.full(count, 0.5 * DIAMETER), masses=np.full(count, 1.6e-4), wall_forces={},
    )  # fmt: skip
    return grains, ContactFrame(0, place[pairs[:, 0]], branch, random.normal(size=branch.shape), pairs + 1)


def timed(grains: GrainFrame, contacts: ContactFrame, grid: Grid, kernel: str, width: float, **how: object) -> Sample:
    """Wall and processor seconds of one coarse graining, `width` in diameters, and wall time a contact (us)."""
    wall, processor = time.perf_counter(), time.process_time()
    coarse_grain(grains, contacts, grid, kernel=kernel, width=width * DIAMETER, **how)  # type: ignore[arg-type]
    wall = time.perf_counter() - wall
    return {"wall": wall, "processor": time.process_time() - processor, "each": 1e6 * wall / len(contacts.ids)}


def measure(edge: int, cells: int, cases: Sequence[tuple[str, float]], rounds: int) -> pd.DataFrame:
    """Samples of all kernels, on one and on all threads."""
    everything = packing(edge)
    grid = Grid(everything[0].low, everything[0].high, (cells,) * 3, (True,) * 3)
    found = []
    for kernel, width in cases:
        title = f"{kernel}, {width:g} d"
        subjects = {f"{threads} threads": partial(timed, *everything, grid, kernel, width, threads=threads)
                    for threads in sorted({1, len(os.sched_getaffinity(0))})}
        found.append(frame.in_turn(title, subjects, rounds))
    return pd.concat(found, ignore_index=True)


def parsed(words: Sequence[str] | None) -> argparse.Namespace:
    """The options of the command line."""
    parser = frame.parser("fields", __doc__, rounds=3)
    parser.add_argument("--edge", type=int, default=100, help="grains along an edge of the cube (100: 1e6 grains, 3e6 contacts)")
    parser.add_argument("--cells", type=int, default=64, help="cells along an edge of the grid")
    given = parser.parse_args(words)
    frame.at_least_one(given, "cells")
    if given.edge < 3:
        raise DembarkError("--edge is out of range", "", "give at least 3")
    return given


def run(given: argparse.Namespace) -> None:
    """Measure, print and write the table."""
    samples = measure(given.edge, given.cells, CASES, given.rounds)
    rows = frame.summary(samples, ("wall", "processor", "each"))
    known = frame.facts(grains=given.edge**3, contacts=3 * given.edge**3, cells=given.cells**3, instruction_set=_fields.instruction_set())
    table = frame.markdown(("kernel, width", "by", "wall s", "processor s", "us a contact"),
                           ([row["comparison"], row["subject"], *(spread(row, part) for part in ("wall", "processor", "each"))]
                            for row in rows))
    frame.write(given.out, "fields", "Coarse graining", [table], rows, known)


def main(words: Sequence[str] | None = None) -> int:
    """The exit code is 2 when an option is wrong."""
    return frame.ended(lambda: run(parsed(words)))


if __name__ == "__main__":
    sys.exit(main())
