"""Debarking drum in YADE: the same logs, drum and measurements as liggghts.in. What is measured and why: README.md.

By hand, in an empty folder: yade -n -x yade.py [key=value ...]
Keys, defaults and units (SI) are those of case.toml beside this file.
"""

import math
import os
import sys
from pathlib import Path

from yade import dembark

p = dembark.parameters(Path(sys.argv[0]).resolve().with_name("case.toml"))

# --- derived quantities; liggghts.in has the same formulas -------------------------------------------------------------
# Diameters are the middles of n equal parts of their range: the same set for every seed, so that filling is met exactly.
mean_d = 0.5 * (p.log_diameter_min + p.log_diameter_max)
range_d = p.log_diameter_max - p.log_diameter_min
n = p.log_count if p.drum_radius is None else math.floor(4 * p.filling * p.drum_radius**2 / (mean_d**2 + range_d**2 / 12) + 0.5)
square_d = mean_d**2 + range_d**2 / 12 * (1 - 1 / (n * n))
radius = 0.5 * math.sqrt(n * square_d / p.filling) if p.drum_radius is None else p.drum_radius
if p.drum_radius is not None:
    print("NOTE: drum_radius is given: the number of logs follows from it and filling; log_count is not used")

# Rows of output: 200 a revolution, each a whole number of steps.
m_min = 0.25 * math.pi * p.log_density * p.log_length * p.log_diameter_min**2
period = 2 * math.pi / p.drum_speed
every = math.ceil(period * math.sqrt(p.log_stiffness / m_min) / p.time_step_fraction / 200)
time_step = period / (200 * every)
steps = 200 * every * (p.run_in + p.revolutions)
stride = 200 * every // p.frames
first = steps - stride * (p.frames - 1)

spacing = 1.02 * p.log_diameter_max
inside = radius - 0.52 * p.log_diameter_max
half = 1.1 * radius
weight = (0, 0, -p.gravity)
HEADER = ("step,time,kinetic_energy,shell_fx,shell_fy,shell_fz,potential_energy,elastic_energy,dissipated_energy,torque,contacts,"
          "active,begun,impulse_sum,pivots,certificate,peak_force\n")


def part(number: float) -> float:
    """Fractional part."""
    return number - math.floor(number)


def new_scene() -> None:
    """Logs on the lowest sites of a lattice of triangles, a little wider than the thickest log (see liggghts.in), and the drum."""
    rise, reach = math.sqrt(3) * spacing, math.ceil(radius / spacing)
    sites = [((i + shift) * spacing, k * rise + shift * rise) for k in range(-reach, reach + 1) for i in range(-reach, reach + 1)
             for shift in (0.0, 0.5)]
    sites = [(x, z) for x, z in sites if math.hypot(x, z) <= inside]
    if len(sites) < n:
        dembark.fail(f"filling is too high, there are places for {len(sites)} of {n} logs only; take less or thinner logs")
    O.materials.append(FrictMat(density=p.log_density, label="wood"))
    for number, (x, z) in enumerate(sites[:n], start=1):
        # Multiplication by a prime modulo n is a permutation: which log gets which diameter.
        rank = math.floor(part((number + p.seed) * 15485863 / n) * n + 0.5)
        diameter = p.log_diameter_min + range_d * (rank + 0.5) / n
        O.bodies.append(dembark.log((x, 0, z), 0.5 * diameter, 0.25 * math.pi * p.log_density * p.log_length * diameter**2, axis="y"))
    shell = O.bodies.append(dembark.drum((0, 0, 0), radius, axis="y", omega=p.drum_speed))
    O.dt = time_step
    O.engines = [
        ForceResetter(),
        LogImpact(stiffness=p.log_stiffness, contactDamping=p.contact_damping, theta=p.theta, friction=p.friction,
                  tangentialRatio=p.tangential_ratio, velocityAtStart=True, impactsFile="impacts.txt", label="hits",
                  walls=[dict(bodies=[shell], stiffness=p.shell_stiffness, friction=p.shell_friction, name="shell")]),
        # Between forces and motion, where positions and forces belong to the same time.
        PyRunner(command="record()", iterPeriod=1),
        NewtonIntegrator(damping=0, gravity=weight),
    ]


new_scene()
if not p.resume:
    Path("time.csv").write_text(HEADER)

drum = O.engines[1].walls[0].bodies[0]
log_ids = [body.id for body in O.bodies if body.id != drum]
snapshot = DembarkSnapshot(wallCount=0, gravity=weight, columns=[-1] * len(O.bodies), types=[int(body.id != drum) for body in O.bodies])
dump = dembark.DumpWriter(walls={}, bounds=((-half, half), (-0.5 * spacing, 0.5 * spacing), (-half, half)), gravity=weight,
                          contacts=os.devnull)
sums = [0.0, 0.0, 0.0]
total_weight = p.gravity * sum(O.bodies[log].state.mass for log in log_ids)


def record() -> None:
    """Sum up the moment and force of the shell on the logs; write what is due at this step."""
    force = hits.walls[0].force
    for k, value in enumerate((-O.forces.t(drum)[1], -force[0], -force[2])):
        sums[k] += value
    if O.iter == 0:
        sums[:] = [0.0, 0.0, 0.0]  # the first mean begins after the start
        return
    if O.iter % every == 0:
        torque, sideways, upward = (value / every for value in sums)
        sums[:] = [0.0, 0.0, 0.0]
        logs = [O.bodies[log] for log in log_ids]
        height = p.gravity * sum(body.state.mass * body.state.pos[2] for body in logs)
        # Spins are half a step behind, as all velocities here; the snapshot knows the translations only.
        spin = sum(0.5 * body.state.inertia[1] * (body.state.angVel[1] + 0.5 * O.dt * O.forces.t(body.id)[1] / body.state.inertia[1])**2
                   for body in logs)
        row = (O.time, snapshot.kineticEnergy() + spin, sideways, 0, upward, height, hits.elasticEnergy, hits.dissipatedEnergy, torque,
               hits.contactCount, hits.activeCount, hits.impactsBegun, hits.impulseSum, hits.pivotsTotal, hits.worstCertificate,
               hits.highestForce)
        with open("time.csv", "a") as file:
            file.write(f"{O.iter}," + ",".join(f"{value:.15g}" for value in row) + "\n")
        print(O.iter, f"{O.time:.6g}", f"{row[1]:.6g}", flush=True)
    if O.iter >= first and (O.iter - first) % stride == 0:
        dump.write()


def save_sums() -> None:
    """The means that have begun belong to the saved scene."""
    O.tags["sums"] = " ".join(value.hex() for value in sums)


def load_sums() -> None:
    """The means as they had begun in the scene that was loaded."""
    sums[:] = [float.fromhex(word) for word in O.tags["sums"].split()]


dembark.announce(steps)
print(f"# logs {n}, drum radius {radius:.9g} m, weight {total_weight:.9g} N, limit of an impact {p.impact_speed} m/s", flush=True)
dembark.run(steps, p.restart_every, p.resume, saving=save_sums, loaded=load_sums)
