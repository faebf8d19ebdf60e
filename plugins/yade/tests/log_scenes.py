"""Runs inside YADE: `PYTHONPATH=. yade -n -x log_scenes.py out.json scene...`. Each scene is a function that returns plain data."""

import builtins
import math
import os
import re

from scene_results import advance, write_results
from yade import dembark, utils

GRAVITY = 9.81


def setting(bodies, dt, gravity=0.0, **impact):
    """A new scene of `bodies` with LcpImpact; returns the engine."""
    O.reset()
    # Bodies take the last material.
    O.materials.append([FrictMat(young=1e9, poisson=0.3, density=700, label=label) for label in ("other", "log")])
    O.bodies.append([body() for body in bodies])
    engine = LcpImpact(**impact)
    O.dt = dt
    O.engines = [ForceResetter(), engine, NewtonIntegrator(damping=0, gravity=(0, -gravity, 0))]
    return engine


def log(*words, **more):
    """A log, made when the scene is there."""
    return lambda: dembark.log(*words, **more)


def floor(height=0.0, sense=1):
    return lambda: utils.wall(height, 1, sense=sense)


def side(x, sense):
    return lambda: utils.wall(x, 0, sense=sense)


def outputs(engine):
    names = ("contactCount activeCount impactsBegun peakForce impulseSum dissipatedEnergy elasticEnergy pivots blockSteps pivotsTotal "
             "certificate worstCertificate highestForce steps")
    return {name: getattr(engine, name) for name in names.split()}


def contacts(engine):
    return [[a, b, list(n), gap, force, list(tangential), list(place)] for a, b, n, gap, force, tangential, place in engine.contacts()]


def motion():
    """Position, velocity and angular velocity of each sphere, to the bit."""
    return [[float(x).hex() for v in (b.state.pos, b.state.vel, b.state.angVel) for x in v] for b in O.bodies
            if isinstance(b.shape, Sphere)]


def kinetic():
    return sum(0.5 * b.state.mass * b.state.vel.squaredNorm() + 0.5 * b.state.inertia[2] * b.state.angVel[2] ** 2 for b in O.bodies
               if b.dynamic)


def pair(mass=(50.0, 50.0), stiffness=(2e7, 2e7), speed=1.0, turn=0.01, **more):
    """Two logs meet head on; `turn` is omega times the step."""
    k = stiffness[0] * stiffness[1] / sum(stiffness)
    reduced = mass[0] * mass[1] / sum(mass)
    omega = math.sqrt(k / reduced)
    dt = turn / omega
    bodies = [log((0, 0, 0), 0.1, mass[0], (speed, 0, 0)), log((0.25, 0, 0), 0.15, mass[1], material="other")]
    engine = setting(bodies, dt, stiffness={"log": stiffness[0], "other": stiffness[1]}, **more)
    begin = kinetic()
    advance(int(1.5 * math.pi / turn))
    return {"velocity": [b.state.vel[0] for b in O.bodies], "outputs": outputs(engine), "peak": speed * math.sqrt(k * reduced),
            "begin": begin,
            "end": kinetic(), "duration": math.pi / omega, "reduced": reduced, "dt": dt, "stiffness": engine.stiffness}


def pairs():
    found = {"plain": pair(), "unequal": pair((20.0, 80.0), (1e7, 3e7), 1.5, 1e-3)}
    for turn in (0.04, 0.02, 0.01):
        found[f"half {turn}"] = pair(turn=turn, theta=0.5)
    found["damped"] = pair(turn=1e-3, contactDamping=2000.0)
    for method in ("energy", "block", "murty"):
        found[method] = pair(method=method)["velocity"]
    return found


