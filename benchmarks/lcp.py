"""Measure the LCP solver beside Siconos's: `python -m benchmarks.lcp`, or `python -m benchmarks.run --only lcp`."""

from __future__ import annotations

import argparse
import csv
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.lcp_cases import Problem, certificate, coupled, network, sequence
from dembark.common.errors import DembarkError, RunError
from dembark.common.files import write_json
from dembark.physics import LcpResult, LcpSolver, solve_lcp
from dembark.validation.provenance import commit, cpu, package_version

HERE = Path(__file__).parent
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


class Row:
    """The samples of one solver on one problem."""

    def __init__(self, case: str, contacts: int, solver: str) -> None:
        self.case, self.contacts, self.solver = case, contacts, solver
        self.seconds: list[float] = []
        self.facts: dict[str, Any] = {}

    def summary(self) -> dict[str, Any]:
        """Median and spread, ready for JSON."""
        return {"case": self.case, "contacts": self.contacts, "solver": self.solver, "median": statistics.median(self.seconds),
                "min": min(self.seconds), "max": max(self.seconds), "samples": len(self.seconds), **self.facts}


def own(problem: Problem, clock: Callable[[], float], row: Row, **how: Any) -> LcpResult:
    """One cold call with all its checks; short ones are repeated until 20 ms are full."""
    count, before = 0, clock()
    while True:
        result = solve_lcp(problem.M, problem.q, **how)
        count += 1
        spent = clock() - before
        if spent > 0.02 or count == 200:
            break
    row.seconds.append(spent / count)
    row.facts = {"pivots": result.pivots, "block_steps": result.block_steps, "islands": result.islands,
                 "used_fallback": result.used_fallback, "status": result.status, "active": int(result.active.sum()),
                 "certificate": certificate(problem, result.z)}
    return result


def peers(problem: Problem, rows: dict[str, Row], wall: bool) -> None:
    """One process with Siconos that runs its methods once each."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "problem.npz"
        dense = problem.M if isinstance(problem.M, np.ndarray) else problem.M.toarray()
        np.savez(path, M=dense, q=problem.q)
        command = [SYSTEM_PYTHON, str(HERE / "lcp_siconos.py"), str(path), "wall" if wall else "cpu", *rows]
        done = subprocess.run(command, capture_output=True, text=True, check=False, env={**os.environ, **ONE_THREAD}, timeout=900)
    if done.returncode:
        lines = done.stderr.strip().splitlines() or ["no message"]
        raise RunError("Siconos", lines[-1], "run the command by hand: it must find siconos.numerics")
    for name, found in json.loads(done.stdout.strip().splitlines()[-1]).items():
        rows[name].seconds.append(found["seconds"])
        rows[name].facts = {"iterations": found["iterations"], "status": "solved" if found["info"] == 0 else f"info {found['info']}",
                            "certificate": certificate(problem, np.array(found["z"]))}


def beside(case: str, problem: Problem, rounds: int, wall: bool, with_peers: bool, say: Callable[[str], None]) -> list[dict[str, Any]]:
    """A dense problem, dembark's methods and Siconos's in turn; every second round the other way round."""
    clock = time.perf_counter if wall else time.process_time
    n = len(problem.q)
    mine = {name: Row(case, n, f"dembark {name}") for name in ("auto", "energy", "block", "murty", "pgs")}
    theirs = {name: Row(case, n, f"Siconos {name}") for name in PEERS}
    say(f"{case}, {n} contacts: {rounds} rounds")
    for turn in range(rounds):
        tasks: list[Callable[[], object]] = [partial(own, problem, clock, row, method=name) for name, row in mine.items()]
        if with_peers:
            tasks.append(partial(peers, problem, theirs, wall))
        for task in tasks if turn % 2 == 0 else reversed(tasks):
            task()
    return [row.summary() for row in [*mine.values(), *theirs.values()] if row.seconds]


def expected(row: dict[str, Any], contacts: int) -> float:
    """Seconds of a peer at `contacts` from those at a smaller size: a sweep costs its square, a factorisation its cube."""
    return row["median"] * (contacts / row["contacts"]) ** (2 if row["solver"].endswith("pgs") else 3)


def cold_networks(sizes: tuple[int, ...], rounds: int, wall: bool, with_peers: bool, say: Callable[[str], None]) -> list[dict[str, Any]]:
    """Sparse planar networks from nothing: checks, islands, order, answer; the peers, which store them dense, once, while they can."""
    clock = time.perf_counter if wall else time.process_time
    rows: list[dict[str, Any]] = []
    going: dict[str, dict[str, Any] | None] = dict.fromkeys(PEERS if with_peers else ())
    for n in sizes:
        say(f"sparse network, {n} contacts: {rounds} rounds")
        problem = network(n)
        pair = {name: Row("network, sparse", n, f"dembark {name}") for name in ("auto", "pgs")}
        for _ in range(rounds):
            for name, row in pair.items():
                own(problem, clock, row, method=name)
        rows += [row.summary() for row in pair.values()]
        going = {name: last for name, last in going.items()
                 if 8 * n**2 <= LARGEST and (last is None or expected(last, n) <= LONGEST)}
        theirs = {name: Row("network, sparse", n, f"Siconos {name}") for name in going}
        if theirs:
            say(f"sparse network, {n} contacts, stored dense: Siconos {', '.join(theirs)}")
            peers(problem, theirs, wall)
        found = {name: row.summary() for name, row in theirs.items()}
        going = {**found}
        rows += found.values()
    return rows


def warm(contacts: int, steps: int, wall: bool, say: Callable[[str], None]) -> list[dict[str, Any]]:
    """Time steps of a network, each from the last one's active set, with and without the checks of the input."""
    clock = time.perf_counter if wall else time.process_time
    say(f"warm starts, {contacts} contacts: {steps} steps")
    problems, rows = sequence(contacts, steps + 1), []
    for check in (True, False):
        row = Row("network, warm", contacts, f"dembark auto{'' if check else ', unchecked'}")
        solver = LcpSolver()
        result = solver.solve(problems[0].M, problems[0].q)
        work, worst, moved = 0, 0.0, 0
        for problem in problems[1:]:
            start = result.active
            before = clock()
            result = solver.solve(problem.M, problem.q, start=start, check=check)
            row.seconds.append(clock() - before)
            work += result.block_steps
            moved += int((result.active != start).sum())
            worst = max(worst, certificate(problem, result.z))
        row.facts = {"block_steps": work / steps, "moved": moved / steps, "active": int(result.active.sum()), "pivots": result.pivots,
                     "status": result.status, "certificate": worst}
        rows.append(row.summary())
    return rows


