"""Runs inside YADE: `PYTHONPATH=. yade -n -x monitor_scenes.py out.json scene...`. Each scene is a function that returns plain data."""

import math
import os
import random
import sys

from scene_results import advance, place, write_results
from yade import utils

R, DENSITY = 2.5e-3, 2500.0


def scene_with(bodies, monitor, step, gravity=(0, 0, 0), law=None, **pair):
    """A new scene of `bodies` with `monitor`."""
    O.reset()
    place(bodies, DENSITY)
    O.dt = step
    O.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Sphere_Aabb(), Bo1_Wall_Aabb()], verletDist=0.2 * R),
        InteractionLoop(
            [Ig2_Sphere_Sphere_ScGeom(), Ig2_Wall_Sphere_ScGeom()],
            [Ip2_FrictMat_FrictMat_FinnieRabinowiczPhys(**{**dict(restitution=1.0, staticFriction=0, kineticFriction=0,
                                                                  criticalSlipDistance=0), **pair})],
            [Law2_ScGeom_FinnieRabinowiczPhys_FinnieRabinowicz(**(law or {}))]),
        monitor,
        NewtonIntegrator(damping=0, gravity=gravity),
    ]
    return monitor


def grain(x, velocity=0.0, fixed=False, radius=R):
    body = utils.sphere((x, 0, 0) if isinstance(x, float) else x, radius, fixed=fixed)
    body.state.vel = Vector3(velocity, 0, 0)
    return body


def chain(phase, steps, **monitor):
    """A compressed Hooke chain of eight, its ends held, in its highest mode with omega h = `phase`; see rig/chains.py."""
    mass, rigidity = 4 / 3 * math.pi * R**3 * DENSITY, math.sqrt(R / 2) * 5e6 / (2 * (1 - 0.3**2))
    stiffness = 16 / 15 * rigidity * (15 * mass / 2 * 0.5**2 / (16 * rigidity)) ** 0.2
    step = phase / (2 * math.sqrt(stiffness / mass) * math.sin(8 * math.pi / 18))
    places = [(2 * R - 4e-4) * k + 5e-5 * math.sin(8 * math.pi * k / 9) * (0 < k < 9) for k in range(10)]
    watch = scene_with([grain(x) for x in places], IntegrationMonitor(**{**dict(speed=1.0, length=1.0, limit=1e9), **monitor}), step,
                       law=dict(normalLaw="hooke", characteristicVelocity=0.5))
    # Held by the integrator's mask: held spheres would be of infinite mass to Hooke's stiffness.
    for body in O.bodies:
        body.mask = 2 if body.id in (0, 9) else 3
    O.engines[-1].mask = 1
    # At rest at the first step: the kick of half a step.
    O.step()
    for body in O.bodies:
        if body.id not in (0, 9):
            body.state.vel *= 0.5
            body.state.pos -= O.dt * body.state.vel
    O.run(steps - 1, True)
    return {"positions": [b.state.pos[0] for b in O.bodies if b.id not in (0, 9)], "figures": watch.figures()}


def long_chain():
    return chain(0.3, 100_000)


def chains():
    return [chain(phase, 4000, every=1) for phase in (0.05, 0.2)]


