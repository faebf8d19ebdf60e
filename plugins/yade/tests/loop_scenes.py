"""Runs inside YADE: `PYTHONPATH=. yade -n -x loop_scenes.py out.json scene...`. Each scene returns what both loops leave."""

import hashlib
import math
import threading

from columns import dilute_column
from scene_results import advance, place, refusal, write_results
from yade import utils

PAIR = dict(restitution=0.6, staticFriction=0.5, kineticFriction=0.3, criticalSlipDistance=1e-5)
ROLLING = dict(rollingFriction=0.1, rollingDampingRatio=0.3)
WET = dict(bridgeVolume=2e-11, surfaceTension=0.072, contactAngle=0.35)
LOOPS = {"stock": InteractionLoop, "short": SphereContactLoop}
D = 0.005


def column(count=60):
    """Grains of 0.8 to 1.2 D that fall onto one another in a narrow column."""
    grains = []
    for k, (x, y, z, radius) in enumerate(dilute_column((2, 2, 16), 1.25 * D, (-1.25 * D, -1.25 * D, 0), count, D, 0.2, 3, 0.1 * D)):
        body = utils.sphere((x, y, z), radius)
        body.state.vel, body.state.angVel = Vector3(0.2 * (-1) ** k, 0.1, -0.5), Vector3(5, 3 * (-1) ** k, 1)
        grains.append(body)
    return grains


def walls():
    sides = [utils.wall(side * 1.3 * D, axis, sense=-side) for axis in (0, 1) for side in (-1, 1)]
    return [utils.wall((0, 0, 0), 2, sense=1), *sides]