def goals(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """What is asked of the largest problems, and what came out."""
    found = {(row["case"], row["contacts"], row["solver"]): row["median"] for row in rows}
    result = []

    def ask(text: str, value: float | None, bound: float, more: bool) -> None:
        if value is not None:
            result.append({"goal": text, "value": value, "bound": bound, "met": bool(value >= bound if more else value <= bound)})

    for case in ("coupled", "network, stored dense"):
        def ratio(other: str, own_: str, case: str = case) -> float | None:
            a, b = found.get((case, 800, other)), found.get((case, 800, own_))
            return a / b if a and b else None

        ask(f"{case}, 800: auto faster than Siconos's Lemke by", ratio("Siconos lemke", "dembark auto"), 10.0, True)
        ask(f"{case}, 800: auto faster than Siconos's PGS by", ratio("Siconos pgs", "dembark auto"), 1.0, True)
        ask(f"{case}, 800: energy faster than Siconos's Lemke by", ratio("Siconos lemke", "dembark energy"), 2.0, True)
    ask("sparse network, 20000 contacts, cold, s", found.get(("network, sparse", 20000, "dembark auto")), 0.25, False)
    ask("warm step of 1000 contacts, checked, s", found.get(("network, warm", 1000, "dembark auto")), 1e-3, False)
    ask("warm step of 1000 contacts, unchecked, s", found.get(("network, warm", 1000, "dembark auto, unchecked")), 1e-3, False)
    return result


def markdown(rows: list[dict[str, Any]], asked: list[dict[str, Any]], facts: dict[str, Any]) -> str:
    """The table."""
    heads = ["problem", "contacts", "solver", "median / ms", "least-greatest / ms", "pivots", "block steps", "certificate", "status"]
    lines = ["# The LCP solver beside Siconos", "",
             f"{facts['clock']}, medians of rounds in turn, one thread, calls from Python with all checks of the input; both to 1e-12.", "",
             "| " + " | ".join(heads) + " |", "|" + " --- |" * len(heads)]
    for row in rows:
        steps = row.get("block_steps", "")
        low, middle, high = (f"{row[which] * 1e3:.3f}" for which in ("min", "median", "max"))
        cells = [row["case"], row["contacts"], row["solver"], middle, f"{low}-{high}", row.get("pivots", row.get("iterations", "")),
                 f"{steps:.1f}" if isinstance(steps, float) else steps, f"{row['certificate']:.1e}", row["status"]]
        lines.append("| " + " | ".join(str(cell) for cell in cells) + " |")
    lines += ["", "| goal | value | asked | |", "| --- | --- | --- | --- |"]
    lines += [f"| {goal['goal']} | {goal['value']:.3g} | {goal['bound']:g} | {'met' if goal['met'] else 'MISSED'} |" for goal in asked]
    if not facts["versions"].get("siconos"):
        lines += ["", ("Siconos's methods, and the goals that compare with them, are left out: the system's Python has no Siconos "
                       "(python3-siconos, not in every release of Debian).")]
    versions = ", ".join(f"{name} {version}" for name, version in facts["versions"].items() if version)
    lines += ["", (f"{facts['date']}, {facts['cpu']}, {facts['cores']} cores, load {facts['load']:.1f} before and "
                   f"{facts['load_after']:.1f} after, commit {facts['commit'] or 'none'}{' with changes' if facts['dirty'] else ''}, "
                   f"{versions}."), ""]
    return "\n".join(lines)


def table(rows: list[dict[str, Any]], path: Path) -> None:
    """What the figure shows, as CSV: a row for each problem and solver; seconds, and how many steps of its own kind the solver took."""
    keys = ("case", "contacts", "solver", "median", "min", "max", "samples", "pivots", "block_steps", "iterations", "certificate", "status")
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, keys, extrasaction="ignore", lineterminator="\n")
        writer.writeheader()
        writer.writerows(row for row in rows if row["case"] != "network, warm")


