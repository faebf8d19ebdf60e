"""The tables of docs/theory/time_steps.md from docs/figures/schemes.json: `python -m benchmarks.schemes_tables`."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.schemes import SCHEMES

FILE = Path(__file__).parents[1] / "docs/figures/schemes.json"
# Errors at which costs are compared, by problem.
GOALS = {"alternating": 1e-2, "impact": 1e-3, "block": 1e-2, "bed": 1e-2}
FRACTIONS, SPEEDS = (0.05, 0.1, 0.11, 0.2, 0.4), (10.0, 30.0, 100.0, 1000.0)


def number(value: float) -> str:
    """Two digits and a power of ten, for a table."""
    if value == 0.0 or not math.isfinite(value):
        return "0" if value == 0.0 else "∞"
    if 1e-3 <= abs(value) < 1e4:
        return f"{value:.2g}" if abs(value) < 10.0 else f"{value:.0f}"
    power = math.floor(math.log10(abs(value)))
    return f"{value / 10.0**power:.1f}·10{str(power).translate(str.maketrans('-0123456789', '⁻⁰¹²³⁴⁵⁶⁷⁸⁹'))}"


def turn(value: float) -> str:
    """An ωh; limits below 0.05 are those of formulas that grow at any step."""
    return "∞" if math.isinf(value) else "0" if value < 0.05 else f"{value:.2f}"


def schemes(found: Mapping[str, Any]) -> list[str]:
    """Orders and limits of stability."""
    rows = []
    for name, (label, each, _) in SCHEMES.items():
        order, (free, damped) = found["orders"][name], (found["limits"][name][key] for key in ("0.0", "0.2"))
        cost = "by iteration" if name == "midpoint" else f"{each}"
        rows.append(f"| {label} | {cost} | {order['0.0']:.2f}; {order['0.1']:.2f} | {turn(free[0])}; {turn(damped[0])} | "
                    f"{turn(free[1])}; {turn(free[2])} | {turn(damped[1])}; {turn(damped[2])} |")
    return rows


def cost_of(rows: Sequence[Mapping[str, Any]], goal: float) -> float:
    """Cost from which on the error stays below `goal`, between two measured costs by a power law; inf where it never does."""
    ordered = sorted(rows, key=lambda row: float(row["cost"]))
    cost, error = np.array([(row["cost"], row["error"]) for row in ordered]).T if ordered else (np.zeros(0), np.zeros(0))
    above = np.nonzero(error > goal)[0]
    if not len(error) or error[-1] > goal:
        return math.inf
    if not len(above):
        return float(cost[0])
    k = int(above[-1])
    share = math.log(error[k] / goal) / math.log(error[k] / error[k + 1])
    return float(cost[k] * (cost[k + 1] / cost[k]) ** share)


def costs(found: Mapping[str, Any]) -> list[str]:
    """Cost of each scheme for a given error of each problem."""
    labels = {name: label for name, (label, _, _) in SCHEMES.items()} | {"rkf45_controlled": "RKF45, controlled step"}
    rows = []
    for name, label in labels.items():
        cells = []
        for problem, goal in GOALS.items():
            cost = cost_of([row for row in found[problem] if row["scheme"] == name], goal)
            cells.append("–" if math.isinf(cost) else f"{cost:.0f}")
        rows.append(f"| {label} | {' | '.join(cells)} |")
    return rows


def drifts(found: Mapping[str, Any]) -> list[str]:
    """Energy after 2, 8 and 16 slow periods."""
    def cell(values: Sequence[float], k: int) -> str:
        return "unstable" if k >= len(values) or not math.isfinite(values[k]) else number(values[k])

    return [f"| {label} | {'; '.join(cell(found['drift'][name], k) for k in (0, 3, 7))} |" for name, (label, _, _) in SCHEMES.items()]


def steps(found: Mapping[str, Any]) -> list[str]:
    """Change of the restitution by the number of steps in an impact."""
    rows = found["step"]
    counts = sorted({int(row["steps"]) for row in rows})
    out = []
    for restitution in sorted({row["restitution"] for row in rows}, reverse=True):
        by = {int(row["steps"]): row for row in rows if row["restitution"] == restitution}
        cells = [f"{number(by[count]['mean'])} ({number(by[count]['largest'])})" for count in counts]
        out.append(f"| {restitution:g} | {' | '.join(cells)} |")
    return out


def duration(poisson: float) -> float:
    """C in T_c / T_R = C (c / v)^(1/5), equal grains: Hertz's 2.9433 (15 m* / (16 E* sqrt(R*)))^(2/5) v^(-1/5) over the Rayleigh time."""
    return 2.9433 * (0.625 * math.sqrt(2.0) * math.pi * (1.0 - poisson)) ** 0.4 * (0.1631 * poisson + 0.8766) / math.pi


def fractions() -> list[str]:
    """Steps in an impact by the fraction and the speed."""
    return [f"| {one:g} | {' | '.join(f'{duration(0.3) * speed**0.2 / one:.0f}' for speed in SPEEDS)} |" for one in FRACTIONS]


def tables(found: Mapping[str, Any]) -> dict[str, list[str]]:
    """The rows of all tables."""
    return {"schemes": schemes(found), "costs": costs(found), "drifts": drifts(found), "steps": steps(found), "fractions": fractions()}


def main() -> int:
    """The command."""
    found = json.loads(FILE.read_text(encoding="utf-8"))
    for name, rows in tables(found).items():
        print(f"{name}\n" + "\n".join(rows) + "\n")
    print(found["oracles"], found["bed_limit"])
    return 0


if __name__ == "__main__":
    sys.exit(main())
