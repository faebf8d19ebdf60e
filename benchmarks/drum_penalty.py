"""The drum by the complementarity fix and by a penalty law of the same stiffness, in LIGGGHTS: error and cost against the time step.

    python -m benchmarks.drum_penalty [--out docs/figures/drum_penalty.json] [--figure docs/figures/drum_penalty.png]

Penalty: `pair_style gran model hooke/stiffness` with the stiffness and damping of each contact as in the fix, and nve/sphere. Steps are
given as omega tau, omega = sqrt(log stiffness / mass of the thinnest log), the highest frequency of any contact.

- `pair`: two equal logs meet, in a few lines of Python: restitution, averaged over where in a step they touch; 1 is exact.
- `closed`: logs fall and bounce without friction or damping in a drum at rest; what must not change is their energy. Error: largest change
  over the energy that falling sets free.
- `turning`: friction, damping, the drum turns. Moment of the drum, kinetic energy and largest force on a log, means over four revolutions;
  the reference is the mean of both laws without numerical loss at the two smallest steps.

- `many`: the same turning drum with 1000 logs, in a drum as large and as fast as gives the same filling and Froude number; with logs of the
  given stiffness, and 16 and 64 times as stiff.

Cost is the engine's processor time for a second of simulated time, in runs of their own that write nothing, less the start of the engine:
the fall of the logs and the first turn, medians of three rounds in which all laws and steps take turns. `--prices` measures it again.
"""

from __future__ import annotations

import argparse
import json
import math
import resource
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from dembark.postproc.statistics import student
from dembark.validation import engines

Array = NDArray[np.float64]
LOGS, LOW, HIGH, DENSITY, FILLING = 60, 0.10, 0.25, 850.0, 0.3
STIFFNESS, SHELL, DAMPING, GRAVITY, SPEED = 1e7, 5e7, 3000.0, 9.81, 1.2
STEPS = (0.05, 0.1, 0.2, 0.5, 1.0, 1.9, 4.0)
LARGE_STEPS = (0.1, 0.2, 0.5, 1.0, 1.9, 4.0, 8.0, 16.0)  # of the turning drum
REVOLUTIONS = 5  # of it, the first of which is left out
MANY = 1000
SKIN = 0.08  # m, of the neighbour lists: the penalty law's cheapest at its largest step; the fix costs the same with any
LAWS = {"theta 1": "fix, θ = 1", "theta 0.5": "fix, θ = ½", "penalty": "hooke/stiffness"}
MANY_LAWS = {**LAWS, "theta 1 sweeps 5": "fix, θ = 1, sweeps 5"}
MANY_STEPS = {  # of 1000 logs, by their stiffness; 8 of the first is as long as 32 and 64 of the others
    1.0: {"penalty": (0.2, 0.5, 1.0, 1.9), "theta 1": (0.2, 1.0, 2.0, 4.0, 8.0, 16.0), "theta 0.5": (0.2, 1.0, 4.0),
          "theta 1 sweeps 5": (8.0, 16.0, 32.0)},
    16.0: {"penalty": (1.0,), "theta 1": (32.0, 64.0), "theta 1 sweeps 5": (32.0, 64.0)},
    64.0: {"penalty": (1.0,), "theta 1": (64.0, 128.0), "theta 1 sweeps 5": (64.0, 128.0)},
}
TOLERANCE = 0.1
SHOWN = (0.1, 1.0, 4.0)  # steps in the guide's table; the data file has all


def restitution(turn: float, law: str, phases: int = 64) -> tuple[float, float]:
    """(mean, half of the range) of the restitution of two bodies at omega tau = `turn`, over where in a step the contact begins.

    Reduced mass, stiffness and approach speed are 1; leapfrog, the force from the gap of the step's begin (penalty) or from the
    complementarity of the theta-weighted gap.
    """
    found = []
    for phase in (np.arange(phases) + 0.5) / phases:
        gap, rate, theta = phase * turn, -1.0, {"theta 1": 1.0, "theta 0.5": 0.5}.get(law)
        for _ in range(100000):
            if theta is None:
                force = max(0.0, -gap)
            else:
                force = max(0.0, -(gap + (2.0 * theta - 1.0) * turn * rate) / (1.0 + theta * turn**2))
            rate += turn * force
            gap += turn * rate
            if gap > 0.0 and rate > 0.0:
                break
        found.append(rate)
    return float(np.mean(found)), 0.5 * float(np.ptp(found))


