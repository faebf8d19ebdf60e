"""Measure coarse graining, compiled and in numpy: `python -m benchmarks.fields`.

One frame of a dense disordered packing (a simple cubic lattice with jitter, three contacts a grain) is spread onto a grid. numpy gets a
share of the contacts and grains, picked at random, for all of them would take minutes; times a contact are compared. Wall time counts, and
processor time beside it, which says what a machine without other work would need at least.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import sys
import time
from collections.abc import Callable, Sequence
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from dembark import _fields
from dembark.common.errors import DembarkError
from dembark.common.files import write_json
from dembark.postproc.contacts import ContactFrame
from dembark.postproc.fields.coarse_graining import coarse_grain
from dembark.postproc.fields.grid import Grid
from dembark.postproc.grains import GrainFrame
from dembark.validation.provenance import commit, cpu, package_version

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


def share(grains: GrainFrame, contacts: ContactFrame, part: float, seed: int = 2) -> tuple[GrainFrame, ContactFrame]:
    """A random `part` of the contacts, with all grains of them and no others."""
    random = np.random.default_rng(seed)
    chosen = np.sort(random.choice(len(contacts.ids), max(1, int(part * len(contacts.ids))), replace=False))
    wanted = np.isin(grains.ids, contacts.ids[chosen])
    kept = ContactFrame(0, contacts.first[chosen], contacts.branch[chosen], contacts.forces[chosen], contacts.ids[chosen])
    return grains.select(wanted), kept


def timed(work: Callable[[], Any]) -> tuple[float, float]:
    """Wall and processor seconds of `work`."""
    wall, processor = time.perf_counter(), time.process_time()
    work()
    return time.perf_counter() - wall, time.process_time() - processor


def row(backend: str, kernel: str, width: float, threads: int, samples: Sequence[tuple[float, float]], contacts: int) -> dict[str, Any]:
    """One line of the table; `width` in diameters."""
    walls, processors = zip(*samples, strict=True)
    wall = statistics.median(walls)
    return {
        "backend": backend, "kernel": kernel, "width": width, "threads": threads, "contacts": contacts, "wall": wall,
        "wall_min": min(walls), "processor": statistics.median(processors), "microseconds_per_contact": 1e6 * wall / contacts,
        "samples": len(samples),
    }  # fmt: skip


def measure(
    edge: int, cells: int, cases: Sequence[tuple[str, float]], rounds: int, part: float, say: Callable[[str], None]
) -> list[dict[str, Any]]:
    """All rows: compiled on one and on all threads, and numpy on a `part` of the contacts."""
    grains, contacts = packing(edge)
    few_grains, few_contacts = share(grains, contacts, part)
    grid = Grid(grains.low, grains.high, (cells,) * 3, (True,) * 3)
    rows = []
    for kernel, width in cases:
        spread = partial(coarse_grain, kernel=kernel, width=width * DIAMETER)
        for threads in sorted({1, len(os.sched_getaffinity(0))}):
            say(f"{kernel}, {width:g} d, compiled on {threads}")
            samples = [timed(partial(spread, grains, contacts, grid, threads=threads)) for _ in range(rounds)]
            rows.append(row("native", kernel, width, threads, samples, len(contacts.ids)))
        say(f"{kernel}, {width:g} d, numpy on {len(few_contacts.ids)} contacts")
        samples = [timed(partial(spread, few_grains, few_contacts, grid, backend="numpy"))]
        rows.append(row("numpy", kernel, width, 1, samples, len(few_contacts.ids)))
    return rows


def table(rows: Sequence[dict[str, Any]]) -> str:
    """The rows as Markdown."""
    lines = ["| kernel | width / d | by | threads | contacts | wall s | processor s | us a contact |", "|---|---|---|---|---|---|---|---|"]
    lines += [
        f"| {one['kernel']} | {one['width']:g} | {one['backend']} | {one['threads']} | {one['contacts']} | {one['wall']:.2f} | "
        f"{one['processor']:.2f} | {one['microseconds_per_contact']:.2f} |" for one in rows]
    return "\n".join(lines)


def main(words: Sequence[str] | None = None) -> int:
    """Run and print; exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.fields", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--edge", type=int, default=100, help="grains along an edge of the cube (100: 1e6 grains, 3e6 contacts)")
    parser.add_argument("--cells", type=int, default=64, help="cells along an edge of the grid")
    parser.add_argument("--rounds", type=int, default=3, help="samples of the compiled code")
    parser.add_argument("--part", type=float, default=0.005, help="share of the contacts that numpy gets")
    parser.add_argument("--out", type=Path, help="a JSON file for the figures")
    given = parser.parse_args(words)
    try:
        if given.edge < 3 or given.cells < 1 or given.rounds < 1 or not 0.0 < given.part <= 1.0:
            raise DembarkError("--edge, --cells, --rounds or --part out of range", "", "edge >= 3, cells >= 1, rounds >= 1, 0 < part <= 1")
        load = os.getloadavg()[0]
        rows = measure(given.edge, given.cells, CASES, given.rounds, given.part, lambda line: print(line, file=sys.stderr))
        facts = {
            "grains": given.edge**3, "contacts": 3 * given.edge**3, "cells": given.cells**3, "cpu": cpu(),
            "cores": len(os.sched_getaffinity(0)), "instruction_set": _fields.instruction_set(), "load": load,
            "load_after": os.getloadavg()[0], **commit(),
            "version": package_version("dembark"), "peak_memory_bytes": 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss,
            "date": datetime.now(UTC).isoformat(timespec="seconds"),
        }  # fmt: skip
        print(table(rows))
        print(", ".join(f"{name} {value}" for name, value in facts.items()))
        if given.out:
            write_json(given.out, {"facts": facts, "rows": rows})
    except DembarkError as error:
        print(f"dembark: {error}", file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
