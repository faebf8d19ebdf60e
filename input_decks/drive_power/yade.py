"""Drive power: grains on a plate that shakes up and down, periodic along x and y; the energies of all forces are booked."""

import math

from yade import dembark

p = dembark.parameters()
weight = (0, 0, -p.gravity)
materials, ids = dembark.begin(p, weight, along=[0, 1])
if p.dimensions == 2:
    dembark.block(ids[1])
walls = dembark.planes(p, materials, plate=(2, 0.0, 1))
moving = dembark.motion(p, walls, ["plate"])


def more():
    """Weight times height of the centre of mass (J), and what belongs to the motion of the plate."""
    height = math.fsum(O.bodies[k].state.mass * O.bodies[k].state.pos[2] for k in range(p.grain_count))
    return (p.gravity * height, *dembark.motion_values(moving))


history = dembark.account_history(("weight_height", *dembark.motion_columns(moving)), more)
record = dembark.Recorder(p, walls, boundary="pp pp ff", gravity=weight, history=history, report=p.stride)
O.engines = dembark.slab_loop(p, materials, weight, account=EnergyAccount(), moving=moving)
dembark.run(p.steps)
