"""Runs inside YADE: `PYTHONPATH=. yade -n -x capsule_scenes.py out.json scene...`. Each scene is a function that returns plain data."""

import builtins
import math
from random import Random

from scene_results import advance, write_results
from yade import dembark, utils
from yade.dembark.frames import motion

GRAVITY = 9.81


def capsule(position, axis=(0, 0, 1), velocity=(0, 0, 0), spin=(0, 0, 0), radius=0.1, mass=40.0, length=1.0):
    """The words of a log, for YADE and for Python."""
    return dict(position=position, axis=axis, velocity=velocity, spin=spin, radius=radius, mass=mass, length=length)


def floor(height=0.0):
    return lambda: utils.wall(height, 1, sense=1)


def plate(z, sense, omega):
    """The end of a drum."""
    def body():
        one = utils.wall(z, 2, sense=sense)
        one.state.angVel = (0, 0, omega)
        return one
    return body


def setting(logs, dt, walls=(), gravity=0.0, before=(), stiff=5e7, **impact):
    """A new scene of logs and, in front of them, walls as functions that make them; returns the engine."""
    O.reset()
    O.materials.append(FrictMat(density=700, label="bark"))
    O.bodies.append([wall() for wall in walls])
    O.bodies.append([dembark.log(**log) if isinstance(log, dict) else log() for log in logs])
    engine = LcpImpact(**{"stiffness": 1e7, "velocityAtStart": True, "walls": [dict(bodies=[k], stiffness=stiff, name=f"wall {k}")
                                                                               for k in range(len(walls))], **impact})
    O.dt = dt
    O.engines = [ForceResetter(), *before, engine, NewtonIntegrator(damping=0, gravity=(0, -gravity, 0))]
    return engine


def spheres():
    return [b for b in O.bodies if isinstance(b.shape, Sphere)]


def bits():
    """All of the motion of each log, to the bit."""
    return [[float(x).hex() for v in (b.state.pos, b.state.vel, b.state.ori, b.state.angVel, b.state.angMom) for x in v] for b in spheres()]


def outputs(engine):
    names = "activeCount impactsBegun dissipatedEnergy elasticEnergy worstCertificate highestForce"
    return {name: getattr(engine, name) for name in names.split()}


def contacts(engine):
    return [[a, b, list(n), gap, force, list(tangential), list(place)] for a, b, n, gap, force, tangential, place in engine.contacts()]


def between(command):
    """Run this between forces and motion, where positions and forces belong to the same time."""
    O.engines = [*O.engines[:-1], command, O.engines[-1]]


def run(logs, dt, steps, every, gravity=0.0, **more):
    """Frames of the logs: position, velocity, spin, orientation (w, x, y, z); and what the engine says at the end."""
    engine, frames = setting(logs, dt, gravity=gravity, **more), []

    def sample():
        frame = []
        for b in spheres():
            x, y, z, w = b.state.ori
            frame.append([*b.state.pos, *(n for v in motion(b, (0, -gravity, 0))[1:] for n in v), w, x, y, z])
        frames.append(frame)
    builtins.sample = sample
    between(PyRunner(command="sample()", iterPeriod=every, initRun=True))
    advance(steps + 1)
    return {"logs": [log for log in logs if isinstance(log, dict)], "frames": frames, "dt": dt, "every": every, "steps": steps,
            "outputs": outputs(engine), "contacts": contacts(engine)}


