"""Schemes of integration: error, cost, stability and energy on problems of grains, and what follows for the time step of an engine.

    python -m benchmarks.schemes [--out docs/figures/schemes.json]

docs/theory/time_steps.md shows the results, docs/figures.py draws them. Cost is the number of
evaluations of all forces, per shortest period (oscillator, block) or per duration of an impact (impact, bed). The problems and their
references are in schemes_problems.py.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from scipy.integrate import RK45
from scipy.optimize import NoConvergence, fsolve, newton_krylov

from benchmarks import schemes_problems as problems
from benchmarks.schemes_problems import Array, Bed, Problem
from dembark.physics import integrate_adams

Scheme = Callable[[Problem, float], Array]  # the final state for a step (s)
BASHFORTH = {2: (3 / 2, -1 / 2), 3: (23 / 12, -16 / 12, 5 / 12), 4: (55 / 24, -59 / 24, 37 / 24, -9 / 24)}
# What is measured; steps of the tables, per duration of an impact; costs of the figure.
PARTS = ("oracles", "orders", "limits", "drift", "alternating", "impact", "block", "bed", "step", "bed_limit")
STEPS = (5, 10, 15, 25, 50, 100, 200)
COSTS = np.round(np.geomspace(8.0, 300.0, 8), 1)


def count(problem: Problem, h: float) -> tuple[int, float]:
    """The number of equal steps, no longer than `h`, and their length."""
    steps = max(1, math.ceil(problem.end / h * (1.0 - 1e-12)))
    return steps, problem.end / steps


def verlet(problem: Problem, h: float, lagged: bool = False) -> Array:
    """Velocity Verlet. The forces see the velocity v + h a, or, `lagged` as in the engines, that of the half step before."""
    steps, h = count(problem, h)
    x, v, s = problem.parts(problem.start.copy())
    a = problem.forces(x, v, s)
    for _ in range(steps):
        half = v + 0.5 * h * a
        x = x + h * half
        s = problem.advance(x, half, s, h)
        a = problem.forces(x, half if lagged else half + 0.5 * h * a, s)
        v = half + 0.5 * h * a
    return np.concatenate([x, v, s])


def bashforth(problem: Problem, h: float, order: int) -> Array:
    """Adams and Bashforth's explicit formula; the first steps are classical Runge-Kutta steps."""
    steps, h = count(problem, h)
    y = problem.start.copy()
    rates: list[Array] = []
    for _ in range(steps):
        rates = [problem.rate(0.0, y), *rates][:order]
        if len(rates) < order:
            k2 = problem.rate(0.0, y + 0.5 * h * rates[0])
            k3 = problem.rate(0.0, y + 0.5 * h * k2)
            k4 = problem.rate(0.0, y + h * k3)
            y = y + h / 6.0 * (rates[0] + 2.0 * (k2 + k3) + k4)
        else:
            y = y + h * sum(weight * rate for weight, rate in zip(BASHFORTH[order], rates, strict=True))
    return y


def adams(problem: Problem, h: float, corrections: int) -> Array:
    """The predictor-corrector of `integrate_adams`, with this number of corrections in each step."""
    _, h = count(problem, h)
    return integrate_adams(problem.rate, problem.start, problem.end, h, corrections=corrections, tolerance=1e-300).state[-1]


class Fehlberg(RK45):  # type: ignore[misc]  # SciPy has no types
    """SciPy's Runge-Kutta pair with Fehlberg's coefficients (NASA TR R-315, 1969); the fifth order goes on."""

    C: ClassVar[Array] = np.array([0, 1 / 4, 3 / 8, 12 / 13, 1, 1 / 2])
    A: ClassVar[Array] = np.array([
        [0, 0, 0, 0, 0], [1 / 4, 0, 0, 0, 0], [3 / 32, 9 / 32, 0, 0, 0], [1932 / 2197, -7200 / 2197, 7296 / 2197, 0, 0],
        [439 / 216, -8, 3680 / 513, -845 / 4104, 0], [-8 / 27, 2, -3544 / 2565, 1859 / 4104, -11 / 40]])
    B: ClassVar[Array] = np.array([16 / 135, 0, 6656 / 12825, 28561 / 56430, -9 / 50, 2 / 55])
    E: ClassVar[Array] = np.array([1 / 360, 0, -128 / 4275, -2197 / 75240, 1 / 50, 2 / 55, 0])


