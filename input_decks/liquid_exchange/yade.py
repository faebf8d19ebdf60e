"""Liquid exchange in YADE: the same grains, paths and walls as liggghts.in. What is measured and why: README.md.

By hand, in an empty folder: yade -n -x yade.py [key=value ...]
Keys, defaults and units (SI) are those of case.toml beside this file.
"""

import math
import sys
from pathlib import Path

from yade import dembark, utils

p = dembark.parameters(Path(sys.argv[0]).resolve().with_name("case.toml"))

# --- derived quantities; liggghts.in has the same formulas -------------------------------------------------------------
O.dt = p.time_step
stride = math.ceil(p.duration / p.time_step / p.rows)
steps = stride * p.rows
radii = [0.5 * p.grain_diameter * size for size in (1.0, 0.7, 1.2, 0.8, 1.0)]
periods = [p.period * part for part in (1.0, 1.37, 0.83, 1.61, 1.13)]
amplitude, gap = p.amplitude * p.grain_diameter, p.gap * p.grain_diameter
middles, x = [], gap
for radius in radii:
    middles.append(x + radius)
    x += 2 * radius + gap
if p.liquid_share == "fraction" and p.liquid_share_factor > 1:
    dembark.fail(f"liquid_share_factor {p.liquid_share_factor:g}, liquid_exchange/yade.py: it must be <= 1 with liquid_share=fraction")

material = O.materials.append(FrictMat(young=5e6, poisson=0.3, density=2500))
for middle, radius in zip(middles, radii):
    body = utils.sphere((middle, 0, 0), radius, material=material)
    # Free along x, or two grains would count as fixed; `move` puts them on their paths.
    body.state.blockedDOFs = "yzXYZ"
    O.bodies.append(body)
left = O.bodies.append(utils.wall((0, 0, 0), axis=0, sense=1, material=material))
right = O.bodies.append(utils.wall((x, 0, 0), axis=0, sense=-1, material=material))

liquid = CapillaryLiquid(share=p.liquid_share, shareFactor=p.liquid_share_factor, returnRule=p.liquid_return, maxBridge=p.max_bridge or 0)
for body in (0, 3):
    liquid.setVolume(body, p.liquid_content * 4 / 3 * math.pi * radii[body] ** 3)
liquid.addWall([left], pool=p.wall_liquid, share=p.wall_share, part=p.wall_part)

history = open("time.csv", "a" if p.resume else "w")
if not p.resume:
    history.write("step,time,kinetic_energy,liquid_grains,liquid_bridges,liquid_walls,liquid_lost,bridge_count,"
                  + ",".join(f"liquid_{k}" for k in range(1, 6)) + "\n")


def move() -> None:
    """Put the grains where they are at this step."""
    for body, (middle, period) in enumerate(zip(middles, periods)):
        state = O.bodies[body].state
        state.pos = (middle + amplitude * math.sin(2 * math.pi / period * O.time), 0, 0)
        state.vel = (amplitude * 2 * math.pi / period * math.cos(2 * math.pi / period * O.time), 0, 0)


def record() -> None:
    """A row of the books of this step."""
    if O.iter == 0 or O.iter % stride:
        return
    # A scene that was loaded has engines of its own.
    books = next(one for one in O.engines if isinstance(one, CapillaryLiquid))
    energy = sum(0.5 * O.bodies[k].state.mass * O.bodies[k].state.vel.squaredNorm() for k in range(5))
    numbers = (O.time, energy, books.inGrains(), books.inBridges(), books.onWalls(), books.lost)
    row = [str(O.iter), *(f"{x:.17g}" for x in numbers), str(books.bridgeCount()), *(f"{books.volume(k):.17g}" for k in range(5))]
    history.write(",".join(row) + "\n")
    history.flush()
    if O.iter % (10 * stride) == 0:
        print(O.iter, f"{O.time:.6g}", f"{energy:.6g}", flush=True)


O.engines = [
    ForceResetter(),
    PyRunner(command="move()", iterPeriod=1, initRun=True),
    # The grains are moved from outside, so the collider looks at each step.
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], verletDist=0),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(
            restitution=0.5, staticFriction=0, kineticFriction=0, criticalSlipDistance=0,
            contactAngle=p.contact_angle, surfaceTension=0.072)],
        [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(capillaryModel="willett", carriedLiquid=True)]),
    liquid,
    PyRunner(command="record()", iterPeriod=1, initRun=True),
    NewtonIntegrator(damping=0),
]

dembark.announce(steps)
dembark.run(steps, p.restart_every, p.resume, outputs=("time.csv",))