def wall():
    """A log against a wall of local stiffness, for each kind of wall, and one that comes towards it."""
    found = {}
    mass, s, local, speed = 30.0, 2e7, 5e7, 2.0
    k = s * local / (s + local)
    dt = 1e-3 / math.sqrt(k / mass)
    corners = [(-1, 0, -1), (1, 0, -1), (1, 0, 1), (-1, 0, 1)]
    kinds = {"wall": [floor()], "two sides": [floor(sense=0)],
             "facets": [lambda: utils.facet([corners[i] for i in (0, 1, 2)]), lambda: utils.facet([corners[i] for i in (0, 2, 3)])],
             "drum": [lambda: dembark.drum((0, 0.5, 0), 0.5)]}
    for kind, bodies in kinds.items():
        engine = setting([*bodies, log((0, 0.1, 0), 0.1, mass, (0, -speed, 0))], dt, stiffness=s,
                         walls=[dict(bodies=list(range(len(bodies))), stiffness=local, name="floor")])
        least = 0.0
        for _ in range(4000):
            O.step()
            least = min(least, engine.wallForce("floor")[1])
            total = sum(O.forces.f(i)[1] for i in range(len(bodies)))
            assert total == engine.walls[0].force[1], (kind, total)
        found[kind] = {"velocity": O.bodies[len(bodies)].state.vel[1], "force": least, "peak": speed * math.sqrt(k * mass),
                       "outputs": outputs(engine)}
    setting([floor(sense=0), log((0, -0.1, 0), 0.1, mass, (0, speed, 0))], dt, stiffness=s, walls=[dict(bodies=[0], stiffness=local)])
    advance(4000)
    found["from below"] = O.bodies[1].state.vel[1]
    engine = setting([floor(), log((0, 0.1, 0), 0.1, mass)], dt, stiffness=s, walls=[dict(bodies=[0], stiffness=local)])
    O.bodies[0].state.vel = (0, speed, 0)
    advance(4000)
    found["moving"] = O.bodies[1].state.vel[1]
    engine = setting([log((0, 0, 0), 0.1, 1.0), log((0.2, 0, 0), 0.1, mass)], dt, stiffness=s)
    O.bodies[0].state.blockedDOFs = "xyzXYZ"
    O.bodies[0].state.vel = (speed, 0, 0)
    advance(8000)
    found["held log"] = O.bodies[1].state.vel[0]
    return found


def cradle():
    engine = setting([log((0.2 * i, 0, 0), 0.1, 50.0, (float(i == 0), 0, 0)) for i in range(5)], 1e-6, stiffness=2e7)
    worst = 0.0
    for _ in range(20):
        advance(1000)
        worst = max(worst, abs(sum(b.state.vel[0] for b in O.bodies) - 1.0))
    return {"velocity": [b.state.vel[0] for b in O.bodies], "momentum": worst, "outputs": outputs(engine)}


def rest():
    """A log set down on a floor exactly at its equilibrium; the same thrown freely from v_0."""
    mass, s, local = 40.0, 1e7, 2e7
    overlap = mass * GRAVITY * (1 / s + 1 / local)
    engine = setting([floor(), log((0, 0.1 - overlap, 0), 0.1, mass)], 1e-5, GRAVITY, stiffness=s,
                     walls=[dict(bodies=[0], stiffness=local)],
                     velocityAtStart=True)
    speeds = []
    for _ in range(2000):
        O.step()
        speeds.append(abs(O.bodies[1].state.vel[1]))
    found = {"fastest": max(speeds), "contacts": contacts(engine), "weight": mass * GRAVITY, "outputs": outputs(engine)}
    for start in (True, False):
        engine = setting([log((0, 0, 0), 0.1, 1.0, (1.0, 2.0, 0), 3.0)], 1e-3, GRAVITY, stiffness=s, velocityAtStart=start)
        advance(100)
        found[f"thrown {start}"] = [*O.bodies[0].state.pos, O.bodies[0].state.angVel[2]]
    return found


def pile():
    """Ten logs in a heap between two walls come to rest on a floor; forces then equal the weights."""
    mass, radius = 30.0, 0.1
    bodies = [floor(), side(-0.4, 1), side(0.4, -1)]
    for row in range(4):
        bodies += [log((0.2 * (i - 0.5 * (3 - row)), radius + row * radius * math.sqrt(3.0), 0), radius, mass) for i in range(4 - row)]
    engine = setting(bodies, 2e-5, GRAVITY, stiffness=1e7, contactDamping=3e3, friction=dict(static=0.4, kinetic=0.3, slip=1e-3),
                     walls=[dict(bodies=0, stiffness=3e7, name="floor"), dict(bodies=1, stiffness=3e7, name="left"),
                            LogWall(bodies=[2], stiffness=3e7, name="right")])
    advance(60000)
    forces = {name: list(engine.wallForce(name)) for name in ("floor", "left", "right")}
    net = {b.id: O.forces.f(b.id)[1] for b in O.bodies if b.dynamic}
    return {"forces": forces, "weight": 10 * mass * GRAVITY, "net": net, "fastest": max(b.state.vel.norm() for b in O.bodies),
            "outputs": outputs(engine),
            "contacts": contacts(engine)}


