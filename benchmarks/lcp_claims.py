"""Test what is claimed of the energy criterion, and compare it with other methods: `python -m benchmarks.lcp_claims`."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from numpy.typing import NDArray
from scipy import sparse
from scipy.optimize import lsq_linear

from benchmarks import frame, lcp_logs
from benchmarks.frame import HERE, say
from benchmarks.lcp import MISSING, Row, peer, siconos_version
from benchmarks.lcp_cases import Problem, certificate, coupled, network
from dembark.common.errors import DembarkError
from dembark.physics import solve_lcp

Floats = NDArray[np.float64]
DATA = HERE.parent / "plugins/python/physics/tests/lcp_data"

# The three test problems of the source, and one in which the rule takes a pivot back (found by trying).
PUBLISHED = {
    "example 1": ([[4, -1, 0, 0], [-1, 4, -1, 0], [0, -1, 4, -1], [0, 0, -1, 4]], [-4, 3, -4, 2]),
    "example 2": ([[100, -2, -3, -4], [-2, 50, -6, -7], [-3, -6, 100, -11], [-4, -7, -11, 200]], [1, -2, 3, -4]),
    "example 3": ([[4, -1, 2, 0], [-1, 4, -1, 0], [2, -1, 4, -1], [0, 0, -1, 4]], [-4, 1, -2, 0])}
COUNTEREXAMPLE = ([[39, -63, -16], [-63, 118, 66], [-16, 66, 150]], [-3, -2, -8])
SICONOS = ("lemke", "newton_min", "pgs", "cpg", "latin")
OWN = ("energy", "block", "murty", "auto", "pgs")
MOST_SWEEPS = 20000  # of PGS and NNCG
ACCURACY = 1e-12  # certificate that ends these two


@dataclass(frozen=True)
class Way:
    """How the published rule gets to the solution: the indices that it exchanges, and the energy 1/2 z M z + q z after each."""

    exchanged: list[int]
    energy: list[float]
    z: Floats
    ended: bool


def gauss_jordan(M: Floats, q: Floats) -> Way:  # noqa: N803
    """The algorithm of the source on the full tableau, step by step; ends where a set of contacts comes back."""
    n = len(q)
    table = np.column_stack([M, q]).astype(float)
    active = np.zeros(n, bool)
    exchanged: list[int] = []
    energy, seen = [0.0], {active.tobytes()}
    rounding = 1e-12 * np.abs(q).max(initial=0.0)
    while True:
        value, diagonal = table[:, n], np.diagonal(table)
        if not (value < -rounding).any():
            return Way(exchanged, energy, np.where(active, value, 0.0), True)
        gain = np.where(value < -rounding, value**2 / diagonal, 0.0)
        i = int(np.argmax(gain >= gain.max() * (1.0 - 1e-10)))  # the first of equal ones
        energy.append(energy[-1] + (0.5 if active[i] else -0.5) * gain[i])
        row, column, pivot = table[i].copy(), table[:, i].copy(), table[i, i]
        table -= np.outer(column, row) / pivot
        table[i] = -row / pivot
        table[:, i] = column / pivot
        table[i, i] = 1.0 / pivot
        active[i] = not active[i]
        exchanged.append(i)
        if active.tobytes() in seen:
            return Way(exchanged, energy, np.where(active, table[:, n], 0.0), False)
        seen.add(active.tobytes())


def row_of_logs(count: int, random: np.random.Generator) -> Problem:
    """Central impacts in a row of `count` + 1 logs, for which the source derives its model: neighbouring contacts share a log."""
    inverse = 1.0 / random.uniform(20.0, 80.0, count + 1)
    shared = np.diag(inverse[1:-1], 1)
    compliance = random.uniform(0.001, 0.1, count)
    return Problem(np.diag(inverse[:-1] + inverse[1:] + compliance) - shared - shared.T, random.standard_normal(count))


def random_matrix(count: int, random: np.random.Generator) -> Problem:
    """G G^T of numbers of both signs: no matrix of contacts."""
    normals = random.standard_normal((count, count))
    return Problem(normals @ normals.T / count + 0.01 * np.eye(count), random.standard_normal(count))


def families(count: int, seed: int) -> dict[str, Problem]:
    """A problem of each family with `count` unknowns."""
    random = np.random.default_rng(seed)
    planar = [network(count, seed, compliance) for compliance in (0.5, 0.005)]
    return {"row of logs": row_of_logs(count, random), "network": planar[0], "network, stiff": planar[1], "coupled": coupled(count, seed),
            "random": random_matrix(count, random)}


def survey(sizes: Sequence[int], samples: int) -> list[Row]:
    """The published rule on random problems: pivots beyond the number of contacts, steps in which the energy rises, sets that came back."""
    rows = []
    for count in sizes:
        say(f"energy criterion, {count} unknowns: {samples} problems of each family")
        found: dict[str, list[Row]] = {}
        for seed in range(samples):
            for name, problem in families(count, seed).items():
                result = solve_lcp(problem.M, problem.q, method="energy")
                path = gauss_jordan(problem.dense, problem.q) if count <= 50 else None  # the full tableau, for as long as that is quick
                found.setdefault(name, []).append({
                    "pivots": result.pivots, "active": int(result.active.sum()), "returned": result.used_fallback,
                    "rises": bool(path and (np.diff(path.energy) > 0.0).any()),
                    "same": path is None or len(path.exchanged) == result.pivots})
        for name, each in found.items():
            table = pd.DataFrame(each)
            beyond = table["pivots"] - table["active"]
            rows.append({"family": name, "unknowns": count, "samples": samples, "minimal": float((beyond == 0).mean()),
                         "mean_beyond": float((beyond / table["active"].clip(lower=1)).mean()), "most_beyond": int(beyond.max()),
                         "rises": float(table["rises"].mean()) if count <= 50 else None, "returned": int(table["returned"].sum()),
                         "differs_from_tableau": int((~table["same"]).sum())})
    return rows


class Sweeps:
    """Projected Gauss-Seidel, and the nonsmooth nonlinear conjugate gradients (NNCG) around it: M. Silcowitz-Hansen, S. Niebe, K. Erleben,
    The Visual Computer 26 (2010) 893. For counts of sweeps, not for speed."""

    def __init__(self, problem: Problem) -> None:
        matrix = sparse.csr_array(problem.M)
        self.problem, self.diagonal = problem, matrix.diagonal()
        self.rows = [(matrix.indices[a:b], matrix.data[a:b]) for a, b in zip(matrix.indptr, matrix.indptr[1:], strict=False)]

    def sweep(self, z: Floats) -> Floats:
        """One sweep of projected Gauss-Seidel."""
        z = z.copy()
        for i, (at, values) in enumerate(self.rows):
            z[i] = max(0.0, z[i] - (values @ z[at] + self.problem.q[i]) / self.diagonal[i])
        return z

    def pgs(self) -> Iterator[Floats]:
        """z after each sweep."""
        z = np.zeros(len(self.problem.q))
        while True:
            z = self.sweep(z)
            yield z

    def nncg(self) -> Iterator[Floats]:
        """z after each sweep."""
        start = np.zeros(len(self.problem.q))
        z = self.sweep(start)
        gradient = start - z
        direction = -gradient
        while True:
            yield np.maximum(z, 0.0)
            swept = self.sweep(z)
            last, gradient = gradient @ gradient, z - swept
            ratio = gradient @ gradient / last if last > 0.0 else np.inf
            if ratio > 1.0:
                z, direction = swept, np.zeros_like(z)
            else:
                z, direction = swept + ratio * direction, ratio * direction - gradient


def curve(problem: Problem, solutions: Iterator[Floats], most: int) -> list[float]:
    """Certificates after each sweep, up to `ACCURACY` or `most` of them."""
    found: list[float] = []
    for z in solutions:
        found.append(certificate(problem, z))
        if found[-1] <= ACCURACY or len(found) >= most:
            return found
    return found


def by_sweeps(problem: Problem, solutions: Iterator[Floats]) -> Row:
    """Number of sweeps and the certificate that was reached."""
    found = curve(problem, solutions, MOST_SWEEPS)
    return {"steps": len(found), "certificate": found[-1]}


def by_dembark(problem: Problem, method: str) -> Row:
    """Pivots and block steps (`auto` counts its sweeps and conjugate gradients in neither)."""
    result = solve_lcp(problem.M, problem.q, method=method)
    return {"steps": result.pivots + result.block_steps, "certificate": certificate(problem, result.z), "status": result.status}


def by_interior_point(problem: Problem, most: int = 200) -> Row:
    """Clarabel's interior point method on min 1/2 z M z + q z, z >= 0."""
    import clarabel

    n = len(problem.q)
    settings = clarabel.DefaultSettings()
    settings.verbose, settings.max_iter = False, most
    settings.tol_gap_abs = settings.tol_gap_rel = settings.tol_feas = 1e-12
    upper, signs = sparse.csc_matrix(sparse.triu(sparse.csc_array(problem.M))), -sparse.identity(n, format="csc")
    solver = clarabel.DefaultSolver(upper, problem.q, signs, np.zeros(n), [clarabel.NonnegativeConeT(n)], settings)
    answer = solver.solve()
    z = np.maximum(np.array(answer.x), 0.0)
    return {"steps": answer.iterations, "certificate": certificate(problem, z), "status": str(answer.status)}