def struck():
    """A Hertz chain struck at its end: positions every few steps."""
    count, step, steps, stride = 40, 4e-6, 4000, 3
    scene_with([grain(2 * R * k, 0.5 if k == 0 else 0.0) for k in range(count)], IntegrationMonitor(speed=0.5), step)
    rows = []
    for _ in range(steps // stride):
        advance(stride)
        rows.append([b.state.pos[0] for b in O.bodies])
    return {"rows": rows, "figures": O.engines[3].figures()}


def warned():
    """The chain with a step that is too long, and with one that is not: figures and what `stop` says."""
    found = []
    for phase, reaction in ((1.0, "warn"), (0.2, "warn"), (1.0, "stop")):
        print("scene: warned", phase, reaction, file=sys.stderr, flush=True)
        try:
            found.append({"figures": chain(phase, 100, limit=0.01, reaction=reaction)["figures"], "line": ""})
        except RuntimeError as error:
            found.append({"line": str(error)})
    return found


def adapted():
    return {reaction: bouncing(reaction) for reaction in ("adapt", "report")}


def bouncing(reaction):
    """Two spheres that bounce between two held ones with a step too long at first: times and dt at rows, and the energy in flight."""
    watch = scene_with([grain(2 * R * -2.2, fixed=True), grain(0.0, 1.0), grain(2 * R * 1.2, -1.0), grain(2 * R * 3.4, fixed=True)],
                       IntegrationMonitor(speed=1.0, reaction=reaction, rows=4 if reaction == "adapt" else 0, every=1), 1e-4)
    rows, energies = [], []
    for _ in range(4000):
        O.step()
        energies.append(sum(b.state.vel.squaredNorm() for b in O.bodies) / 2)
        rows.append([O.iter, O.time, O.dt, watch.nextRow, watch.level])
    return {"rows": rows, "energies": energies}


def saved():
    """The same without and with a scene that is saved and loaded on the way, in each format."""
    return [bed(), *(bed(stop=703, path=f"bed.{ending}") for ending in ("yade.gz", "xml", "bin"))]


def on_a_wall():
    """Figures of a scene that is saved after the shortest contact, which is that of a wall, and loaded."""
    found = []
    for path in (None, "wall.xml", "wall.bin"):
        bodies = [utils.wall(0, 2), grain((0, 0, 1.001 * R)), grain((0, 0, 10 * R))]
        scene_with(bodies, IntegrationMonitor(speed=1.0, every=1), 1e-5, gravity=(0, 0, -9.81))
        O.run(250, True)
        if path:
            O.save(path, quiet=True)
            O.load(path, quiet=True)
        O.run(50, True)
        found.append(O.engines[3].figures())
    return found


def bed(steps=1500, stop=None, path="bed.yade.gz"):
    """64 grains that fall on a floor; at step `stop` the scene is saved and loaded."""
    chance = random.Random(3)
    bodies = [utils.wall(0, 2)]
    for i in range(4):
        for j in range(4):
            for k in range(4):
                bodies.append(grain((0.006 * i, 0.006 * j, 0.003 + 0.006 * k), radius=R * (1 + 0.1 * math.sin(37 * len(bodies)))))
                bodies[-1].state.vel = Vector3(*(chance.uniform(-0.3, 0.3) for _ in range(2)), -0.3)
    scene_with(bodies, IntegrationMonitor(speed=1.0, impacts=1, every=5), 1e-5, gravity=(0, 0, -9.81), restitution=0.7, staticFriction=0.5,
               kineticFriction=0.4, criticalSlipDistance=1e-5)
    if stop:
        O.run(stop, True)
        O.save(path, quiet=True)
        O.load(path, quiet=True)
        os.unlink(path)
        steps -= stop
    O.run(steps, True)
    return next(e for e in O.engines if isinstance(e, IntegrationMonitor)).figures()


def lag():
    """Deviations of one damped impact for two steps."""
    found = []
    for step in (2e-5, 2e-5 / 16):
        watch = scene_with([grain(0.0, 0.3), grain(2.002 * R, -0.3)], IntegrationMonitor(speed=1.0, impacts=1, every=1), step,
                           law=dict(normalLaw="hooke", characteristicVelocity=0.5), restitution=0.6)
        O.run(round(3e-3 / step), True)
        found.append(watch.figures())
    return found


def messages():
    """What mistakes are answered with."""
    lines = []
    for words in ({}, dict(speed=-1.0), dict(speed=1.0, every=0), dict(speed=1.0, limit=0.0), dict(speed=1.0, contactSteps=0.0),
                  dict(speed=1.0, reaction="shout"), dict(speed=1.0, reaction="adapt"), dict(speed=1.0, length=0.0),
                  dict(speed=1.0, impacts=-1)):
        scene_with([grain(0.0, 0.5)], IntegrationMonitor(**words), 1e-5)
        lines.append(_line())
    watch = scene_with([grain(0.0, 0.5)], IntegrationMonitor(speed=1.0), 1e-5)
    O.engines = [e for e in O.engines if e is not watch and not isinstance(e, IntegrationMonitor)] + [IntegrationMonitor(speed=1.0)]
    lines.append(_line())
    scene_with([utils.wall(0, 2)], IntegrationMonitor(speed=1.0), 1e-5)
    lines.append(_line())
    return lines


def _line():
    try:
        O.step()
    except RuntimeError as error:
        return str(error)
    return ""


if __name__ == "__main__":
    write_results(globals())
