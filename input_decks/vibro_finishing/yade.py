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


def more():
    """Weight times height of the centre of mass (J), and what belongs to the motion of the trough."""
    height = math.fsum(O.bodies[k].state.mass * O.bodies[k].state.pos[2] for k in ids[1])
    return (p.gravity * height, *dembark.motion_values(moving))


history = dembark.account_history(("weight_height", *dembark.motion_columns(moving)), more)
record = dembark.Recorder(p, walls, boundary="ff ff ff", gravity=weight, history=history, report=p.stride)
O.engines = dembark.mesh_loop(p, materials, weight, account=EnergyAccount(), moving=moving)
dembark.run(p.steps)