def by_least_squares(problem: Problem) -> Row:
    """SciPy's bounded-variable least squares (an active set, one index a step) on |L^T z + L^-1 q|, M = L L^T."""
    factor, n = np.linalg.cholesky(problem.dense), len(problem.q)
    answer = lsq_linear(factor.T, -np.linalg.solve(factor, problem.q), (0.0, np.inf), method="bvls", tol=1e-15, max_iter=10 * n)
    return {"steps": int(answer.nit), "certificate": certificate(problem, answer.x), "status": "solved" if answer.status > 0 else "stopped"}


def solvers(peers: Sequence[str]) -> dict[str, Callable[[Problem], Row]]:
    """All methods by name; peers of Siconos are asked together."""
    found: dict[str, Callable[[Problem], Row]] = {f"dembark {name}": partial(by_dembark, method=name) for name in OWN}
    found["NNCG"] = lambda one: by_sweeps(one, Sweeps(one).nncg())
    found["SciPy bvls"] = by_least_squares
    if find_spec("clarabel"):
        found["Clarabel"] = by_interior_point
    for name in peers:
        found[f"Siconos {name}"] = partial(by_siconos, name=name)
    return found


def by_siconos(problem: Problem, name: str) -> Row:
    """A method of Siconos."""
    found = peer(problem, name, wall=False)
    return {"steps": found["iterations"], "certificate": found["certificate"], "status": found["status"]}


