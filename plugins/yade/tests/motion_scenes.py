"""Runs inside YADE: `PYTHONPATH=. yade -n -x motion_scenes.py out.json scene...`. Walls that move as prescribed."""

import os
import sys
from pathlib import Path

from scene_results import advance, refusal, write_results
from yade import utils

sys.path.insert(0, str(Path(sys.argv[0] if sys.argv[0].endswith(".py") else __file__).resolve().parents[2] / "tests"))

from rig import late_motion, vessel

SHAKE = "harmonic amplitude 1e-3 0 2e-3 frequency 50 ramp 2"
ROCK = "rocking point 0.01 0.01 0.01 axis 0 1 0 angle 0.2 frequency 40 ramp 1"
PAIR = dict(restitution=0.6, staticFriction=0.5, kineticFriction=0.4, criticalSlipDistance=1e-5)
SMOOTH = dict(staticFriction=0.0, kineticFriction=0.0)


def scene(motion, grains=None, gravity=(0, 0, -9.81), step=vessel.STEP, triangles=None, held=False, account=True, young=vessel.MODULUS,
          **pair):
    """Grains in the box, which moves; returns the account, the motion, and the ids of the grains."""
    O.reset()
    O.dt = step
    material = O.materials.append(FrictMat(young=young, poisson=0.3, density=vessel.DENSITY, frictionAngle=0))
    walls = O.bodies.append([utils.facet(three, fixed=True, material=material) for three in triangles or vessel.box()])
    ids = []
    for place, radius, speed in vessel.grains() if grains is None else grains:
        body = utils.sphere(place, radius, material=material)
        if held:
            # Of two held bodies no force would be computed: it may turn about z.
            body.state.blockedDOFs = "xyzXY"
        # Velocities of half a step before.
        body.state.vel = Vector3(*speed) - 0.5 * step * Vector3(*gravity)
        ids.append(O.bodies.append(body))
    books, surface, moves = EnergyAccount(), FacetSurface(), WallMotion(ids=walls, motion=motion)
    O.engines = [
        ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Facet_Aabb()], verletDist=0.001), surface,
        InteractionLoop([Ig2_Sphere_Sphere_ScGeom(), Ig2_FacetSurface_Sphere_ScGeom(surface=surface)],
                        [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(**{**PAIR, **pair})],
                        [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz()]),
        *([books] if account else []), moves, NewtonIntegrator(damping=0, gravity=gravity)]
    moves.start()
    return books, moves, ids


def place():
    """Places of a corner of the floor, and of one that rocks, at steps after 100 periods."""
    step, found = 1e-4, {}
    for motion in ("harmonic amplitude 0 0 1e-3 frequency 50", "rocking point 0.01 0.01 0.01 axis 0 1 0 angle 0.2 frequency 50"):
        scene(motion, grains=[], step=step)
        corner = lambda: O.bodies[0].state.pos + O.bodies[0].state.ori * O.bodies[0].shape.vertices[0]
        rows = [[0.0, *corner()]]
        for _ in range(30):
            advance(700)
            rows.append([O.iter * step, *corner()])
        found[motion.split()[0]] = rows
    return found


def velocity():
    """Velocity of a strip at a held grain's point of contact beside v + w x r, and the grain's force, with few and many triangles."""
    found = []
    for parts in (1, 7):
        motion = "rotation point 0.004 0.006 0 axis 0 0 1 rate -40 uniform velocity 0.3 -0.2 0"
        strip = vessel.rectangle((-0.03, -0.03, 0), (0.07, 0, 0), (0, 0.07, 0), parts)
        _, _, (grain,) = scene(motion, [((0.012, 0.011, 0.0048), 0.005, (0, 0, 0))], (0, 0, 0), triangles=strip, held=True)
        rows = []
        for _ in range(500):
            O.step()
            t = (O.iter - 1) * O.dt
            contact = next(i for i in O.interactions if i.isReal)
            rows.append([t, *O.forces.f(grain), *contact.geom.contactPoint])
        rows = rows[::25]
        # Before the next step: each facet has the velocity of the step that brought it here.
        at, state = Vector3(0.012, 0.011, 0.0), [b.state for b in O.bodies if isinstance(b.shape, Facet)]
        found.append({"rows": rows, "time": O.iter * O.dt, "velocities": [list(s.vel + s.angVel.cross(at - s.pos)) for s in state]})
    return found


def forces(motion, gravity, speed=(0, 0, 0)):
    """Forces on the grains over 1000 steps."""
    grains = [(x, r, [a + b for a, b in zip(v, speed, strict=True)]) for x, r, v in vessel.grains()]
    _, _, ids = scene(motion, grains, gravity, account=False)
    rows = []
    for _ in range(1000):
        O.step()
        if O.iter % 10 == 1:
            rows.append([list(O.forces.f(k)) for k in ids])
    return rows