def logs(count: int = LOGS) -> tuple[Array, Array, float]:
    """Places (n, 2), diameters (n,) and the drum's radius, in m."""
    diameters = LOW + (HIGH - LOW) * (np.random.default_rng(1).permutation(count) + 0.5) / count
    radius = 0.5 * math.sqrt(float((diameters**2).sum()) / FILLING)
    spacing, reach = 1.02 * HIGH, math.ceil(radius / HIGH)
    rise = 0.5 * math.sqrt(3.0) * spacing
    sites = [((i + 0.5 * (k % 2)) * spacing, k * rise) for k in range(-2 * reach, 2 * reach) for i in range(-reach, reach)]
    inside = [site for site in sites if math.hypot(*site) <= radius - 0.52 * HIGH][:count]
    return np.array(inside), diameters, radius


def highest_frequency(stiffer: float = 1.0) -> float:
    """omega (rad/s) that the steps are given in, of logs that are so many times as stiff."""
    return math.sqrt(stiffer * STIFFNESS / (0.25 * math.pi * DENSITY * LOW**2))


def drum_speed(count: int) -> float:
    """rad/s: the Froude number of the drum of 60 logs."""
    return SPEED * math.sqrt(logs()[2] / logs(count)[2])


def deck(law: str, step: float, seconds: float, rows: int, *, turning: bool, count: int = LOGS, stiffer: float = 1.0) -> str:
    """The deck of one run that writes `rows` rows: time, kinetic, potential and elastic energy, moment of the shell, largest force.

    The drum's axis is z: the engine's own cylinders do not turn about y.
    """
    places, diameters, radius = logs(count)
    every = max(1, math.ceil(seconds / step / max(rows, 1)))
    friction, damping, speed = (0.4, DAMPING * math.sqrt(stiffer), drum_speed(count)) if turning else (0.0, 0.0, 0.0)
    log, shell = stiffer * STIFFNESS, stiffer * SHELL
    lines = ["units si", "atom_style granular", "atom_modify map array sort 0 0.0", "boundary f f f", "newton off",
             "communicate single vel yes",
             f"region domain block {-1.1 * radius} {1.1 * radius} {-1.1 * radius} {1.1 * radius} -0.2 0.2 units box", "create_box 2 domain",
             f"neighbor {SKIN} bin", "neigh_modify delay 0", f"timestep {step!r}"]
    for number, ((x, y), diameter) in enumerate(zip(places, diameters, strict=True), 1):
        lines += [f"create_atoms 1 single {float(x)!r} {float(y)!r} 0 units box",
                  f"set atom {number} diameter {float(diameter)!r} density {1.5 * DENSITY / float(diameter)!r}"]
    weight = f"fix weight all gravity {GRAVITY} vector 0 -1 0"
    if law == "penalty":
        pair, wall = 0.5 * log, log * shell / (log + shell)

        def table(of_pair: float, of_wall: float) -> str:
            return f"peratomtypepair 2 {of_pair!r} {of_wall!r} {of_wall!r} {of_wall!r}"

        lines += [f"fix p1 all property/global kn {table(pair, wall)}", f"fix p2 all property/global kt {table(pair / 3.5, wall / 3.5)}",
                  f"fix p3 all property/global gamman_abs {table(damping, damping)}",
                  f"fix p4 all property/global gammat_abs {table(0.0, 0.0)}",
                  f"fix p5 all property/global coefficientFriction {table(friction, 1.5 * friction)}",
                  "pair_style gran model hooke/stiffness tangential history absolute_damping on tangential_damping off limitForce on",
                  "pair_coeff * *", weight,
                  ("fix shell all wall/gran model hooke/stiffness tangential history primitive type 2 zcylinder "
                   f"{radius!r} 0 0 shear x {speed!r} absolute_damping on tangential_damping off limitForce on")]
        elastic = "0"
    else:
        lines += [weight, (f"fix hits all lcp/impact stiffness {log} {log} contact_damping {damping} {law} "
                          f"friction {friction} tangential_ratio {1 / 3.5!r} inertia sphere "
                          f"wall cylinder shell z 0 0 {radius!r} stiffness {shell} friction {1.5 * friction} omega {speed!r}")]
        elastic = "f_hits[7]"
    lines.append("fix motion all nve/sphere")
    if rows == 0:
        return "\n".join([*lines, f"thermo {every}", "thermo_modify lost error norm no", f"run {every}", "print finished"]) + "\n"
    lines += ["compute own all property/atom radius omegaz tqz mass",
              "variable spin atom 0.2*c_own[4]*c_own[1]^2*c_own[2]^2", f"variable height atom c_own[4]*{GRAVITY}*y",
              f"variable moment atom x*(fy+c_own[4]*{GRAVITY})-y*fx+c_own[3]", "variable size atom sqrt(fx^2+fy^2)",
              "compute moving all ke", "compute sums all reduce sum v_spin v_height", "compute shell all reduce sum v_moment",
              "compute largest all reduce max v_size", f"fix means all ave/time 1 {every} {every} c_shell c_largest",
              "variable t equal step*dt", "variable ke equal c_moving+c_sums[1]",
              "variable pe equal c_sums[2]", f"variable el equal {elastic}",
              "variable m equal f_means[1]", "variable f equal f_means[2]",
              f'fix history all print {every} "${{t}} ${{ke}} ${{pe}} ${{el}} ${{m}} ${{f}}" file rows.txt screen no title "#"',
              f"dump logs all custom {every} logs.dump id x y radius", 'dump_modify logs sort id format "%d %.15g %.15g %.15g"',
              "thermo_style custom step ke", "thermo_modify lost error norm no", f"thermo {every}", f"run {every * rows}", "print finished"]
    return "\n".join(lines) + "\n"


