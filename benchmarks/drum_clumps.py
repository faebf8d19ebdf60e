"""The drum of `benchmarks.drum_capsules` with logs of soft spheres: cost of a second of drum time next to capsules and cross-section.

    python -m benchmarks.drum_clumps [--logs 300] [--seconds 2.618] [--after 2.618] [--spacings 1 0.5] [--share 0.5] [--out FILE.json]

Logs, drum, filling, speed and places at the start are those of the level drum with plates. A log is a rod of equal spheres of its radius
along its axis, `spacing` radii apart or a little less, with the mass and the moments of inertia of the capsule: a body of LAMMPS's `fix
rigid/small`. Each contact of two spheres, or of a sphere and the drum, has the friction of a contact of two logs and a `share` of its
spring and of its damper (`pair_style granular hooke`, `damping velocity`, `tangential linear_history`). Logs that cross touch with one to
four spheres each; with a half the overlaps are about those of capsules. Logs that lie along each other touch with all their spheres, which
makes the stiffest contact, and a strongly damped one. The step is that of docs/theory/time_steps.md for strong damping: 17 in the shortest
contact, that of the two thinnest logs side by side.

All models are measured in the same window of drum time: cost (processor time of one core), points of contact between logs, the overlap of
each pair of logs at its deepest point, the tilt of the logs, and the horizontal distance of the centre of mass from the axis.
"""

from __future__ import annotations

import argparse
import json
import math
import re
import subprocess
import tempfile
import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from benchmarks.drum_capsules import FRICTION, STEP, interval, layout, logs, section, space
from benchmarks.drum_penalty import DAMPING, GRAVITY, SHELL, SPEED, STIFFNESS
from dembark._physics import capsule_inertia
from dembark.physics import CapsuleSystem, ImpactSystem
from dembark.postproc import GrainsDump
from dembark.validation import engines

Array = NDArray[np.float64]
STEPS_IN_A_CONTACT = 17
SAMPLES = 80  # in the window
TANGENTIAL = 2.0 / 7.0  # tangential over normal stiffness, the default of the impact model
PAIR, WALL = 0.5 * STIFFNESS, STIFFNESS * SHELL / (STIFFNESS + SHELL)  # N/m


def rods(count: int, spacing: float) -> tuple[Array, NDArray[np.int64]]:
    """Place of each sphere along its log, from the centre (m), and the number of its log."""
    r, length, _ = logs(count)
    members = 1 + np.ceil(length / (spacing * r) - 1e-9).astype(int)
    along = np.concatenate([np.linspace(-0.5, 0.5, n) * own for n, own in zip(members, length, strict=True)])
    return along, np.repeat(np.arange(count), members)


def step_of(count: int, spacing: float, share: float) -> float:
    """s: the contact of the two thinnest logs side by side, with all spheres of the shorter one, lasts STEPS_IN_A_CONTACT steps."""
    _, _, mass = logs(count)
    members = np.bincount(rods(count, spacing)[1])
    a, b = np.argsort(mass)[:2]
    reduced = mass[a] * mass[b] / (mass[a] + mass[b])
    return float(math.pi / math.sqrt(share * PAIR * min(members[a], members[b]) / reduced) / STEPS_IN_A_CONTACT)


