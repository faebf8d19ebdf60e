"""Runs inside YADE: `PYTHONPATH=. yade -n -x liquid_scenes.py out.json scene...`. Each scene is a function that returns plain data."""

import math
import os
import random

from scene_results import advance, write_results
from yade import dembark, utils

PAIR = dict(restitution=0.6, staticFriction=0.5, kineticFriction=0.3, criticalSlipDistance=1e-5, surfaceTension=0.072, contactAngle=0.35)
R = 0.0025


def scene_with(bodies, gravity=(0, 0, 0), pair=None, **liquid):
    """A new scene of `bodies` whose bridges carry liquid; returns its engine CapillaryLiquid."""
    O.reset()
    material = O.materials.append(FrictMat(young=5e6, poisson=0.3, density=2500, frictionAngle=0))
    O.bodies.append([body() for body in bodies])
    for body in O.bodies:
        body.mat = O.materials[material]
    engine = CapillaryLiquid(**liquid)
    O.dt = 2e-6
    O.engines = [
        ForceResetter(),
        # Grains are put from place to place, so the collider looks at each step.
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], verletDist=0),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
            [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(**{**PAIR, **(pair or {})})],
            [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(capillaryModel="willett", carriedLiquid=True)]),
        engine,
        NewtonIntegrator(damping=0, gravity=gravity),
    ]
    return engine


def grain(position, radius=R, **options):
    return lambda: utils.sphere(position, radius, **options)


def held(position, radius=R):
    """A grain that is put from place to place: free to move along y only, so that it does not count as fixed."""
    def make():
        body = utils.sphere(position, radius)
        body.state.blockedDOFs = "xzXYZ"
        return body

    return make


def tallies(engine, count):
    return {"grains": [engine.volume(i) for i in range(count)], "bridges": engine.inBridges(), "walls": engine.onWalls(),
            "lost": engine.lost,
            "count": engine.bridgeCount(), "total": engine.total(),
            "volumes": {f"{min(i.id1, i.id2)}-{max(i.id1, i.id2)}": i.phys.bridgeVolume for i in O.interactions if i.isReal}}


def put(places):
    """One step with the bodies at `places` (x of each); nothing else moves."""
    for body, x in places.items():
        state = O.bodies[body].state
        state.pos, state.vel = Vector3(x, 0, 0), Vector3(0, 0, 0)
    O.step()


FAR, TOUCH = 0.0052, 0.0049


def sequence():
    """Three grains, the middle one wet and larger: both neighbours touch it in one step, then leave one after the other."""
    found = {}
    for name, words in {"cap": {}, "fraction": dict(share="fraction", shareFactor=0.8), "radius": dict(returnRule="radius"),
                        "taken": dict(returnRule="taken"), "largest": dict(maxBridge=1e-11)}.items():
        engine = scene_with([held((0, 0, 0), 0.003), held((0.0062, 0, 0), 0.002), held((-0.007, 0, 0), 0.002)], **words)
        engine.setVolume(0, 3e-10)
        engine.setVolume(1, 1e-11)
        rows = []
        for places in ({0: 0, 1: 0.0062, 2: -0.0062}, {1: 0.0049, 2: -0.0049}, {}, {1: 0.0065}, {2: -0.008}):
            put(places)
            rows.append(tallies(engine, 3) | {"pull": O.forces.f(1)[0]})
        found[name] = rows
    return found


def many_at_once():
    """A wet grain that six others touch in the same step, each asking for all it has."""
    around = [held([0.0049 * s if i == k else 0 for i in range(3)]) for k in range(3) for s in (-1, 1)]
    engine = scene_with([held((0, 0, 0)), *around], share="fraction", shareFactor=1.0)
    engine.setVolume(0, 6e-11)
    O.step()
    return tallies(engine, 7)


def wall():
    """A dry grain on a wet wall, which is the first or the second body, and off again; and a wet grain on a wall that was not added."""
    found = []
    for order in (0, 1):
        bodies = [lambda: utils.wall(-R, 0), held((0.0002, 0, 0))]
        engine = scene_with(bodies[::-1] if order else bodies)
        ids = (1, 0) if order else (0, 1)
        engine.addWall([ids[0]], pool=2e-10, share=0.25, part=0.4)
        rows = []
        for x in (0.0002, -0.00001, 0.0, 0.005):
            put({ids[1]: x})
            rows.append({"grain": engine.volume(ids[1]), "pool": engine.wallPool(0), "bridges": engine.inBridges(),
                         "total": engine.total()})
        found.append(rows)
    engine = scene_with([lambda: utils.wall(-R, 0), held((-0.00001, 0, 0))])
    engine.setVolume(1, 1e-10)
    O.step()
    on = tallies(engine, 2)
    put({1: 0.005})
    return {"orders": found, "plain": [on, tallies(engine, 2)]}


