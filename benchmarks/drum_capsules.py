"""Logs in space in a turning drum, next to logs in cross-section: cost, tilt, impacts, and the way of the logs through an inclined drum.

    python -m benchmarks.drum_capsules [--logs 300] [--revolutions 10] [--only PART] [--out FILE.json]

Logs are 1.2 m long in all and 0.10 to 0.24 m thick; GOST 10.4-69 has pulpwood of 8 to 24 cm and of 1.0, 1.2, ... 3.0 m. The mean ratio of
length to diameter is 7. Density, stiffness, damping and friction are those of `benchmarks.drum_penalty`, all of them assumed, and so is the
drum: its radius of 1.3 m, and the length at which the logs fill 0.3 of it.

- `closed`: a level drum with end plates that turn with it.
- `section`: as many logs in cross-section, at the same filling and Froude number; the same step.
- `inclined`: the drum repeats after its length (a period), and gravity is tilted by the slope; the logs move along it for ever. The mean
  speed along the axis gives the time that a log takes through a drum of a given length. A drum with a feed and a gate has ends; this has
  none, so what holds back logs at a gate is not in the numbers.
- `engine`: the first second of `closed` and `section` in LIGGGHTS, YADE and Python: largest distance of a log from its place in Python
  after half a second, and the cost of a step, medians of three rounds in which all take turns.
- `crib`: one step of a stack of crossed layers on a floor, with a contact of every log with every one of the layers above and below.

Means have 95 % intervals over quarters of a revolution, after the first revolution. Cost is the processor time of a step.
"""

from __future__ import annotations

import argparse
import json
import math
import resource
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.drum_penalty import DAMPING, DENSITY, FILLING, GRAVITY, SHELL, SPEED, STIFFNESS, spent_by
from dembark.physics import CapsuleSystem, Drum, ImpactMotion, ImpactSystem, Plane
from dembark.postproc import GrainsDump
from dembark.postproc.debarking import ForceRange, Load, Logs, outcome
from dembark.postproc.impacts import RECORD
from dembark.postproc.statistics import student
from dembark.validation import engines

Array = NDArray[np.float64]
TOTAL, THIN, THICK = 1.2, 0.10, 0.24  # m
RADIUS, FRICTION, STEP, THETA = 1.3, 0.4, 2e-4, 0.5
SLOPES = (2.0, 4.0)  # degrees
SLOWEST = 0.1  # m/s: what begins slower is no impact
RANGE = ForceRange(1800.0, 1e4)  # N, as in the studies of debarking_drum
SAMPLES = 80  # a revolution


def logs(count: int, seed: int = 1) -> tuple[Array, Array, Array]:
    """Radius (m), length of the cylinder (m) and mass (kg)."""
    r = np.random.default_rng(seed).uniform(THIN / 2, THICK / 2, count)
    length = TOTAL - 2 * r
    return r, length, DENSITY * math.pi * r**2 * (length + 4 / 3 * r)


def drum_length(count: int) -> float:
    """m, at which the logs fill FILLING of the drum."""
    return float(logs(count)[2].sum()) / DENSITY / (FILLING * math.pi * RADIUS**2)