def load(count=18, seed=4):
    """Logs in a closed drum of 1.8 m: tilted, of unequal length, and balls among them."""
    random = Random(seed)
    return [capsule((0.26 * (i % 3 - 1), 0.26 * (i // 3 % 3 - 1), 0.8 * (i // 9) - 0.4), (random.gauss(0, 1), random.gauss(0, 1), 9),
                    (random.uniform(-1, 1), -1.0, (i // 9 - 0.5) * random.uniform(1, 4)), (0, 0, 0), random.uniform(0.08, 0.1),
                    random.uniform(20, 50), 0.0 if i % 7 == 0 else random.uniform(0.2, 0.5)) for i in range(count)]


DRUM = dict(walls=(lambda: dembark.drum((0, 0, 0), 0.65, omega=2.0), plate(-0.9, 1, 2.0), plate(0.9, -1, 2.0)), gravity=GRAVITY,
            contactDamping=500.0, friction=0.4)


def drum():
    """A load in a closed drum."""
    return {str(theta): run(load(), 2e-4, 1500, 150, theta=theta, **DRUM) for theta in (1.0, 0.5)}


def cluster():
    """Logs in any direction that close in on each other, turn, and fly apart again."""
    random = Random(3)

    def three(size):
        return [random.gauss(0, size) for _ in range(3)]

    logs = []
    for i in range(8):
        x = [1.2 * (i // part % 2) - 0.6 + random.uniform(-0.05, 0.05) for part in (1, 2, 4)]
        velocity = [a - 2 * b for a, b in zip(three(0.5), x, strict=True)]
        logs.append(capsule(x, three(1), velocity, three(3), random.uniform(0.06, 0.12), random.uniform(10, 60), random.uniform(0, 0.8)))
    return run(logs, 2e-4, 5000, 5000, contactDamping=300.0, friction=0.3)


def falling():
    """A tilted log falls on its lower end, and the other end follows."""
    angle, stiffness = 0.15, 1e11
    log = capsule((0.0, 0.1 + 0.75 * math.sin(angle) + 1e-5, 0.0), (math.cos(angle), math.sin(angle), 0.0), (0, -1.0, 0), length=1.5)
    found = run([log], 7e-7, 185000, 185000, walls=[floor()], stiff=1e15, stiffness=stiffness, theta=0.5, impactsFile="falling.txt")
    return {**found, "impacts": open("falling.txt", encoding="utf-8").read()}


def ends():
    """Two logs meet end to end, and an end meets a side off its middle."""
    return {"end": run([capsule((0, 0, 0), velocity=(0, 0, 1.0), mass=30.0),
                        capsule((0, 0, 0.951), velocity=(0, 0, -0.5), mass=50.0, radius=0.15, length=0.4)], 1e-5, 2000, 200),
            "balls": run([lambda: ball((0, 0, 0.5), 0.1, 30.0, 1.0), lambda: ball((0, 0, 0.751), 0.15, 50.0, -0.5)], 1e-5, 2000, 200),
            "side": run([capsule((0, 0, 0)), capsule((0.3, 0.72, 0.301), (0, 1, 0.7), (0, -1.0, -1.5), (1.0, 3.0, 0.2))], 1e-4, 3000, 300)}


def ball(position, radius, mass, speed):
    body = utils.sphere(position, radius)
    body.state.mass, body.state.inertia, body.state.vel = mass, (1e9, 1e9, 1e9), (0, 0, speed)
    return body


def parallel():
    """Logs that are all parallel next to logs in cross-section, in a drum and on a floor."""
    found = {}
    for kind, walls, mu in (("drum", DRUM["walls"][:1], 0.0), ("floor", [floor(-0.45)], 0.0)):
        random = Random(3)
        logs = [dict(position=(0.26 * (i % 3 - 1) + random.uniform(-0.004, 0.004), 0.26 * (i // 3 - 1), 0),
                     radius=random.uniform(0.06, 0.12), mass=random.uniform(20, 60), velocity=(random.uniform(-1, 1), 0, 0))
                for i in range(9)]
        words = dict(walls=walls, gravity=GRAVITY, contactDamping=500.0, friction=mu)
        found[kind] = {"discs": run(logs, 2e-4, 2000, 200, **words),
                       "logs": run([dict(log, length=1.2, axis=(0, 0, -1)) for log in logs], 2e-4, 2000, 200, **words)}
    return found


def top():
    """A log that turns freely, by half a radian a step; another that is held and turned."""
    free = run([capsule((0, 0, 0), spin=(3.0, -2.0, 20.0), length=1.5)], 2.5e-2, 400, 20)
    engine = setting([capsule((0, 0, 0), (1, 0, 0)), capsule((0.4, 0.5, 0.0), (0, 1, 0), length=0.4)], 1e-4, theta=0.5)
    held = O.bodies[0].state
    held.blockedDOFs, held.angVel, held.vel = "xyzXYZ", (0, 0, 1.0), (0, 0, 0)
    advance(4000)
    return {"free": free, "held": [list(held.ori * Vector3(0, 0, 1)), list(held.pos)], "pushed": list(O.bodies[1].state.vel),
            "impacts": engine.impactsBegun}


def inertia():
    """What the engine sets, and a log that the torque of another engine turns."""
    engine = setting([capsule((0, 0, 0), (0, 1, 0))], 1e-3, before=[TorqueEngine(ids=[0], moment=(2.0, 3.0, 0.0))])
    advance(100)
    body = O.bodies[0]
    momentum = Vector3(*body.state.angMom)
    found = {"inertia": list(body.state.inertia), "aspherical": body.aspherical, "momentum": list(momentum),
             "blocked": body.state.blockedDOFs, "energy": utils.kineticEnergy()}
    # Then on its own; a new step keeps the angular momentum, a spin or an angular momentum that is set counts.
    O.engines = [ForceResetter(), engine, O.engines[-1]]
    O.dt *= 0.3
    advance(10)
    found["new step"] = list(body.state.angMom - momentum)
    body.state.angMom = (1.0, 0, 0)
    advance(1)
    found["set momentum"] = list(body.state.angMom)
    axis = body.state.ori * Vector3(0, 0, 1)
    body.state.angVel = 2.0 * axis
    advance(100)
    found["set spin"] = [list(v) for v in (body.state.angMom, 2.0 * body.state.inertia[2] * axis, body.state.ori * Vector3(0, 0, 1), axis)]
    return found


def lying():
    """A log on a floor that gives way by its weight, and its own load."""
    engine = setting([capsule((0, 0.1 - 40.0 * GRAVITY * (1e-7 + 2e-8), 0))], 1e-5, walls=[floor()], gravity=GRAVITY)
    advance(200)
    return {"contacts": contacts(engine), "weight": 40.0 * GRAVITY, "force": list(engine.wallForce("wall 0")), "on": list(O.forces.f(0)),
            "fastest": max(O.bodies[1].state.vel.norm(), O.bodies[1].state.angVel.norm())}


def leaning():
    """A log that is pushed against a plate which turns: the forces on log and plate."""
    engine = setting([capsule((1.0, 0, -0.65), length=0.5, mass=10.0)], 1e-4, walls=[plate(-1.0, 1, 1.5)],
                     before=[ForceEngine(ids=[1], force=(0, 0, -100.0))], friction=0.2, contactDamping=1000.0)
    advance(500)
    return {"contacts": contacts(engine), "force": list(O.forces.f(0)), "torque": list(O.forces.t(0))}


def writer():
    """The files of LogWriter."""
    logs = [dict(log, spin=(1.0, 2.0, 3.0)) for log in load(4)]
    setting(logs, 2e-4, **DRUM)
    record = dembark.LogWriter(O.engines[1], bounds=[(-1, 1)] * 3, gravity=(0, -GRAVITY, 0))
    builtins.record = record
    between(PyRunner(command="record.write()", iterPeriod=100, initRun=True))
    advance(601)
    record._history.flush()
    return {"logs": logs, **{name: open(name, encoding="utf-8").read() for name in ("grains.dump", "time.csv")}}


def mistake():
    """A first step that fails as it writes, and is done again."""
    found = []
    for name in ("nowhere/impacts.txt", ""):
        engine = setting(load(4), 2e-4, impactsFile=name, **DRUM)
        try:
            advance(1)
        except RuntimeError as error:
            found.append(str(error))
            engine.impactsFile = ""
            advance(1)
        advance(500)
        found.append(bits())
    return found


def save_load():
    """A run on from a saved scene next to the run that was never interrupted, for each format."""
    found = {}
    for ending in ("xml", "yade.gz", "bin"):
        name = f"impacts-{ending}.txt"
        setting(load(), 2e-4, impactsFile=name, **DRUM)
        advance(900)
        O.save(f"logs.{ending}")
        advance(600)
        straight, lines = bits(), open(name, encoding="utf-8").read()
        O.load(f"logs.{ending}")
        O.save(f"again.{ending}")
        advance(600)
        resumed, twice = bits(), open(name, encoding="utf-8").read()
        O.load(f"again.{ending}")
        advance(600)
        found[ending] = {"straight": straight, "resumed": resumed, "again": bits(), "lines": lines, "twice": twice,
                         "lengths": [b.shape.length for b in spheres()], "logs": load()}
    # Saved between LcpImpact and NewtonIntegrator: the step is done again after loading, the first one too.
    for step in (0, 900):
        setting(load(), 2e-4, **DRUM)
        builtins.save = lambda: O.save("middle.bin")
        between(PyRunner(command="save()", iterPeriod=10000, firstIterRun=step, initRun=step == 0))
        advance(1200)
        straight = bits()
        O.load("middle.bin")
        begin = O.iter
        advance(1200 - begin)
        found[f"middle {step}"] = {"begin": begin, "straight": straight, "resumed": bits()}
    return found


write_results(globals())