def erased():
    """One of two grains held by a bridge is erased."""
    engine = scene_with([held((0, 0, 0)), held((TOUCH, 0, 0)), held((-TOUCH, 0, 0))])
    for k in range(3):
        engine.setVolume(k, 1e-10)
    O.step()
    before = tallies(engine, 3)
    O.bodies.erase(1)
    O.run(1, True)  # in a thread of its own, without Python's lock
    return [before, tallies(engine, 3)]


def cleared():
    """A script ends all interactions; the grains still touch."""
    engine = scene_with([held((0, 0, 0)), held((TOUCH, 0, 0)), held((-TOUCH, 0, 0))])
    for k in range(3):
        engine.setVolume(k, 1e-10)
    O.step()
    before = tallies(engine, 3)
    O.interactions.clear()
    O.run(2, True)
    return [before, tallies(engine, 3)]


def reused_id():
    """A grain is erased, with the bridge that holds it, and another one is put in its place before the next step."""
    engine = scene_with([held((0, 0, 0)), held((TOUCH, 0, 0)), held((-TOUCH, 0, 0))], content=0.01)
    O.step()
    before = tallies(engine, 3)
    O.bodies.erase(1)
    body = held((0.03, 0, 0), 0.002)()
    body.mat = O.materials[0]
    O.bodies.insertAtId(body, 1)
    O.step()
    after = tallies(engine, 3)
    put({1: -0.0093})  # it touches the third grain
    O.bodies.erase(1)
    body = held((0.03, 0, 0), 0.002)()
    body.mat = O.materials[0]
    O.bodies.insertAtId(body, 1)
    engine.setVolume(1, 5e-11)
    O.step()
    return [before, after, tallies(engine, 3)]


def rolling_over_facets():
    """A grain that a wet floor of two triangles lends a bridge is drawn over their common edge and up."""
    corners = ((-1, -1, -R), (0, -1, -R), (0, 1, -R), (1, -1, -R))
    floor = [lambda three=three: utils.facet([corners[k] for k in three]) for three in ((0, 1, 2), (1, 3, 2))]
    scene_with([*floor, held((-0.0004, 0, -0.00001))])
    surface = FacetSurface()
    O.engines = [O.engines[0], InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Facet_Aabb()], verletDist=0.001), surface, InteractionLoop(
        [Ig2_Sphere_Sphere_ScGeom(), Ig2_FacetSurface_Sphere_ScGeom(surface=surface)], O.engines[2].physDispatcher.functors,
        O.engines[2].lawDispatcher.functors), *O.engines[3:]]
    engine = O.engines[4]
    engine.addWall([0, 1], pool=2e-10, share=0.25, part=0.4)
    rows = []
    for x, z in ((-0.0004, -0.00001), (-0.0002, 0), (0.0003, 0), (0.0006, 0), (0.0006, 0.004)):
        O.bodies[2].state.pos, O.bodies[2].state.vel = Vector3(x, 0, z), Vector3(0, 0, 0)
        O.step()
        rows.append({"grain": engine.volume(2), "pool": engine.wallPool(0)} | tallies(engine, 0))
    return {"rows": rows, "handed": surface.handedOver}


def erased_facet():
    """The wall under a bridge is erased; then the grain of another bridge to a wall."""
    engine = scene_with([lambda: utils.wall(-R, 0), lambda: utils.wall(R + 0.01, 0), held((-0.00001, 0, 0)), held((0.01001, 0, 0))])
    engine.addWall([0], pool=2e-10, share=0.25, part=0.4)
    engine.addWall([1], pool=2e-10, share=0.25, part=0.4)
    for _ in range(2):
        O.step()
    before = tallies(engine, 4) | {"pools": list(engine.pools)}
    O.bodies.erase(0)
    O.bodies.erase(3)
    O.step()
    return [before, tallies(engine, 4) | {"pools": list(engine.pools)}]


