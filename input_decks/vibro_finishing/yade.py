"""Vibratory finishing: grains and a free part in a trough that moves on a circle; with a sphere as part all energies are booked."""

import math

from yade import dembark, utils

p = dembark.parameters()
weight = (0, 0, -p.gravity)
materials, ids = dembark.begin(p, weight)


def free_body():
    """The part as a clump of spheres, with the mass and, about each axis, the moment of inertia that it has about y."""
    x, z, radius = p.body_places[::2], p.body_places[1::2], 0.5 * p.part_sphere
    spheres = [utils.sphere((p.body_x + a, 0, p.body_z + b), radius, material=materials[0]) for a, b in zip(x, z, strict=True)]
    # YADE sums up mass and inertia of members: those of one without a volume, while spheres have no density. It is taken out at once.
    core = utils.box((p.body_x, 0, p.body_z), (1e-9, 1e-9, 1e-9), material=materials[0])
    core.state.mass, core.state.inertia = p.body_mass, Vector3(1, 1, 1) * p.body_moment
    shared = O.materials[materials[0]]
    shared.density = 0
    number, members = O.bodies.appendClumped([core, *spheres])
    shared.density = p.grain_density
    O.bodies.erase(members[0])
    for sphere in spheres:
        sphere.state.mass = p.body_mass / len(spheres)
        sphere.state.inertia = Vector3(1, 1, 1) * (0.4 * sphere.state.mass * radius**2)
    O.bodies[number].state.vel = -0.5 * O.dt * Vector3(*weight)
    return number, members[1:]


if p.part == "sphere":
    # The last body is the part, whose density is not that of the grains' material.
    part = O.bodies[ids[1][-1]]
    part.state.mass = 4.0 / 3.0 * math.pi * part.shape.radius**3 * p.part_density
    part.state.inertia = Vector3(1, 1, 1) * (p.part_inertia * part.state.mass * part.shape.radius**2)
    spheres = ids[1][-1:]
    dembark.block(ids[1])
else:
    number, spheres = free_body()
    dembark.block([*ids[1], number])
walls = {"trough": dembark.mesh("trough.stl", materials[1])}
moving = dembark.motion(p, walls, ["trough"])
# The account refuses clumps.
history = dembark.machine_history(ids[1], weight, moving) if p.part == "sphere" else None
account = EnergyAccount() if p.part == "sphere" else None
frames = dembark.Recorder(p, walls, boundary="ff ff ff", gravity=weight, history=history, report=p.stride, moving=moving)
touches = dembark.PartWriter("trough", walls["trough"], spheres, dembark.box(), boundary="ff ff ff", gravity=weight)


def record():
    """Write what is due at this step, and several times in each impact the grains on the part."""
    frames()
    if O.iter >= p.touches and (O.iter - p.touches) % p.sample == 0:
        touches.write()


O.engines = dembark.mesh_loop(p, materials, weight, account=account, moving=moving)
dembark.run(p.steps, outputs=("time.csv", "grains.dump", "contacts.dump", "touches.dump"))