def overlap_energy(folder: Path, count: int = LOGS) -> Array:
    """Energy (J) in the contacts of each frame after the first, from the overlaps of the undeformed logs and the penalty stiffness."""
    _, _, radius = logs(count)
    pair, wall = 0.5 * STIFFNESS, STIFFNESS * SHELL / (STIFFNESS + SHELL)
    found = []
    for frame in (folder / "logs.dump").read_text().split("ITEM: TIMESTEP\n")[2:]:
        x, y, r = np.array([line.split()[1:] for line in frame.split("\n")[8:-1]], float).T
        overlap = np.maximum(0.0, r[:, None] + r - np.hypot(x[:, None] - x, y[:, None] - y))
        np.fill_diagonal(overlap, 0.0)
        found.append(0.25 * pair * (overlap**2).sum() + 0.5 * wall * (np.maximum(0.0, np.hypot(x, y) + r - radius) ** 2).sum())
    return np.array(found)


def spent_by(words: str, folder: Path) -> tuple[float, str | None]:
    """Processor time (s) of a run of this deck, and the engine's last word when it did not end."""
    engine = engines.find("liggghts")
    (folder / "drum.in").write_text(words)
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    done = subprocess.run([str(engine.executable), "-in", "drum.in", "-log", "none"], cwd=folder, env=engine.environment(), text=True,
                          errors="replace", capture_output=True, stdin=subprocess.DEVNULL, check=False)
    spent = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
    if done.returncode or "finished" not in done.stdout:
        return spent, "".join([line for line in (done.stdout + done.stderr).splitlines() if "ERROR" in line][-1:]) or "no word"
    return spent, None


def run(law: str, turn: float, seconds: float, rows: int, *, turning: bool, count: int = LOGS, stiffer: float = 1.0) -> dict[str, Any]:
    """The rows of one run; `failed` holds the engine's last word when it did not end."""
    step = turn / highest_frequency(stiffer)
    with tempfile.TemporaryDirectory(prefix="dembark-penalty-") as name:
        folder = Path(name)
        _, failed = spent_by(deck(law, step, seconds, rows, turning=turning, count=count, stiffer=stiffer), folder)
        if failed:
            return {"failed": failed}
        time, kinetic, potential, elastic, moment, force = np.loadtxt(folder / "rows.txt").T
        if law == "penalty" and not turning:
            elastic = overlap_energy(folder, count)
    return {"time": time, "kinetic": kinetic, "potential": potential, "elastic": elastic, "moment": moment, "force": force}


def closed(law: str, turn: float) -> dict[str, Any]:
    """Energy error of a second in the closed drum."""
    found = run(law, turn, 1.0, 40, turning=False)
    if "failed" in found:
        return {"law": law, "turn": turn, "error": None, **found}
    places, diameters, _ = logs()
    begin = float((0.25 * math.pi * DENSITY * diameters**2 * GRAVITY * places[:, 1]).sum())
    change = found["kinetic"] + found["potential"] + found["elastic"] - begin
    freed = begin - float(found["potential"].min())
    return {"law": law, "turn": turn, "error": float(np.abs(change).max() / freed), "change": float(change[-1] / freed)}