def deck(count: int, spacing: float, share: float, after: float, seconds: float) -> dict[str, str]:
    """LAMMPS's script, its atoms and its bodies: `after` s without output, then the window, whose time the log has."""
    r, length, mass = logs(count)
    spot, radius, speed, long = layout(count, in_space=True)
    along, member = rods(count, spacing)
    volume = np.bincount(member) * 4.0 / 3.0 * math.pi * r**3
    inertia = np.asarray(capsule_inertia(mass, r, length))  # about the axis, across it
    step = step_of(count, spacing, share)
    every = max(1, round(seconds / SAMPLES / step))

    def contact(stiffness: float) -> str:
        k = share * stiffness
        return (f"hooke {k!r} {share * DAMPING!r} tangential linear_history {TANGENTIAL * k!r} 0.0 {FRICTION!r} damping velocity "
                "limit_damping")

    wide, high = 1.1 * radius, 0.55 * long
    script = f"""\
units si
atom_style sphere
atom_modify map array sort 0 0.0
boundary f f f
newton off
comm_modify vel yes cutoff 1.5
fix bodies all property/atom mol ghost yes
region domain block {-wide!r} {wide!r} {-wide!r} {wide!r} {-high!r} {high!r} units box
read_data logs.data fix bodies NULL Molecules
neighbor 0.02 bin
neigh_modify delay 0 exclude molecule/intra all
timestep {step!r}
pair_style granular
pair_coeff * * {contact(PAIR)}
variable turn equal {speed!r}*step*dt
region drum cylinder z 0 0 {radius!r} {-0.5 * long!r} {0.5 * long!r} side in units box rotate v_turn 0 0 0 0 0 1
fix shell all wall/gran/region granular {contact(WALL)} region drum
group none empty
fix weight none gravity {GRAVITY!r} vector 0 -1 0
fix motion all rigid/small molecule infile logs.infile gravity weight
thermo_style custom step atoms
thermo_modify lost error
thermo 100000
run {round(after / step)}
print "window"
dump logs all custom {every} logs.dump id x y z radius mass
dump_modify logs sort id format float %.10g
run {every * SAMPLES}
print "finished"
"""
    bodies = list(zip(r.tolist(), (mass / volume).tolist(), mass.tolist(), inertia.tolist(), spot.tolist(), strict=True))
    data = [f"# {count} logs of spheres", "", f"{len(along)} atoms", "1 atom types", "", f"{-wide!r} {wide!r} xlo xhi",
            f"{-wide!r} {wide!r} ylo yhi", f"{-high!r} {high!r} zlo zhi", "", "Atoms # sphere", ""]
    infile = [str(count)]
    for n, (k, z) in enumerate(zip(member.tolist(), along.tolist(), strict=True), 1):
        own, density, _, _, place = bodies[k]
        data.append(f"{n} 1 {2 * own!r} {density!r} {place[0]!r} {place[1]!r} {place[2] + z!r}")
    data += ["", "Molecules", "", *(f"{n} {k + 1}" for n, k in enumerate(member.tolist(), 1))]
    for k, (_, _, weight, (axial, across), place) in enumerate(bodies, 1):
        infile.append(f"{k} {weight!r} {place[0]!r} {place[1]!r} {place[2]!r} {across!r} {across!r} {axial!r}" + 12 * " 0")
    return {"drum.in": script, "logs.data": "\n".join(data) + "\n", "logs.infile": "\n".join(infile) + "\n"}


def deepest(places: Array, radii: Array, member: NDArray[np.int64]) -> Array:
    """m: the largest overlap of each pair of logs whose spheres touch."""
    a, b = cKDTree(places).query_pairs(2.0 * radii.max(), output_type="ndarray").T
    keep = member[a] != member[b]
    a, b = a[keep], b[keep]
    overlap = radii[a] + radii[b] - np.linalg.norm(places[a] - places[b], axis=1)
    a, b, overlap = member[a][overlap > 0.0], member[b][overlap > 0.0], overlap[overlap > 0.0]
    pair = np.minimum(a, b) * (member.max() + 1) + np.maximum(a, b)
    _, inverse = np.unique(pair, return_inverse=True)
    found = np.zeros(inverse.max(initial=-1) + 1)
    np.maximum.at(found, inverse, overlap)
    return found


def summary(step: float, cost: float, points: Array, overlaps: list[Array], tilt: Array, arm: Array) -> dict[str, Any]:
    """`cost`: s of a step; one value an instant of points, tilt (degrees) and arm (m)."""
    every = np.concatenate(overlaps)
    deep = [1e3 * float(np.percentile(every, p)) for p in (50, 99)] if len(every) else [0.0, 0.0]
    return {"step": step, "ms_per_step": 1e3 * cost, "s_per_second": cost / step, "points": interval(points),
            "overlap_mm": deep, "tilt": interval(tilt), "arm": interval(arm)}


