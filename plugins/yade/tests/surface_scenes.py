"""Runs inside YADE: `yade -n -x surface_scenes.py out.json`. Spheres on prescribed paths over walls made of facets."""

import json
import math
import os
import sys
from pathlib import Path

from yade import utils

sys.path.insert(0, str(Path(sys.argv[0] if sys.argv[0].endswith(".py") else __file__).resolve().parents[2] / "tests"))

from rig import floors
from rig.meshes import bent, box_corner, patch

RADIUS, DENSITY, STEP = 0.005, 2500.0, 1e-5
PAIR = dict(restitution=0.8, staticFriction=0.5, kineticFriction=0.3, criticalSlipDistance=1e-5,
            bridgeVolume=2e-10, surfaceTension=0.072, contactAngle=0.35)


def scene(walls, joined=True, cell=0.0, **surface):
    """A wet sphere, body 0, and walls; returns law and surface."""
    O.reset()
    if cell:
        O.periodic, O.cell.hSize = True, Matrix3(cell, 0, 0, 0, cell, 0, 0, 0, cell)
    material = O.materials.append(FrictMat(young=1e7, poisson=0.3, density=DENSITY, frictionAngle=0))
    grain = utils.sphere((0, 0, 1), RADIUS, material=material)
    O.bodies.append(grain)
    for wall in walls:
        wall.mat = O.materials[material]
        O.bodies.append(wall)
    surface = FacetSurface(**surface)
    law = Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(capillaryModel="exact")
    facets = Ig2_FacetSurface_Sphere_ScGeom(surface=surface) if joined else Ig2_Facet_Sphere_ScGeom()
    O.dt = STEP
    O.engines = [
        ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb(), Bo1_Facet_Aabb()], verletDist=0), surface,
        InteractionLoop([Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom(), facets],
                        [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(**PAIR)], [law]),
        NewtonIntegrator(damping=0)]
    return law, surface


def sum_of(contacts, name):
    return sum((float(getattr(i.phys, name)) for i in contacts), 0.0)


def drag(walls, path, steps, joined=True, half=0, **surface):
    """Rows of one sphere on a path (place and velocity as functions of time); saved and loaded after `half` steps."""
    scene(walls, joined, **surface)
    rows = []
    for k in range(steps):
        place, velocity = path(k * STEP)
        if half and k == half:
            O.save("half.yade.gz")
            O.load("half.yade.gz")
            os.remove("half.yade.gz")
        grain = O.bodies[0].state
        grain.pos, grain.vel, grain.angVel = Vector3(*place), Vector3(*velocity), Vector3(1, 2, 3)
        O.step()
        real = [i for i in O.interactions if i.isReal]
        touch = [i for i in real if i.geom.penetrationDepth > 0]
        rows.append([*O.forces.f(0), *O.forces.t(0), sum_of(real, "slip"), sum_of(real, "bridgeVolume"), sum_of(real, "dissipatedEnergy"),
                     len(real), len(touch), *sum((i.phys.elasticDisplacement for i in real), Vector3(0, 0, 0))])
    joint = O.engines[2]
    return {"rows": rows, "handed": joint.handedOver, "lost": O.engines[3].lawDispatcher.functors[0].dissipatedEnergy()}


def facets(triangles, **options):
    return [utils.facet(three, **options) for three in triangles]


def floor_path(t):
    """To and fro over a border by less than the elastic limit, then far over many, now touching, now held by the bridge."""
    if t < 0.005:
        return (-0.0041 + 2e-6 * math.sin(2000 * t), -0.002, RADIUS - 2e-5), (0.004 * math.cos(2000 * t), 0, 0)
    t -= 0.005
    place = -0.0041 + 0.2 * t, -0.002 + 0.115 * t, RADIUS - 2e-5 + 7.5e-5 * (1 - math.cos(300 * t))
    return place, (0.2, 0.115, 0.0225 * math.sin(300 * t))


def bend_path(t):
    """Over x = 0 at one height above the first strip."""
    return (-0.0012 + 0.08 * t, 0.0003, RADIUS - 3e-5), (0.08, 0, 0)


def flat():
    steps = 4000
    plane = drag([utils.wall(0, 2)], floor_path, steps)
    return {"plane": plane, "patch": drag(facets(patch()), floor_path, steps), "fine": drag(facets(patch(0.8)), floor_path, steps),
            "reloaded": drag(facets(patch()), floor_path, steps, half=2100),
            "stock": drag(facets(patch()), floor_path, steps, joined=False)}


def bends():
    cases = {"flat": 0.0, "convex": -0.035, "concave": 0.035, "convex, not smooth": -0.2}
    return {name: drag(facets(bent(angle)), bend_path, 3000) for name, angle in cases.items()}


def corner():
    """A sphere pressed into the corner of three square walls, of planes and of facets."""
    path = lambda t: ((RADIUS - 2e-5, RADIUS - 3e-5, RADIUS - 1e-5 - 0.001 * t), (0, 0, -0.001))
    return {"planes": drag([utils.wall(0, k) for k in range(3)], path, 20),
            "facets": drag(facets(box_corner()), path, 20)}


def moving():
    """The sphere rests and the facets move, against the moving sphere over facets at rest."""
    path = lambda t: ((-0.002, 0.0003, RADIUS - 2e-5), (0, 0, 0))
    rest = drag(facets(patch()), lambda t: ((-0.002 + 0.2 * t, 0.0003, RADIUS - 2e-5), (0.2, 0, 0)), 1500)
    walls = facets(patch())
    for wall in walls:
        wall.state.vel = (-0.2, 0, 0)
    return {"rest": rest, "moving": drag(walls, path, 1500)}