def fehlberg(problem: Problem, h: float, tolerance: float | None = None) -> Array:
    """RKF45 with steps `h`, or with steps that keep the error below a relative tolerance and a thousandth of it absolutely."""
    if tolerance is None:
        _, h = count(problem, h)
        solver = Fehlberg(problem.rate, 0.0, problem.start, problem.end, max_step=h, first_step=h, rtol=1e30, atol=1e30)
    else:
        solver = Fehlberg(problem.rate, 0.0, problem.start, problem.end, rtol=tolerance, atol=1e-3 * tolerance)
    while solver.status == "running":
        solver.step()
    return np.asarray(solver.y)


def midpoint(problem: Problem, h: float) -> Array:
    """The implicit midpoint rule, solved by MINPACK, or by a Newton-Krylov method where there are many unknowns, to 1e-10 of a step."""
    steps, h = count(problem, h)
    y = problem.start.copy()
    rate = problem.rate(0.0, y)
    scale = np.concatenate([np.full(len(part), max(float(np.abs(part).max(initial=0.0)), 1e-12)) for part in
                            problem.parts(h * np.abs(rate) + np.abs(y))])
    for _ in range(steps):
        def residual(z: Array, y: Array = y) -> Array:
            return z - 0.5 * h * problem.rate(0.0, y + z * scale) / scale

        guess = 0.5 * h * rate / scale
        if len(y) < 10:
            move, _, found, _ = fsolve(residual, guess, full_output=True, xtol=1e-10)
            if found != 1 and np.abs(residual(move)).max() > 1e-9:
                raise NoConvergence
        else:
            move = newton_krylov(residual, guess, f_tol=1e-10, maxiter=50, method="gmres")
        move = move * scale
        y, rate = y + 2.0 * move, 2.0 * move / h
    return y


SCHEMES: dict[str, tuple[str, int, Scheme]] = {
    "verlet": ("velocity Verlet, v + h a in the forces", 1, verlet),
    "engines": ("leapfrog of the engines, damping lags", 1, lambda p, h: verlet(p, h, lagged=True)),
    "ab2": ("Adams–Bashforth 2", 1, lambda p, h: bashforth(p, h, 2)),
    "ab3": ("Adams–Bashforth 3", 1, lambda p, h: bashforth(p, h, 3)),
    "ab4": ("Adams–Bashforth 4", 1, lambda p, h: bashforth(p, h, 4)),
    "pece": ("Adams PECE 4", 2, lambda p, h: adams(p, h, 1)),
    "pecece": ("Adams P(EC)²E 4", 3, lambda p, h: adams(p, h, 2)),
    "rkf45": ("RKF45, constant step", 6, fehlberg),
    "midpoint": ("implicit midpoint", 4, midpoint)}


def solved(problem: Problem, scheme: Scheme, h: float, most: float = 1e6) -> Array | None:
    """The final state, or None where the scheme fails or a number of the state exceeds `most`."""
    problem.evaluations = 0
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        try:
            y = scheme(problem, h)
        except (ValueError, NoConvergence, OverflowError, FloatingPointError, np.linalg.LinAlgError):
            return None
    return y if np.isfinite(y).all() and np.abs(y).max() < most else None


def error_of(problem: Problem, scheme: Scheme, h: float, exact: Array) -> tuple[float, float] | None:
    """The largest difference of what the problem measures, and the evaluations per shortest time; None where the scheme fails."""
    y = solved(problem, scheme, h)
    if y is None:
        return None
    return float(np.abs(problem.measure(y) - exact).max()), problem.evaluations * problem.fast / problem.end


