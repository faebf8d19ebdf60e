"""Vibratory finishing: grains and a free part in a trough that moves on a circle; the energies of all forces are booked."""

import math

from yade import dembark

p = dembark.parameters()
weight = (0, 0, -p.gravity)
materials, ids = dembark.begin(p, weight)
dembark.block(ids[1])
# The last body is the part, whose density is not that of the grains' material.
part = O.bodies[ids[1][-1]]
part.state.mass = 4.0 / 3.0 * math.pi * part.shape.radius**3 * p.part_density
part.state.inertia = Vector3(1, 1, 1) * (p.part_inertia * part.state.mass * part.shape.radius**2)
walls = {"trough": dembark.mesh("trough.stl", materials[1])}
moving = dembark.motion(p, walls, ["trough"])
history = dembark.machine_history(ids[1], weight, moving)
record = dembark.Recorder(p, walls, boundary="ff ff ff", gravity=weight, history=history, report=p.stride)
O.engines = dembark.mesh_loop(p, materials, weight, account=EnergyAccount(), moving=moving)
dembark.run(p.steps)