def frames():
    """The same forces in a vessel at rest, at constant speed, at constant acceleration and with gravity tilted by that."""
    still = "uniform velocity 0 0 0"
    return {"rest": forces(still, (0, 0, -9.81)), "speed": forces("uniform velocity 0.4 -0.3 0.2", (0, 0, -9.81), (0.4, -0.3, 0.2)),
            "push": forces("uniform velocity 0 0 0 acceleration 3 -2 1.5", (0, 0, -9.81)), "tilt": forces(still, (-3, 2, -11.31))}


def momentum(states):
    return sum((s.mass * s.vel for s in states), Vector3.Zero)


def shaken():
    """Momenta, impulse, work and energies, at two time steps."""
    found = []
    for motion, pair in ((SHAKE, {}), (ROCK, SMOOTH)):
        for step in (2e-5, 1e-5):
            books, moves, ids = scene(motion, step=step, **pair)
            states = [O.bodies[k].state for k in ids]
            mass = sum(s.mass for s in states)
            # Momentum of full steps: that of the half step and half a step of all forces.
            first, rows = momentum(states) + 0.5 * step * mass * Vector3(0, 0, -9.81), []
            every = round(2e-3 / step)
            for part in range(20):
                advance(every if part else every + 1)
                n = O.iter - 1
                # v(n+1/2) less the second half of step n
                load = sum((O.forces.f(k) for k in ids), Vector3.Zero)
                now = momentum(states) - 0.5 * step * (load + mass * Vector3(0, 0, -9.81))
                rows.append([n * step, *(now - first + n * step * mass * Vector3(0, 0, 9.81)), *moves.impulse, moves.work, moves.power,
                             *moves.force, *moves.velocity, *(load), books["walls"], books["balance"], books["scale"]])
            found.append({"rows": rows, "weight": mass * 9.81, "step": step, "motion": motion})
    return found


def pushed():
    """An elastic grain that a plate speeds into: the error of the step, at two time steps."""
    found = []
    for step in (2e-5, 1e-5):
        grains = [((0.01, 0.01, 0.00252), 0.0025, (0, 0, 0))]
        books, _, _ = scene("uniform velocity 0 0 0 acceleration 0 0 60", grains, (0, 0, 0), step=step, restitution=1.0, **SMOOTH)
        errors = []
        for _ in range(200):
            advance(round(1e-4 / step))
            errors.append(abs(books["step_error"]))
        found.append(max(errors) / books["scale"])
    return found


def other_ids():
    """Energies of a step after which the list of bodies that move is as it was, in another order, or longer."""
    found = []
    for change in (lambda ids: ids, lambda ids: ids[::-1], lambda ids: [*ids, *range(100, 200)], lambda ids: ids[:1]):
        books, moves, _ = scene(ROCK)
        advance(200)
        moves.ids = change(list(moves.ids))
        found.append(books.energies())
    return found


def bounce():
    """Times at which a grain lands on a shaken plate."""
    step, radius = vessel.BOUNCE_STEP, vessel.RADIUS
    _, _, (grain,) = scene(f"harmonic amplitude 0 0 {vessel.BOUNCE_AMPLITUDE} frequency {vessel.BOUNCE_FREQUENCY} ramp 0",
                           [((0.01, 0.01, radius + vessel.BOUNCE_GAP), radius, (0, 0, 0))], step=step, account=False,
                           young=vessel.BOUNCE_MODULUS, restitution=vessel.BOUNCE_RESTITUTION, **SMOOTH)
    found, touched = [], False
    while len(found) < 5 and O.iter < 400000:
        O.step()
        touches = O.forces.f(grain)[2] > 0
        if touches and not touched:
            found.append((O.iter - 1) * step)
        touched = touches
    return found


def reloaded():
    """A run that goes on, and the same from where it was saved on the way: work, impulse, and places of all bodies."""
    def result():
        moves = next(e for e in O.engines if isinstance(e, WallMotion))
        advance(400)
        return {"walls": [[*b.state.pos, *b.state.ori, *b.state.vel] for b in O.bodies if isinstance(b.shape, Facet)],
                "sums": [*moves.impulse, moves.work], "grains": [list(b.state.pos) for b in O.bodies if isinstance(b.shape, Sphere)]}

    scene(f"{SHAKE} {ROCK}")
    advance(300)
    O.save("motion.yade.gz", quiet=True)
    found = [result()]
    O.load("motion.yade.gz", quiet=True)
    found.append(result())
    os.unlink("motion.yade.gz")
    return found