def work(make: Callable[[float], list[Problem]], exact: Array, costs: Array = COSTS) -> list[dict[str, Any]]:
    """Rows `scheme`, `cost`, `error`: for each scheme at the costs of the figure; the rms over the problems that make(h) gives. RKF45 with
    error control stands in rows of its own."""
    rows: list[dict[str, Any]] = []

    def add(name: str, found: list[tuple[float, float] | None]) -> None:
        kept = [one for one in found if one is not None]
        if len(kept) == len(found):
            errors, costs = np.array(kept).T
            if (error := float(np.sqrt(np.mean(errors**2)))) < 10.0:
                rows.append({"scheme": name, "cost": float(costs.mean()), "error": error})

    for name, (_, each, scheme) in SCHEMES.items():
        for cost in costs:
            fast = make(1.0)[0].fast
            h = each * fast / cost
            add(name, [error_of(problem, scheme, h, exact) for problem in make(h)])
        print(f"dembark: {name} done", file=sys.stderr, flush=True)
    for tolerance in 10.0 ** -np.arange(2.0, 8.0):
        add("rkf45_controlled", [error_of(problem, partial(fehlberg, tolerance=tolerance), 0.0, exact)
                                 for problem in make(make(1.0)[0].fast / 20.0)])
    return rows


def growth(scheme: Scheme, turn: float, damping: float = 0.0, steps: int = 200) -> float:
    """Mean factor by which the amplitude of an oscillator grows in a step of omega h = `turn`, after `steps` steps."""
    ends = []
    for number in (steps, 2 * steps):
        problem = problems.oscillator(damping)
        problem.end = number * turn
        y = solved(problem, scheme, turn, most=1e250)
        ends.append(math.inf if y is None else float(np.hypot(*y[:2])))
    return (ends[1] / ends[0]) ** (1.0 / steps) if ends[0] > 0.0 and math.isfinite(ends[1]) else math.inf


def known_growth(name: str, turn: float, damping: float = 0.0) -> float:
    """The same from the characteristic equation of the scheme."""
    loss = 2.0 * damping * turn
    if name == "engines":
        return float(np.abs(np.roots([1.0, turn**2 + loss - 2.0, 1.0 - loss])).max())
    if name == "verlet":  # x, h v, h^2 a
        place = np.array([1.0, 1.0, 0.5])
        force = -turn**2 * place - loss * np.array([0.0, 1.0, 1.0])
        return float(np.abs(np.linalg.eigvals([place, np.array([0.0, 1.0, 0.5]) + 0.5 * force, force])).max())
    z = turn * complex(-damping, math.sqrt(1.0 - damping**2))
    if name == "midpoint":
        return abs((1.0 + 0.5 * z) / (1.0 - 0.5 * z))
    if name == "rkf45":
        return abs(sum(z**k / d for k, d in enumerate((1, 1, 2, 6, 24, 120, 2080))))
    if name in ("pece", "pecece"):
        y = np.array([0.0, 1.0, 0.0, 0.0, 0.0])
        ahead = y + z / 24.0 * np.array([0.0, 55.0, -59.0, 37.0, -9.0])
        for _ in range(1 if name == "pece" else 2):
            ahead = y + z / 24.0 * (9.0 * ahead + np.array([0.0, 19.0, -5.0, 1.0, 0.0]))
        return float(np.abs(np.roots(np.array([1.0, 0.0, 0.0, 0.0, 0.0]) - ahead)).max())
    weights = BASHFORTH[int(name[-1])]
    return float(np.abs(np.roots([1.0, -1.0 - z * weights[0], *(-z * weight for weight in weights[1:])])).max())


def limit(grows: Callable[[float], float], excess: float, most: float = 4.0) -> float:
    """The omega h from which on an oscillator grows by more than `excess` in a step, to 1e-4; inf beyond `most`."""
    if grows(most) <= 1.0 + excess:
        return math.inf
    low, high = 0.0, most
    while high - low > 1e-4:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if grows(middle) > 1.0 + excess else (middle, high)
    return 0.5 * (low + high)


