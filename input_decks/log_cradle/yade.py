"""Log cradle in YADE: the same logs and measurements as liggghts.in. What is measured and why: README.md.

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
spacing = 2 * p.radius + p.gap
reach = p.log_count * spacing + 2 * p.velocity * steps * p.time_step + 1

O.materials.append(FrictMat(label="wood"))
for number in range(p.log_count):
    O.bodies.append(dembark.log((number * spacing, 0, 0), p.radius, p.mass, (p.velocity if number == 0 else 0, 0, 0)))

impacts = LogImpact(
    stiffness=p.stiffness, theta=p.theta, impactsFile="impacts.txt",
    # The velocities above belong to the time zero, as in LIGGGHTS.
    velocityAtStart=True)
dump = dembark.LogWriter(impacts, bounds=((-reach, reach), (-1, 1), (-1, 1)))

O.engines = [
    ForceResetter(),
    impacts,
    # Between forces and motion, where positions and forces belong to the same time.
    PyRunner(command="dump.write()", iterPeriod=stride, initRun=True),
    NewtonIntegrator(damping=0),
]

dembark.announce(steps)
dembark.run(steps, p.restart_every, p.resume)