def places(count: int, radius: float, layers: int) -> Array:
    """(x, y) and number of the layer of each log, on lattices of triangles in the drum."""
    edge = 1.01 * THICK
    n = int(radius / edge) + 1
    sites = np.array([(edge * (i + 0.5 * (j % 2)), edge * math.sqrt(0.75) * j) for j in range(-n, n + 1) for i in range(-n, n + 1)])
    sites = sites[np.hypot(*sites.T) < radius - 0.51 * THICK]
    sites = sites[np.argsort(sites[:, 1], kind="stable")]
    if len(sites) * layers < count:
        raise ValueError(f"{count} logs do not fit into the drum")
    return np.array([(*sites[k // layers], k % layers) for k in range(count)])


def layout(count: int, *, in_space: bool) -> tuple[Array, float, float, float]:
    """Places (m) of the logs at the start, radius (m), speed (rad/s) and length (m) of their drum; a cross-section has no length."""
    long = drum_length(count) if in_space else 0.0
    layers = int(long / (1.01 * TOTAL)) if in_space else 1
    radius = RADIUS if in_space else math.sqrt(float(np.sum(logs(count)[0] ** 2)) / FILLING)
    spot = places(count, radius, layers)
    spot[:, 2] = ((spot[:, 2] + 0.5) / layers - 0.5) * long
    return spot, radius, SPEED * math.sqrt(RADIUS / radius), long


def space(count: int, slope: float | None) -> CapsuleSystem:
    """The level, closed drum (slope None), or the one that repeats along its axis, with a slope in degrees."""
    r, length, mass = logs(count)
    spot, radius, speed, long = layout(count, in_space=True)
    shell = Drum(radius=radius, omega=speed, stiffness=SHELL)
    tilt = math.radians(slope or 0.0)
    return CapsuleSystem(mass, r, length, spot, stiffness=STIFFNESS, friction=FRICTION, theta=THETA, contact_damping=DAMPING,
                         gravity=(0.0, -GRAVITY * math.cos(tilt), GRAVITY * math.sin(tilt)), period=0.0 if slope is None else long,
                         walls=[shell, *shell.end_plates(long)] if slope is None else [shell])


def section(count: int) -> tuple[ImpactSystem, float]:
    """As many discs, and the speed of their drum (rad/s)."""
    r, _, mass = logs(count)
    spot, radius, speed, _ = layout(count, in_space=False)
    return ImpactSystem(mass, r, spot[:, :2], stiffness=STIFFNESS, friction=FRICTION, theta=THETA,
                        contact_damping=DAMPING, gravity=(0.0, -GRAVITY), walls=[Drum(radius=radius, omega=speed, stiffness=SHELL)]), speed


def run(system: CapsuleSystem | ImpactSystem, speed: float, revolutions: float) -> tuple[ImpactMotion, float]:
    """The motion after the first revolution, and the processor time of a step (s)."""
    turn = 2 * math.pi / speed
    every = round(turn / SAMPLES / STEP)
    system.run(turn, STEP, every=every)
    begin = time.process_time()
    motion = system.run((revolutions - 1) * turn, STEP, every=every)
    return motion, (time.process_time() - begin) / max(1, round((revolutions - 1) * turn / STEP))


def deck(count: int, steps: int, *, in_space: bool) -> tuple[str, str]:
    """LIGGGHTS's script of the level, closed drum, or of the cross-section, and its list of logs; the last frame is dumped."""
    r, length, mass = logs(count)
    spot, radius, speed, long = layout(count, in_space=in_space)
    wide, high = 1.1 * radius, 0.6 * long + 0.5
    lines = ["units si", "atom_style granular", "atom_modify map array sort 0 0.0", "boundary f f f", "newton off",
             "communicate single vel yes",
             f"region domain block {-wide} {wide} {-wide} {wide} {-high} {high} units box",
             "create_box 1 domain", "neighbor 0.05 bin", "neigh_modify delay 0", f"timestep {STEP!r}"]
    for number, (place, own, weight) in enumerate(zip(spot.tolist(), r.tolist(), mass.tolist(), strict=True), 1):
        lines += [f"create_atoms 1 single {place[0]!r} {place[1]!r} {place[2]!r} units box", f"set atom {number} diameter {2 * own!r}",
                  f"set atom {number} mass {weight!r}"]
    hits = (f"fix hits all lcp/impact stiffness {STIFFNESS} theta {THETA} contact_damping {DAMPING} friction {FRICTION} "
            f"{'logs logs.txt' if in_space else ''} wall cylinder shell z 0 0 {radius!r} stiffness {SHELL} omega {speed!r}")
    if in_space:
        for name, side in (("back", "lo"), ("front", "hi")):
            hits += f" wall plane {name} z {(0.5 if side == 'hi' else -0.5) * long!r} {side} stiffness {SHELL} omega {speed!r} 0 0"
    lines += [f"fix weight all gravity {GRAVITY} vector 0 -1 0", hits, "fix motion all nve/sphere",
              f"dump logs all custom {max(1, steps)} logs.dump id x y z radius mass",
              'dump_modify logs sort id format "%d %.15g %.15g %.15g %.15g %.15g"',
              f"thermo {max(1, steps)}", f"run {steps}", "print finished"]
    return "\n".join(lines) + "\n", "".join(f"{n} {float(own)!r} 0 0 1\n" for n, own in enumerate(length, 1))


def in_liggghts(count: int, steps: int, *, in_space: bool) -> tuple[float, Array]:
    """Cost of a step (ms) without the start of the engine, and the places (m) of the logs at the end."""
    with tempfile.TemporaryDirectory(prefix="dembark-logs-") as name:
        folder, spent = Path(name), []
        for length in (0, steps):
            script, listed = deck(count, length, in_space=in_space)
            (folder / "logs.txt").write_text(listed)
            cost, failed = spent_by(script, folder)
            if failed:
                raise RuntimeError(failed)
            spent.append(cost)
        return 1e3 * (spent[1] - spent[0]) / steps, GrainsDump(folder / "logs.dump")[-1].positions


def in_yade(count: int, steps: int, *, in_space: bool) -> tuple[float, Array]:
    """As in LIGGGHTS."""
    r, length, mass = logs(count)
    spot, radius, speed, long = layout(count, in_space=in_space)
    words = [{"position": place, "radius": own, "mass": weight, **({"length": more} if in_space else {})}
             for place, own, weight, more in zip(spot.tolist(), r.tolist(), mass.tolist(), length.tolist(), strict=True)]
    drum = {"logs": words, "radius": radius, "omega": speed, "length": long, "step": STEP, "shell": SHELL, "gravity": GRAVITY,
            "impact": {"stiffness": STIFFNESS, "theta": THETA, "contactDamping": DAMPING, "friction": FRICTION}}
    engine = engines.find("yade")
    with tempfile.TemporaryDirectory(prefix="dembark-logs-") as name:
        (Path(name) / "drum.json").write_text(json.dumps(drum))
        words_of_run = engine.command(Path(__file__).parent / "yade_drum.py", {"drum": "drum.json", "steps": steps})
        done = engines.call(words_of_run, Path(name), engine.environment())
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    if done.returncode or not lines:
        raise RuntimeError(((done.stderr or done.stdout).strip().splitlines() or ["no word"])[-1])
    found = json.loads(lines[-1])
    return found["ms_per_step"], np.array(found["places"])


def in_engines(count: int, seconds: float = 1.0, rounds: int = 3) -> dict[str, Any]:
    """Distance of the logs from their places in Python (m) after half a second, cost of a step (ms) with its range, certificate."""
    steps, short = round(seconds / STEP), round(0.5 / STEP)
    programs = {"LIGGGHTS": in_liggghts, "YADE": in_yade}
    found: dict[str, Any] = {}
    spent: dict[tuple[str, str], list[float]] = {}

    def python(model: str) -> CapsuleSystem | ImpactSystem:
        return space(count, None) if model == "closed" else section(count)[0]

    for model in ("closed", "section"):
        place = python(model).run(short * STEP, STEP, every=short).position[-1]
        apart = {name: program(count, short, in_space=model == "closed")[1][:, : place.shape[1]] - place
                 for name, program in programs.items()}
        found[model] = {"apart": {name: float(np.abs(way).max()) for name, way in apart.items()}}
    for _ in range(rounds):
        for model in ("closed", "section"):
            for name, program in programs.items():
                spent.setdefault((model, name), []).append(program(count, steps, in_space=model == "closed")[0])
            system = python(model)
            begin = time.process_time()
            motion = system.run(steps * STEP, STEP, every=steps)
            spent.setdefault((model, "Python"), []).append(1e3 * (time.process_time() - begin) / steps)
            found[model]["certificate"] = float(motion.report["worst_certificate"][-1])
    for (model, name), values in spent.items():
        found[model][name] = {"ms_per_step": float(np.median(values)), "range": [min(values), max(values)]}
    return found


def crib(layers: int = 5, side: int = 160) -> dict[str, Any]:
    """Time (s) and memory (MB) of the first step of a stack: (layers - 1) side^2 contacts of logs and 2 side of them with the floor."""
    edge, r = 0.11, 0.05
    random = np.random.default_rng(2)
    line = edge * (np.arange(side) - 0.5 * (side - 1))
    x, axis = np.zeros((layers * side, 3)), np.zeros((layers * side, 3))
    for k in range(layers):
        own = slice(k * side, (k + 1) * side)
        x[own, k % 2], axis[own, 1 - k % 2] = line, 1.0
        x[own, 2] = r + 2 * r * k - 2e-5 * k + random.uniform(-1e-5, 1e-5, side)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    stack = CapsuleSystem(100.0, r, edge * side, x, axis=axis, gravity=(0.0, 0.0, -GRAVITY), stiffness=STIFFNESS, friction=FRICTION,
                          walls=[Plane(point=(0, 0, 0), normal=(0, 0, 1))])
    begin = time.process_time()
    motion = stack.run(0.0, STEP)
    cost = time.process_time() - begin
    memory = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024
    return {"contacts": int(motion.report["contacts"][0]), "active": int(motion.report["active"][0]), "seconds": cost, "megabytes": memory,
            "certificate": float(motion.report["certificate"][0])}


def interval(values: Array) -> list[float]:
    """Mean and half of its 95 % interval, over quarters of a revolution."""
    parts = np.array([part.mean() for part in np.array_split(values, max(2, 4 * (len(values) // SAMPLES)))])
    return [float(parts.mean()), float(student(len(parts) - 1) * parts.std(ddof=1) / math.sqrt(len(parts)))]


def debarked(motion: ImpactMotion, radius: Array, mass: Array, speed: float) -> dict[str, list[float]]:
    """Value and half of its 95 % interval of what debarking depends on, a log and revolution: impacts in the range of forces of the studies
    of the case debarking_drum, and above it (J/kg: the wood-loss index), and the work of friction (J/m2). The logs have one sector."""
    found = np.array([(i.a, i.b, i.time, i.duration, i.peak_force, i.impulse, i.relative_speed, i.dissipated, *i.point, i.friction_loss,
                       *i.normal, i.turn_a, i.turn_b) for i in motion.impacts])
    load = Load(found.view(RECORD)[:, 0], Logs(np.arange(len(mass)), radius, mass, TOTAL), float(motion.time[0]), float(motion.time[-1]),
                2 * math.pi / speed, SLOWEST, STIFFNESS)
    return {name: [one.value, one.half] for name, one in outcome(load, RANGE, sectors=1).values.items()}


def measure(motion: ImpactMotion, cost: float, speed: float, radius: Array, mass: Array) -> dict[str, Any]:
    """What all three have in common: cost, contacts, impacts a log and revolution, their mean peak force (N), certificate, debarking."""
    hard = [i for i in motion.impacts if i.relative_speed >= SLOWEST]
    turns = (motion.time[-1] - motion.time[0]) * speed / (2 * math.pi)
    return {"ms_per_step": 1e3 * cost, "active": interval(motion.report["active"]), "impacts": len(hard) / turns / motion.position.shape[1],
            "peak_force": float(np.mean([i.peak_force for i in hard])), "certificate": float(motion.report["worst_certificate"][-1]),
            "debarking": debarked(motion, radius, mass, speed)}


def along(motion: ImpactMotion) -> dict[str, Any]:
    """Of logs in space: tilt against the axis of the drum (degrees), speed along it (m/s)."""
    tilt = np.degrees(np.arccos(np.minimum(1.0, np.abs(motion.axis[..., 2])))).mean(axis=1)
    rate = np.diff(motion.position[..., 2].mean(axis=1)) / np.diff(motion.time)
    own = (motion.position[-1, :, 2] - motion.position[0, :, 2]) / (motion.time[-1] - motion.time[0])
    return {"tilt": interval(tilt), "axial_speed": interval(rate), "axial_speed_of_logs": [float(x) for x in np.percentile(own, [5, 95])]}


def main() -> None:
    """Run all of it and print a line each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--logs", type=int, default=300)
    parser.add_argument("--revolutions", type=float, default=10.0)
    parser.add_argument("--only", choices=["closed", "section", "inclined", "engine", "crib"])
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    found: dict[str, Any] = {"logs": options.logs, "revolutions": options.revolutions, "drum_length": drum_length(options.logs)}
    r, _, mass = logs(options.logs)
    if options.only in (None, "crib"):
        found["crib"] = crib()
        print("crib", found["crib"], flush=True)
    if options.only in (None, "engine"):
        found["engine"] = in_engines(options.logs)
        print("engine", found["engine"], flush=True)
    if options.only in (None, "section"):
        discs, speed = section(options.logs)
        found["section"] = measure(*run(discs, speed, options.revolutions), speed, r, mass)
        print("section", found["section"], flush=True)
    for slope in (None, *SLOPES):
        if options.only not in (None, "closed" if slope is None else "inclined"):
            continue
        motion, cost = run(space(options.logs, slope), SPEED, options.revolutions)
        name = "closed" if slope is None else f"inclined {slope:g}"
        found[name] = measure(motion, cost, SPEED, r, mass) | along(motion)
        print(name, found[name], flush=True)
    if options.out:
        options.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
