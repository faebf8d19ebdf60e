"""Measure the LCP solver and Siconos's: `python -m benchmarks.lcp`, or `python -m benchmarks.run --only lcp`."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from benchmarks import frame
from benchmarks.frame import HERE, say
from benchmarks.lcp_cases import Problem, certificate, coupled, network, sequence
from dembark.common.errors import DembarkError, RunError
from dembark.physics import LcpResult, LcpSolver, solve_lcp

SYSTEM_PYTHON = "/usr/bin/python3"
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
SIZES = (10, 25, 50, 100, 200, 400, 800)
NETWORKS = (1000, 2000, 5000, 10000, 20000)
PEERS = ("lemke", "newton_min", "pgs")
# What one call of a peer may be expected to take (s), and its matrix, which is always dense, to hold (bytes), so that it is measured.
LONGEST = 100.0
LARGEST = 4 << 30


def siconos_version() -> str | None:
    """Version of the system's Siconos as the package manager names it, None when there is none."""
    try:
        done = subprocess.run([SYSTEM_PYTHON, "-c", "import siconos.numerics"], capture_output=True, check=False, timeout=120)
        if done.returncode:
            return None
        named = subprocess.run(["dpkg-query", "-W", "-f", "${Version}", "python3-siconos"], capture_output=True, text=True, check=False)
    except OSError:
        return "of unknown version" if Path(SYSTEM_PYTHON).exists() else None
    return named.stdout.strip() or "of unknown version"


Row = dict[str, Any]


def own(problem: Problem, clock: Callable[[], float], **how: Any) -> Row:
    """One cold call with all its checks; short ones are repeated until 20 ms are full."""
    count, before = 0, clock()
    while True:
        result = solve_lcp(problem.M, problem.q, **how)
        count += 1
        spent = clock() - before
        if spent > 0.02 or count == 200:
            break
    return {"seconds": spent / count, **_facts(result), "certificate": certificate(problem, result.z)}


def _facts(result: LcpResult) -> Row:
    return {"pivots": result.pivots, "block_steps": result.block_steps, "status": result.status, "active": int(result.active.sum())}


def peer(problem: Problem, name: str, wall: bool) -> Row:
    """One call of a method of Siconos, in a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "problem.npz"
        np.savez(path, M=problem.dense, q=problem.q)
        command = [SYSTEM_PYTHON, str(HERE / "lcp_siconos.py"), str(path), "wall" if wall else "cpu", name]
        done = subprocess.run(command, capture_output=True, text=True, check=False, env={**os.environ, **ONE_THREAD}, timeout=900)
    if done.returncode:
        raise RunError("Siconos", (done.stderr.strip().splitlines() or ["no message"])[-1], "it must find siconos.numerics")
    found = json.loads(done.stdout.strip().splitlines()[-1])[name]
    status = "solved" if found["info"] == 0 else f"info {found['info']}"
    return {"seconds": found["seconds"], "iterations": found["iterations"], "status": status,
            "certificate": certificate(problem, np.array(found["z"]))}


def rows_of(samples: pd.DataFrame, contacts: int) -> list[Row]:
    """An entry for each solver: median and spread of its seconds, and the facts of its last call."""
    found = []
    for (case, solver), own_samples in samples.groupby(["comparison", "subject"], sort=False):
        seconds, last = own_samples["seconds"], own_samples.iloc[-1].drop(["comparison", "subject", "round", "seconds"]).dropna()
        found.append({"case": case, "contacts": contacts, "solver": solver, "median": float(seconds.median()), "min": float(seconds.min()),
                      "max": float(seconds.max()), "samples": len(seconds), **{key: _plain(value) for key, value in last.items()}})
    return found


def _plain(value: Any) -> Any:
    value = value.item() if isinstance(value, np.generic) else value
    return int(value) if isinstance(value, float) and value.is_integer() and value else value


def cold(case: str, problem: Problem, rounds: int, wall: bool, methods: Sequence[str], peers: Sequence[str]) -> list[Row]:
    """A problem from nothing, by dembark's `methods` and by `peers`, in turn."""
    clock = time.perf_counter if wall else time.process_time
    subjects = {f"dembark {name}": partial(own, problem, clock, method=name) for name in methods}
    subjects |= {f"Siconos {name}": partial(peer, problem, name, wall) for name in peers}
    return rows_of(frame.in_turn(f"{case}", subjects, rounds), len(problem.q))


def expected(row: Row, contacts: int) -> float:
    """Seconds of a peer at `contacts` from those at a smaller size: a sweep costs its square, a factorisation its cube."""
    return row["median"] * (contacts / row["contacts"]) ** (2 if row["solver"].endswith("pgs") else 3)