def turning(law: str, turn: float, *, count: int = LOGS, stiffer: float = 1.0, revolutions: int = REVOLUTIONS) -> dict[str, Any]:
    """Means and 95 % half-widths, from blocks of half a revolution."""
    entry: dict[str, Any] = {"law": law, "turn": turn, "stiffer": stiffer}
    found = run(law, turn, 2.0 * math.pi * revolutions / drum_speed(count), 100 * revolutions, turning=True, count=count, stiffer=stiffer)
    if "failed" in found:
        return {**entry, **found}
    for name in ("moment", "kinetic", "force"):
        blocks = found[name][100:].reshape(2 * (revolutions - 1), -1).mean(axis=1)
        entry[name] = [float(blocks.mean()), student(len(blocks) - 1) * float(blocks.std(ddof=1)) / math.sqrt(len(blocks))]
    return entry


def many(report: Callable[[dict[str, Any]], None]) -> list[dict[str, Any]]:
    """The turning drum with 1000 logs."""
    found = []
    for stiffer, steps in MANY_STEPS.items():
        for law, turns in steps.items():
            for turn in turns:
                found.append(turning(law, turn, count=MANY, stiffer=stiffer, revolutions=4))
                report(found[-1])
    return found


def price(entries: Sequence[dict[str, Any]], seconds: float, *, turning: bool, count: int, rounds: int = 3) -> None:
    """Add to each entry of a run that ended `cost` (s for a simulated second), its range, and `cost_of_a_step` (s)."""
    spent: list[list[float]] = [[] for _ in entries]
    with tempfile.TemporaryDirectory(prefix="dembark-penalty-") as name:
        for _ in range(rounds):
            for entry, values in zip(entries, spent, strict=True):
                if "failed" not in entry:
                    stiffer = entry.get("stiffer", 1.0)
                    step = entry["turn"] / highest_frequency(stiffer)
                    decks = [deck(entry["law"], step, until, 0, turning=turning, count=count, stiffer=stiffer) for until in (seconds, 0.0)]
                    full, start = (spent_by(words, Path(name))[0] for words in decks)
                    values.append((full - start) / seconds)
    for entry, values in zip(entries, spent, strict=True):
        if values:
            step = entry["turn"] / highest_frequency(entry.get("stiffer", 1.0))
            middle = float(np.median(values))
            entry |= {"cost": middle, "cost_range": [min(values), max(values)], "cost_of_a_step": middle * step}


def prices(found: dict[str, Any]) -> None:
    """The cost of everything in `found`."""
    price(found["closed"], 5.0, turning=False, count=LOGS)
    price(found["turning"], 5.0, turning=True, count=LOGS)
    price(found["many"], 5.0, turning=True, count=MANY)


def reference_of(entries: Sequence[dict[str, Any]], name: str) -> tuple[float, float]:
    """Mean and half-width of `name` at the two smallest steps of the two laws without numerical loss."""
    small = sorted({one["turn"] for one in entries})[:2]
    chosen = [one[name] for one in entries if one["law"] in ("theta 0.5", "penalty") and one["turn"] in small and "failed" not in one]
    return float(np.mean([mean for mean, _ in chosen])), math.hypot(*(half for _, half in chosen)) / len(chosen)


def usable(entries: Sequence[dict[str, Any]], references: dict[str, tuple[float, float]]) -> float | None:
    """Largest step up to which all means of one law agree with `references`: within 10 % and the joint interval, but never beyond 20 %."""
    largest = None
    for entry in sorted(entries, key=lambda one: one["turn"]):
        if "failed" in entry:
            break
        gaps = [(abs(entry[name][0] - mean), math.hypot(entry[name][1], half), mean) for name, (mean, half) in references.items()]
        if not all(gap <= min(TOLERANCE * mean + joint, 2.0 * TOLERANCE * mean) for gap, joint, mean in gaps):
            break
        largest = entry["turn"]
    return largest


def judge(runs: Sequence[dict[str, Any]], laws: Iterable[str]) -> dict[str, dict[str, float | None]]:
    """The largest usable step of each law, for motion and for forces."""
    return {law: {what: usable([one for one in runs if one["law"] == law], {name: reference_of(runs, name) for name in names})
                  for what, names in (("motion", ("moment", "kinetic")), ("forces", ("force",)))} for law in laws}


def conclude(found: dict[str, Any]) -> None:
    """Add the largest usable steps to `found`."""
    found["usable"] = judge(found["turning"], LAWS)
    found["usable_many"] = judge([one for one in found["many"] if one["stiffer"] == 1.0], MANY_LAWS)