def clumps(count: int, spacing: float, share: float, after: float, seconds: float) -> dict[str, Any]:
    """The window with logs of spheres."""
    engine = engines.find("lammps")
    with tempfile.TemporaryDirectory(prefix="dembark-clumps-") as name:
        folder = Path(name)
        for file, text in deck(count, spacing, share, after, seconds).items():
            (folder / file).write_text(text)
        done = subprocess.run([str(engine.executable), "-in", "drum.in", "-log", "none"], cwd=folder, env=engine.environment(), text=True,
                              capture_output=True, stdin=subprocess.DEVNULL, check=False)
        if done.returncode or "finished" not in done.stdout:
            raise RuntimeError("".join([line for line in (done.stdout + done.stderr).splitlines() if "ERROR" in line][-1:]) or "no word")
        said = done.stdout.partition("window")[2]
        loop = re.search(r"Loop time of (\S+) on 1 procs for (\d+) steps", said)
        used = re.search(r"(\S+)% CPU use", said)
        assert loop is not None and used is not None
        frames = GrainsDump(folder / "logs.dump")
        member, mass = rods(count, spacing)[1], logs(count)[2]
        first = np.flatnonzero(np.diff(member, prepend=-1))
        last = np.append(first[1:], len(member)) - 1
        points, overlaps, tilt, arm = [], [], [], []
        for frame in frames:
            x = frame.positions
            own = deepest(x, frame.radii, member)
            axis = x[last] - x[first]
            overlaps.append(own)
            points.append(float(len(own)))
            tilt.append(float(np.degrees(np.arccos(np.minimum(1.0, np.abs(axis[:, 2]) / np.linalg.norm(axis, axis=1)))).mean()))
            arm.append(float(0.5 * (x[first, 0] + x[last, 0]) @ mass / mass.sum()))
    cost = float(loop[1]) * float(used[1]) / 100.0 / int(loop[2])
    step = step_of(count, spacing, share)
    return {"spheres": len(member)} | summary(step, cost, np.array(points), overlaps, np.array(tilt), np.array(arm))


def impacts(system: CapsuleSystem | ImpactSystem, mass: Array, after: float, seconds: float) -> dict[str, Any]:
    """The same window with capsules, or in cross-section."""
    every = max(1, round(seconds / SAMPLES / STEP))
    system.run(round(after / STEP) * STEP, STEP, every=10**9)
    points, overlaps, tilt, arm, spent = [], [], [], [], 0.0
    for _ in range(SAMPLES):
        begin = time.process_time()
        motion = system.run(every * STEP, STEP, every=every)
        spent += time.process_time() - begin
        deep: dict[tuple[int, int], float] = {}
        for one in system.contacts():
            a, b = int(one["a"]), int(one["b"])  # type: ignore[call-overload]
            if b >= 0 and one["normal_force"] > 0.0:  # type: ignore[operator]
                deep[a, b] = max(deep.get((a, b), 0.0), -float(one["gap"]))  # type: ignore[arg-type]
        overlaps.append(np.array(list(deep.values())))
        points.append(float(len(deep)))
        along = motion.axis[-1][:, 2] if isinstance(system, CapsuleSystem) else np.ones(len(mass))
        tilt.append(float(np.degrees(np.arccos(np.minimum(1.0, np.abs(along)))).mean()))
        arm.append(float(motion.position[-1][:, 0] @ mass / mass.sum()))
    return summary(STEP, spent / SAMPLES / every, np.array(points), overlaps, np.array(tilt), np.array(arm))


def main() -> None:
    """All models, a line each."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--logs", type=int, default=300)
    half = round(math.pi / SPEED, 3)
    parser.add_argument("--after", type=float, default=half, help="s of drum time before the window, default half a revolution")
    parser.add_argument("--seconds", type=float, default=half, help="s of drum time in the window, default half a revolution")
    parser.add_argument("--share", type=float, default=0.5, help="of the spring and damper of a log in those of a sphere")
    parser.add_argument("--spacings", type=float, nargs="*", default=[1.0, 0.5], help="distances of the spheres of a log over its radius")
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    found: dict[str, Any] = {"logs": options.logs, "after": options.after, "seconds": options.seconds, "share": options.share}
    mass = logs(options.logs)[2]
    window = (options.after, options.seconds)
    subjects = {"capsules": partial(impacts, space(options.logs, None), mass, *window),
                "cross-section": partial(impacts, section(options.logs)[0], mass, *window)}
    subjects |= {f"spheres {spacing:g}": partial(clumps, options.logs, spacing, options.share, *window) for spacing in options.spacings}
    for name, subject in subjects.items():
        found[name] = subject()
        print(name, json.dumps(found[name]), flush=True)
        if options.out:
            options.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
