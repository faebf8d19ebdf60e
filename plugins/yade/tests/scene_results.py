"""What scenes leave for the tests; imported inside YADE."""

import json
import math
import sys
from pathlib import Path

from yade import FrictMat, Omega, Sphere, Vector3


def refusal(do, otherwise="accepted"):
    """What YADE says when `do()` is wrong."""
    try:
        do()
    except RuntimeError as error:
        return str(error)
    return otherwise


def place(bodies, density):
    """Make `bodies` those of the scene, of one material; spheres get the masses of solid ones."""
    scene = Omega()
    scene.materials.append(FrictMat(young=5e6, poisson=0.3, density=density, frictionAngle=0))
    for body in bodies:
        body.mat = scene.materials[0]
        if isinstance(body.shape, Sphere):
            mass = 4 / 3 * math.pi * body.shape.radius**3 * density
            body.state.mass, body.state.inertia = mass, Vector3(1, 1, 1) * 0.4 * mass * body.shape.radius**2
        scene.bodies.append(body)


def advance(count):
    """Make so many steps; O.run(count, True) looks only every 40 ms whether it is over."""
    scene = Omega()
    for _ in range(count):
        scene.step()


def write_results(scenes):
    """Write what the functions in `scenes` return that are named on the command line, after the file to write into."""
    out, *names = sys.argv[1:]
    Path(out).write_text(json.dumps({name: scenes[name]() for name in names}), encoding="utf-8")
    print("scenes: finished", flush=True)