def limits(name: str, damping: float) -> list[float]:
    """Known limit, known limit of growth by 1 % in a step, and the same measured."""
    return [limit(lambda turn: known_growth(name, turn, damping), 1e-12), limit(lambda turn: known_growth(name, turn, damping), 0.01),
            limit(lambda turn: growth(SCHEMES[name][2], turn, damping), 0.01)]


def order(scheme: Scheme, damping: float, steps: Sequence[int] = (160, 320)) -> float:
    """The order of convergence on an oscillator over five periods, from these steps in a period."""
    exact = problems.oracle(problems.oscillator(damping))
    errors = [float(np.abs(scheme(problems.oscillator(damping), 2.0 * math.pi / n) - exact).max()) for n in steps]
    return math.log(errors[0] / errors[1]) / math.log(steps[1] / steps[0])


def drift(scheme: Scheme, each: int, cost: float = 48.0, spans: int = 8) -> list[float]:
    """Energy over that at the start, less 1, of the coupled oscillators after each of `spans` spans of two slow periods."""
    out: list[float] = []
    problem = problems.coupled()
    first = problem.energy(problem.start) if problem.energy else 0.0
    for _ in range(spans):
        y = solved(problem, scheme, each * problem.fast / cost)
        if y is None or problem.energy is None:
            return [*out, math.inf]
        out.append(problem.energy(y) / first - 1.0)
        problem.start = y
    return out


def impacts(restitution: float, phases: int = 4) -> Callable[[float], list[Problem]]:
    """Impacts that begin at `phases` places within a step."""
    return lambda h: [problems.impact(restitution, (k + 0.5) / phases * h) for k in range(phases)]


def falling_bed(end: float = 4.0) -> Problem:
    """Grains without friction fall on the floor at 1 m/s, over `end` durations of an impact at that speed."""
    bed = Bed(restitution=0.7, friction=0.0)
    x = bed.lattice()
    v = np.random.default_rng(2).uniform(-0.1, 0.1, len(x))
    v[1::3] -= 1.0
    v[2::3] = 0.0
    bed.keep_near(x, 1.7)
    return bed.problem(x, v, problems.NONE, end * problems.duration(1.0, 0.5 * problems.MASS, 0.5 * problems.RADIUS))


@cache
def bed_at_rest() -> tuple[Array, Array]:
    """Positions and springs of a bed that has fallen and come to rest."""
    soft = Bed(restitution=0.05, friction=0.3)
    x, v, s = soft.lattice(), np.zeros(150), np.zeros(len(soft.body))
    h = problems.duration(1.0) / 20.0
    for part in range(25):
        x, v, s = soft.problem(x, v, s, 300 * h).parts(verlet(soft.problem(x, v, s, 300 * h), h, lagged=True))
        v = v * (1.0 if part < 10 else 0.1)
    return x, s


def bed_limit(restitution: float = 1.0, steps: int = 500) -> dict[str, float]:
    """The step at which a bed at rest, whose contacts do not slide, becomes unstable: omega h, with the highest frequency `omega` (rad/s)
    of small motions without damping, measured by what a push of 1e-9 m/s becomes; and the steps that the shortest contact then lasts."""
    (x, s), bed = bed_at_rest(), Bed(restitution, friction=1e9)
    overlap = bed.geometry(x, 0.0 * x)[0]
    stiffness = 2.0 * problems.E_STAR * bed.root * np.sqrt(np.maximum(overlap, 0.0))
    shortest = math.pi * float(np.sqrt(np.min(bed.mass / np.maximum(stiffness, 1e-300))))
    highest, rest = bed.stiffest(x, s), bed.acceleration(x, 0.0 * x, s)
    push = np.random.default_rng(3).uniform(-1e-9, 1e-9, len(x))

    def grows(turn: float) -> bool:
        problem = bed.problem(x, push, s, steps * turn / highest)
        problem.acceleration = lambda x, v, s: bed.acceleration(x, v, s) - rest  # exactly at rest
        y = solved(problem, SCHEMES["engines"][2], turn / highest)
        return y is None or float(np.abs(y[150:300]).max()) > 1e-6

    low, high = 0.1, 2.5
    assert grows(high) and not grows(low)
    while high - low > 0.02:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if grows(middle) else (middle, high)
    turn = 0.5 * (low + high)
    return {"omega": highest, "turn": turn, "shortest": shortest, "steps": shortest * highest / turn}


