"""The settled bed in YADE under one contact law, timed.

    yade -n -j1 -x yade_bed.py bed=FILE law=stock|dembark|PRESLIDING relax=STEPS steps=STEPS samples=N [loop=SphereContactLoop] [step=S]

Prints one line of JSON a sample: processor time of the loop and of the interaction loop (its share of the loop by the engine's
own timers), in seconds.
"""

import json
import math
import sys
import time

options = dict(word.partition("=")[::2] for word in sys.argv[1:])
friction, kinetic, restitution = 0.5, 0.4, 0.5
relax, steps, samples = (int(options[key]) for key in ("relax", "steps", "samples"))

with open(options["bed"], encoding="utf-8") as bed:
    rows = iter(bed)
    widths = []  # of the base (m)
    for line in rows:
        if line.rstrip().endswith("hi"):
            widths.append(float(line.split()[1]))
        if line.startswith("Atoms"):
            break
    grains = [[float(word) for word in line.split()] for line in rows if line.strip()]
diameter = min(grain[2] for grain in grains)

O.dt = float(options.get("step", 2e-5))
O.periodic = True
O.cell.setBox(*widths[:2], 1.0)
material = O.materials.append(FrictMat(young=5e6, poisson=0.3, density=2500, frictionAngle=math.atan(friction)))
O.bodies.append([utils.sphere(grain[4:7], 0.5 * grain[2], material=material, mask=3) for grain in grains])
floor = O.bodies.append(utils.box((0, 0, -diameter), (1e3 * diameter, 1e3 * diameter, diameter), fixed=True, material=material, mask=1))

if options["law"] == "stock":
    physics = Ip2_FrictMat_FrictMat_MindlinPhys(en=restitution, es=restitution)
    law = Law2_ScGeom_MindlinPhys_Mindlin()
else:
    physics = Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(
        restitution=restitution, staticFriction=friction, kineticFriction=kinetic, criticalSlipDistance=1e-5)
    law = Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(presliding="linear" if options["law"] == "dembark" else options["law"])
motion = NewtonIntegrator(damping=0.3, gravity=(0, 0, -9.81))
loop = globals()[options.get("loop", "InteractionLoop")]([Ig2_Sphere_Sphere_ScGeom(), Ig2_Box_Sphere_ScGeom()], [physics], [law])
O.engines = [
    ForceResetter(),
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Box_Aabb()], allowBiggerThanPeriod=True, verletDist=0.1 * diameter),
    loop,
    motion,
]
O.run(relax, True)
motion.damping = 0.0
O.timingEnabled = True
for _ in range(samples):
    for engine in O.engines:
        engine.execTime = 0
    begin = time.process_time()
    O.run(steps, True)
    total = time.process_time() - begin
    share = loop.execTime / sum(engine.execTime for engine in O.engines)
    contacts = sum(1 for each in O.interactions if each.isReal)
    print(json.dumps({"loop": total, "pair": total * share, "contacts": contacts}), flush=True)