def both_fixed():
    """A bridge between two grains that become fixed stays, and is given back when they are put apart."""
    engine = scene_with([held((0, 0, 0)), held((TOUCH, 0, 0))], content=0.01)
    O.step()
    O.bodies[0].dynamic = O.bodies[1].dynamic = False
    rows = []
    for x in (0.00505, 0.0051, 0.008):
        put({1: x})
        rows.append(tallies(engine, 2))
    return rows


def cloud():
    """Wet grains of two sizes that fall into a corner of walls and bounce about: the liquid at begin, on the way, and at the end."""
    chance = random.Random(3)
    bodies = [lambda a=a: utils.wall(0, a) for a in range(3)]
    for k in range(4):
        for j in range(4):
            for i in range(4):
                place = [0.0028 + 0.0053 * n + chance.uniform(-1e-4, 1e-4) for n in (i, j, k)]
                bodies.append(grain(place, R * chance.uniform(0.8, 1.0)))
    engine = scene_with(bodies, (-3, -3, -9.81), content=0.01)
    engine.addWall([0, 1], pool=1e-9, share=0.1, part=0.5)
    for body in O.bodies:
        if isinstance(body.shape, Sphere):
            body.state.vel = Vector3(*(chance.uniform(-1.0, 1.0) for _ in range(3)))
    O.dt = 1e-5
    return engine


def conserved(step=1e-5, blocks=15, length=100):
    engine = cloud()
    O.dt = step
    rows = []
    for _ in range(blocks):
        advance(length)
        rows.append(tallies(engine, 0))
    solid = sum(4 / 3 * math.pi * b.shape.radius**3 for b in O.bodies if isinstance(b.shape, Sphere))
    return {"begin": engine.content * solid + 1e-9, "rows": rows}


def conserved_briefly():
    """Threads that wait for each other are slow on a busy machine."""
    return conserved(2e-5, 5, 50)


def save_load():
    """What bodies carry after saving and loading, and after some steps more, for each format."""
    found = {}
    for ending in ("xml", "yade.gz", "bin"):
        engine = cloud()
        advance(700)
        name = f"liquid.{ending}"
        O.save(name)
        exact = lambda e: [float(x).hex() for x in (*e.liquid, *e.pools, e.inBridges(), e.lost)]
        before = exact(engine)
        O.load(name)
        after = exact(O.engines[3])
        ends = []
        for _ in range(2):
            O.load(name)
            advance(300)
            ends.append(exact(O.engines[3]))
        os.remove(name)
        found[ending] = {"before": before, "after": after, "ends": ends}
    return found


def history():
    """Columns of time.csv."""
    engine = scene_with([held((0, 0, 0)), held((TOUCH, 0, 0)), lambda: utils.wall(1.0, 0)], content=0.01)
    writer = dembark.HistoryWriter({"side": 2}, gravity=(0, 0, 0), progress=False, liquid=engine)
    O.step()
    writer.write()
    return {"text": open("time.csv", encoding="utf-8").read(), "tallies": tallies(engine, 2)}


def messages():
    said = []

    def heard(act):
        try:
            act()
            said.append("accepted")
        except RuntimeError as error:
            said.append(str(error))

    for words in (dict(share="all"), dict(shareFactor=3.0), dict(share="fraction", shareFactor=1.5), dict(returnRule="back"),
                  dict(content=-0.1), dict(maxBridge=-1.0)):
        heard(lambda words=words: CapillaryLiquid(**words))
    engine = scene_with([held((0, 0, 0)), lambda: utils.wall(1.0, 0)])
    heard(lambda: engine.setVolume(0, -1.0))
    heard(lambda: engine.setVolume(1, 1e-10))
    heard(lambda: engine.addWall([0], pool=1e-10))
    heard(lambda: engine.addWall([1], share=2.0))
    engine.addWall([1])
    heard(lambda: engine.addWall([1]))
    return said


def without_engine():
    engine = scene_with([held((0, 0, 0)), held((TOUCH, 0, 0))])
    O.engines = [e for e in O.engines if e is not engine and not isinstance(e, CapillaryLiquid)]
    advance(3)


def without_law():
    scene_with([held((0, 0, 0))])
    O.engines[2].lawDispatcher.functors[0].carriedLiquid = False
    advance(1)


def fixed_volumes_too():
    scene_with([held((0, 0, 0)), held((TOUCH, 0, 0))], pair=dict(bridgeVolume=1e-11))
    advance(1)


write_results(globals())