def published_set() -> tuple[dict[str, Problem], int]:
    """The problems of Siconos's tests that are symmetric and positive definite, and the number of the others, which are refused."""
    kept, refused = {}, 0
    for path in sorted(DATA.glob("*.dat")):
        words = path.read_text(encoding="utf-8").split()
        n = int(words[0])
        numbers = np.array(words[6:6 + n * n + n], dtype=float)
        problem = Problem(numbers[:n * n].reshape((n, n), order="F"), numbers[n * n:])
        try:
            solve_lcp(problem.M, problem.q)
        except ValueError:
            refused += 1
        else:
            kept[path.stem.replace("lcp_", "Siconos ")] = problem
    return kept, refused


def compare(problems: dict[str, Problem], peers: Sequence[str]) -> list[Row]:
    """Steps and certificate of each method on each problem."""
    rows = []
    for name, problem in problems.items():
        about = {"problem": name, "unknowns": len(problem.q), "contacts": int(solve_lcp(problem.M, problem.q).active.sum())}
        for solver, solve in solvers(peers).items():
            say(f"{name}: {solver}")
            rows.append({**about, "solver": solver, **solve(problem)})
    return rows


def reached(row: Row) -> str:
    """Steps, and the certificate where it is not round-off."""
    return f"{row['steps']}" if row["certificate"] <= 1e-11 else f"{row['steps']} ({row['certificate']:.0e})"


def comparison_table(rows: Sequence[Row]) -> str:
    """A line for each solver, a column for each problem."""
    table = pd.DataFrame([{**row, "text": reached(row)} for row in rows])
    wide = table.pivot_table(index="solver", columns="problem", values="text", aggfunc="first", sort=False)
    about = table.groupby("problem", sort=False)[["unknowns", "contacts"]].first()
    lines = [["unknowns", *about["unknowns"]], ["contacts", *about["contacts"]]]
    return frame.markdown(["method", *wide.columns], [*lines, *([name, *line] for name, line in wide.iterrows())])


def survey_table(rows: Sequence[Row]) -> str:
    """A line for each family and size."""
    heads = ("problems", "unknowns", "pivots = contacts in", "mean excess", "largest excess (pivots)", "energy rises in",
             "a set came back in")
    return frame.markdown(heads, [[row["family"], row["unknowns"], f"{row['minimal']:.1%}", f"{row['mean_beyond']:.2%}", row["most_beyond"],
                                   "" if row["rises"] is None else f"{row['rises']:.1%}", row["returned"]] for row in rows])


def curves(problem: Problem) -> dict[str, list[float]]:
    """Certificates over the steps of the methods that approach the solution."""
    sweeps = Sweeps(problem)
    found = {"PGS": curve(problem, sweeps.pgs(), 5000), "NNCG": curve(problem, sweeps.nncg(), 5000)}
    if find_spec("clarabel"):
        steps = range(1, by_interior_point(problem)["steps"] + 1)
        found["interior point (Clarabel)"] = [by_interior_point(problem, most)["certificate"] for most in steps]
    return found