def periodic():
    """Dragged over a patch in a periodic cell by a sphere that is an image away."""
    path = lambda shift: lambda t: ((-0.002 + 0.2 * t + shift, 0.0003, RADIUS - 2e-5), (0.2, 0, 0))
    return {"free": drag(facets(patch()), path(0.0), 1500), "images": drag(facets(patch()), path(0.2), 1500, cell=0.1)}


def changes():
    """Facets that come and go during a run."""
    scene(facets(patch()))
    found = []
    grain = O.bodies[0].state
    for step in range(3):
        grain.pos, grain.vel = Vector3(0.001, 0.0005, RADIUS - 2e-5), Vector3(0, 0, 0)
        if step == 1:
            O.bodies.append(utils.facet([(0.00599, -0.02, -0.02), (0.00599, -0.02, 0.02), (0.00599, 0.05, 0)], material=0))
            O.bodies.append(utils.facet([(-0.02, -0.02, -5e-6), (0.02, -0.02, -5e-6), (0, 0.03, -5e-6)], material=0))
        if step == 2:
            owner = next(i.id1 for i in O.interactions if i.isReal and i.id1 < len(O.bodies) - 2)
            O.bodies.erase(owner)
        O.step()
        found.append([O.forces.f(0)[2], sum(i.isReal for i in O.interactions)])
    return found


def floor_forces(walls):
    """Forces (step, grain, 3) on grains that are dragged over a floor."""
    O.reset()
    material = O.materials.append(FrictMat(young=5e6, poisson=0.3, density=2500, frictionAngle=0))
    heavy = O.materials.append(FrictMat(young=5e6, poisson=0.3, density=1e12, frictionAngle=0))
    walls(material)
    grains = []
    for start, velocity in floors.PATHS:
        grain = utils.sphere((*start, floors.HEIGHT), floors.RADIUS, material=heavy)
        grain.state.vel, grain.state.blockedDOFs = Vector3(*velocity, 0), "zXYZ"
        grains.append(O.bodies.append(grain))
    surface = FacetSurface()
    O.dt = floors.STEP
    O.engines = [
        ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb(), Bo1_Facet_Aabb()], verletDist=1e-3), surface,
        InteractionLoop([Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom(), Ig2_FacetSurface_Sphere_ScGeom(surface=surface)],
                        [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(restitution=1, staticFriction=0.5, kineticFriction=0.4,
                                                                    criticalSlipDistance=1e-5)],
                        [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz()]),
        NewtonIntegrator(damping=0)]
    rows = []
    for step in range(floors.STEPS + 1):
        O.step()
        if step % 5 == 0:
            rows.append([list(O.forces.f(k)) for k in grains])
    return rows


def files():
    """Facets as a file has them, with what the reader leaves out, and as the reader gives them."""
    from yade import dembark

    found = {"plane": floor_forces(lambda material: O.bodies.append(utils.wall(0, 2, material=material)))}
    plain = floors.quad(-floors.HALF, 0, -floors.HALF, floors.HALF) + floors.quad(0, floors.HALF, -floors.HALF, floors.HALF)
    turned = plain + [(c, a, b) for a, b, c in plain] + [((0, -0.02, 0), (0, 0, 0), (0, 0.02, 0))]
    found["facets given twice, and one without area"] = floor_forces(
        lambda material: O.bodies.append([utils.facet(three, material=material) for three in turned]))
    for name, content in floors.files().items():
        Path("floor.stl").write_bytes(content)
        found[name] = floor_forces(lambda material: dembark.mesh("floor.stl", material))
    return found


def refused():
    from yade import dembark

    found = {}
    for line, content in floors.refused().items():
        Path("floor.stl").write_bytes(content)
        try:
            dembark.mesh("floor.stl", 0)
            found[line] = "accepted"
        except RuntimeError as error:
            found[line] = str(error)
    return found


def entering():
    """A grain that is made when the surface knows of none, one that has grown, and where it should be."""
    O.reset()
    material = O.materials.append(FrictMat(young=5e6, poisson=0.3, density=2500, frictionAngle=0))
    O.bodies.append([utils.facet(three, material=material) for three in floors.quad(-0.02, 0.02, -0.02, 0.02)])
    surface = FacetSurface()
    O.dt = 1e-7
    O.engines = [
        ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Facet_Aabb()], verletDist=1e-4), surface,
        InteractionLoop([Ig2_Sphere_Sphere_ScGeom(), Ig2_FacetSurface_Sphere_ScGeom(surface=surface)],
                        [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(restitution=1, staticFriction=0.5, kineticFriction=0.4,
                                                                    criticalSlipDistance=1e-5)],
                        [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz()]), NewtonIntegrator(damping=0)]
    O.step()
    forces = []
    for radius in (0.0025, 0.05):
        grain = O.bodies.append(utils.sphere((0.001, 0.002, radius - 1e-5), radius, material=material))
        O.step()
        forces.append(O.forces.f(grain)[2] / radius**0.5)
        O.bodies.erase(grain)
    return forces


def messages():
    said = []
    for wrong in (lambda: FacetSurface(smoothAngle=3), lambda: FacetSurface(precision=-1), lambda: FacetSurface(smoothAngle=math.nan)):
        try:
            wrong()
            said.append("accepted")
        except RuntimeError as error:
            said.append(str(error))
    return said


out, *names = sys.argv[1:]
results = {name: globals()[name]() for name in names}
with open(out, "w", encoding="utf-8") as file:
    json.dump(results, file)
print("scenes: finished", flush=True)
