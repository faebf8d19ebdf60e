"""Liquid exchange: a row of grains between two walls on given paths; they touch, share liquid and part."""

import math

from yade import dembark

p = dembark.parameters()
O.dt = p.time_step
material = O.materials.append(FrictMat(young=5e6, poisson=0.3, density=2500))
grains = dembark.grains(material)[1]
middles = [O.bodies[grain].state.pos[0] for grain in grains]
# Free along x, or two grains would count as fixed; `move` puts them on their paths.
dembark.block(grains, "yzXYZ")
left = O.bodies.append(utils.wall((0, 0, 0), axis=0, sense=1, material=material))
right = O.bodies.append(utils.wall((p.end, 0, 0), axis=0, sense=-1, material=material))

liquid = CapillaryLiquid(share=p.liquid_share, shareFactor=p.liquid_share_factor, returnRule=p.liquid_return, maxBridge=p.largest_bridge)
for grain, volume in zip(grains, p.volumes, strict=False):
    liquid.setVolume(grain, volume)
liquid.addWall([left], pool=p.wall_liquid, share=p.wall_share, part=p.wall_part)


def move() -> None:
    """Put the grains where they are at this step."""
    for grain, middle, period in zip(grains, middles, p.periods, strict=False):
        state, angle = O.bodies[grain].state, 2 * math.pi / period * O.time
        state.pos = (middle + p.reach * math.sin(angle), 0, 0)
        state.vel = (p.reach * 2 * math.pi / period * math.cos(angle), 0, 0)


history = dembark.table("time.csv", "step,time,kinetic_energy,liquid_grains,liquid_bridges,liquid_walls,liquid_lost,bridge_count,"
                        + ",".join(f"liquid_{k}" for k in range(1, 6)))


def record() -> None:
    """A row of the books of this step."""
    if O.iter == 0:
        return
    # A scene that was loaded has engines of its own.
    books = next(one for one in O.engines if isinstance(one, CapillaryLiquid))
    energy = sum(0.5 * O.bodies[k].state.mass * O.bodies[k].state.vel.squaredNorm() for k in grains)
    numbers = (O.time, energy, books.inGrains(), books.inBridges(), books.onWalls(), books.lost, books.bridgeCount(),
               *map(books.volume, grains))
    history.write(",".join([str(O.iter), *(f"{x:.17g}" for x in numbers)]) + "\n")
    history.flush()
    print(O.iter, f"{O.time:.6g}", f"{energy:.6g}", flush=True)


O.engines = [
    ForceResetter(),
    PyRunner(command="move()", iterPeriod=1, initRun=True),
    # The grains are moved from outside, so the collider looks at each step.
    InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], verletDist=0),
    InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
        [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(
            restitution=0.5, staticFriction=0, kineticFriction=0, criticalSlipDistance=0, contactAngle=p.contact_angle,
            surfaceTension=0.072)],
        [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(capillaryModel="willett", carriedLiquid=True)]),
    liquid,
    PyRunner(command="record()", iterPeriod=p.stride, initRun=True),
    NewtonIntegrator(damping=0),
]

dembark.run(p.steps, outputs=("time.csv",))