def step_table() -> list[dict[str, float]]:
    """Rows: steps per impact, restitution, and the mean and largest error of the velocity after the impact in the engines' scheme."""
    rows = []
    for restitution in (1.0, 0.9, 0.7, 0.5, 0.3):
        exact = problems.impact_oracle(restitution)
        for steps in STEPS:
            h = problems.duration(1.0) / steps
            found = [solved(one, SCHEMES["engines"][2], h) for one in impacts(restitution, 16)(h)]
            errors = np.array([1e9 if y is None else y[1] - exact for y in found])
            rows.append({"restitution": restitution, "steps": steps, "mean": float(errors.mean()), "largest": float(np.abs(errors).max())})
    return rows


@cache
def bed_oracle(tolerance: float) -> Array:
    """What the falling bed measures at its end."""
    bed = falling_bed()
    return bed.measure(problems.oracle(bed, tolerance))


def oracles() -> dict[str, float]:
    """How far the references change when their tolerance is a hundred times larger."""
    alternating = problems.alternating()
    return {"alternating": float(np.abs(problems.oracle(alternating) - problems.oracle(alternating, 1e-11)).max()),
            "impact": abs(problems.impact_oracle(0.7) - problems.impact_oracle(0.7, 1e-11)),
            "block": float(np.abs(problems.block_oracle() - problems.block_oracle(1e-11)).max()),
            "bed": float(np.abs(bed_oracle(1e-12) - bed_oracle(1e-10)).max())}


def measured(only: Sequence[str] | None) -> Iterator[tuple[str, Any]]:
    """All that the page shows, or some of it, part by part."""
    alternating, bed = problems.alternating(), falling_bed()
    parts: dict[str, Callable[[], Any]] = {
        "oracles": oracles,
        "orders": lambda: {name: {str(damping): order(scheme, damping) for damping in (0.0, 0.1)}
                           for name, (_, _, scheme) in SCHEMES.items()},
        "limits": lambda: {name: {str(damping): limits(name, damping) for damping in (0.0, 0.2)} for name in SCHEMES},
        "drift": lambda: {name: drift(scheme, each) for name, (_, each, scheme) in SCHEMES.items()},
        "alternating": lambda: work(lambda _: [alternating], problems.oracle(alternating)),
        "impact": lambda: work(impacts(0.7), np.array([problems.impact_oracle(0.7)])),
        "block": lambda: work(lambda _: [problems.block()], problems.block_oracle()),
        "bed": lambda: work(lambda _: [bed], bed_oracle(1e-12), COSTS[1::2]),
        "step": step_table,
        "bed_limit": lambda: {str(e): bed_limit(e) for e in (1.0, 0.7, 0.5, 0.3, 0.1)}}
    for name in only or parts:
        print(f"dembark: {name}", file=sys.stderr, flush=True)
        yield name, parts[name]()


def main(words: Sequence[str] | None = None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.schemes", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("docs/figures/schemes.json"), help="file of the results (default %(default)s)")
    parser.add_argument("--only", nargs="+", choices=PARTS, help="measure these parts anew; the file keeps the others")
    given = parser.parse_args(words)
    found = json.loads(given.out.read_text(encoding="utf-8")) if given.only and given.out.is_file() else {}
    for name, part in measured(given.only):
        found[name] = part
        given.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