def cold_networks(sizes: Sequence[int], rounds: int, wall: bool, peers: Sequence[str]) -> list[Row]:
    """Sparse planar networks; the peers, which store them dense, once, while they can."""
    rows: list[Row] = []
    going: dict[str, Row | None] = dict.fromkeys(peers)
    for n in sizes:
        problem = network(n)
        rows += cold("network, sparse", problem, rounds, wall, ("auto", "pgs"), ())
        able = [name for name, last in going.items() if 8 * n**2 <= LARGEST and (last is None or expected(last, n) <= LONGEST)]
        found = cold("network, sparse", problem, 1, wall, (), able) if able else []
        going = dict(zip(able, found, strict=True))
        rows += found
    return rows


def warm(contacts: int, steps: int, wall: bool) -> list[Row]:
    """Time steps of a network, each from the last one's active set, with and without the checks of the input."""
    clock = time.perf_counter if wall else time.process_time
    say(f"warm starts, {contacts} contacts: {steps} steps")
    problems, found = sequence(contacts, steps + 1), []
    for check in (True, False):
        solver, rows = LcpSolver(), []
        result = solver.solve(problems[0].M, problems[0].q)
        for step, problem in enumerate(problems[1:]):
            start, before = result.active, clock()
            result = solver.solve(problem.M, problem.q, start=start, check=check)
            rows.append({"seconds": clock() - before, **_facts(result), "moved": int((result.active != start).sum()), "round": step,
                         "certificate": certificate(problem, result.z)})
        samples = pd.DataFrame(rows).assign(comparison="network, warm", subject=f"dembark auto{'' if check else ', unchecked'}")
        mean = {name: float(samples[name].mean()) for name in ("block_steps", "moved")}
        found.append(rows_of(samples, contacts)[0] | mean | {"certificate": float(samples["certificate"].max())})
    return found


# Of the largest problems: case, contacts, solver, the one that it is compared with, and the least ratio, or else the most seconds.
GOALS = (*((case, 800, solver, other, least) for case in ("coupled", "network, stored dense") for solver, other, least in (
             ("dembark auto", "Siconos lemke", 10.0), ("dembark auto", "Siconos pgs", 1.0), ("dembark energy", "Siconos lemke", 2.0))),
         ("network, sparse", 20000, "dembark auto", "", 0.25), ("network, warm", 1000, "dembark auto", "", 1e-3),
         ("network, warm", 1000, "dembark auto, unchecked", "", 1e-3))


def goals(rows: Sequence[Row]) -> list[Row]:
    """What is aimed at, and what came out, where it was measured."""
    found = {(row["case"], row["contacts"], row["solver"]): row["median"] for row in rows}
    result = []
    for case, contacts, solver, other, bound in GOALS:
        mine, its = found.get((case, contacts, solver)), found.get((case, contacts, other), 1.0 if not other else None)
        if mine and its:
            value = its / mine if other else mine
            how = f" faster than {other} by" if other else ", s"
            text = f"{case}, {contacts}: {solver}{how}"
            result.append({"goal": text, "value": value, "bound": bound, "met": bool(value >= bound if other else value <= bound)})
    return result


HEADS = ("problem", "contacts", "solver", "median / ms", "least-greatest / ms", "pivots", "block steps", "certificate", "status")
MISSING = ("Siconos's methods, and the goals that compare with them, are left out: the system's Python has no Siconos "
           "(python3-siconos, not in every release of Debian).")


def cells(row: Mapping[str, Any]) -> list[object]:
    """A row of the table."""
    low, middle, high = (f"{row[which] * 1e3:.3f}" for which in ("min", "median", "max"))
    steps = row.get("block_steps", "")
    return [row["case"], row["contacts"], row["solver"], middle, f"{low}-{high}", row.get("pivots", row.get("iterations", "")),
            f"{steps:.1f}" if isinstance(steps, float) else steps, f"{row['certificate']:.1e}", row["status"]]


def table(rows: Sequence[Row], path: Path) -> None:
    """What the figure shows, as CSV: a row for each problem and solver; seconds, and how many steps of its own kind the solver took."""
    keys = ["case", "contacts", "solver", "median", "min", "max", "samples", "pivots", "block_steps", "iterations", "certificate", "status"]
    counts = dict.fromkeys(("pivots", "block_steps", "iterations"), "Int64")
    kept = pd.DataFrame([row for row in rows if row["case"] != "network, warm"]).reindex(columns=keys).astype(counts)
    kept.to_csv(path, index=False)


def steps_of(row: Row) -> float:
    """Steps of a solver: pivots and block steps of dembark's (sweeps of pgs), iterations of the others."""
    return float(row.get("iterations", row.get("pivots", 0)) + row.get("block_steps", 0))