def scene_with(kind, bodies, pair=None, law=None, geometry=None, engines=()):
    """A new scene of `bodies` with this kind of loop; returns its loop and its law."""
    O.reset()
    place(bodies, 2500.0)
    law = Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(**(law or {}))
    O.dt = 1e-5
    loop = LOOPS[kind](geometry or [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
                       [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(**{**PAIR, **(pair or {})})], [law])
    bounds = [Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()]
    O.engines = [ForceResetter(), InsertionSortCollider(bounds, verletDist=0.1 * D, allowBiggerThanPeriod=True), loop,
                 *engines, NewtonIntegrator(damping=0, gravity=(0, 0, -50))]
    return loop, law


def left(loop, law):
    """Every number of the bodies, and of the contacts all but what the short way leaves alone: digests, and some to look at."""
    one = lambda x: (float(x) + 0.0).hex()  # zero has one sign
    exact = lambda v: [one(x) for x in v] if hasattr(v, "__len__") else one(v)
    bodies = [[exact(v) for v in (b.state.pos, b.state.vel, b.state.angVel)] for b in O.bodies]
    real = sorted((i for i in O.interactions if i.isReal), key=lambda i: (i.id1, i.id2))
    states = [[i.id1, i.id2, i.iterMadeReal, sorted((name, exact(value)) for name, value in i.phys.dict().items())] for i in real]
    geometry = [[*i.geom.normal, *i.geom.contactPoint, i.geom.penetrationDepth, i.geom.refR1, i.geom.refR2] for i in real]
    digest = lambda rows: hashlib.sha256(repr(rows).encode()).hexdigest()
    return {"bodies": digest(bodies), "contacts": digest(states), "geometry": geometry, "count": len(real), "listed": len(O.interactions),
            "lost": law.dissipatedEnergy(), "bridges": law.bridgeCount(), "fall": sum(b.state.pos[2] for b in O.bodies),
            "short": getattr(loop, "shortWay", None), "packed": getattr(loop, "packed", None)}


def both(scene):
    """The scene with both kinds of loop: it takes the kind, and returns what there is to tell."""
    return lambda: {kind: scene(kind) for kind in LOOPS}


def settled(kind, *words, **options):
    """The loop and the law of grains that have come to rest on one another."""
    loop, law = scene_with(kind, walls() + column(), *words, **options)
    advance(6000)
    return loop, law


@both
def dry(kind):
    return left(*settled(kind))


@both
def wet(kind):
    return left(*settled(kind, WET, {"capillaryModel": "willett"}))


@both
def partial_slip(kind):
    return left(*settled(kind, ROLLING, {"presliding": "partial_slip", "rollingResistance": "elastic_plastic"}))


@both
def elastic_limit(kind):
    return left(*settled(kind, {}, {"frictionLimit": "elastic"}))


@both
def carried(kind):
    """With liquid that is exchanged."""
    return left(*settled(kind, {"surfaceTension": 0.072, "contactAngle": 0.35}, {"capillaryModel": "willett", "carriedLiquid": True},
                         engines=[CapillaryLiquid(content=0.02)]))


def in_cell(kind, steps, *words):
    """What is left of grains in a cell of two and a half grains that is sheared and pressed together."""
    loop, law = scene_with(kind, column(), *words, geometry=[Ig2_Sphere_Sphere_ScGeom()])
    O.engines[-1].gravity = Vector3(0, 0, 0)
    O.periodic = True
    O.cell.setBox(2.5 * D, 2.5 * D, 20 * D)
    O.cell.velGrad = Matrix3(0, 0, 2, 0, 0, 0, 0, 0, -18)
    advance(steps)
    return left(loop, law)


@both
def periodic(kind):
    return in_cell(kind, 6000)


@both
def odd_bodies(kind):
    """Held spheres, a clump, contacts seen from afar, and a body that is erased on the way."""
    loop, law = scene_with(kind, walls() + column(40),
                           geometry=[Ig2_Sphere_Sphere_ScGeom(interactionDetectionFactor=1.05), Ig2_Wall_Sphere_ScGeom()])
    O.engines[1].boundDispatcher.functors = [Bo1_Sphere_Aabb(aabbEnlargeFactor=1.05), Bo1_Wall_Aabb()]
    held = [O.bodies.append(utils.sphere((0.4 * D * side, 0, 0.5 * D), 0.5 * D, fixed=True)) for side in (-1, 1)]
    O.bodies.appendClumped([utils.sphere((0.3 * D * side, 0, 30 * D), 0.5 * D) for side in (-1, 1)])
    advance(5000)
    O.bodies.erase(10)
    O.bodies[held[1]].dynamic = True
    advance(5000)
    return left(loop, law)


@both
def changed_on_the_way(kind):
    """New attributes of the law, of a contact and of the functors, and other spheres of the same contacts."""
    loop, law = settled(kind)
    law.presliding = "exponential"
    for i in O.interactions:
        if i.isReal:
            i.phys.kineticFriction = 0.1
    advance(500)
    for body in O.bodies:
        if isinstance(body.shape, Sphere):
            body.shape.radius *= 1.001
    loop.geomDispatcher.functors = [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()]
    advance(500)
    return left(loop, law)


@both
def many_laws(kind):
    """Contacts each with a friction of its own: more kinds than packs know."""
    loop, law = settled(kind)
    for n, i in enumerate(sorted((i for i in O.interactions if i.isReal), key=lambda i: (i.id1, i.id2))):
        # Two neighbours each differ in nothing but the distance.
        i.phys.kineticFriction, i.phys.healingTime = 0.3 - 0.002 * (n // 2), 1e-4 * (n // 2 % 2)
        i.phys.criticalSlipDistance = 1e-5 * (1 + n % 2)
        if n // 2 % 3 == 0:
            i.phys.interfaceShearStrength = 2e4
    advance(1000)
    return left(loop, law)


@both
def saved(kind):
    """Saved and loaded in the middle."""
    settled(kind, WET, {"capillaryModel": "willett"})
    O.save("loop.yade.gz")
    O.load("loop.yade.gz")
    loop = O.engines[2]
    assert type(loop) is LOOPS[kind]
    advance(3000)
    return left(loop, loop.lawDispatcher.functors[0])


@both
def crowd(kind):
    """Many grains that are pressed into one another, for a few steps."""
    side = [0.97 * D * k for k in range(10)]
    grains = [utils.sphere((x, y, z), 0.5 * D) for x in side for y in side for z in side]
    for k, grain in enumerate(grains):
        grain.state.vel = Vector3(0.1 * math.sin(k), 0.1 * math.cos(3 * k), 0.1 * math.sin(7 * k))
    loop, law = scene_with(kind, grains)
    advance(30)
    return left(loop, law)


@both
def cell(kind):
    """Wet grains, for as long as round-off stays small."""
    return in_cell(kind, 5000, WET, {"capillaryModel": "willett"})


@both
def coincident(kind):
    """Two spheres in one place, in the plane."""
    loop, _ = scene_with(kind, [utils.sphere((0, 0, 0), 0.5 * D), utils.sphere((0.9 * D, 0, 0), 0.5 * D)])
    O.engines[-1].gravity = Vector3(0, 0, 0)
    for body in O.bodies:
        body.state.blockedDOFs = "zXY"
    advance(3)
    touching = sum(i.isReal for i in O.interactions)
    O.bodies[1].state.pos = O.bodies[0].state.pos
    return {"touching": touching, "short": getattr(loop, "shortWay", None), "said": refusal(lambda: advance(1), "nothing")}


@both
def callback(kind):
    """A callback of every contact: YADE's own way is taken."""
    loop, law = scene_with(kind, walls() + column())
    loop.callbacks = [SumIntrForcesCb()]
    advance(6000)
    return left(loop, law)


@both
def no_number(kind):
    """A grain without a finite velocity, met on the short way."""
    settled(kind)
    O.bodies[8].state.vel = Vector3(float("nan"), 0, 0)
    return refusal(lambda: advance(10), "nothing")


def interpreter():
    """How often a PyRunner was called before by the thread that calls it, as far as Python knows that thread."""
    global calls, known
    calls, known = threading.local(), {}
    for kind in LOOPS:
        known[kind] = []
        runner = PyRunner(command=f"calls.{kind} = getattr(calls, '{kind}', 0) + 1; known['{kind}'].append(calls.{kind})", iterPeriod=1)
        scene_with(kind, walls() + column(), engines=[runner])
        O.run(4, True)
    return known


def said():
    """What mistakes in the parameters say, and missing functors."""
    def told(pair=None, **functors):
        loop, _ = scene_with("short", walls() + column(), pair)
        for dispatcher, given in functors.items():
            getattr(loop, dispatcher).functors = given
        return refusal(lambda: advance(6000), "nothing")

    return {"restitution": told(pair={"restitution": 2.0}), "no law": told(lawDispatcher=[]), "no physics": told(physDispatcher=[]),
            "no geometry": told(geomDispatcher=[])}


write_results(globals())