def steps_of(row: dict[str, Any]) -> float:
    """Steps of a solver: pivots and block steps of dembark's (sweeps of pgs), iterations of the others."""
    return float(row.get("iterations", row.get("pivots", 0)) + row.get("block_steps", 0))


def plot(rows: list[dict[str, Any]], path: Path) -> None:
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


def measure(out: Path, rounds: int, wall: bool, say: Callable[[str], None], quick: bool = False) -> list[dict[str, Any]]:
    """Run everything, write lcp.json, lcp.md and lcp.png into `out` and return the goals."""
    version = siconos_version()
    if version is None:
        say(f"{SYSTEM_PYTHON} has no Siconos (Debian: python3-siconos): its columns stay out")
    facts = {**commit(), "date": datetime.now(UTC).isoformat(timespec="seconds"), "load": os.getloadavg()[0], "cpu": cpu(),
             "cores": os.cpu_count(), "clock": "elapsed time" if wall else "processor time", "rounds": rounds,
             "versions": {"dembark": package_version("dembark"), "siconos": version, "numpy": package_version("numpy")}}
    rows = []
    for n in SIZES[:3] if quick else SIZES:
        rows += beside("coupled", coupled(n), rounds, wall, version is not None, say)
        planar = network(n)
        rows += beside("network, stored dense", Problem(planar.dense, planar.q), rounds, wall, version is not None, say)
    rows += cold_networks(NETWORKS[:1] if quick else NETWORKS, rounds, wall, version is not None, say)
    rows += warm(200 if quick else 1000, 10 if quick else 100, wall, say)
    facts["load_after"] = os.getloadavg()[0]
    asked = goals(rows)
    out.mkdir(parents=True, exist_ok=True)
    write_json(out / "lcp.json", {"rows": rows, "goals": asked, "provenance": facts})
    (out / "lcp.md").write_text(markdown(rows, asked, facts), encoding="utf-8")
    table(rows, out / "lcp.csv")
    plot(rows, out / "lcp.png")
    say(f"wrote {out / 'lcp.md'}, lcp.json, lcp.csv and lcp.png")
    return asked


def redraw(found: Path, figure: Path) -> None:
    """Draw the lcp.json in the folder `found` again, as `figure` and a CSV file beside it."""
    path = found / "lcp.json"
    try:
        rows = json.loads(path.read_text(encoding="utf-8"))["rows"]
    except (OSError, ValueError, KeyError):
        raise DembarkError("no measurement to draw", str(path), "run python -m benchmarks.run --only lcp first") from None
    table(rows, figure.with_suffix(".csv"))
    plot(rows, figure)


def report(asked: list[dict[str, Any]]) -> int:
    """Print what was asked and what came out; the exit code."""
    for goal in asked:
        print(f"{goal['goal']}: {goal['value']:.3g} ({'met' if goal['met'] else 'MISSED'}, asked {goal['bound']:g})")
    return 0


def main(words: list[str] | None = None) -> int:
    """Run and print the goals; the exit code is 1 when a run failed, 2 when something is missing."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.lcp", description=__doc__)
    parser.add_argument("--rounds", type=int, default=5, help="samples of each solver (default %(default)s)")
    parser.add_argument("--wall-clock", action="store_true", help="elapsed time; default: processor time")
    parser.add_argument("--quick", action="store_true", help="small problems only")
    parser.add_argument("--out", type=Path, default=HERE.parent / "results/bench", help="folder of lcp.json, lcp.md, lcp.csv and lcp.png")
    given = parser.parse_args(words)

    def say(line: str) -> None:
        print(f"dembark: {line}", file=sys.stderr, flush=True)

    try:
        if given.rounds < 1:
            raise DembarkError("--rounds", "", "give a whole number from 1 on")
        asked = measure(given.out, given.rounds, given.wall_clock, say, given.quick)
    except DembarkError as error:
        say(str(error))
        return error.exit_code
    return report(asked)


if __name__ == "__main__":
    sys.exit(main())
