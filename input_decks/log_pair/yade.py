"""Log pair in YADE: the same logs, wall and measurements as liggghts.in. What is measured and why: README.md.

By hand, in an empty folder: yade -n -x yade.py [key=value ...]
Keys, defaults and units (SI) are those of case.toml beside this file.
"""

import math
import sys
from pathlib import Path

from yade import dembark

p = dembark.parameters(Path(sys.argv[0]).resolve().with_name("case.toml"))

# --- derived quantities; liggghts.in has the same formulas -------------------------------------------------------------
O.dt = p.time_step
stride = math.ceil(p.duration / p.time_step / (p.frames - 1))
steps = stride * (p.frames - 1)
touch = p.radius_1 + p.radius_2
on_wall = p.target == "wall"
if not on_wall and p.velocity_1 <= p.velocity_2:
    dembark.fail(f"velocity_1 {p.velocity_1:g} m/s, log_pair/yade.py: it must be larger than velocity_2 {p.velocity_2:g} m/s")
if on_wall and p.velocity_1 <= 0:
    dembark.fail(f"velocity_1 {p.velocity_1:g} m/s, log_pair/yade.py: it must be larger than 0")
if not on_wall and p.offset >= touch:
    dembark.fail(f"offset {p.offset:g} m, log_pair/yade.py: it must be smaller than radius_1 + radius_2, {touch:g} m")

first, second = (O.materials.append(FrictMat(label=name)) for name in ("log 1", "log 2"))
walls = []
# Logs come first: their number is the body's id + 1. Log 2 begins at the origin; a wall stands with its surface there.
if on_wall:
    x = -(p.radius_1 + p.velocity_1 * p.lead_time)
    O.bodies.append(dembark.log((x, 0, 0), p.radius_1, p.mass_1, (p.velocity_1, 0, 0), material=first))
    plane = O.bodies.append(utils.wall((0, 0, 0), axis=0, sense=-1, material=second))
    walls.append(LogWall(bodies=[plane], stiffness=p.stiffness_2, name="target"))
else:
    x = -(math.sqrt(touch**2 - p.offset**2) + (p.velocity_1 - p.velocity_2) * p.lead_time)
    O.bodies.append(dembark.log((x, p.offset, 0), p.radius_1, p.mass_1, (p.velocity_1, 0, 0), material=first))
    O.bodies.append(dembark.log((0, 0, 0), p.radius_2, p.mass_2, (p.velocity_2, 0, 0), material=second))

impacts = LogImpact(
    stiffness={first: p.stiffness_1, second: p.stiffness_2}, damping=p.damping, contactDamping=p.contact_damping, theta=p.theta,
    walls=walls, impactsFile="impacts.txt",
    # The velocities above belong to the time zero, as in LIGGGHTS.
    velocityAtStart=True)
reach = 1 + touch + (abs(p.velocity_1) + abs(p.velocity_2)) * (steps * p.time_step + p.lead_time)
dump = dembark.LogWriter(impacts, bounds=((-reach, reach), (-reach, reach), (-1, 1)))

O.engines = [
    ForceResetter(),
    impacts,
    # Between forces and motion, where positions and forces belong to the same time.
    PyRunner(command="dump.write()", iterPeriod=stride, initRun=True),
    NewtonIntegrator(damping=0),
]

dembark.announce(steps)
dembark.run(steps, p.restart_every, p.resume)