def cells(entry: dict[str, Any] | None) -> list[str]:
    """Moment, kinetic energy, largest force, microseconds per step and processor time per second of a turning drum."""
    if entry is None:
        return ["–"] * 5
    if "failed" in entry:
        return ["lost logs"] * 3 + ["–"] * 2
    return [f"{mean:.0f} ± {half:.0f}" for mean, half in (entry[name] for name in ("moment", "kinetic", "force"))] + [
        f"{1e6 * entry['cost_of_a_step']:.0f}", f"{entry['cost']:.2g}"]


def markdown(found: dict[str, Any]) -> str:
    """The table of the guide."""
    lines = [("| ωτ | law | energy error | torque (N m) | kinetic energy (J) | largest force (N) | µs per step "
              "| s per simulated second |"), "|---|---|---|---|---|---|---|---|"]
    for turn in SHOWN:
        for law, label in LAWS.items():
            still = next((one for one in found["closed"] if one["law"] == law and one["turn"] == turn), None)
            moving = next((one for one in found["turning"] if one["law"] == law and one["turn"] == turn), None)
            error = "–" if still is None else "lost logs" if still["error"] is None else f"{still['error']:.2g}"
            lines.append(f"| {turn:g} | {label} | {error} | " + " | ".join(cells(moving)) + " |")
    return "\n".join(lines)


def draw(found: dict[str, Any], path: Path) -> None:
    """Three panels: restitution of a pair, energy error against the step, energy error against cost."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import NullFormatter

    figure = Figure(figsize=(10.0, 3.4), layout="constrained")
    one, two, three = figure.subplots(1, 3)
    colours = dict(zip(LAWS, ("#0072B2", "#009E73", "#D55E00"), strict=True))
    for law, label in LAWS.items():
        rows = [entry for entry in found["pair"] if entry["law"] == law]
        turn, mean, half = (np.array([row[key] for row in rows]) for key in ("turn", "mean", "half_range"))
        one.plot(turn, mean, color=colours[law], label=label)
        one.fill_between(turn, mean - half, mean + half, color=colours[law], alpha=0.15, linewidth=0)
        rows = [entry for entry in found["closed"] if entry["law"] == law and entry["error"] is not None]
        for axes, key in ((two, "turn"), (three, "cost")):
            axes.loglog([row[key] for row in rows], [row["error"] for row in rows], "o-", color=colours[law], markersize=3.5)
    turn = np.linspace(0.0, 2.0, 50)
    one.plot(turn, np.exp(-0.5 * math.pi * turn), "k:", linewidth=1.0, label="exp(−πωτ/2)")
    one.set(xlabel="ωτ", ylabel="restitution", title="Two logs, no damping", ylim=(0.0, 1.6), xlim=(0.0, 2.0))
    two.set(xlabel="ωτ", ylabel="energy error of 1 s", title="60 logs, nothing lost")
    three.set(xlabel="processor time (s) per second", ylabel="energy error of 1 s", title="The same against cost")
    one.legend(fontsize=7, frameon=False)
    for axes in (one, two, three):
        axes.grid(alpha=0.3)
        axes.xaxis.set_minor_formatter(NullFormatter())
    figure.savefig(path, dpi=110)


def main(words: list[str]) -> int:
    """Measure, write, draw."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("docs/figures/drum_penalty.json"))
    parser.add_argument("--figure", type=Path, default=Path("docs/figures/drum_penalty.png"))
    parser.add_argument("--redraw", action="store_true", help="only judge and draw what --out holds")
    parser.add_argument("--many", action="store_true", help="of the runs of --out only those with 1000 logs again, and all prices")
    parser.add_argument("--prices", action="store_true", help="only measure again what the runs of --out cost")
    options = parser.parse_args(words)
    anew = not (options.redraw or options.prices or options.many)
    if anew:
        fine = (*np.geomspace(0.01, 0.2, 8), *np.linspace(0.3, 2.0, 18))
        found: dict[str, Any] = {"logs": LOGS, "omega": highest_frequency(), "pair": [], "closed": [], "turning": []}
        for law in LAWS:
            for turn in fine:
                mean, half = restitution(float(turn), law)
                found["pair"].append({"law": law, "turn": float(turn), "mean": mean, "half_range": half})
            for turn in STEPS:
                found["closed"].append(closed(law, turn))
                print(json.dumps(found["closed"][-1]), flush=True)
            for turn in LARGE_STEPS:
                found["turning"].append(turning(law, turn))
                print(json.dumps(found["turning"][-1]), flush=True)
    else:
        found = json.loads(options.out.read_text(encoding="utf-8"))
    if anew or options.many:
        found["many"] = many(lambda entry: print(json.dumps(entry), flush=True))
    if not options.redraw:
        prices(found)
    conclude(found)
    options.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    draw(found, options.figure)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