def late():
    """Plates that get motions late, all of one place, below a held grain: rows of displacement, angle, force and `begun` of each."""
    late = late_motion
    Path("late.csv").write_text(late.TABLE, encoding="ascii")
    O.reset()
    O.dt = late.STEPS[0]
    material = O.materials.append(FrictMat(young=vessel.MODULUS, poisson=0.3, density=vessel.DENSITY, frictionAngle=0))
    # A grain that may turn: of two held bodies no force would be computed.
    grain = utils.sphere(late.GRAIN, late.RADIUS, material=material)
    grain.state.blockedDOFs = "xyzXY"
    O.bodies.append(grain)
    plates = [O.bodies.append([utils.facet(three, fixed=True, material=material) for three in late.PLATE]) for _ in late.MOTIONS]
    # The engine's own contacts with facets: to a surface of facets the plates would be one.
    O.engines = [
        ForceResetter(), InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Facet_Aabb()], verletDist=0.001),
        InteractionLoop([Ig2_Facet_Sphere_ScGeom()],
                        [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(restitution=1.0, criticalSlipDistance=1e-5, **SMOOTH)],
                        [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz()]),
        NewtonIntegrator(damping=0)]
    advance(late.COUNTS[0])
    O.dt = late.STEPS[1]
    advance(late.COUNTS[1])
    moves = [WallMotion(ids=plate, motion=words) for plate, words in zip(plates, late.MOTIONS, strict=True)]
    O.engines = [*O.engines[:-1], *moves, O.engines[-1]]
    advance(1)
    rows = [[] for _ in moves]
    for part in range(2):
        for _ in range(late.PART // late.EVERY):
            advance(late.EVERY)
            # A scene that was loaded has engines of its own.
            now = [engine for engine in O.engines if isinstance(engine, WallMotion)]
            for engine, table in zip(now, rows, strict=True):
                table.append([*engine.displacement, engine.angle, engine.force[2], engine.begun])
        if not part:
            O.save("late.yade.gz", quiet=True)
            O.load("late.yade.gz", quiet=True)
    os.unlink("late.yade.gz")
    return rows


def again():
    """Heights of a plate: its motion, another one, and what is said of one that did not run or whose scene's time is reset."""
    _, moves, _ = scene("uniform velocity 0 0 0.1", [], triangles=vessel.rectangle((0, 0, 0), (0.02, 0, 0), (0, 0.02, 0)))
    height = lambda: (O.bodies[0].state.pos + O.bodies[0].state.ori * O.bodies[0].shape.vertices[0])[2]
    found = []
    for words in ("uniform velocity 0 0 0.1", "uniform velocity 0 0 -0.2", "harmonic amplitude 0 0 1e-3 frequency 50 ramp 0"):
        moves.motion = words
        advance(50)
        found.append([O.iter * O.dt, moves.begun, height()])

    def dead():
        moves.dead = True
        advance(3)
        moves.dead = False
        O.step()

    said = [refusal(dead)]
    # Without the account, which stands first and refuses the step as well.
    scene("uniform velocity 0 0 0.1", [], triangles=vessel.rectangle((0, 0, 0), (0.02, 0, 0), (0, 0.02, 0)), account=False)
    advance(5)
    O.resetTime()
    said.append(refusal(O.step))
    return {"heights": found, "said": said}


def messages():
    def trial(motion="harmonic amplitude 0 0 1e-3 frequency 50", change=lambda: None):
        def do():
            scene(motion, grains=[])
            change()
            O.step()
        return refusal(do)

    def last():
        O.engines = [O.engines[-1], *O.engines[:-1]]

    def stepped():
        O.engines = [*O.engines, GlobalStiffnessTimeStepper()]

    def freed():
        O.bodies[0].dynamic = True

    def moving(ids):
        return refusal(lambda: (scene(SHAKE), setattr(O.engines[-2], "ids", ids), O.step()))

    with open("back.csv", "w", encoding="ascii") as file:
        file.write("0,0,0,0\n0.1,1e-3,0,0\n0.1,2e-3,0,0\n")
    return {"word": trial("shake 1"), "zero": trial("harmonic amplitude 0 0 1e-3 frequency 0"), "back": trial("table file back.csv"),
            "short": trial("jolts shape half_sine acceleration 1 0 0 duration 2e-5"),
            "fast": trial("harmonic amplitude 0 0 1e-3 frequency 20000"), "order": trial(change=last),
            "step": trial(change=stepped),
            "free": trial(change=freed), "empty": moving([]), "strangers": [moving([body]) for body in (-1, 77, 10**6)]}


write_results(globals())