def drum():
    """A drum turns under a log: one that cannot roll swings about the angle where friction holds it, the other ends up rolling along."""
    found = {}
    for blocked in ("zXYZ", "zXY"):
        engine = setting([lambda: dembark.drum((0, 0, 0), 0.5, omega=2.0), log((0, -0.4, 0), 0.1, 30.0)], 5e-5, GRAVITY, stiffness=1e7,
                         contactDamping=5e3, walls=[dict(bodies=[0], stiffness=3e7, friction=0.3, name="shell")])
        O.bodies[1].state.blockedDOFs = blocked
        highest = 0.0
        for _ in range(600):
            advance(100)
            x, y, _ = O.bodies[1].state.pos
            highest = max(highest, math.atan2(x, -y))
        state = O.bodies[1].state
        x, y, _ = state.pos
        along = (x * state.vel[1] - y * state.vel[0]) / math.hypot(x, y)
        found[blocked] = {"highest": highest, "spin": state.angVel[2], "along": along, "outputs": outputs(engine),
                          "torque": O.forces.t(0)[2],
                          "force": list(engine.wallForce("shell")), "contact": contacts(engine)[0]}
    return found


def oblique():
    """Two logs meet off centre with friction: what is kept."""
    def sums():
        p = [b.state.mass * b.state.vel for b in O.bodies]
        spin = sum(b.state.inertia[2] * b.state.angVel[2] + b.state.mass * b.state.pos.cross(b.state.vel)[2] for b in O.bodies)
        return [sum(v[0] for v in p), sum(v[1] for v in p), spin]

    engine = setting([log((0, 0, 0), 0.1, 30.0, (2.0, 0, 0), 5.0), log((0.21, 0.12, 0), 0.14, 60.0)], 1e-6, stiffness=2e7, friction=0.4)
    begin, energy = sums(), kinetic()
    advance(8000)
    return {"begin": begin, "end": sums(), "energy": [energy, kinetic()], "outputs": outputs(engine),
            "spins": [b.state.angVel[2] for b in O.bodies],
            "flat": max(abs(b.state.pos[2]) + abs(b.state.vel[2]) for b in O.bodies)}


