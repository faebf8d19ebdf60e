"""Log pile in YADE: the same logs, ground, stakes and measurements as liggghts.in. What is measured and why: README.md.

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
largest = p.radius * (1 + p.radius_spread)
if p.width < 2.4 * largest:
    dembark.fail(f"width {p.width:g} m, log_pile/yade.py: it must be at least {2.4 * largest:g} m, 2.4 of the largest radius")
# Rows of places with a log each, none touching: 0.2 of the largest radius between two, of which the shift takes a half.
columns = math.floor(p.width / (2.2 * largest))
cell = p.width / columns
level = 2.2 * largest
jitter = 0.05 * largest
half = 0.5 * p.width
top = (math.ceil(p.log_count / columns) + 2) * level


def shake(number: int, use: int) -> float:
    """One uniform number in [0, 1) per log and use: the fractional part of a large sine."""
    large = 43758.5453 * math.sin(12.9898 * number + 78.233 * p.seed + use)
    return large - math.floor(large)


wood, ground_material, stakes = (O.materials.append(FrictMat(label=name)) for name in ("wood", "ground", "stakes"))
# Logs come first: their number is the body's id + 1.
for number in range(1, p.log_count + 1):
    size = p.radius * (1 + p.radius_spread * (2 * shake(number, 1) - 1))
    row = math.floor((number - 1) / columns)
    x = (number - 1 - row * columns + 0.5) * cell - half + jitter * (2 * shake(number, 2) - 1)
    y = (row + 0.5) * level + jitter * (2 * shake(number, 3) - 1)
    O.bodies.append(dembark.log((x, y, 0), size, p.density * math.pi * size * size * p.log_length, material=wood))
walls = [
    LogWall(bodies=[O.bodies.append(utils.wall((0, 0, 0), axis=1, sense=1, material=ground_material))], stiffness=p.wall_stiffness,
            name="ground"),
    LogWall(bodies=[O.bodies.append(utils.wall((-half, 0, 0), axis=0, sense=1, material=stakes))], stiffness=p.wall_stiffness,
            friction=p.stake_friction, name="left"),
    LogWall(bodies=[O.bodies.append(utils.wall((half, 0, 0), axis=0, sense=-1, material=stakes))], stiffness=p.wall_stiffness,
            friction=p.stake_friction, name="right"),
]

weight = (0, -p.gravity, 0)
impacts = LogImpact(
    stiffness=p.stiffness, damping=p.damping, contactDamping=p.contact_damping, theta=p.theta, friction=p.friction, walls=walls,
    impactsFile="impacts.txt",
    # The logs are at rest at the time zero, as in LIGGGHTS.
    velocityAtStart=True)
dump = dembark.LogWriter(impacts, bounds=((-p.width, p.width), (-p.width, top), (-p.width, p.width)), gravity=weight)

O.engines = [
    ForceResetter(),
    impacts,
    # Between forces and motion, where positions and forces belong to the same time.
    PyRunner(command="dump.write()", iterPeriod=stride, initRun=True),
    NewtonIntegrator(damping=0, gravity=weight),
]

dembark.announce(steps)
dembark.run(steps, p.restart_every, p.resume)