def plot(found: dict[str, Any], path: Path) -> None:
    """Energy over the pivots of the counterexample, excess of pivots, convergence."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(12.0, 3.6), layout="constrained")
    for name, energy in found["paths"].items():
        scaled = np.array(energy) / abs(min(energy))
        left.plot(range(len(energy)), scaled, marker="o", markersize=3, linewidth=1.2, label=name)
    left.set(xlabel="pivots", ylabel="energy over its smallest value", title="energy on the way")
    table = pd.DataFrame(found["survey"])
    for name, each in table.groupby("family", sort=False):
        middle.plot(each["unknowns"], 100.0 * each["mean_beyond"], marker="o", markersize=3, linewidth=1.2, label=name)
    middle.set(xscale="log", xlabel="unknowns", ylabel="pivots beyond the contacts (%)", title="minimality")
    for name, certificates in found["curves"].items():
        right.loglog(range(1, len(certificates) + 1), np.maximum(certificates, 1e-17), linewidth=1.2, label=name)
    for row in found["comparison"]:
        if row["problem"] == "pile 40" and row["solver"] in ("dembark energy", "dembark block", "Siconos lemke"):
            right.plot([max(1, row["steps"])], [max(row["certificate"], 1e-17)], "x", label=row["solver"])
    right.set(xlabel="sweeps, iterations or pivots", ylabel="certificate", title="pile, long steps")
    for axis in (left, middle, right):
        axis.grid(alpha=0.3)
        axis.legend(fontsize=7, frameon=False)
    figure.savefig(path, dpi=130, metadata={"Software": None})
    plt.close(figure)


def measure(out: Path, logs: int, samples: int, sizes: Sequence[int] = (3, 5, 10, 20, 50, 100)) -> dict[str, Any]:
    """Run everything, write lcp_claims.json, .md, .csv and .png into `out`."""
    version = siconos_version()
    small = {name: Problem(np.array(M, float), np.array(q, float)) for name, (M, q) in {**PUBLISHED, "3 × 3": COUNTEREXAMPLE}.items()}
    data, refused = published_set()
    large = lcp_logs.problems(logs)
    rows = compare({**small, **data, **large}, SICONOS if version else ())
    found: dict[str, Any] = {
        "survey": survey(sizes, samples), "comparison": rows,
        "paths": {name: gauss_jordan(one.dense, one.q).energy for name, one in small.items()}, "curves": curves(large["pile 40"])}
    known = frame.facts(("numpy", "scipy", "clarabel"), siconos=version, logs=logs, samples=samples)
    frame.write(out, "lcp_claims", "What is claimed of the energy criterion", [
        comparison_table(rows), f"Siconos's other {refused} test problems are refused.", *([] if version else [MISSING]),
        survey_table(found["survey"])], found, known)
    pd.DataFrame(rows).to_csv(out / "lcp_claims.csv", index=False)
    plot(found, out / "lcp_claims.png")
    return found


def redraw(folder: Path, figure: Path) -> None:
    """Draw the lcp_claims.json in `folder` again, as `figure` and a CSV file next to it."""
    path = folder / "lcp_claims.json"
    try:
        found = json.loads(path.read_text(encoding="utf-8"))["rows"]
    except (OSError, ValueError, KeyError):
        raise DembarkError("no measurement to draw", str(path), "run python -m benchmarks.lcp_claims first") from None
    pd.DataFrame(found["comparison"]).to_csv(figure.with_suffix(".csv"), index=False)
    plot(found, figure)


def run(words: list[str] | None) -> None:
    """Measure, or draw again."""
    parser = frame.parser("lcp_claims", __doc__, rounds=1)
    parser.add_argument("--logs", type=int, default=60, help="logs in the drum and in the pile (default %(default)s)")
    parser.add_argument("--samples", type=int, default=50, help="random problems of each family and size (default %(default)s)")
    parser.add_argument("--redraw", action="store_true", help="measure nothing, draw docs/figures/lcp_claims from --out")
    given = parser.parse_args(words)
    frame.at_least_one(given, "logs", "samples")
    if given.redraw:
        redraw(given.out, HERE.parent / "docs/figures/lcp_claims.png")
    else:
        measure(given.out, given.logs, given.samples)


def main(words: list[str] | None = None) -> int:
    """The exit code is 1 when a run failed, 2 when something is missing."""
    return frame.ended(lambda: run(words))


if __name__ == "__main__":
    sys.exit(main())