def heap(**more):
    """Logs that tumble in a turning drum with a plane floor of their own, dense in impacts."""
    bodies = [lambda: dembark.drum((0, 0, 0), 0.6, omega=3.0), side(-0.5, 1)]
    bodies += [log((0.22 * (i % 4) - 0.33, 0.22 * (i // 4) - 0.3, 0), 0.07 + 0.003 * i, 20.0 + 2 * i, (0.5 - 0.1 * i, 0.2, 0), 2.0 - i)
               for i in range(12)]
    return setting(bodies, 5e-5, GRAVITY, stiffness=1e7, damping=100.0, contactDamping=500.0,
                   friction=dict(static=0.5, kinetic=0.3, slip=1e-4, healing=0.1),
                   walls=[dict(bodies=[0], stiffness=3e7, name="shell"), dict(bodies=[1], stiffness=2e7, friction=0.1, name="flat")],
                   **more)


def save_load():
    """A run on from a saved scene beside the run that was never interrupted, for each format."""
    found = {}
    more = 4000
    for ending in ("xml", "yade.gz", "bin"):
        name = f"impacts-{ending}.txt"
        engine = heap(impactsFile=name, velocityAtStart=True)
        advance(12000)
        O.save(f"logs.{ending}")
        half = open(name, encoding="utf-8").read()
        advance(more)
        straight, lines, end = motion(), open(name, encoding="utf-8").read(), outputs(engine)
        O.load(f"logs.{ending}")
        engine = O.engines[1]
        O.save(f"again.{ending}")
        loaded = outputs(engine)
        advance(more)
        resumed, twice, last = motion(), open(name, encoding="utf-8").read(), outputs(engine)
        O.load(f"again.{ending}")
        advance(more)
        found[ending] = {"straight": straight, "resumed": resumed, "again": motion(), "lines": lines, "twice": twice, "half": half,
                         "end": end,
                         "last": last, "loaded": loaded, "stiffness": O.engines[1].stiffness, "friction": O.engines[1].friction,
                         "walls": [[w.name, w.stiffness, w.bodies, w.friction] for w in O.engines[1].walls]}
        # A new time step takes the histories along.
        O.dt *= 0.5
        advance(10)
        found[ending]["half step"] = outputs(O.engines[1])
        for file in (f"logs.{ending}", f"again.{ending}", name):
            os.remove(file)
    # Saved between LcpImpact and NewtonIntegrator: the whole step is done again after loading.
    engine = heap(velocityAtStart=True)
    builtins.save = lambda: O.save("middle.bin")
    O.engines = [*O.engines[:2], PyRunner(command="save()", iterPeriod=9000, firstIterRun=9000), O.engines[2]]
    advance(9500)
    straight, end = motion(), outputs(engine)
    O.load("middle.bin")
    begin = O.iter
    advance(9500 - begin)
    found["middle"] = {"begin": begin, "straight": straight, "resumed": motion(), "end": end, "last": outputs(O.engines[1])}
    engine = heap(impactsFile="lost.txt")
    advance(3000)
    O.save("lost.bin")
    os.remove("lost.txt")
    O.load("lost.bin")
    try:
        O.step()
        found["lost"] = "went on"
    except RuntimeError as error:
        found["lost"] = str(error)
    return found


def other_format():
    """What loading says of scenes whose engine is said to be of another format."""
    lines = {}
    for number in ("0", "2"):
        heap()
        advance(10)
        O.save("other.xml")
        text = open("other.xml", encoding="utf-8").read()
        text, found = re.subn(r'(class_name="yade::LcpImpact" tracking_level="\d" version=)"\d+"', rf'\1"{number}"', text)
        open("other.xml", "w", encoding="utf-8").write(text)
        try:
            O.load("other.xml")
        except RuntimeError as error:
            lines[number] = [found, str(error)]
    return lines


def records():
    """Lines of the file of impacts: a pair, a wall."""
    engine = setting([floor(-0.1), log((0, 0, 0), 0.1, 50.0, (1.0, 0, 0)), log((0.25, 0, 0), 0.1, 50.0),
                      log((1, 0.03, 0), 0.1, 40.0, (0, -3.0, 0))],
                     1e-6, stiffness=2e7, walls=[dict(bodies=[0], stiffness=2e7)], impactsFile="records.txt")
    advance(80000)
    return {"text": open("records.txt", encoding="utf-8").read(), "outputs": outputs(engine)}


def first_impacts():
    """A small pile that falls together, for comparison with the model alone."""
    radii, masses = (0.1, 0.12, 0.09, 0.11), (30.0, 45.0, 25.0, 35.0)
    places = ((0.0, 0.11), (0.24, 0.13), (0.05, 0.32), (0.28, 0.36))
    bodies = [floor()] + [log((x, y, 0), r, m, (0.3 - 0.2 * i, -0.5, 0), 1.0 * i)
                          for i, ((x, y), r, m) in enumerate(zip(places, radii, masses, strict=True))]
    engine = setting(bodies, 1e-5, GRAVITY, stiffness=1.5e7, friction=0.4, velocityAtStart=True,
                     walls=[dict(bodies=[0], stiffness=4e7, friction=0.4, name="floor")])
    rows = []
    for _ in range(40):
        advance(200)
        rows.append([[*b.state.pos, *b.state.vel, *b.state.angVel] for b in O.bodies if b.dynamic])
    return {"rows": rows, "radii": radii, "masses": masses, "places": places, "outputs": outputs(engine)}


write_results(globals())