def plot(rows: Sequence[Row], path: Path) -> None:
    """Time, and below it the steps that it took, against the number of contacts."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    cases = [case for case in ("coupled", "network, stored dense", "network, sparse") if any(row["case"] == case for row in rows)]
    solvers = list(dict.fromkeys(row["solver"] for row in rows if row["case"] in cases))
    colours = {solver: f"C{k}" for k, solver in enumerate(solvers)}
    figure, axes = plt.subplots(2, len(cases), figsize=(4.2 * len(cases), 6.4), squeeze=False, sharex="col", layout="constrained")
    for upper, lower, case in zip(axes[0], axes[1], cases, strict=True):
        for solver in solvers:
            own_rows = sorted((row for row in rows if row["case"] == case and row["solver"] == solver), key=lambda row: row["contacts"])
            if not own_rows:
                continue
            style: dict[str, Any] = {"color": colours[solver], "marker": "x" if solver.startswith("Siconos") else "o", "markersize": 4,
                                     "linestyle": "--" if solver.startswith("Siconos") else "-", "linewidth": 1.2, "label": solver}
            contacts = [row["contacts"] for row in own_rows]
            upper.loglog(contacts, [row["median"] for row in own_rows], **style)
            lower.loglog(contacts, [max(1.0, steps_of(row)) for row in own_rows], **style)
        upper.set(title=case, ylabel="processor time / s")
        lower.set(xlabel="contacts", ylabel="pivots, block steps, sweeps or iterations")
        upper.legend(fontsize=7, frameon=False)
        for axis in (upper, lower):
            axis.grid(alpha=0.3)
    figure.savefig(path, dpi=130, metadata={"Software": None})
    plt.close(figure)


def measure(out: Path, rounds: int, wall: bool, quick: bool = False) -> list[Row]:
    """Run everything, write lcp.json, lcp.md, lcp.csv and lcp.png into `out` and return the goals."""
    version = siconos_version()
    peers = PEERS if version else ()
    known = frame.facts(("numpy",), siconos=version, clock="elapsed time" if wall else "processor time", rounds=rounds)
    rows = []
    for n in SIZES[:3] if quick else SIZES:
        planar = network(n)
        for case, problem in (("coupled", coupled(n)), ("network, stored dense", Problem(planar.dense, planar.q))):
            rows += cold(case, problem, rounds, wall, ("auto", "energy", "block", "murty", "pgs"), peers)
    rows += cold_networks(NETWORKS[:1] if quick else NETWORKS, rounds, wall, peers)
    rows += warm(200 if quick else 1000, 10 if quick else 100, wall)
    asked = goals(rows)
    frame.write(out, "lcp", "The LCP solver and Siconos", [
        "Medians of rounds in turn, one thread, calls from Python with all checks of the input; both to 1e-12.",
        frame.markdown(HEADS, map(cells, rows)), *([] if version else [MISSING]),
        frame.markdown(("goal", "value", "aim", ""), ([one["goal"], f"{one['value']:.3g}", f"{one['bound']:g}",
                                                       "met" if one["met"] else "MISSED"] for one in asked))], rows, known)
    table(rows, out / "lcp.csv")
    plot(rows, out / "lcp.png")
    return asked


def redraw(found: Path, figure: Path) -> None:
    """Draw the lcp.json in the folder `found` again, as `figure` and a CSV file next to it."""
    path = found / "lcp.json"
    try:
        rows = json.loads(path.read_text(encoding="utf-8"))["rows"]
    except (OSError, ValueError, KeyError):
        raise DembarkError("no measurement to draw", str(path), "run python -m benchmarks.lcp first") from None
    table(rows, figure.with_suffix(".csv"))
    plot(rows, figure)


def run(words: list[str] | None) -> None:
    """Measure, or draw again."""
    parser = frame.parser("lcp", __doc__, rounds=5)
    parser.add_argument("--wall-clock", action="store_true", help="elapsed time; default: processor time")
    parser.add_argument("--quick", action="store_true", help="small problems only")
    parser.add_argument("--redraw", action="store_true", help="measure nothing, draw docs/figures/lcp_scaling from --out")
    given = parser.parse_args(words)
    frame.at_least_one(given)
    if given.redraw:
        redraw(given.out, HERE.parent / "docs/figures/lcp_scaling.png")
    else:
        measure(given.out, given.rounds, given.wall_clock, given.quick)


def main(words: list[str] | None = None) -> int:
    """The exit code is 1 when a run failed, 2 when something is missing."""
    return frame.ended(lambda: run(words))


if __name__ == "__main__":
    sys.exit(main())
